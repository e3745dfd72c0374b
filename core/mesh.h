#pragma once
// Indexed triangle meshes, and the queries on them that more than one part needs.
#include <array>
#include <string>
#include <vector>

#include "pavel/core/vec.h"

namespace pavel {

using Triangle = std::array<int, 3>;

/// A triangle soup with shared vertices, counter-clockwise seen from outside. Nothing about closedness is promised:
/// see mesh_check.h. Lengths are in scene units unless a function says otherwise.
struct TriangleMesh {
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
    /// Part of the surface that each triangle belongs to, an index into groupNames; empty where there is but one.
    std::vector<int> groups;
    std::vector<std::string> groupNames;

    Vec3 corner(size_t triangle, int k) const { return points[size_t(triangles[triangle][size_t(k)])]; }
};

struct Bounds {
    Vec3 min{1e300, 1e300, 1e300}, max{-1e300, -1e300, -1e300};
    void add(const Vec3& p) {
        min.minimize(p);
        max.maximize(p);
    }
    Vec3 size() const { return max - min; }
    double diagonal() const { return length(size()); }
    double longestSide() const { return std::max({max[0] - min[0], max[1] - min[1], max[2] - min[2]}); }
};

Bounds meshBounds(const TriangleMesh& mesh);
double triangleArea(const Vec3& a, const Vec3& b, const Vec3& c);
double meshArea(const TriangleMesh& mesh);
/// Signed volume by the divergence theorem; meaningful for closed, consistently oriented meshes.
double meshVolume(const TriangleMesh& mesh);
Vec3 triangleNormal(const TriangleMesh& mesh, size_t triangle);
/// What a triangle adds to the normals of its corners: its own, times the angle there.
std::array<Vec3, 3> cornerNormals(const TriangleMesh& mesh, size_t triangle);
/// Unit vertex normals, corner angles as weights.
std::vector<Vec3> vertexNormals(const TriangleMesh& mesh);
/// neighbours[t][k]: triangle across the edge from corner k to corner k+1, or -1 at a boundary or non-manifold edge.
std::vector<std::array<int, 3>> triangleNeighbours(const TriangleMesh& mesh);
/// Appends b to a; b's groups are dropped unless both have them under the same names.
void append(TriangleMesh& a, const TriangleMesh& b);
/// Area of a closed mesh's cut at height z.
double sectionArea(const TriangleMesh& mesh, double z);
/// The height of the widest cut.
double widestHeight(const TriangleMesh& mesh);
void scaleMesh(TriangleMesh& mesh, double factor);
/// The triangles of one named group, with unused vertices removed. Throws InputError where there is no such group.
TriangleMesh groupSubmesh(const TriangleMesh& mesh, const std::string& group);
/// The same surface with vertices of their own on each side of edges bent by more than the angle, so that vertex
/// normals break there. `source`: the vertex that each was.
TriangleMesh splitAtCreases(const TriangleMesh& mesh, double degrees, std::vector<int>& source);
/// Drops vertices that no triangle uses; returns how many.
size_t removeUnusedVertices(TriangleMesh& mesh);
/// Point of the triangle (a, b, c) closest to p, with its barycentric weights (C. Ericson 2005, 5.1.5).
Vec3 closestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, Vec3* weights = nullptr);

}  // namespace pavel
