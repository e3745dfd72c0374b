#pragma once
#include "pavel/core/mesh.h"
#include "pavel/vdb/grid.h"

namespace pavel {

/// Triangles of a level set's surface by OpenVDB's volumeToMesh: closed and 2-manifold, outward. Index space times
/// `voxelSize`; the grid's own transform is taken as the unit one.
TriangleMesh levelSetMesh(const openvdb::FloatGrid& grid, double voxelSize);

}  // namespace pavel
