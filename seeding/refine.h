#pragma once
// Refinement of placed elements that are not radially symmetric: what the paper's Limitations leave open.
#include "pavel/core/placement.h"
#include "pavel/seeding/surface.h"

namespace pavel {

/// How evenly footprints cover a surface.
struct CoverMeasure {
    double uncovered = 0;  ///< share of the area under no footprint
    double deviation = 0;  ///< standard deviation of the number of footprints over a point
};

/// Counts the footprints over points spread evenly on the surface, about 80 for each seed.
CoverMeasure measureCover(const Surface& surface, const std::vector<Seed>& seeds,
                          const std::vector<ElementKind>& kinds);

struct RefineOptions {
    int iterations = 0;
    bool turn = true;  ///< may elements turn, too
    uint64_t seed = 1;
};

/// Greedy improvement of position and rotation, for even overlap without holes: every element in turn tries a few steps
/// and turns, and takes what lowers the integral of (footprints over a point - mean)^2 most, points under none counting
/// more; steps get shorter with every iteration.
/// @param points where the seeds are, on `ground`; both are updated
/// @param region the decorated surface, which elements do not leave; the same as `ground` where they were sampled on it
/// O(iterations * seeds)
void refine(const Surface& ground, const Surface& region, const std::vector<ElementKind>& kinds,
            const RefineOptions& options, std::vector<SurfacePoint>& points, Seed* seeds);

}  // namespace pavel
