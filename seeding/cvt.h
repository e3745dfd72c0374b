#pragma once
// Isotropic seeding by a centroidal Voronoi tessellation restricted to the surface (paper, Isotropic seeding;
// Y. Liu et al., On centroidal Voronoi tessellation: energy smoothness and fast computation, 2009).
#include <functional>
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

struct CvtOptions {
    int iterations = 100;  ///< at most; 0 leaves the stratified random start: the hand-made look
    double tolerance =
        1e-3;  ///< stops when seeds are this near to their centroids (root mean square, in seed spacings)
    uint64_t seed = 1;
};

/// Exactly `count` points on the surface. Lloyd steps first, then L-BFGS (m = 7) on the tessellation's energy, with the
/// gradient in the tangent planes and every step mapped back to the surface.
/// @param progress called after each iteration with the share done; may throw to stop
std::vector<SurfacePoint> centroidalSeeds(const Surface& surface, size_t count, const CvtOptions& options,
                                          const std::function<void(double)>& progress = {});

}  // namespace pavel
