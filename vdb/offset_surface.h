#pragma once
#include "pavel/core/mesh.h"

namespace pavel {

/// The surface at a distance outside a closed solid, from a sparse level set: closed, 2-manifold, scene units. Where it
/// merges across a gap, the gap is closed.
/// @throws InputError where the voxel size would take the band beyond a thousand voxels
TriangleMesh offsetSurface(const TriangleMesh& solid, double distance, double voxelSize);

}  // namespace pavel
