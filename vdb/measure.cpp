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

double leafVolume(const WorkReader& reader, const WorkLeaf& leaf) {
    double volume = 0;
    for (openvdb::Index i = 0; i < WorkLeaf::SIZE; ++i) {
        const float v = leaf.getValue(i);
        if (v <= -1.8f)
            volume += 1;
        else if (v < 1.8f)
            volume += insideShare(reader, leaf.offsetToGlobalCoord(i), v);
    }
    return volume;
}

InsideMeasure measureInside(const WorkTree& tree) {
    InsideMeasure m;
    const WorkReader reader(tree);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        m.volume += leafVolume(reader, *leaf);
        for (openvdb::Index i = 0; i < WorkLeaf::SIZE; ++i) m.voxels += leaf->getValue(i) < 0;
    }
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(WorkTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) m.voxels += tile.getVoxelCount(), m.volume += double(tile.getVoxelCount());
    return m;
}

}  // namespace pavel
