#include "pavel/vdb/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace pavel {

double cubeShareUnderPlane(double value, Vec3 n) {
    const double x = std::abs(n[0]), y = std::abs(n[1]), z = std::abs(n[2]), sum = x + y + z;
    if (!(sum > 0)) return value < 0;
    const double inv = 1 / sum;
    double alpha = 0.5 - value * inv;  // 0: the cube is just outside, 1: just inside
    if (alpha <= 0) return 0;
    if (alpha >= 1) return 1;
    const bool upper = alpha > 0.5;
    if (upper) alpha = 1 - alpha;
    const double lo = std::min(x, y), hi = std::max(x, y);
    // Away from zero, where the differences of cubes would cancel.
    const double m1 = std::max(std::min(lo, z) * inv, 1e-6), m2 = std::max(std::max(lo, std::min(hi, z)) * inv, 1e-6),
                 m3 = std::max(hi, z) * inv;
    const auto cube = [](double t) { return t > 0 ? t * t * t : 0; };
    const double v = alpha >= m1 + m2
                         ? (2 * alpha - m1 - m2) / (2 * m3)
                         : (cube(alpha) - cube(alpha - m1) - cube(alpha - m2) - cube(alpha - m3)) / (6 * m1 * m2 * m3);
    return upper ? 1 - v : v;
}

PAVEL_WIDE InsideMeasure measureBlock(const HaloBlock& f) {
    InsideMeasure m;
    for (int row = 0; row < 64; ++row) {
        const float* at = &f[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)];
        int inside = 0, cut = 0, isCut[8];
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float v = at[z], gx = std::abs(at[z + 100] - at[z - 100]), gy = std::abs(at[z + 10] - at[z - 10]),
                        gz = std::abs(at[z + 1] - at[z - 1]);
            // Half the sum of the slopes is how far the values reach at a voxel's corners: beyond it, the plane misses.
            isCut[z] = int(std::abs(v) < 1.8f) & int(std::abs(v) < 0.25f * (gx + gy + gz));
            inside += v < 0;
            cut += isCut[z];
        }
        m.voxels += uint64_t(inside);
        m.volume += inside;
        if (!cut) continue;
        for (int z = 0; z < 8; ++z, ++at) {
            if (!isCut[z]) continue;
            const Vec3 slope(at[100] - at[-100], at[10] - at[-10], at[1] - at[-1]);
            m.volume += cubeShareUnderPlane(*at, 0.5 * slope) - (*at < 0);
        }
    }
    return m;
}

namespace {

template <class Tree>
void addTiles(const Tree& tree, InsideMeasure& m) {
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(Tree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) m.voxels += tile.getVoxelCount(), m.volume += double(tile.getVoxelCount());
}

}  // namespace

InsideMeasure measureInside(const WorkTree& tree) {
    InsideMeasure m;
    HaloBlock halo;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        loadHalo(tree, *leaf, halo);
        m.add(measureBlock(halo));
    }
    addTiles(tree, m);
    return m;
}

InsideMeasure measureInside(const openvdb::FloatTree& tree) {
    constexpr size_t kChunk = 256;
    std::vector<const WorkLeaf*> leaves;
    tree.getNodes(leaves);
    std::vector<InsideMeasure> parts((leaves.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t part) {
        const BaseReader reader(tree);
        HaloBlock halo;
        for (size_t k = part * kChunk; k < std::min(leaves.size(), (part + 1) * kChunk); ++k) {
            loadHalo(reader, *leaves[k], halo);
            parts[part].add(measureBlock(halo));
        }
    });
    InsideMeasure m;
    for (const InsideMeasure& part : parts) m.add(part);
    addTiles(tree, m);
    return m;
}

}  // namespace pavel
