#pragma once
// The fused surface of all elements, without the phantom walls that a plain minimum leaves at contact faces.
#include "pavel/vdb/packed_grids.h"

namespace pavel {

/// Makes grids.surface = max(union of the elements, -base) and, where asked for, grids.solid = min(union, base), both
/// as clean distances, from the packed elements and the base in `grids`; and grids.ids. Creases between elements that
/// touch get a fillet a voxel deep, whose volume is taken back evenly from the decoration's surface; where they run on
/// flush, or a gap was left, none is made.
/// @param volume of all elements, in voxels
void fuse(double volume, bool withSolid, bool touching, PackedGrids& grids);

/// Union of some elements, raw: right where it changes sign. `touching`: with the fillets.
openvdb::FloatTree::Ptr unionOf(const std::vector<const CompactLevelSet*>& elements, bool touching);
/// max(all, clearance - base), raw; the base's band must reach two voxels beyond the clearance (voxels).
openvdb::FloatTree::Ptr outside(const openvdb::FloatTree& all, const openvdb::FloatTree& base, float clearance);

}  // namespace pavel
