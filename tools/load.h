#pragma once
#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"

namespace pavel {

/// The scene's base as a closed solid in scene units; repairs are added to the context's warnings.
TriangleMesh loadBase(const Scene& scene, RunContext& context);
/// The scene's elements, ready to be placed.
std::vector<ElementKind> loadKinds(const Scene& scene, RunContext& context);
/// h: as given, or from the resolution (voxels across a mean element's footprint diameter).
double sceneVoxelSize(const Scene& scene, const std::vector<ElementKind>& kinds);

}  // namespace pavel
