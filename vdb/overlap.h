#pragma once
// Resolves the overlap: who keeps what, at sub-voxel precision (paper, PAVEL deformations).
//   phi'_i = max(phi_i, -phi_B, max_j min(-phi_j, g_ij))
// This is the CSG difference of i and the part of j on j's side of the bisector, fused over all neighbours.
#include "pavel/core/run_context.h"
#include "pavel/vdb/block_level_set.h"
#include "pavel/vdb/element.h"

namespace pavel {

/// Fills `neighbours` of all elements through a spatial index. O(n log n).
void findNeighbours(std::vector<WorkElement>& elements);

/// Makes the body of one element from the placed level sets of its neighbours and the base (voxels, may be null).
/// Reads the other elements' `placed` only: safe to run in parallel. Returns phi'.
BlockLevelSet trimElement(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base,
                          bool recoverBaseLoss = true);

/// The pieces besides the largest.
std::vector<MaskedBlock> findStrays(const BlockMasks& body);
/// Turns voxels inside out: they become outside, without tearing the values beside them.
void erase(CompactLevelSet& of, const std::vector<MaskedBlock>& voxels);

/// Neighbours, bodies and contacts of all elements. A piece that the trim cuts off its element is erased from the
/// placed level set, so that it goes to the next element that contains it, or is free.
/// Volume lost to the base counts as lost, to be grown back, where `recoverBaseLoss`; rigid elements never get it back.
void resolveOverlap(std::vector<WorkElement>& elements, const openvdb::FloatTree* base, bool recoverBaseLoss,
                    const RunContext& context);

}  // namespace pavel
