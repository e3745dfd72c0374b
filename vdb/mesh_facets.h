#pragma once
// A mesh's triangles with what signed distances to them ask for.
#include <algorithm>
#include <array>
#include <cmath>

#include "pavel/core/mesh.h"

namespace pavel {

struct Facet {
    Vec3 a, b, c;
    Vec3 normal;             ///< unit
    std::array<Vec3, 3> in;  ///< unit, in the plane, away from the edges ab, bc, ca into the triangle
    /// Pseudo-normals, not of unit length: they tell the side (J. A. Baerentzen and H. Aanaes 2005).
    std::array<Vec3, 3> edge, vertex;
    /// The way from its edges and corners to the points that these are nearest to leads away from the prism over the
    /// facet by no more than this share of its length: small where the mesh bends little, 1 at sharp corners.
    double aside = 1;

    /// May a box hold points within `band` of the facet that it is nearest to?
    bool mayMeet(const Vec3& centre, const Vec3& half, double band) const {
        const auto over = [&](const Vec3& n) {
            return std::abs(n[0]) * half[0] + std::abs(n[1]) * half[1] + std::abs(n[2]) * half[2];
        };
        const double beside = aside * band;
        return std::abs(dot(centre - a, normal)) <= band + over(normal) &&
               dot(centre - a, in[0]) >= -beside - over(in[0]) && dot(centre - b, in[1]) >= -beside - over(in[1]) &&
               dot(centre - c, in[2]) >= -beside - over(in[2]);
    }
    /// How far along an axis such points may lie beyond its corners.
    double reach(int axis, double band) const { return band * std::min(1.0, std::abs(normal[axis]) + aside); }
};

/// The facets of a closed mesh; none where an edge has not two triangles that agree about its sides, or a triangle has
/// no area. O(triangles).
std::vector<Facet> makeFacets(const TriangleMesh& mesh);

/// From the nearest point of the facet to p, and the normal that tells p's side: of the face, edge or corner that it is
/// on.
Vec3 fromNearest(const Facet& f, const Vec3& p, const Vec3*& normal);

}  // namespace pavel
