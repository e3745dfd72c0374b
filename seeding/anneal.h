#pragma once
// Rids a tessellation of defects that descent cannot reach. Internal to this folder.
#include "pavel/core/rng.h"
#include "pavel/seeding/restricted_voronoi.h"

namespace pavel {

/// Shakes the seeds around cells that do not have six neighbours, lets them settle, and keeps of every such place what
/// lowered the energy, some rounds long (after L. Lu, F. Sun, H. Pan and W. Wang, Global optimization of centroidal
/// Voronoi tessellation with Monte Carlo approach, 2012, but many places at a time, and by cells in tangent planes).
/// For even density. Ends near the tessellation's centroids, not on them: let it descend afterwards. O(seeds log
/// seeds).
std::vector<SurfacePoint> annealed(const Surface& surface, RestrictedVoronoi& voronoi, std::vector<SurfacePoint> seeds,
                                   Rng& rng);

}  // namespace pavel
