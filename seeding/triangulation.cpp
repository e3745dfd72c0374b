#include "pavel/seeding/triangulation.h"

#include <algorithm>
#include <numeric>

#include "pavel/core/error.h"

namespace pavel {
namespace {

void checkEdges(const TriangleMesh& mesh) {
    // Where each goes, in buckets by where it comes from: a handful in each.
    std::vector<size_t> end(mesh.points.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
        for (int v : t) ++end[size_t(v) + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<int> to(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k) to[end[size_t(t[k])]++] = t[(k + 1) % 3];  // the bucket's begin becomes its end
    auto begin = to.begin();
    for (size_t v = 0; v < mesh.points.size(); ++v) {
        const auto stop = to.begin() + std::ptrdiff_t(end[v]);
        std::sort(begin, stop);
        if (std::adjacent_find(begin, stop) != stop)
            throw InputError(
                "the mesh has an edge of more than two triangles, or neighbours that face opposite ways; repair it "
                "first");
        begin = stop;
    }
}

}  // namespace

TriangleMesh manifold(const TriangleMesh& mesh) {
    checkEdges(mesh);
    std::vector<int> source;
    return splitAtCreases(mesh, 180, source);
}

Triangulation::Triangulation(const TriangleMesh& from) : Triangulation(from, triangleNeighbours(from)) {}

Triangulation::Triangulation(const TriangleMesh& from, const std::vector<std::array<int, 3>>& neighbours)
    : place(from.points), vertices(from.points.size()) {
    mesh.reserve(from.points.size(), from.triangles.size() * 3 / 2 + 16, from.triangles.size());
    for (size_t v = 0; v < from.points.size(); ++v) mesh.add_vertex({0, 0, 0});
    const bool closed = std::all_of(neighbours.begin(), neighbours.end(),
                                    [](const std::array<int, 3>& n) { return n[0] >= 0 && n[1] >= 0 && n[2] >= 0; });
    if (closed) {
        connect(from.triangles, neighbours);
        return;
    }
    for (const Triangle& t : from.triangles)
        if (!mesh.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2])).is_valid())
            throw InputError("the mesh is not manifold; repair it first");
}

/// What add_face makes of a closed surface, without its searches.
void Triangulation::connect(const std::vector<Triangle>& triangles, const std::vector<std::array<int, 3>>& neighbours) {
    std::vector<std::array<Halfedge, 3>> sides(triangles.size());
    for (size_t t = 0; t < triangles.size(); ++t) {
        for (size_t k = 0; k < 3; ++k) {
            const size_t other = size_t(neighbours[t][k]);
            const Vertex from(triangles[t][k]), to(triangles[t][(k + 1) % 3]);
            if (other > t) {
                sides[t][k] = mesh.new_edge(from, to);
            } else {
                size_t back = 0;  // the other triangle's side, which runs the other way
                while (triangles[other][(back + 1) % 3] != from.idx() || triangles[other][back] != to.idx())
                    if (++back == 3) throw InputError("the mesh is not manifold; repair it first");
                sides[t][k] = mesh.opposite_halfedge_handle(sides[other][back]);
            }
            mesh.set_halfedge_handle(from, sides[t][k]);
        }
        const auto face = mesh.new_face();
        mesh.set_halfedge_handle(face, sides[t][2]);
        for (size_t k = 0; k < 3; ++k) {
            mesh.set_next_halfedge_handle(sides[t][k], sides[t][(k + 1) % 3]);
            mesh.set_face_handle(sides[t][k], face);
        }
    }
}

/// Does the boundary run straight on at one of its vertices?
bool Triangulation::straightAt(Vertex v) const {
    constexpr double kStraight = 0.9;              // cosine of the turn
    const Halfedge out = mesh.halfedge_handle(v);  // on the boundary, for a vertex that is
    const Vec3 &p = at(v), &before = at(mesh.from_vertex_handle(mesh.prev_halfedge_handle(out))),
               &after = at(mesh.to_vertex_handle(out));
    return dot(normalized(p - before), normalized(after - p)) > kStraight;
}

/// The link condition: the two ends share no neighbours but those across from the edge. As the library's
/// is_collapse_ok, which spends most of its time on looking up its own tags.
bool Triangulation::keepsTopology(Halfedge h) const {
    const Halfedge back = mesh.opposite_halfedge_handle(h);
    const Vertex from = mesh.from_vertex_handle(h), to = mesh.to_vertex_handle(h);
    Vertex across[2];
    for (int side = 0; side < 2; ++side) {
        const Halfedge along = side ? back : h;
        if (mesh.is_boundary(along)) continue;
        const Halfedge next = mesh.next_halfedge_handle(along), last = mesh.next_halfedge_handle(next);
        if (mesh.is_boundary(mesh.opposite_halfedge_handle(next)) &&
            mesh.is_boundary(mesh.opposite_halfedge_handle(last)))
            return false;
        across[side] = mesh.to_vertex_handle(next);
    }
    if (across[0] == across[1]) return false;
    if (mesh.is_boundary(from) && mesh.is_boundary(to) && !mesh.is_boundary(h) && !mesh.is_boundary(back)) return false;
    for (auto a = mesh.cvv_ccwbegin(from); a.is_valid(); ++a) {
        if (*a == to || *a == across[0] || *a == across[1]) continue;
        for (auto b = mesh.cvv_ccwbegin(to); b.is_valid(); ++b)
            if (*a == *b) return false;
    }
    return true;
}

/// Has a vertex more than three neighbours?
bool Triangulation::branches(Vertex v) const {
    int count = 0;
    for (auto h = mesh.cvoh_ccwbegin(v); h.is_valid() && count <= 3; ++h) ++count;
    return count > 3;
}

bool Triangulation::collapse(Halfedge h, double longest, double turn) {
    const Vertex from = mesh.from_vertex_handle(h), to = mesh.to_vertex_handle(h);
    const Halfedge back = mesh.opposite_halfedge_handle(h);
    const bool onBoundary = mesh.is_boundary(h) || mesh.is_boundary(back);
    if (mesh.is_boundary(from) && (!onBoundary || !straightAt(from))) return false;
    // No fin: the two vertices opposite keep three neighbours.
    for (const Halfedge side : {h, back})
        if (!mesh.is_boundary(side) && !branches(mesh.to_vertex_handle(mesh.next_halfedge_handle(side)))) return false;
    const Vec3 &p = at(from), &q = at(to);
    for (auto it = mesh.cvoh_ccwbegin(from); it.is_valid(); ++it) {
        const Vertex a = mesh.to_vertex_handle(*it);
        if (a == to) continue;
        const Vec3& pa = at(a);
        if (dot(pa - q, pa - q) > longest * longest) return false;
        if (mesh.is_boundary(*it)) continue;
        const Vertex b = mesh.to_vertex_handle(mesh.next_halfedge_handle(*it));
        if (b == to) continue;
        const Vec3 &pb = at(b), before = cross(pa - p, pb - p), after = cross(pa - q, pb - q);
        const double s = dot(before, after);
        if (s <= 0 || s * s < turn * turn * dot(before, before) * dot(after, after)) return false;
    }
    if (!keepsTopology(h)) return false;
    mesh.collapse(h);
    --vertices;
    return true;
}

bool Triangulation::flip(OpenMesh::EdgeHandle e) {
    if (mesh.is_boundary(e)) return false;
    const Halfedge h = mesh.halfedge_handle(e, 0);
    if (!branches(mesh.from_vertex_handle(h)) || !branches(mesh.to_vertex_handle(h))) return false;
    if (!mesh.is_flip_ok(e)) return false;
    mesh.flip(e);
    return true;
}

TriangleMesh Triangulation::compact(std::vector<int>& kept) const {
    TriangleMesh out;
    std::vector<int> number(place.size(), -1);
    kept.clear();
    for (size_t v = 0; v < place.size(); ++v) {
        const Vertex handle{int(v)};
        if (mesh.status(handle).deleted() || mesh.is_isolated(handle)) continue;
        number[v] = int(out.points.size());
        out.points.push_back(place[v]);
        kept.push_back(int(v));
    }
    for (size_t f = 0; f < mesh.n_faces(); ++f) {
        const OpenMesh::FaceHandle face{int(f)};
        if (mesh.status(face).deleted()) continue;
        Halfedge h = mesh.halfedge_handle(face);
        Triangle t;
        for (int k = 0; k < 3; ++k, h = mesh.next_halfedge_handle(h))
            t[size_t(k)] = number[size_t(mesh.to_vertex_handle(h).idx())];
        out.triangles.push_back(t);
    }
    return out;
}

}  // namespace pavel
