#pragma once
// The trees that packing works on. Internal: it pulls in OpenVDB, so no public header includes it.
//
// Everything in this folder lives in index space: one linear transform of voxel size h is shared by all grids, voxel
// centres are the integer points, and distances count voxels, until a file or a mesh is written.
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>

#include "pavel/core/vec.h"
#include "pavel/core/wide.h"

namespace pavel {

using openvdb::Coord;
using openvdb::CoordBBox;

/// A small tree: 7.7 KB empty against 300 KB of a FloatTree, with the same leaves. Files hold standard grids only.
using WorkTree =
    openvdb::tree::Tree<openvdb::tree::RootNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<float, 3>, 3>>>;
using WorkLeaf = WorkTree::LeafNodeType;
using WorkReader = openvdb::tree::ValueAccessor<const WorkTree, false>;
using BaseReader = openvdb::tree::ValueAccessor<const openvdb::FloatTree, false>;

/// Half width, in voxels, of the bands in work; results are cut to kResultBand.
constexpr float kBand = 4;
constexpr float kResultBand = 3;

inline openvdb::Vec3d toVdb(const Vec3& v) {
    return {v[0], v[1], v[2]};
}
inline Vec3 fromVdb(const openvdb::Vec3d& v) {
    return {v[0], v[1], v[2]};
}
inline Vec3 centreOf(const Coord& c) {
    return {double(c[0]), double(c[1]), double(c[2])};
}
inline Coord leafOrigin(const Coord& c) {
    return {c[0] & ~7, c[1] & ~7, c[2] & ~7};
}

/// The values of a leaf that lies deep inside, or far outside.
inline const float* uniformValues(bool inside) {
    struct Uniform {
        float values[512];
        explicit Uniform(float v) { std::fill(values, values + 512, v); }
    };
    static const Uniform in(-kBand), out(kBand);
    return inside ? in.values : out.values;
}

/// Rounded down, below zero, too.
inline int floorDivide(int a, int b) {
    return (a >= 0 ? a : a - b + 1) / b;
}

/// For hash tables of leaf origins.
struct CoordHash {
    size_t operator()(const Coord& c) const { return c.hash<20>() ^ (size_t(c[1]) * 2654435761u); }
};

/// Trilinear value at a point in index space.
template <class Reader>
double sampleAt(const Reader& reader, const Vec3& p) {
    return openvdb::tools::BoxSampler::sample(reader, toVdb(p));
}

/// Calls f(origin) for the origin of every leaf-sized block that meets the box.
template <class F>
void forEachBlock(const CoordBBox& box, F f) {
    const Coord lo = leafOrigin(box.min()), hi = leafOrigin(box.max());
    for (int x = lo[0]; x <= hi[0]; x += 8)
        for (int y = lo[1]; y <= hi[1]; y += 8)
            for (int z = lo[2]; z <= hi[2]; z += 8) f(Coord(x, y, z));
}

/// For a box that holds a block, kBefore voxels before it and kAfter beyond, in rows that are kRow apart: calls
/// f(part, row, at, n) for every piece of a row, whose n values (n is a constant) begin at `row` in a leaf and at `at`
/// in the box. part: the block, number 13, and its neighbours, x slowest.
template <int kBefore, int kAfter, int kRow, class F>
void forEachRowAround(F f) {
    constexpr int kSide = kBefore + 8 + kAfter;
    const auto pieces = [&](int x, int y, int z, int at, auto first, auto n) {
        const auto from = [](int k) { return k < 0 ? 8 - kBefore : 0; };
        const auto to = [](int k) { return k > 0 ? kAfter : 8; };
        for (int u = from(x); u < to(x); ++u)
            for (int v = from(y); v < to(y); ++v)
                f((x + 1) * 9 + (y + 1) * 3 + z + 1, u * 64 + v * 8 + first,
                  ((8 * x + kBefore + u) * kSide + 8 * y + kBefore + v) * kRow + at, n);
    };
    using std::integral_constant;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y) {
            pieces(x, y, -1, 0, integral_constant<int, 8 - kBefore>(), integral_constant<int, kBefore>());
            pieces(x, y, 0, kBefore, integral_constant<int, 0>(), integral_constant<int, 8>());
            pieces(x, y, 1, kBefore + 8, integral_constant<int, 0>(), integral_constant<int, kAfter>());
        }
}

}  // namespace pavel
