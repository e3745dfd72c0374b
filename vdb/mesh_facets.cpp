#include "pavel/vdb/mesh_facets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <boost/container/small_vector.hpp>
#include <numeric>

#include "pavel/core/mesh_check.h"

namespace pavel {
namespace {

/// A direction in a plane, of unit length.
struct Turn {
    double x, y;
    /// Orders like the angle with the x axis, from 0 to 4.
    double order() const {
        const double along = x / (std::abs(x) + std::abs(y));
        return y < 0 ? 3 + along : 1 - along;
    }
};

/// The largest angle between a corner's normal, or its opposite, and the way to a point that the corner is nearest to:
/// that way makes no acute angle with any edge there. [first, last): vertices at the edges' other ends.
double openAngle(const TriangleMesh& mesh, const Vec3& corner, const Vec3& normal, const int* first, const int* last) {
    const Vec3 u = anyPerpendicular(normal), w = cross(normal, u);
    double highest = 0, shortest = 1;  // of edges of unit length, along the normal and across it
    boost::container::small_vector<Turn, 12> turns;
    for (; first != last; ++first) {
        const Vec3 e = normalized(mesh.points[size_t(*first)] - corner);
        const double x = dot(e, u), y = dot(e, w), across = std::sqrt(x * x + y * y);
        if (!(across > 1e-6)) return kPi / 2;
        highest = std::max(highest, std::abs(dot(e, normal)));
        shortest = std::min(shortest, across);
        turns.push_back({x / across, y / across});
    }
    std::sort(turns.begin(), turns.end(), [](const Turn& a, const Turn& b) { return a.order() < b.order(); });
    if (turns.size() < 3 || turns.front().order() == turns.back().order()) return kPi / 2;
    double widest = 1;  // gap between neighbours: its cosine
    for (size_t k = 0; k < turns.size(); ++k) {
        const Turn &a = turns[k], &b = turns[k + 1 < turns.size() ? k + 1 : 0];
        if (a.x * b.y < a.y * b.x) return kPi / 2;  // more than half a turn
        widest = std::min(widest, a.x * b.x + a.y * b.y);
    }
    // The widest of k gaps is no less than the k-th part of a turn: else all ways are one, to rounding.
    if (widest > std::cos(2 * kPi / double(turns.size())) + 1e-9) return kPi / 2;
    // Whichever way it leans, there is an edge within half the widest gap.
    const double nearest = shortest * std::sqrt(std::max(0.0, (1 + widest) / 2));
    return nearest > 0 ? std::atan(highest / nearest) : kPi / 2;
}

/// openAngle at every vertex.
std::vector<double> openAngles(const TriangleMesh& mesh, const std::vector<Vec3>& normals) {
    // Each edge at a corner begins one triangle's side there.
    std::vector<size_t> first(mesh.points.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
        for (int v : t) ++first[size_t(v) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int> ends(3 * mesh.triangles.size());
    std::vector<size_t> next(first.begin(), first.end() - 1);
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k) ends[next[size_t(t[k])]++] = t[(k + 1) % 3];
    std::vector<double> angles(mesh.points.size(), kPi / 2);
    tbb::parallel_for(size_t(0), angles.size(), [&](size_t v) {
        if (first[v] == first[v + 1]) return;
        angles[v] = openAngle(mesh, mesh.points[v], normals[v], &ends[first[v]], ends.data() + first[v + 1]);
    });
    return angles;
}

double angleBetween(const Vec3& unit, const Vec3& other) {
    return std::acos(std::clamp(dot(unit, other), -1.0, 1.0));
}

}  // namespace

std::vector<Facet> makeFacets(const TriangleMesh& mesh) {
    const auto neighbours = triangleNeighbours(mesh);
    const std::vector<Vec3> atVertex = vertexNormals(mesh);
    const std::vector<double> open = openAngles(mesh, atVertex);
    const size_t n = mesh.triangles.size();
    std::vector<Facet> facets(n);
    std::atomic<bool> good{true};
    tbb::parallel_for(size_t(0), n, [&](size_t t) {
        const Triangle& corners = mesh.triangles[t];
        Facet& f = facets[t];
        const Vec3 p[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
        f.a = p[0], f.b = p[1], f.c = p[2];
        const Vec3 across = cross(f.b - f.a, f.c - f.a);
        const double twice = length(across);
        if (!(twice > 1e-12)) good = false;
        f.normal = normalized(across);
        double widest = 0;  // angle between its normal and the way to a point that is nearest to an edge or a corner
        for (size_t k = 0; k < 3; ++k) {
            const auto v = size_t(corners[k]);
            f.in[k] = normalized(cross(f.normal, p[(k + 1) % 3] - p[k]));
            f.vertex[k] = atVertex[v];
            widest = std::max(widest, open[v] + angleBetween(f.normal, atVertex[v]));
            const int m = neighbours[t][k];
            if (m < 0) {
                good = false;
                continue;
            }
            const Triangle& other = mesh.triangles[size_t(m)];
            bool agrees = false;
            for (size_t j = 0; j < 3; ++j)
                agrees |= other[j] == corners[(k + 1) % 3] && other[(j + 1) % 3] == corners[k];
            if (!agrees) good = false;
            const Vec3 beside = triangleNormal(mesh, size_t(m));
            f.edge[k] = f.normal + beside;
            widest = std::max(widest, angleBetween(f.normal, beside));
        }
        f.aside = widest < kPi / 2 ? std::sin(widest) : 1;
    });
    if (!good) facets.clear();
    return facets;
}

Vec3 fromNearest(const Facet& f, const Vec3& p, const Vec3*& normal) {
    Vec3 weights;
    const Vec3 nearest = closestPointOnTriangle(p, f.a, f.b, f.c, &weights);
    const bool onBc = weights[0] == 0, onCa = weights[1] == 0, onAb = weights[2] == 0;
    normal = onCa && onAb   ? &f.vertex[0]
             : onAb && onBc ? &f.vertex[1]
             : onBc && onCa ? &f.vertex[2]
             : onAb         ? &f.edge[0]
             : onBc         ? &f.edge[1]
             : onCa         ? &f.edge[2]
                            : &f.normal;
    return p - nearest;
}

}  // namespace pavel
