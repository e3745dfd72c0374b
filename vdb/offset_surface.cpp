#include "pavel/vdb/offset_surface.h"

#include <cmath>

#include "pavel/core/error.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {

TriangleMesh offsetSurface(const TriangleMesh& solid, double distance, double voxelSize) {
    const double voxels = distance / voxelSize;
    if (voxels > 1000) throw InputError("seeding.offset is too large for elements of this size");
    openvdb::initialize();
    const auto grid = voxelizeBase(solid, voxelSize, float(voxels + 3));
    for (auto it = grid->beginValueAll(); it; ++it) it.setValue(*it - float(voxels));
    grid->tree().root().setBackground(3.f, false);
    return levelSetMesh(*grid, voxelSize);
}

}  // namespace pavel
