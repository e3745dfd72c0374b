#pragma once
// From a scene's seeding section to seeds: how many, where, which kind, how turned and how large.
#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"

namespace pavel {

/// The surface that a scene decorates: its region of the base.
TriangleMesh decoratedSurface(const TriangleMesh& base, const SeedingOptions& options);

/// Mean of the kinds' footprints over their weights and the size variation: one element's expected share of the area.
double meanFootprint(const std::vector<ElementKind>& kinds, double sizeVariation);

/// @param manual placements, read already, for the method "manual"
/// @throws InputError where the coverage asks for no element or for more than ten million
SeedSet makeSeeds(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const Scene& scene,
                  const std::vector<PlacementOptions>& manual, RunContext& context);

}  // namespace pavel
