// The last move of a remeshing's vertices: its triangles lie in the middle of the surface, not under its bulges.
#include <tbb/parallel_for.h>

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

/// Moves vertices along their normals to where the squared distance between the triangles and the surface is least (H.
/// Hoppe et al., Mesh optimization, 1993, with places and connectivity fixed). O(triangles).
void Remesher::fitPlaces() {
    constexpr int kIterations = 20;
    constexpr double kFarthest = 0.1;  // spacings
    constexpr double kSliver = 0.86;   // cosine of the least angle that may come of it
    const Connectivity& m = tri_.mesh;
    const TriangleMesh& mesh = surface_.mesh();
    const auto cornersOf = [&](Halfedge h) {
        return std::array<Vertex, 3>{m.from_vertex_handle(h), m.to_vertex_handle(h),
                                     m.to_vertex_handle(m.next_halfedge_handle(h))};
    };
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
            const auto c = cornersOf(m.halfedge_handle(*f));
            const Vec3 n = normalized(normal(c[0], c[1], c[2]));
            if (dot(n, from) <= 0) continue;
            const auto w = weightsOf(middle_[t], tri_.at(c[0]), tri_.at(c[1]), tri_.at(c[2]));
            const Vec3 off = middle_[t] - (w[0] * tri_.at(c[0]) + w[1] * tri_.at(c[1]) + w[2] * tri_.at(c[2]));
            if (const double d = dot(off, off); d < least) {
                least = d;
                samples[t] = {f->idx(), {float(w[0]), float(w[1]), float(w[2])}, float(dot(off, n))};
            }
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
    std::vector<Vec3> up(on_.size(), Vec3(0, 0, 0));
    for (size_t v = 0; v < on_.size(); ++v) {
        if (m.status(Vertex(int(v))).deleted() || kind_[v] > Kind::crease) continue;
        for (auto f = m.cvf_ccwbegin(Vertex(int(v))); f.is_valid(); ++f) {
            const auto c = cornersOf(m.halfedge_handle(*f));
            up[v] += normal(c[0], c[1], c[2]);
        }
        if (dot(up[v], up[v]) > 0) up[v] = normalized(up[v]);
    }
    std::vector<double> height(on_.size(), 0), next(on_.size(), 0);
    for (int it = 0; it < kIterations; ++it) {
        tbb::parallel_for(size_t(0), on_.size(), [&](size_t v) {
            if (!(dot(up[v], up[v]) > 0)) return;
            double asked = 0, weight = 0;
            for (auto f = m.cvf_ccwbegin(Vertex(int(v))); f.is_valid(); ++f) {
                const auto c = cornersOf(m.halfedge_handle(*f));
                const Vec3 n = normalized(normal(c[0], c[1], c[2]));
                const Fit& fit = fits[size_t(f->idx())];
                const size_t own = c[0].idx() == int(v) ? 0 : c[1].idx() == int(v) ? 1 : 2;
                const double slope = dot(up[v], n);
                double missing = fit.b[own], sum = 0;
                for (size_t k = 0; k < 3; ++k) {
                    const double s = dot(up[size_t(c[k].idx())], n);
                    missing -= fit.a[own][k] * s * height[size_t(c[k].idx())];
                    sum += fit.a[own][k] * std::abs(s);
                }
                asked += slope * missing;
                weight += std::abs(slope) * sum;
            }
            next[v] = weight > 0 ? height[v] + asked / weight : 0;
            next[v] = std::clamp(next[v], -kFarthest * spacing_, kFarthest * spacing_);
        });
        height.swap(next);
    }
    for (size_t v = 0; v < on_.size(); ++v) {
        const Vec3 before = tri_.place[v], after = before + height[v] * up[v];
        if (height[v] == 0) continue;
        if (const double now = sharpestAround(Vertex(int(v)), after);
            now < kSliver || now <= sharpestAround(Vertex(int(v)), before))
            tri_.place[v] = after;
    }
}

}  // namespace pavel
