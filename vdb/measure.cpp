#include "pavel/vdb/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>

namespace pavel {

namespace {

/// Without branches, so that it works on eight voxels at a time. Where all slopes are zero, all of the cube or nothing.
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

namespace {

constexpr int kLanes = 8;

/// Values and slopes (differences over two voxels) of voxels.
struct Planes {
    const float *value, *slopes[3];
};

/// A block's voxels that the surface cuts, or would cut if it moved by no more than `margin`.
struct CutVoxels {
    float value[512 + kLanes], slopes[3][512 + kLanes];
    int count = 0, inside = 0;  ///< `inside`: of all voxels
    Planes planes() const { return {value, {slopes[0], slopes[1], slopes[2]}}; }
};

PAVEL_WIDE void findCut(const HaloBlock& f, float margin, CutVoxels& out) {
    int cut[512], inside[8] = {};
    const auto first = [&](int row) { return &f[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)]; };
    for (int row = 0; row < 64; ++row) {
        const float* at = first(row);
        int isCut[8];
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float v = at[z], gx = std::abs(at[z + 100] - at[z - 100]), gy = std::abs(at[z + 10] - at[z - 10]),
                        gz = std::abs(at[z + 1] - at[z - 1]), all = gx + gy + gz, size = std::abs(v) - margin;
            // Half the sum of the slopes is how far the values reach at a voxel's corners: beyond it, the plane misses.
            isCut[z] = int(size < 1.8f) & int(size < 0.25f * all);
            inside[z] += v < 0;
        }
        std::memcpy(cut + 8 * row, isCut, sizeof isCut);
    }
    uint8_t cutBytes[512];
    for (int v = 0; v < 512; ++v) cutBytes[v] = uint8_t(cut[v]);
    int count = 0;
    for (int row = 0; row < 64; ++row) {
        uint64_t bytes;
        std::memcpy(&bytes, cutBytes + 8 * row, 8);
        for (; bytes; bytes &= bytes - 1, ++count) {
            const float* v = first(row) + __builtin_ctzll(bytes) / 8;
            out.value[count] = *v;
            out.slopes[0][count] = v[100] - v[-100], out.slopes[1][count] = v[10] - v[-10],
            out.slopes[2][count] = v[1] - v[-1];
        }
    }
    out.count = count;
    out.inside = 0;
    for (int z = 0; z < 8; ++z) out.inside += inside[z];
}

/// Of voxels: the volume inside once the surface grew by `grown`, less the number of centres that were inside before.
/// Reads whole lanes.
PAVEL_WIDE double moreThanCentres(const Planes& of, int count, float grown) {
    double shares[kLanes] = {};
    for (int k = 0; k < count; k += kLanes) {
        PAVEL_ROLLED
        for (int i = 0; i < kLanes; ++i) {
            const double v = double(of.value[k + i]);
            shares[i] += shareUnderPlane(2 * (v - double(grown)), of.slopes[0][k + i], of.slopes[1][k + i],
                                         of.slopes[2][k + i]) -
                         (v < 0 ? 1.0 : 0.0);
        }
    }
    double sum = 0;
    for (const double share : shares) sum += share;
    return sum;
}

}  // namespace

InsideMeasure measureBlock(const HaloBlock& f) {
    CutVoxels cut;
    findCut(f, 0, cut);
    std::fill_n(cut.value + cut.count, kLanes, 1.f);  // outside
    for (auto& slope : cut.slopes) std::fill_n(slope + cut.count, kLanes, 0.1f);
    return {double(cut.inside) + moreThanCentres(cut.planes(), cut.count, 0), uint64_t(cut.inside)};
}

void SurfaceVoxels::add(const HaloBlock& values) {
    CutVoxels cut;
    findCut(values, most_, cut);
    inside_ += uint64_t(cut.inside);
    values_->insert(values_->end(), cut.value, cut.value + cut.count);
    for (size_t k = 0; k < 3; ++k) slopes_[k]->insert(slopes_[k]->end(), cut.slopes[k], cut.slopes[k] + cut.count);
}

double SurfaceVoxels::volume(double grown) const {
    const int all = int(values_->size()), whole = all / kLanes * kLanes, rest = all - whole;
    const Planes planes{values_->data(), {slopes_[0]->data(), slopes_[1]->data(), slopes_[2]->data()}};
    float last[4][kLanes];
    std::fill_n(last[0], kLanes, 1e3f);  // outside
    std::copy_n(planes.value + whole, rest, last[0]);
    for (int k = 0; k < 3; ++k) {
        std::fill_n(last[k + 1], kLanes, 0.1f);
        std::copy_n(planes.slopes[k] + whole, rest, last[k + 1]);
    }
    return double(inside_) + moreThanCentres(planes, whole, float(grown)) +
           moreThanCentres({last[0], {last[1], last[2], last[3]}}, rest, float(grown));
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
