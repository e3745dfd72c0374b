#include "pavel/vdb/offset_surface.h"

#include <cmath>

#include "pavel/core/error.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {

TriangleMesh offsetSurface(const TriangleMesh& solid, double distance, double voxelSize) {
    const double voxels = distance / voxelSize;
    if (voxels > 1000) throw InputError("seeding.offset is too large for elements of this size");
    openvdb::initialize();
    const auto grid = openvdb::FloatGrid::create(
        widened(narrowBand(solid, voxelSize, kResultBand)->tree(), float(voxels) + kResultBand, kResultBand));
    for (auto it = grid->beginValueAll(); it; ++it) it.setValue(*it - float(voxels));
    grid->tree().root().setBackground(kResultBand, false);
    return levelSetMesh(*grid, voxelSize);
}

}  // namespace pavel
