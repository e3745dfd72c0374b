#pragma once
// Where one element ends and the next begins on a fused mesh, finer than its triangles.
#include "pavel/vdb/extract.h"
#include "pavel/vdb/packed_grids.h"

namespace pavel {

/// The vertices around the borders between labels, ascending. Distances to the packed elements (and the base, where
/// `withBase`) tell whose each is: labels alone are as jagged as the triangles.
/// @param mesh in voxels times `h`; `ids` of its triangles, roughly
std::vector<SeamVertex> seamVertices(const PackedGrids& grids, double h, bool withBase, const TriangleMesh& mesh,
                                     const std::vector<int>& ids);
/// The same for the given vertices, of which those that are far from everything are left out.
std::vector<SeamVertex> ownersOf(const PackedGrids& grids, double h, bool withBase, const TriangleMesh& mesh,
                                 const std::vector<int>& vertices);

}  // namespace pavel
