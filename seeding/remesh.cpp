#include "pavel/seeding/remesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/seeding/coarsen.h"
#include "pavel/seeding/remesher.h"

namespace pavel {
namespace {

/// Edges longer than this are split, shorter ones collapsed, in spacings.
constexpr double kLong = 1.4, kShort = 0.7;
/// Shorter ones spoil what is around them.
constexpr double kTiny = 0.25;
/// Cosine of the angle by which a triangle may lean from the surface at its corners, on a coarse level and on the last.
constexpr double kFitCoarse = 0.6, kFitFine = 0.2;

/// Length of an edge where all triangles are equilateral.
double spacingOf(double area, size_t vertices) {
    return std::sqrt(area / double(vertices) * 2 / std::sqrt(3.0));
}

/// How many vertices each part deserves. The distance between n triangles and a surface goes with its area and total
/// curvature over n, so that the sum is least for shares as the root of their product.
std::vector<double> sharesOf(const std::vector<MeshPart>& parts) {
    if (parts.size() == 1) return {1};
    constexpr double kFlat = 4;  // times the mean curvature are added to each: flat parts get some, angles stay good
    std::vector<double> areas(parts.size()), bends(parts.size());
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t i) {
        const TriangleMesh& part = parts[i].mesh;
        areas[i] = meshArea(part);
        const auto neighbours = triangleNeighbours(part);
        for (size_t t = 0; t < neighbours.size(); ++t)
            for (int k = 0; k < 3; ++k)
                if (const int n = neighbours[t][size_t(k)]; n > int(t))
                    bends[i] +=
                        length(part.corner(t, (k + 1) % 3) - part.corner(t, k)) *
                        std::acos(std::clamp(dot(triangleNormal(part, t), triangleNormal(part, size_t(n))), -1.0, 1.0));
    });
    const double area = std::accumulate(areas.begin(), areas.end(), 0.0),
                 bend = std::accumulate(bends.begin(), bends.end(), 0.0);
    std::vector<double> shares;
    for (size_t i = 0; i < parts.size(); ++i)
        shares.push_back(bend > 0 ? std::sqrt(areas[i] * (bends[i] / bend + kFlat * areas[i] / area)) : areas[i]);
    return shares;
}

/// One component; as it is where it has no more vertices than that.
Remeshed remeshedPart(MeshPart part, size_t vertices, const std::function<void(double)>& progress) {
    TriangleMesh& mesh = part.mesh;
    if (mesh.points.size() <= vertices) return {std::move(mesh), std::move(part.source)};
    // Clusters of triangles tell where creases are: none may be as large as a cluster.
    const double spacing = spacingOf(meshArea(mesh), vertices);
    mesh.groups = std::move(part.source);  // groups are handed on
    subdivideLongEdges(mesh, 0.5 * spacing);
    const std::vector<int> source = std::move(mesh.groups);
    mesh.groups.clear();
    Remeshed out = Remesher(std::move(mesh), vertices, spacing).run(progress);
    for (int& t : out.source) t = source[size_t(t)];
    return out;
}

}  // namespace

void Remesher::startFrom(const Triangulation& dense) {
    std::vector<int> kept, triangleOf(dense.place.size(), -1);
    tri_ = Triangulation(dense.compact(kept));
    const auto& triangles = surface_.mesh().triangles;
    for (size_t t = 0; t < triangles.size(); ++t)
        for (int v : triangles[t]) triangleOf[size_t(v)] = int(t);
    std::vector<SurfacePoint> on;
    for (int v : kept) on.push_back(surface_.pointOn(triangleOf[size_t(v)], dense.place[size_t(v)]));
    standOn(std::move(on));
}

/// Forgets what was known of the vertices but where they stand.
void Remesher::standOn(std::vector<SurfacePoint> points) {
    on_ = std::move(points);
    kind_.assign(on_.size(), Kind::smooth);
    along_.assign(on_.size(), Vec3(0, 0, 0));
    optimum_ = tri_.place;
    owner_.clear();
    for (size_t v = 0; v < on_.size(); ++v)
        if (tri_.mesh.is_boundary(Vertex(int(v)))) kind_[v] = Kind::boundary;
}

double Remesher::lengthOf(Edge e) const {
    const Halfedge h = tri_.mesh.halfedge_handle(e, 0);
    return length(tri_.at(tri_.mesh.from_vertex_handle(h)) - tri_.at(tri_.mesh.to_vertex_handle(h)));
}

/// Length of an edge in the lengths that edges are to have there.
double Remesher::relativeLengthOf(Edge e) const {
    const Halfedge h = tri_.mesh.halfedge_handle(e, 0);
    return 2 * lengthOf(e) /
           (spacing_ * (gradeAt(tri_.mesh.from_vertex_handle(h)) + gradeAt(tri_.mesh.to_vertex_handle(h))));
}

/// Does the edge run along a crease?
bool Remesher::follows(Vertex a, Vertex b) const {
    const Vec3 d = normalized(tri_.at(b) - tri_.at(a));
    const auto agrees = [&](Vertex v) {
        const size_t i = size_t(v.idx());
        return kind_[i] == Kind::corner || kind_[i] == Kind::boundary ||
               (kind_[i] == Kind::crease && std::abs(dot(d, along_[i])) > 0.7);
    };
    return agrees(a) && agrees(b);
}

/// Does a triangle face as the surface does at its corners? Creases say nothing.
bool Remesher::fits(Vertex a, Vertex b, Vertex c) const {
    const Vec3 n = normalized(normal(a, b, c));
    for (Vertex v : {a, b, c})
        if (kind_[size_t(v.idx())] == Kind::smooth && dot(n, on_[size_t(v.idx())].normal) < fit_) return false;
    return true;
}

/// Do both triangles beside an edge fit?
bool Remesher::fits(Edge e) const {
    const Connectivity& m = tri_.mesh;
    for (int side = 0; side < 2; ++side)
        if (const Halfedge h = m.halfedge_handle(e, side);
            !m.is_boundary(h) &&
            !fits(m.from_vertex_handle(h), m.to_vertex_handle(h), m.to_vertex_handle(m.next_halfedge_handle(h))))
            return false;
    return true;
}

/// Would the triangles that a collapse moves fit?
bool Remesher::staysClose(Halfedge h) const {
    const Connectivity& m = tri_.mesh;
    const Vertex from = m.from_vertex_handle(h), to = m.to_vertex_handle(h);
    for (auto it = m.cvoh_ccwbegin(from); it.is_valid(); ++it) {
        if (m.is_boundary(*it)) continue;
        const Vertex a = m.to_vertex_handle(*it), b = m.to_vertex_handle(m.next_halfedge_handle(*it));
        if (a != to && b != to && !fits(to, a, b)) return false;
    }
    return true;
}

/// Merges an edge's vertices; what lies on a crease stays there.
bool Remesher::collapse(Edge e, double longest, double turn) {
    const Connectivity& m = tri_.mesh;
    Halfedge h = m.halfedge_handle(e, 0);
    const auto kindOf = [&](Vertex v) { return kind_[size_t(v.idx())]; };
    const Vertex a = m.from_vertex_handle(h), b = m.to_vertex_handle(h);
    const auto sameCrease = [&] {
        const Vec3 &u = along_[size_t(a.idx())], &v = along_[size_t(b.idx())], d = tri_.at(b) - tri_.at(a);
        return kindOf(a) == Kind::crease && kindOf(b) == Kind::crease && std::abs(dot(u, v)) > 0.7 &&
               length(d - dot(d, u) * u) < 0.3 * spacing_;
    };
    if (kindOf(a) != Kind::smooth && kindOf(b) != Kind::smooth && !follows(a, b) && !sameCrease()) return false;
    if (kindOf(a) > kindOf(b)) h = m.opposite_halfedge_handle(h);
    if (!staysClose(h)) return false;
    return tri_.collapse(h, longest, turn);
}

void Remesher::split(Edge e) {
    const Connectivity& m = tri_.mesh;
    const Halfedge h = m.halfedge_handle(e, 0);
    const size_t a = size_t(m.from_vertex_handle(h).idx()), b = size_t(m.to_vertex_handle(h).idx());
    Kind kind = follows(m.from_vertex_handle(h), m.to_vertex_handle(h)) ? Kind::crease : Kind::smooth;
    if (m.is_boundary(e)) kind = Kind::boundary;
    on_.push_back(surface_.walked(on_[a], 0.5 * (tri_.place[b] - tri_.place[a])));
    tri_.place.push_back(on_.back().position);
    optimum_.push_back(on_.back().position);
    along_.push_back(normalized(tri_.place[b] - tri_.place[a]));
    kind_.push_back(kind);
    tri_.mesh.split(e, tri_.mesh.add_vertex({0, 0, 0}));
    ++tri_.vertices;
}

/// Splits long edges and collapses short ones: this is what heals faults in the pattern.
void Remesher::anneal() {
    const double scale = std::sqrt(double(tri_.vertices) / double(count_));
    const size_t edges = tri_.mesh.n_edges();
    // What is folded must not feed itself: it can only be split, not collapsed.
    for (size_t i = 0; i < edges; ++i)
        if (const Edge e{int(i)}; alive(e) && relativeLengthOf(e) > kLong * scale && fits(e)) split(e);
    for (size_t i = 0; i < tri_.mesh.n_edges(); ++i) {
        const Edge e{int(i)};
        if (!alive(e)) continue;
        if (const double relative = relativeLengthOf(e); relative < kShort * scale)
            collapse(e, kLong * scale * lengthOf(e) / relative, 0.5);
    }
}

/// Every triangle into four: the new vertices have six neighbours, so that the pattern's order is handed on.
void Remesher::subdivide() {
    std::vector<int> kept;
    TriangleMesh fine = tri_.compact(kept);
    std::vector<SurfacePoint> on;
    for (int v : kept) on.push_back(on_[size_t(v)]);
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
        const auto [it, isNew] = middles.emplace(std::minmax(a, b), int(fine.points.size()));
        if (isNew) {
            on.push_back(surface_.walked(on[size_t(a)], 0.5 * (fine.points[size_t(b)] - fine.points[size_t(a)])));
            fine.points.push_back(on.back().position);
        }
        return it->second;
    };
    std::vector<Triangle> triangles;
    for (const Triangle& t : fine.triangles) {
        const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
        triangles.insert(triangles.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    fine.triangles = std::move(triangles);
    tri_ = Triangulation(fine);
    standOn(std::move(on));
}

/// Exactly the number of vertices asked for: from where edges are short, or to where they are long.
void Remesher::meetCount() {
    const double held = fit_;
    // Where slits and tunnels resist, shape gives way before the number does; topology never.
    for (double fit : {held, -1.0, -2.0}) {
        if (tri_.vertices == count_) break;
        fit_ = fit;
        std::vector<std::pair<double, int>> edges;
        const double sign = tri_.vertices > count_ ? 1 : -1;
        for (size_t i = 0; i < tri_.mesh.n_edges(); ++i)
            if (alive(Edge(int(i)))) edges.emplace_back(sign * relativeLengthOf(Edge(int(i))), int(i));
        std::sort(edges.begin(), edges.end());
        for (size_t k = 0; k < edges.size() && tri_.vertices != count_; ++k) {
            const Edge e{edges[k].second};
            if (!alive(e)) continue;
            if (sign > 0)
                collapse(e, 1e300, fit < -1 ? 0 : 0.5);
            else
                split(e);
        }
    }
    fit_ = held;
}

/// Edges far shorter than the others, left where necks and slits are no wider, go whatever they stand on.
void Remesher::dissolveTiny() {
    std::vector<std::pair<double, int>> tiny;
    for (size_t i = 0; i < tri_.mesh.n_edges(); ++i)
        if (const Edge e{int(i)}; alive(e) && lengthOf(e) < kTiny * spacing_) tiny.emplace_back(lengthOf(e), int(i));
    std::sort(tiny.begin(), tiny.end());
    for (const auto& [length, i] : tiny) {
        if (!alive(Edge(i))) continue;
        Halfedge h = tri_.mesh.halfedge_handle(Edge(i), 0);
        Halfedge back = tri_.mesh.opposite_halfedge_handle(h);
        const auto kindAtEndOf = [&](Halfedge x) { return kind_[size_t(tri_.mesh.to_vertex_handle(x).idx())]; };
        if (kindAtEndOf(h) < kindAtEndOf(back)) std::swap(h, back);
        if (!tri_.collapse(h, kLong * spacing_, 0)) tri_.collapse(back, kLong * spacing_, 0);
    }
    meetCount();
}

/// Rounds of flips and relaxation; the first of them also anneal.
void Remesher::settle(int rounds, const std::function<void(double)>& report) {
    for (int round = 0; round < rounds; ++round) {
        if (round % 4 == 2 && round < rounds - 4) findCreases(true);
        if (round < rounds / 2)
            anneal();
        else if (round == rounds / 2)
            meetCount();
        flipEdges(round < rounds * 7 / 10);
        relax();
        report(double(round + 1) / rounds);
    }
}

Remeshed Remesher::run(const std::function<void(double)>& progress) {
    const auto span = [&](double from, double to) {
        return [&progress, from, to](double share) {
            if (progress) progress(from + (to - from) * share);
        };
    };
    constexpr size_t kLeastLevels = 400;
    const size_t count = count_;
    const double spacing = spacing_;
    if (count >= kLeastLevels) {
        // From coarse to fine, so that nearly all vertices come in rows (as in seeding/cvt.h).
        count_ = count / 4;
        spacing_ = 2 * spacing;
        fit_ = kFitCoarse;
        startFrom(coarsened(surface_, count_, spacing_, true));
        settle(12, span(0.3, 0.5));
        subdivide();
    } else {
        startFrom(coarsened(surface_, count, spacing, false));
    }
    count_ = count;
    spacing_ = spacing;
    fit_ = kFitFine;
    settle(12, span(0.5, 0.95));
    dissolveTiny();
    for (int round = 0; round < 2; ++round) {
        flipEdges(false);
        improveAngles();
    }
    for (int round = 0; round < 3; ++round) {
        flipEdges(false);
        improveWorst();
    }
    placeVertices();
    fitPlaces();
    Remeshed out;
    std::vector<int> kept;
    out.mesh = tri_.compact(kept);
    for (const Triangle& t : out.mesh.triangles) out.source.push_back(on_[size_t(kept[size_t(t[0])])].triangle);
    span(0, 1)(1);
    return out;
}

Remeshed remeshed(const TriangleMesh& mesh, size_t vertices, const std::function<void(double)>& progress) {
    if (vertices < 4)
        throw InputError("a closed mesh has at least 4 vertices; ask for more than " + std::to_string(vertices));
    if (mesh.points.size() <= vertices)
        throw InputError("the mesh has " + std::to_string(mesh.points.size()) +
                         " vertices; ask for fewer than that, not " + std::to_string(vertices));
    std::vector<MeshPart> parts = connectedParts(manifold(mesh));
    const std::vector<double> shares = sharesOf(parts);
    const size_t largest = size_t(std::max_element(shares.begin(), shares.end()) - shares.begin());
    const double all = std::accumulate(shares.begin(), shares.end(), 0.0);
    std::vector<Remeshed> remade(parts.size());
    tbb::parallel_for(size_t(0), parts.size(), [&](size_t i) {
        if (i != largest)
            remade[i] = remeshedPart(std::move(parts[i]),
                                     std::max(size_t(4), size_t(double(vertices) * shares[i] / all + 0.5)), {});
    });
    // The largest makes up for what was not met elsewhere.
    size_t taken = 0;
    for (const Remeshed& r : remade) taken += r.mesh.points.size();
    remade[largest] = remeshedPart(std::move(parts[largest]), vertices > taken + 4 ? vertices - taken : 4, progress);
    Remeshed out = std::move(remade[0]);
    for (size_t i = 1; i < remade.size(); ++i) {
        append(out.mesh, remade[i].mesh);
        out.source.insert(out.source.end(), remade[i].source.begin(), remade[i].source.end());
    }
    return out;
}

}  // namespace pavel
