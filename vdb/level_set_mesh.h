#pragma once
#include "pavel/core/mesh.h"
#include "pavel/vdb/grid.h"

namespace pavel {

/// Triangles of a level set's surface by OpenVDB's volumeToMesh: closed and 2-manifold, outward. World space of the
/// grid's transform times `scale`. `adaptivity` in [0, 1]: larger polygons where it is flat.
TriangleMesh levelSetMesh(const openvdb::FloatGrid& grid, double scale, double adaptivity = 0);

}  // namespace pavel
