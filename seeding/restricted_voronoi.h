#pragma once
// Exact restricted Voronoi diagram: the partition of a surface by the nearest seed.
//
// Every triangle is clipped by the bisectors of all seeds that can own a part of it: those no farther from its centre
// than the nearest seed plus twice its circumscribed radius, which is the security radius of B. Levy and N. Bonneel
// (Variational anisotropic surface meshing with Voronoi parallel linear enumeration, 2013) applied to a triangle.
// A cell counts only the piece connected to its seed; orphaned pieces (the far side of a thin wall) are clipped again
// among the seeds that are connected to them, so that areas always sum to the surface's.
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

struct VoronoiCell {
    double area = 0;
    Vec3 moment{0, 0, 0};  ///< integral of x: centroid * area
    double energy = 0;     ///< integral of |x - seed|^2
};

/// @param seeds points on the surface, each with the triangle it lies on
/// @return one cell per seed, equal for any number of threads. O((triangles + seeds) log seeds) where triangles are not
///         larger than cells (subdivideLongEdges).
std::vector<VoronoiCell> restrictedVoronoi(const Surface& surface, const std::vector<SurfacePoint>& seeds);

}  // namespace pavel
