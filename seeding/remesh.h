#pragma once
// Remeshing of a dense surface into few, well-shaped triangles (paper, High-quality meshes; D.-M. Yan et al., Isotropic
// remeshing with fast and exact computation of restricted Voronoi diagram, 2009, whose centroidal Voronoi
// tessellation is reached here by local steps, so that every part, handle and pocket of the input is kept).
#include <functional>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

struct Remeshed {
    TriangleMesh mesh;
    std::vector<int> source;  ///< for each of its triangles one of the input's that lies under it
};

/// A mesh of the same surface with `vertices` vertices, or with a few more where its many parts and handles need them.
/// Short edges are collapsed until the number is reached; then edges flip towards the Delaunay triangulation, and
/// vertices walk on the input's surface to the centroids of what surrounds them. Vertices near creases are moved onto
/// them by the quadrics of the surface around them (M. Garland and P. Heckbert 1997), so that creases stay sharp.
/// Vertices are evenly spaced on each component; small, bent ones get more of them than their share of the area.
/// Topology is that of the input: components, genus and boundaries are kept; vertices on boundaries stay on them.
/// Equal for any number of threads. Time and memory O(triangles).
/// @param mesh manifold edges, consistently oriented; a boundary is welcome, groups are dropped
/// @param progress called with the share done; may throw to stop
/// @throws InputError where the mesh has an edge of more than two triangles, or not more vertices than asked for
Remeshed remeshed(const TriangleMesh& mesh, size_t vertices, const std::function<void(double)>& progress = {});

}  // namespace pavel
