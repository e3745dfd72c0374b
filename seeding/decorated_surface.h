#pragma once
// The part of a base that a seeding decorates.
#include <functional>

#include "pavel/core/scene.h"
#include "pavel/seeding/surface_map.h"

namespace pavel {

/// Cuts a mesh along the zero set of f, linear between its values at the vertices, and keeps where f >= 0. Vertices are
/// shared along the cut; groups are dropped.
void clipMesh(TriangleMesh& mesh, const std::function<double(const Vec3& point, const Vec3& normal)>& f);

/// The surface that a seeding decorates: its region of the base, cut along the region's border: exactly where that is a
/// plane or lies on the base's edges; a ball, a curve's surroundings or a mask is followed by sides no longer than an
/// eighth of `spacing`.
/// @param mask values of the region's vertex mask, kept where they are above 1/2; null where it has none
/// @throws InputError where the region is empty
TriangleMesh decoratedSurface(const TriangleMesh& base, const SeedingOptions& options, double spacing,
                              const SurfaceMap* mask = nullptr);

}  // namespace pavel
