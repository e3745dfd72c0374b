#include "pavel/vdb/measure.h"

#include <algorithm>

namespace pavel {

double cubeShareUnderPlane(double distance, Vec3 n) {
    const double x = std::abs(n[0]), y = std::abs(n[1]), z = std::abs(n[2]), sum = x + y + z;
    double alpha = 0.5 - distance / sum;  // 0: the cube is just outside, 1: just inside
    if (alpha <= 0) return 0;
    if (alpha >= 1) return 1;
    const bool upper = alpha > 0.5;
    if (upper) alpha = 1 - alpha;
    const double lo = std::min(x, y), hi = std::max(x, y), inv = 1 / sum;
    // Away from zero, where the differences of cubes would cancel.
    const double m1 = std::max(std::min(lo, z) * inv, 1e-6), m2 = std::max(std::max(lo, std::min(hi, z)) * inv, 1e-6),
                 m3 = std::max(hi, z) * inv;
    const auto cube = [](double t) { return t > 0 ? t * t * t : 0; };
    const double v = alpha >= m1 + m2
                         ? (2 * alpha - m1 - m2) / (2 * m3)
                         : (cube(alpha) - cube(alpha - m1) - cube(alpha - m2) - cube(alpha - m3)) / (6 * m1 * m2 * m3);
    return upper ? 1 - v : v;
}

InsideMeasure measureBlock(const HaloBlock& f) {
    InsideMeasure m;
    double shares = 0;
    for (int row = 0; row < 64; ++row) {
        const float* at = &f[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)];
        for (int z = 0; z < 8; ++z, ++at) {
            const float v = *at;
            m.voxels += v < 0;
            if (v >= 1.8f) continue;
            if (v <= -1.8f) {
                shares += 1;
                continue;
            }
            const float gx = 0.5f * (at[100] - at[-100]), gy = 0.5f * (at[10] - at[-10]), gz = 0.5f * (at[1] - at[-1]);
            const float l = std::sqrt(gx * gx + gy * gy + gz * gz);
            if (std::abs(v) > 0.87f * l)  // the plane misses the voxel
                shares += v < 0;
            else
                shares += cubeShareUnderPlane(v / l, Vec3(gx / l, gy / l, gz / l));
        }
    }
    m.volume = shares;
    return m;
}

void loadHalo(const WorkTree& tree, const WorkLeaf& leaf, HaloBlock& out) {
    const auto neighbour = [&](int side) {
        Coord c = leaf.origin();
        c[side / 2] += side % 2 ? 8 : -8;
        return c;
    };
    fillHalo(
        leaf.buffer().data(),
        [&](int side) {
            const WorkLeaf* n = tree.probeConstLeaf(neighbour(side));
            return n ? n->buffer().data() : nullptr;
        },
        [&](int side) { return tree.getValue(neighbour(side)); }, out);
}

InsideMeasure measureInside(const WorkTree& tree) {
    InsideMeasure m;
    HaloBlock halo;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        loadHalo(tree, *leaf, halo);
        m.add(measureBlock(halo));
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(WorkTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) m.voxels += tile.getVoxelCount(), m.volume += double(tile.getVoxelCount());
    return m;
}

}  // namespace pavel
