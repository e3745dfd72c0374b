// Where the creases are, from the triangles of the surface around each vertex.
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "pavel/seeding/remesher.h"

namespace pavel {
namespace {

/// Normals around a vertex that differ by more than this share of their sum in a second direction make it a crease, in
/// a third a corner.
constexpr double kCrease = 0.05;
/// The same with the neighbours' triangles, for a corner.
constexpr double kCorner = 0.1;
/// The same at the bottom of a slit, whose walls face each other.
constexpr double kSlit = 1e-3;
/// Mean normals shorter than this are of a surface that folds, as at the bottom of a slit.
constexpr double kFolded = 0.45;
/// Cosine of an angle that no triangle gets by the last move alone.
constexpr double kSliver = 0.98;
/// Vertices are moved onto a crease from no farther than this, in spacings.
constexpr double kSnap = 0.7;

}  // namespace

void Planes::add(double area_, const Vec3& n, const Vec3& to) {
    const Eigen::Vector3d e(n[0], n[1], n[2]);
    a += area_ * e * e.transpose();
    b += area_ * dot(n, to) * e;
    normal += area_ * n;
    area += area_;
}

void Planes::add(const Planes& o, const Vec3& from) {
    a += o.a;
    b += o.b + o.a * Eigen::Vector3d(from[0], from[1], from[2]);
    normal += o.normal;
    area += o.area;
}

bool Planes::folded() const {
    return length(normal) < kFolded * area;
}

int Planes::solve(double share, int most, double reach, Vec3& move, Vec3& along) const {
    move = Vec3(0, 0, 0);
    if (!(area > 0)) return 0;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
    const Eigen::Vector3d values = solver.eigenvalues();  // ascending
    const auto axis = [&](int k) {
        return Vec3(solver.eigenvectors()(0, k), solver.eigenvectors()(1, k), solver.eigenvectors()(2, k));
    };
    along = axis(0);
    for (int k = 2, rank = 0;; --k, ++rank) {
        if (k < 0 || rank == most) return rank;
        const double least = k == 1 && folded() ? std::min(share, kSlit) : share;
        if (k < 2 && values[k] <= std::max(least, 1e-9) * values[2]) return rank;
        const Vec3 next = move + b.dot(solver.eigenvectors().col(k)) / values[k] * axis(k);
        if (length(next) > reach) return rank;
        move = next;
    }
}

/// Every triangle of the surface to a vertex that is nearer than its neighbours', spreading from the vertices' own
/// triangles: in each round, a triangle looks at what its neighbours had in the last.
void Remesher::assignTriangles() {
    const auto& neighbours = surface_.neighbours();
    const auto distance2 = [&](size_t t, int v) {
        const Vec3 d = middle_[t] - on_[size_t(v)].position;
        return dot(d, d);
    };
    const size_t n = neighbours.size();
    // Vertices move little between two calls: most owners stay.
    const bool known = owner_.size() == n;
    if (!known) owner_.assign(n, -1);
    for (int& v : owner_)
        if (v >= 0 && tri_.mesh.status(Vertex(v)).deleted()) v = -1;
    std::vector<char> changed(n, 0);
    std::vector<int> front;  // triangles whose owner changed
    const auto enter = [&](size_t t) {
        if (!changed[t]) front.push_back(int(t));
        changed[t] = 1;
    };
    for (size_t v = 0; v < on_.size(); ++v) {
        const size_t t = size_t(on_[v].triangle);
        int& owner = owner_[t];
        if (owner == int(v) || tri_.mesh.status(Vertex(int(v))).deleted()) continue;
        if (owner >= 0 && distance2(t, int(v)) >= distance2(t, owner)) continue;
        owner = int(v);
        enter(t);
    }
    /// The nearest of the owners of its neighbours that are `asked`, and of its own.
    const auto nearest = [&](size_t t, const auto& asked) {
        int best = owner_[t];
        double least = best < 0 ? 1e300 : -1;
        for (int m : neighbours[t]) {
            if (m < 0 || owner_[size_t(m)] < 0 || owner_[size_t(m)] == best || !asked(size_t(m))) continue;
            if (least < 0) least = distance2(t, best);
            const double d = distance2(t, owner_[size_t(m)]);
            if (d < least) best = owner_[size_t(m)], least = d;
        }
        return best;
    };
    std::vector<int> beside, next;
    std::vector<char> listed(n, 0);
    if (known) {  // all may have moved
        next.resize(n);
        tbb::parallel_for(size_t(0), n, [&](size_t t) { next[t] = nearest(t, [](size_t) { return true; }); });
        for (int t : front) changed[size_t(t)] = 0;
        front.clear();
        for (size_t t = 0; t < n; ++t)
            if (owner_[t] != next[t]) owner_[t] = next[t], enter(t);
    }
    while (!front.empty()) {
        beside.clear();
        for (int t : front)
            for (int m : neighbours[size_t(t)])
                if (m >= 0 && !listed[size_t(m)]) listed[size_t(m)] = 1, beside.push_back(m);
        next.resize(beside.size());
        tbb::parallel_for(size_t(0), beside.size(), [&](size_t k) {
            next[k] = nearest(size_t(beside[k]), [&](size_t m) { return changed[m]; });
        });
        for (int t : front) changed[size_t(t)] = 0;
        front.clear();
        for (size_t k = 0; k < beside.size(); ++k) {
            const size_t t = size_t(beside[k]);
            listed[t] = 0;
            if (owner_[t] == next[k]) continue;
            owner_[t] = next[k];
            enter(t);
        }
    }
}

std::vector<Planes> Remesher::planesAround() const {
    const TriangleMesh& mesh = surface_.mesh();
    std::vector<Planes> planes(on_.size());
    for (size_t t = 0; t < owner_.size(); ++t) {
        if (owner_[t] < 0) continue;
        const size_t v = size_t(owner_[t]);
        planes[v].add(surface_.faceArea(int(t)), surface_.faceNormal(int(t)), mesh.corner(t, 0) - on_[v].position);
    }
    return planes;
}

/// A corner lies on the creases of several vertices; it goes to the nearest.
void Remesher::findCorners(const std::vector<Planes>& planes) {
    std::vector<Vec3> corner(on_.size(), Vec3(1e300, 0, 0));
    tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
        if (kind_[v] != Kind::crease || tri_.mesh.status(Vertex(int(v))).deleted()) return;
        Planes sum = planes[v];
        for (auto it = tri_.mesh.cvv_ccwbegin(Vertex(int(v))); it.is_valid(); ++it)
            sum.add(planes[size_t(it->idx())], on_[size_t(it->idx())].position - on_[v].position);
        Vec3 move, along;
        if (!sum.folded() && sum.solve(kCorner, 3, spacing_, move, along) == 3) corner[v] = on_[v].position + move;
    });
    for (size_t v = 0; v < on_.size(); ++v) {
        if (corner[v][0] > 1e299) continue;
        bool nearest = true;
        for (auto it = tri_.mesh.cvv_ccwbegin(Vertex(int(v))); it.is_valid(); ++it)
            nearest &= length(tri_.at(*it) - corner[v]) > length(tri_.place[v] - corner[v]);
        if (nearest) kind_[v] = Kind::corner, optimum_[v] = corner[v];
    }
}

/// The planes of the triangles around each vertex tell by their rank what it stands on, and where it should.
/// @param classify find out anew; else only the place
void Remesher::findCreases(bool classify) {
    assignTriangles();
    const std::vector<Planes> planes = planesAround();
    tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
        if (kind_[v] == Kind::boundary) return;
        const int most = classify ? 3 : kind_[v] == Kind::smooth ? 1 : kind_[v] == Kind::crease ? 2 : 3;
        Vec3 move;
        const int rank = planes[v].solve(classify ? kCrease : 0, most, kSnap * spacing_, move, along_[v]);
        kind_[v] = rank <= 1 ? Kind::smooth : rank == 2 ? Kind::crease : Kind::corner;
        optimum_[v] = on_[v].position + move;
    });
    if (!classify) return;
    findCorners(planes);
    if (grade_.empty()) findGrades(planes);
}

/// How long edges are to be: shorter where the surface bends, since its distance to triangles goes with their area and
/// its curvature; changing slowly from edge to edge, so that angles stay good. Found once and tied to the surface:
/// vertices that carried it along would drag it with them.
void Remesher::findGrades(const std::vector<Planes>& planes) {
    constexpr double kFlat = 0.3, kBent = 2;  // least and largest bend that counts, in means
    constexpr int kSmoothing = 6;             // rounds
    std::vector<double> bend(on_.size(), 0);
    double bends = 0, area = 0, wanted = 0;
    for (size_t v = 0; v < on_.size(); ++v) {
        const Planes& p = planes[v];
        if (!(p.area > 0)) continue;
        bend[v] = std::sqrt(std::max(0.0, 1 - length(p.normal) / p.area) / p.area);
        bends += bend[v] * p.area;
        area += p.area;
    }
    std::vector<double> grade(on_.size(), 1), next;
    for (size_t v = 0; v < on_.size() && bends > 0; ++v)
        grade[v] = 1 / std::sqrt(kFlat + std::min(kBent, bend[v] * area / bends));
    for (int round = 0; round < kSmoothing; ++round) {
        next = grade;
        tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
            if (tri_.mesh.status(Vertex(int(v))).deleted()) return;
            double sum = 2 * grade[v], weight = 2;
            for (auto it = tri_.mesh.cvv_ccwbegin(Vertex(int(v))); it.is_valid(); ++it)
                sum += grade[size_t(it->idx())], ++weight;
            next[v] = sum / weight;
        });
        grade.swap(next);
    }
    for (size_t v = 0; v < on_.size(); ++v) wanted += planes[v].area / (grade[v] * grade[v]);
    const double scale = std::sqrt(wanted / area);  // as many vertices as without
    grade_.assign(owner_.size(), 1);
    for (size_t t = 0; t < owner_.size(); ++t)
        if (owner_[t] >= 0) grade_[t] = scale * grade[size_t(owner_[t])];
}

/// Off the surface to where the quadrics have their least: straight up or down where it is smooth.
void Remesher::placeVertices() {
    findCreases(false);
    for (size_t v = 0; v < on_.size(); ++v) {
        if (kind_[v] == Kind::boundary || tri_.mesh.status(Vertex(int(v))).deleted()) continue;
        const Vec3 move = optimum_[v] - on_[v].position, before = tri_.place[v];
        const double sharpest = sharpestAround(Vertex(int(v)), before);
        tri_.place[v] =
            kind_[v] == Kind::smooth ? on_[v].position + dot(move, on_[v].normal) * on_[v].normal : optimum_[v];
        // Two that ask for the same place would make triangles without area.
        if (const double now = sharpestAround(Vertex(int(v)), tri_.place[v]); now > kSliver && now > sharpest)
            tri_.place[v] = before;
    }
    // In slits and pockets no larger than a triangle, vertices may have met: back to the surface, or apart.
    const Connectivity& m = tri_.mesh;
    for (bool onSurface : {true, false})
        for (size_t f = 0; f < m.n_faces(); ++f) {
            const OpenMesh::FaceHandle face{int(f)};
            if (m.status(face).deleted()) continue;
            const Halfedge h = m.halfedge_handle(face);
            const Vertex corners[3] = {m.from_vertex_handle(h), m.to_vertex_handle(h),
                                       m.to_vertex_handle(m.next_halfedge_handle(h))};
            for (Vertex v : corners) {
                if (length(normal(corners[0], corners[1], corners[2])) > 1e-4 * spacing_ * spacing_) break;
                if (kind_[size_t(v.idx())] == Kind::boundary) continue;
                tri_.place[size_t(v.idx())] =
                    onSurface ? on_[size_t(v.idx())].position : tri_.at(v) + 0.5 * centroidStep(v);
            }
        }
}

}  // namespace pavel
