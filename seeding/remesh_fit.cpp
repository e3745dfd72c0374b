// The last move of a remeshing's vertices: its triangles lie in the middle of the surface, not under its bulges.
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>

#include "pavel/seeding/remesher.h"

namespace pavel {
namespace {

/// Weights of a triangle's corners for the point of it nearest to p, nearly: outside, they are cut off at 0.
std::array<double, 3> weightsOf(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = cross(b - a, c - a);
    const double twice2 = dot(n, n);
    std::array<double, 3> w{dot(cross(c - b, p - b), n), dot(cross(a - c, p - c), n), dot(cross(b - a, p - a), n)};
    double sum = 0;
    for (double& x : w) sum += x = std::max(0.0, twice2 > 0 ? x / twice2 : 1.0);
    for (double& x : w) x /= sum;
    return w;
}

/// What the surface's triangles ask of a triangle over them: normal equations for the heights of its corners.
struct Fit {
    std::array<std::array<double, 3>, 3> a{};
    std::array<double, 3> b{};
};

}  // namespace

/// Moves vertices to where the squared distance between the triangles and the surface is least (H. Hoppe et al., Mesh
/// optimization, 1993, with places and connectivity fixed): along their normals, or on creases any way. O(triangles).
void Remesher::fitPlaces() {
    constexpr int kIterations = 8;
    constexpr double kFarthest = 0.3;  // spacings
    constexpr double kStiff = 0.3;     // share of the quadrics, against moves in which they do not differ
    constexpr double kFacing = 0.6;    // cosine between a triangle and those of the surface that are under it
    constexpr double kSliver = 0.86;   // cosine of the least angle that may come of it
    const Connectivity& m = tri_.mesh;
    const TriangleMesh& mesh = surface_.mesh();
    const auto cornersOf = [&](Halfedge h) {
        return std::array<Vertex, 3>{m.from_vertex_handle(h), m.to_vertex_handle(h),
                                     m.to_vertex_handle(m.next_halfedge_handle(h))};
    };
    struct Face {
        std::array<Vertex, 3> corner;
        Vec3 across, normal{0, 0, 0};  // the normal's length twice the area, and 1
    };
    std::vector<Face> faces(m.n_faces());
    tbb::parallel_for(size_t(0), faces.size(), [&](size_t i) {
        const OpenMesh::FaceHandle face{int(i)};
        if (m.status(face).deleted()) return;
        Face& f = faces[i];
        f.corner = cornersOf(m.halfedge_handle(face));
        f.across = normal(f.corner[0], f.corner[1], f.corner[2]);
        f.normal = normalized(f.across);
    });
    assignTriangles();
    struct Sample {
        int face = -1;
        std::array<float, 3> weight;
        float distance = 0;
    };
    std::vector<Sample> samples(owner_.size());
    tbb::parallel_for(size_t(0), owner_.size(), [&](size_t t) {
        if (owner_[t] < 0) return;
        const Vec3 from = surface_.faceNormal(int(t));
        double least = 1e300;
        for (auto f = m.cvf_ccwbegin(Vertex(owner_[t])); f.is_valid(); ++f) {
            const auto& c = faces[size_t(f->idx())].corner;
            const Vec3& n = faces[size_t(f->idx())].normal;
            if (dot(n, from) <= kFacing) continue;
            const auto w = weightsOf(middle_[t], tri_.at(c[0]), tri_.at(c[1]), tri_.at(c[2]));
            const Vec3 off = middle_[t] - (w[0] * tri_.at(c[0]) + w[1] * tri_.at(c[1]) + w[2] * tri_.at(c[2]));
            if (const double d = dot(off, off); d < least) {
                least = d;
                samples[t] = {f->idx(), {float(w[0]), float(w[1]), float(w[2])}, float(dot(off, n))};
            }
            if (w[0] > 0 && w[1] > 0 && w[2] > 0) break;  // right over it
        }
    });
    std::vector<Fit> fits(m.n_faces());
    for (size_t t = 0; t < samples.size(); ++t) {
        const Sample& s = samples[t];
        if (s.face < 0 || std::abs(s.distance) > spacing_) continue;
        const double area = triangleArea(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
        Fit& fit = fits[size_t(s.face)];
        for (size_t i = 0; i < 3; ++i) {
            fit.b[i] += area * double(s.weight[i]) * double(s.distance);
            for (size_t j = 0; j < 3; ++j) fit.a[i][j] += area * double(s.weight[i]) * double(s.weight[j]);
        }
    }
    const auto held = [&](size_t v) { return kind_[v] == Kind::boundary || m.status(Vertex(int(v))).deleted(); };
    const auto eigen = [](const Vec3& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
    const auto ownOf = [](const Face& f, size_t v) -> size_t {
        return f.corner[0].idx() == int(v) ? 0 : f.corner[1].idx() == int(v) ? 1 : 2;
    };
    // What a vertex makes of what its triangles ask for.
    std::vector<Eigen::Matrix3d> answer(on_.size(), Eigen::Matrix3d::Zero());
    tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
        if (held(v)) return;
        Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
        Eigen::Vector3d up = Eigen::Vector3d::Zero();
        for (auto i = m.cvf_ccwbegin(Vertex(int(v))); i.is_valid(); ++i) {
            const Face& f = faces[size_t(i->idx())];
            const auto& row = fits[size_t(i->idx())].a[ownOf(f, v)];
            a += (row[0] + row[1] + row[2]) * eigen(f.normal) * eigen(f.normal).transpose();
            up += eigen(f.across);
        }
        const double trace = a.trace();
        if (!(trace > 0)) return;  // no triangle of the surface asks for anything
        if (kind_[v] != Kind::smooth) {
            a.diagonal().array() += kStiff * trace;
            answer[v] = a.inverse();
        } else if (const double along = up.dot(a * up); along > 0) {
            answer[v] = up * up.transpose() / along;
        }
    });
    std::vector<Vec3> move(on_.size(), Vec3(0, 0, 0));
    std::vector<std::array<double, 3>> missing(faces.size());
    for (int it = 0; it < kIterations; ++it) {
        tbb::parallel_for(size_t(0), faces.size(), [&](size_t i) {
            const Face& f = faces[i];
            missing[i] = fits[i].b;
            for (size_t k = 0; k < 3 && f.corner[k].is_valid(); ++k) {
                const double height = dot(move[size_t(f.corner[k].idx())], f.normal);
                for (size_t j = 0; j < 3; ++j) missing[i][j] -= fits[i].a[j][k] * height;
            }
        });
        tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
            if (held(v)) return;
            Vec3 asked(0, 0, 0);
            for (auto i = m.cvf_ccwbegin(Vertex(int(v))); i.is_valid(); ++i) {
                const Face& f = faces[size_t(i->idx())];
                asked += missing[size_t(i->idx())][ownOf(f, v)] * f.normal;
            }
            const Eigen::Vector3d step = answer[v] * eigen(asked);
            move[v] += Vec3(step[0], step[1], step[2]);
            if (const double l = length(move[v]); l > kFarthest * spacing_) move[v] *= kFarthest * spacing_ / l;
        });
    }
    for (size_t v = 0; v < on_.size(); ++v) {
        if (held(v)) continue;
        const Vec3 before = tri_.place[v], after = before + move[v];
        if (const double now = sharpestAround(Vertex(int(v)), after);
            now < kSliver || now <= sharpestAround(Vertex(int(v)), before))
            tri_.place[v] = after;
    }
}

}  // namespace pavel
