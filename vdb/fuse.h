#pragma once
// The fused surface of all elements, without the phantom walls that a plain minimum leaves at contact faces.
#include "pavel/vdb/packed_grids.h"
#include "pavel/vdb/region_builder.h"

namespace pavel {

/// Raw union of all elements: placed shapes overlap, and fronts know their values a little into each other's ground, so
/// the minimum is well inside at every contact face and right at the outer surface.
/// surface = max(union, -base) and, where asked for, solid = min(union, base), both as clean distances.
/// `grids` holds the packed elements and the base already.
void fuse(const RegionBuilder& builder, bool withSolid, PackedGrids& grids);

/// Ids inside the packed elements; a voxel inside two (by rounding) goes to the one in which it lies deeper.
openvdb::Int32Tree::Ptr elementIds(const std::vector<WorkTree::Ptr>& elements);

}  // namespace pavel
