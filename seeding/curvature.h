#pragma once
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

/// Principal curvatures at a vertex, positive where the surface bends away from its normal (a ball's are 1 / radius).
struct Curvature {
    double least = 0, greatest = 0;  ///< by magnitude
    Vec3 alongLeast{1, 0, 0};        ///< unit, tangent: along a limb or ridge
};

/// From the change of the normals over the triangles around each vertex (S. Rusinkiewicz, Estimating curvatures and
/// their derivatives on triangle meshes, 2004). O(triangles).
std::vector<Curvature> principalCurvatures(const TriangleMesh& mesh);

}  // namespace pavel
