#include "pavel/vdb/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

namespace pavel {

namespace {

/// Without branches, so that it works on eight voxels at a time; not a number where all slopes are zero.
inline double shareUnderPlane(double value, double x, double y, double z) {
    const auto least = [](double a, double b) { return a < b ? a : b; };
    const auto most = [](double a, double b) { return a > b ? a : b; };
    const auto cube = [&](double t) { return most(0, t) * most(0, t) * most(0, t); };
    x = std::abs(x), y = std::abs(y), z = std::abs(z);
    const double inv = 1 / (x + y + z), below = 0.5 - value * inv;  // 0: the cube is just outside, 1: just inside
    const double alpha = most(0, least(below, 1 - below));
    const double lo = least(x, y), hi = most(x, y);
    // Away from zero, where the differences of cubes would cancel.
    const double m1 = most(least(lo, z) * inv, 1e-6), m2 = most(most(lo, least(hi, z)) * inv, 1e-6),
                 m3 = most(hi, z) * inv;
    const bool flat = alpha >= m1 + m2;
    const double straight = 2 * alpha - m1 - m2,
                 bent = cube(alpha) - cube(alpha - m1) - cube(alpha - m2) - cube(alpha - m3), twoM3 = 2 * m3,
                 product = 6 * m1 * m2 * m3;
    const double v = (flat ? straight : bent) / (flat ? twoM3 : product), share = alpha > 0 ? v : 0, rest = 1 - share;
    return below > 0.5 ? rest : share;
}

}  // namespace

double cubeShareUnderPlane(double value, Vec3 n) {
    return n == Vec3(0, 0, 0) ? double(value < 0) : shareUnderPlane(value, n[0], n[1], n[2]);
}

PAVEL_WIDE InsideMeasure measureBlock(const HaloBlock& f) {
    constexpr int kLanes = 8;
    int cut[512], inside[8] = {};
    const auto first = [&](int row) { return &f[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)]; };
    for (int row = 0; row < 64; ++row) {
        const float* at = first(row);
        int isCut[8];
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float v = at[z], gx = std::abs(at[z + 100] - at[z - 100]), gy = std::abs(at[z + 10] - at[z - 10]),
                        gz = std::abs(at[z + 1] - at[z - 1]);
            // Half the sum of the slopes is how far the values reach at a voxel's corners: beyond it, the plane misses.
            isCut[z] = int(std::abs(v) < 1.8f) & int(std::abs(v) < 0.25f * (gx + gy + gz));
            inside[z] += v < 0;
        }
        std::memcpy(cut + 8 * row, isCut, sizeof isCut);
    }
    // Cut voxels are few, and dear: gathered, so that none of the lanes is idle.
    uint8_t cutBytes[512];
    for (int v = 0; v < 512; ++v) cutBytes[v] = uint8_t(cut[v]);
    float value[512 + kLanes], slopes[3][512 + kLanes];
    int count = 0;
    for (int row = 0; row < 64; ++row) {
        uint64_t bytes;
        std::memcpy(&bytes, cutBytes + 8 * row, 8);
        for (; bytes; bytes &= bytes - 1, ++count) {
            const float* v = first(row) + __builtin_ctzll(bytes) / 8;
            value[count] = *v;
            slopes[0][count] = v[100] - v[-100], slopes[1][count] = v[10] - v[-10], slopes[2][count] = v[1] - v[-1];
        }
    }
    std::fill_n(value + count, kLanes, 1.f);  // outside
    for (auto& slope : slopes) std::fill_n(slope + count, kLanes, 0.1f);
    double shares[kLanes] = {};
    for (int k = 0; k < count; k += kLanes) {
        PAVEL_ROLLED
        for (int i = 0; i < kLanes; ++i) {
            const double v = double(value[k + i]);
            shares[i] +=
                shareUnderPlane(2 * v, slopes[0][k + i], slopes[1][k + i], slopes[2][k + i]) - (v < 0 ? 1.0 : 0.0);
        }
    }
    InsideMeasure m;
    for (int z = 0; z < 8; ++z) m.voxels += uint64_t(inside[z]);
    for (const double share : shares) m.volume += share;
    m.volume += double(m.voxels);
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
