#pragma once
// Isotropic seeding by a centroidal Voronoi tessellation restricted to the surface (paper, Isotropic seeding;
// Y. Liu et al., On centroidal Voronoi tessellation: energy smoothness and fast computation, 2009).
#include <functional>
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

/// Triangles much larger than cells would make each meet many seeds: surfaces are best subdivided to this share of the
/// seed spacing.
constexpr double kLongestEdge = 1.5;

struct CvtOptions {
    /// At most; 0 leaves the stratified random start: the hand-made look. From 20 on the start is orderly, too: see
    /// centroidalSeeds.
    int iterations = 100;
    double tolerance =
        2e-3;  ///< stops when seeds are this near to their centroids (root mean square, in seed spacings)
    uint64_t seed = 1;
    std::vector<double> density;  ///< wanted seeds per area, relative, one value above 0 for each triangle; empty: even
};

/// Exactly `count` points on the surface. Lloyd steps first, then L-BFGS (m = 7) on the tessellation's energy, with the
/// gradient in the tangent planes and every step walked along the surface. From coarse to fine: a tessellation with a
/// quarter of the seeds is made first, and seeds are added between neighbours, so that its order is handed on (92 % of
/// cells get six neighbours, where a random start leads to 80 %). Up to 6,000 evenly spread seeds are annealed, too.
/// @param progress called after each iteration with the share done; may throw to stop
std::vector<SurfacePoint> centroidalSeeds(const Surface& surface, size_t count, const CvtOptions& options,
                                          const std::function<void(double)>& progress = {});

}  // namespace pavel
