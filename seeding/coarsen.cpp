#include "pavel/seeding/coarsen.h"

#include <algorithm>
#include <numeric>

namespace pavel {
namespace {

/// How far a vertex may lie from the planes of all triangles that were merged into it (root mean square), in spacings.
constexpr double kOff = 0.05;

/// Sum of squared distances to the planes of triangles, by area (M. Garland and P. Heckbert 1997).
struct Quadric {
    double a[6] = {}, b[3] = {}, c = 0, area = 0;
    void add(const Vec3& n, double d, double weight) {  // plane n x = d
        a[0] += weight * n[0] * n[0], a[1] += weight * n[0] * n[1], a[2] += weight * n[0] * n[2];
        a[3] += weight * n[1] * n[1], a[4] += weight * n[1] * n[2], a[5] += weight * n[2] * n[2];
        for (int k = 0; k < 3; ++k) b[k] += weight * d * n[k];
        c += weight * d * d;
        area += weight;
    }
    void add(const Quadric& o) {
        for (int k = 0; k < 6; ++k) a[k] += o.a[k];
        for (int k = 0; k < 3; ++k) b[k] += o.b[k];
        c += o.c, area += o.area;
    }
    double at(const Vec3& p) const {
        return a[0] * p[0] * p[0] + a[3] * p[1] * p[1] + a[5] * p[2] * p[2] +
               2 * (a[1] * p[0] * p[1] + a[2] * p[0] * p[2] + a[4] * p[1] * p[2]) -
               2 * (b[0] * p[0] + b[1] * p[1] + b[2] * p[2]) + c;
    }
};

}  // namespace

Triangulation coarsened(const Surface& surface, size_t count, double spacing, bool faithful) {
    using Edge = OpenMesh::EdgeHandle;
    using Halfedge = Triangulation::Halfedge;
    Triangulation dense(surface.mesh(), surface.neighbours());
    const Connectivity& m = dense.mesh;
    std::vector<Quadric> quadrics(dense.place.size());
    for (size_t t = 0; t < surface.mesh().triangles.size(); ++t) {
        const Vec3& n = surface.faceNormal(int(t));
        const double d = dot(n, surface.mesh().corner(t, 0)), share = surface.faceArea(int(t)) / 3;
        for (int v : surface.mesh().triangles[t]) quadrics[size_t(v)].add(n, d, share);
    }
    std::vector<int> edges(m.n_edges());  // that are left
    std::iota(edges.begin(), edges.end(), 0);
    for (double share = 0.25; dense.vertices > count && share < (faithful ? 1 : 100);
         share *= share < 0.5 ? 1.12 : 1.03) {
        const double threshold = share * spacing, longest = std::max(1.4, 1.9 * share) * spacing,
                     turn = share < 1 ? 0.5 : 0.2, off = kOff * std::max(1.0, share * share * share) * spacing;
        const auto tryCollapse = [&](Halfedge h) {
            const size_t from = size_t(m.from_vertex_handle(h).idx()), to = size_t(m.to_vertex_handle(h).idx());
            Quadric sum = quadrics[from];
            sum.add(quadrics[to]);
            if (sum.at(dense.place[to]) > off * off * sum.area || !dense.collapse(h, longest, turn)) return false;
            quadrics[to] = sum;
            return true;
        };
        edges.erase(
            std::remove_if(edges.begin(), edges.end(), [&](int i) { return bool(m.status(Edge(i)).deleted()); }),
            edges.end());
        for (size_t i = 0; i < edges.size() && dense.vertices > count; ++i) {
            const Edge e{edges[i]};
            if (m.status(e).deleted()) continue;
            const Halfedge h = m.halfedge_handle(e, 0);
            const Vec3 d = dense.at(m.from_vertex_handle(h)) - dense.at(m.to_vertex_handle(h));
            if (dot(d, d) > threshold * threshold) continue;
            if (!tryCollapse(h)) tryCollapse(m.opposite_halfedge_handle(h));
        }
    }
    return dense;
}

}  // namespace pavel
