#pragma once
// Descent of a tessellation's energy towards a centroidal one. Internal to this folder.
#include <functional>

#include "pavel/seeding/restricted_voronoi.h"

namespace pavel {

/// The cells of seeds; one without area rests.
using CellsOf = std::function<std::vector<VoronoiCell>(const std::vector<SurfacePoint>&)>;

struct Descent {
    int lloydSteps;  ///< the first of the iterations
    int iterations;
    double tolerance;  ///< as CvtOptions'
};

/// Moves the seeds until they are near their cells' centroids, by Lloyd's steps, then L-BFGS (Y. Liu et al., On
/// centroidal Voronoi tessellation: energy smoothness and fast computation, 2009).
/// @param progress if set, called with the share of the iterations done
std::vector<SurfacePoint> descended(const Surface& surface, const CellsOf& cellsOf, std::vector<SurfacePoint> start,
                                    const Descent& descent, const std::function<void(double)>& progress = {});

}  // namespace pavel
