#include "pavel/vdb/measure.h"

#include <algorithm>

namespace pavel {

double cubeShareUnderPlane(double distance, Vec3 n) {
    double m[3] = {std::abs(n[0]), std::abs(n[1]), std::abs(n[2])};
    std::sort(m, m + 3);
    const double sum = m[0] + m[1] + m[2];
    double alpha = 0.5 - distance / sum;  // 0: the cube is just outside, 1: just inside
    if (alpha <= 0) return 0;
    if (alpha >= 1) return 1;
    const bool upper = alpha > 0.5;
    if (upper) alpha = 1 - alpha;
    const double m1 = std::max(m[0] / sum, 1e-9), m2 = std::max(m[1] / sum, 1e-9), m3 = m[2] / sum, m12 = m1 + m2;
    const auto cube = [](double x) { return x * x * x; };
    double v;
    if (alpha < m1)
        v = cube(alpha) / (6 * m1 * m2 * m3);
    else if (alpha < m2)
        v = alpha * (alpha - m1) / (2 * m2 * m3) + m1 * m1 / (6 * m2 * m3);
    else if (alpha < std::min(m12, m3))
        v = (alpha * alpha * (3 * m12 - alpha) + m1 * m1 * (m1 - 3 * alpha) + m2 * m2 * (m2 - 3 * alpha)) /
            (6 * m1 * m2 * m3);
    else if (m3 < m12)
        v = (alpha * alpha * (3 - 2 * alpha) + m1 * m1 * (m1 - 3 * alpha) + m2 * m2 * (m2 - 3 * alpha) +
             m3 * m3 * (m3 - 3 * alpha)) /
            (6 * m1 * m2 * m3);
    else
        v = (2 * alpha - m12) / (2 * m3);
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

InsideMeasure measureInside(const WorkTree& tree) {
    InsideMeasure m;
    HaloBlock halo;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        const auto neighbour = [&](int side) {
            Coord c = leaf->origin();
            c[side / 2] += side % 2 ? 8 : -8;
            return c;
        };
        fillHalo(
            leaf->buffer().data(),
            [&](int side) {
                const WorkLeaf* n = tree.probeConstLeaf(neighbour(side));
                return n ? n->buffer().data() : nullptr;
            },
            [&](int side) { return tree.getValue(neighbour(side)); }, halo);
        m.add(measureBlock(halo));
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(WorkTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) m.voxels += tile.getVoxelCount(), m.volume += double(tile.getVoxelCount());
    return m;
}

}  // namespace pavel
