#pragma once
// Resolves the overlap: who keeps what, at sub-voxel precision (paper, PAVEL deformations).
//   phi'_i = max(phi_i, -phi_B, max_j min(-phi_j, g_ij))
// This is the CSG difference of i and the part of j on j's side of the bisector, fused over all neighbours.
#include "pavel/vdb/element.h"

namespace pavel {

/// Fills `neighbours` of all elements through a spatial index. O(n log n).
void findNeighbours(std::vector<WorkElement>& elements);

/// Makes the body of one element from the placed level sets of its neighbours and the base (voxels, may be null), and
/// drops pieces that the trim cut off. Reads the other elements' `placed` only: safe to run in parallel.
void trimElement(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base);

/// Keeps the largest piece of {phi < 0}; the voxels of the others become outside. Returns those voxels.
std::vector<Coord> dropIslands(WorkTree& tree);

}  // namespace pavel
