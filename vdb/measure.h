#pragma once
// Sub-voxel volume of a level set: each voxel counts by the share of it that lies under the plane given by the value
// and its gradient. `tools::levelSetVolume` is off by an amount that follows the curved area; this is not.
#include <array>
#include <cstring>

#include "pavel/vdb/grid.h"
#include "pavel/vdb/scratch.h"

namespace pavel {

/// Share of the unit cube around the origin with n.x + value < 0; n and value may be scaled alike (R. Scardovelli and
/// S. Zaleski 2000).
double cubeShareUnderPlane(double value, Vec3 n);

/// A block with one layer of its face neighbours: 10^3 values, index ((x + 1) * 10 + y + 1) * 10 + z + 1. Edges and
/// corners of the layer are not read.
using HaloBlock = std::array<float, 1000>;

struct InsideMeasure {
    double volume = 0;    ///< sub-voxel, in voxels
    uint64_t voxels = 0;  ///< voxel centres inside
    void add(const InsideMeasure& m) { volume += m.volume, voxels += m.voxels; }
};

InsideMeasure measureBlock(const HaloBlock& values);

/// What measuring asks for of the voxels near a surface, to be measured again after small moves of it.
class SurfaceVoxels {
  public:
    /// @param most how far it may move either way, in voxels
    explicit SurfaceVoxels(float most) : most_(most) {}
    void add(const HaloBlock& values);
    void addInside(uint64_t voxels) { inside_ += voxels; }
    /// Volume in voxels once the surface moved outwards everywhere by so much.
    double volume(double grown) const;

  private:
    float most_;
    uint64_t inside_ = 0;  ///< voxel centres
    Scratch values_;
    std::array<Scratch, 3> slopes_;
};

/// Fills the halo of a block. at(side) gives the 512 values of the face neighbour, -x +x -y +y -z +z, or null where
/// tile(side) stands for all of them.
template <class At, class Tile>
void fillHalo(const float* own, At at, Tile tile, HaloBlock& out) {
    constexpr auto halo = [](int x, int y, int z) { return size_t((x + 1) * 100 + (y + 1) * 10 + z + 1); };
    // Rows of a known size: no call for each.
    const auto copyRow = [](const float* from, float* to) { std::memcpy(to, from, 8 * sizeof(float)); };
    for (int row = 0; row < 64; ++row) copyRow(own + row * 8, &out[halo(row >> 3, row & 7, 0)]);
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2, from = side % 2 ? 0 : 7, to = side % 2 ? 8 : -1;
        const float* other = at(side);
        float uniform[8];
        std::fill_n(uniform, 8, other ? 0 : tile(side));
        for (int i = 0; i < 8; ++i) {
            if (axis == 0)
                copyRow(other ? other + 64 * from + 8 * i : uniform, &out[halo(to, i, 0)]);
            else if (axis == 1)
                copyRow(other ? other + 64 * i + 8 * from : uniform, &out[halo(i, to, 0)]);
            else
                for (int j = 0; j < 8; ++j) out[halo(i, j, to)] = other ? other[64 * i + 8 * j + from] : uniform[j];
        }
    }
}

/// The same for a leaf of a tree.
template <class Tree>
void loadHalo(const Tree& tree, const WorkLeaf& leaf, HaloBlock& out) {
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

InsideMeasure measureInside(const WorkTree& tree);
/// The same in parallel, for a large tree; equal on any number of threads.
InsideMeasure measureInside(const openvdb::FloatTree& tree);

}  // namespace pavel
