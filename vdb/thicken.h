#pragma once
#include "pavel/vdb/grid.h"

namespace pavel {

/// Makes thin places as thick as a printer needs. A place is thin where the middle of the solid is nearer to its
/// surface than `radius` and farther than one and a half of them from all that a ball of that radius can reach inside
/// the solid: sharp edges of thick things are left alone. Balls of the radius are joined there.
/// @param solid a clean level set; values in voxels, half width kResultBand
/// @param radius half the least thickness, voxels
/// @param places set to the number of voxels in the middle of thin places
/// @return the raw union, right where it changes sign; null where nothing is thin
openvdb::FloatTree::Ptr thickened(const openvdb::FloatTree& solid, double radius, size_t& places);

}  // namespace pavel
