#pragma once
#include "pavel/core/mesh.h"
#include "pavel/vdb/grid.h"

namespace pavel {

/// Triangles of a level set's surface by OpenVDB's volumeToMesh: closed and 2-manifold, outward. World space of the
/// grid's transform times `scale`.
TriangleMesh levelSetMesh(const openvdb::FloatGrid& grid, double scale);

}  // namespace pavel
