#pragma once
#include <memory>

#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"
#include "pavel/seeding/surface_map.h"
#include "pavel/vdb/pack.h"

namespace pavel {

/// The scene's base as a closed solid in scene units; repairs are added to the context's warnings.
TriangleMesh loadBase(const Scene& scene, RunContext& context);
/// The scene's elements, ready to be placed.
std::vector<ElementKind> loadKinds(const Scene& scene, RunContext& context);
/// The manual placements of each seeding, from the scene or the file that it names.
std::vector<std::vector<PlacementOptions>> loadPlacements(const Scene& scene);
/// The vertex mask that a seeding's region names, or null.
std::shared_ptr<const SurfaceMap> loadMask(const Scene& scene, const SeedingOptions& seeding);
/// Seeds of a scene: reads placements and makes offset surfaces where they are asked for.
SeedSet loadSeeds(const Scene& scene, const TriangleMesh& base, const std::vector<ElementKind>& kinds,
                  RunContext& context);
PackOptions packOptions(const Scene& scene, double voxelSize);
/// h: as given, or from the resolution (voxels across a mean element's footprint diameter).
double sceneVoxelSize(const Scene& scene, const std::vector<ElementKind>& kinds);

}  // namespace pavel
