#pragma once
// Sub-voxel volume of a level set: each voxel counts by the share of it that lies under the plane given by the value
// and its gradient. `tools::levelSetVolume` is off by an amount that follows the curved area; this is not.
#include <array>

#include "pavel/vdb/grid.h"

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

/// Fills the halo of a block. at(side) gives the 512 values of the face neighbour, -x +x -y +y -z +z, or null where
/// tile(side) stands for all of them.
template <class At, class Tile>
void fillHalo(const float* own, At at, Tile tile, HaloBlock& out) {
    for (int row = 0; row < 64; ++row)
        std::copy(own + row * 8, own + row * 8 + 8, &out[size_t(((row >> 3) + 1) * 100 + ((row & 7) + 1) * 10 + 1)]);
    constexpr int step[3] = {64, 8, 1}, haloStep[3] = {100, 10, 1};
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2, u = axis == 0 ? 1 : 0, w = axis == 2 ? 1 : 2;
        const float* other = at(side);
        const float same = other ? 0 : tile(side);
        const int from = side % 2 ? 0 : 7 * step[axis], to = side % 2 ? 9 : 0;
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j)
                out[size_t(to * haloStep[axis] + (i + 1) * haloStep[u] + (j + 1) * haloStep[w])] =
                    other ? other[from + i * step[u] + j * step[w]] : same;
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
