#pragma once
// From a scene's seeding section to seeds: how many, where, which kind, how turned and how large.
#include <memory>

#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"
#include "pavel/seeding/decorated_surface.h"

namespace pavel {

/// Mean of the footprints of a seeding's kinds over their weights and the size variation: one element's expected share
/// of the area.
double meanFootprint(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding, double sizeVariation);

/// About the distance between seeds on a surface.
double meanSpacing(const TriangleMesh& surface, const std::vector<ElementKind>& kinds, const SeedingOptions& seeding,
                   double sizeVariation);

/// The height above the surface at which a seeding is sampled: its offset, or the mean height of its elements' widest
/// sections.
double samplingOffset(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding);

/// What a seeding needs besides the scene.
struct SeedingInput {
    std::vector<PlacementOptions> manual;                 ///< placements, for the method "manual"
    TriangleMesh offsetSurface{};                         ///< of the base, at samplingOffset; empty where that is 0
    std::shared_ptr<const SurfaceMap> mask{}, density{};  ///< where the region or the density names one
};

/// With an offset the tessellation is made on the offset surface (paper, Sampling on the offset surface), the part of
/// it whose feet lie in the region, and mapped back; where a point has no unique foot, because the offset surface
/// merges across a gap, no element is placed, and the context is warned.
/// @param inputs one for each seeding; may be left out where none needs any
/// @throws InputError where the coverage asks for no element or for more than a million
SeedSet makeSeeds(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const Scene& scene,
                  const std::vector<SeedingInput>& inputs, RunContext& context);

}  // namespace pavel
