#pragma once
// The narrow band of a closed mesh, straight from its triangles.
#include "pavel/core/mesh.h"
#include "pavel/vdb/grid.h"

namespace pavel {

/// Signed distances to a mesh in index space, exact within the band: the nearest point of the nearest triangle, with
/// its side told by the pseudo-normal of the face, edge or vertex that the point lies on (J. A. Baerentzen and H.
/// Aanaes 2005). Blocks of 8^3 voxels are made in parallel, each from the triangles near it: linear in the band's
/// voxels times the triangles near one. Null where the sides cannot be told so: the mesh is open, has edges of more
/// than two triangles, cuts itself, or holds solids in solids.
openvdb::FloatTree::Ptr meshBand(const TriangleMesh& mesh, float halfWidth);

}  // namespace pavel
