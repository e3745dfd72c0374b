#pragma once
// What stands on a seed: which kind, how turned, how large.
#include "pavel/core/placement.h"
#include "pavel/core/scene.h"
#include "pavel/seeding/stripes.h"

namespace pavel {

/// "Up" along the surface where there is such a direction.
Vec3 upTangent(const Vec3& normal);

struct Dressing {
    const std::vector<ElementKind>& kinds;
    std::vector<int> of;  ///< the kinds that are placed
    const Scene& scene;
    uint64_t stream = 0;                               ///< first of its random streams: see kStreams
    const DirectionField* field = nullptr;             ///< for the rotation "field"
    std::vector<double> scale;                         ///< by point, before the variation of size; empty: 1
    const std::vector<StripeSeed>* stripes = nullptr;  ///< the points' own, where they come from stripes
};
/// Random streams that one dressing may use.
constexpr uint64_t kStreams = 16;

/// Appends a seed for every point. On stripes, "alternate" turns follow the main stripe, alternate kinds both ways, and
/// a sequence runs along the main stripe; elsewhere alternation is by the neighbours. Random kinds come in numbers by
/// weight, and random sizes evenly over their range, so that the coverage is what was asked for.
void dress(const std::vector<SurfacePoint>& points, const Dressing& dressing, std::vector<Seed>& seeds);

}  // namespace pavel
