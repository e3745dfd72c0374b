#pragma once
// Clearance between packed elements, and to the base.
#include <vector>

#include "pavel/vdb/grid.h"

namespace pavel {

/// The widest gap, in voxels: what the bands of the elements reach.
constexpr double kMostGap = 4;

/// Sets elements back by half the gap from the surface that lies halfway to each other element, so that wherever two
/// touched, or nearly did, the gap is left between them, and by the whole of it from the base.
///   phi'_i = max(phi_i, gap - phi_B, max_j (gap - phi_j + phi_i) / 2)
/// Half the difference of two distances changes by a voxel a voxel at most: no two points are nearer than the gap.
/// @param elements level sets whose bands reach half a voxel beyond the gap; they are replaced, half width kResultBand
/// @param base its band must reach beyond the gap
/// @return the volume each one loses, in voxels. Linear in the bands.
std::vector<double> leaveGap(std::vector<WorkTree::Ptr>& elements, const openvdb::FloatTree& base, double gap);

}  // namespace pavel
