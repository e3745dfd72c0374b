// The last move of a remeshing's vertices: its triangles lie in the middle of the surface, not under its bulges.
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>

#include "pavel/seeding/remesher.h"

namespace pavel {
namespace {

Eigen::Vector3d eigen(const Vec3& v) {
    return {v[0], v[1], v[2]};
}

}  // namespace

/// The triangles that are fitted, and what the surface under each asks for.
class PlaceFit {
  public:
    explicit PlaceFit(Remesher& remesher)
        : r_(remesher),
          owner_(remesher.owner_),
          middle_(remesher.middle_),
          vertices_(remesher.on_.size()),
          faces_(connections().n_faces()) {}

    void run() {
        readFaces();
        askFaces(samples());
        findAnswers();
        for (int i = 0; i < kIterations; ++i) iterate();
        apply();
    }

  private:
    static constexpr int kIterations = 8;
    static constexpr double kFarthest = 0.3;  // spacings
    static constexpr double kStiff = 0.3;     // share of the quadrics, against moves in which they do not differ
    static constexpr double kFacing = 0.6;    // cosine between a triangle and those of the surface that are under it
    static constexpr double kSliver = 0.86;   // cosine of the least angle that may come of it

    struct Face {
        std::array<int, 3> corner{-1, -1, -1};
        Vec3 across{0, 0, 0}, normal{0, 0, 0};  // twice the area long, and 1
        std::array<Vec3, 2> rise{};             // gradients of the first corners' weights
        // Normal equations for the heights of its corners, and what the moves so far have left.
        std::array<std::array<double, 3>, 3> a{};
        std::array<double, 3> b{}, left{};

        size_t cornerAt(size_t v) const { return corner[0] == int(v) ? 0 : corner[1] == int(v) ? 1 : 2; }
    };
    struct Vertex {
        Eigen::Matrix3d answer = Eigen::Matrix3d::Zero();  // from what its triangles ask for to its move
        Vec3 move{0, 0, 0};
    };
    /// A triangle of the surface over one of ours.
    struct Sample {
        int face = -1;
        std::array<float, 3> weight{};
        float distance = 0;
    };

    const Connectivity& connections() const { return r_.tri_.mesh; }
    bool held(size_t v) const {
        return r_.kind_[v] == Kind::boundary || connections().status(Remesher::Vertex(int(v))).deleted();
    }

    void readFaces() {
        const auto& m = connections();
        tbb::parallel_for(size_t(0), faces_.size(), [&](size_t i) {
            const OpenMesh::FaceHandle face{int(i)};
            if (m.status(face).deleted()) return;
            Face& f = faces_[i];
            size_t k = 0;
            for (auto v = m.cfv_ccwbegin(face); v.is_valid(); ++v) f.corner[k++] = v->idx();
            f.across = cross(at(f, 1) - at(f, 0), at(f, 2) - at(f, 0));
            f.normal = normalized(f.across);
            const double twice2 = dot(f.across, f.across);
            for (size_t c = 0; c < 2; ++c)
                f.rise[c] = twice2 > 0 ? cross(f.across, at(f, (c + 2) % 3) - at(f, c + 1)) / twice2 : Vec3(0, 0, 0);
        });
    }

    /// Weights of a triangle's corners for the point of it nearest to p, nearly: outside, they are cut off at 0.
    std::array<double, 3> weightsOf(const Face& f, const Vec3& p) const {
        const Vec3 to = p - at(f, 2);
        const double first = dot(to, f.rise[0]), second = dot(to, f.rise[1]);
        std::array<double, 3> w{first, second, 1 - first - second};
        double sum = 0;
        for (double& x : w) sum += x = std::max(0.0, x);
        for (double& x : w) x /= sum;
        return w;
    }

    const Vec3& at(const Face& f, size_t k) const { return r_.tri_.place[size_t(f.corner[k])]; }

    std::vector<Sample> samples() const {
        std::vector<Sample> samples(owner_.size());
        tbb::parallel_for(size_t(0), owner_.size(), [&](size_t t) {
            if (owner_[t] < 0) return;
            const Vec3 from = r_.surface_.faceNormal(int(t));
            double least = 1e300;
            for (auto i = connections().cvf_ccwbegin(Remesher::Vertex(owner_[t])); i.is_valid(); ++i) {
                const Face& f = faces_[size_t(i->idx())];
                if (dot(f.normal, from) <= kFacing) continue;
                const auto w = weightsOf(f, middle_[t]);
                const Vec3 off = middle_[t] - (w[0] * at(f, 0) + w[1] * at(f, 1) + w[2] * at(f, 2));
                if (const double d = dot(off, off); d < least) {
                    least = d;
                    samples[t] = Sample{i->idx(), {float(w[0]), float(w[1]), float(w[2])}, float(dot(off, f.normal))};
                }
                if (w[0] > 0 && w[1] > 0 && w[2] > 0) break;  // right over it
            }
        });
        return samples;
    }

    void askFaces(const std::vector<Sample>& samples) {
        for (size_t t = 0; t < samples.size(); ++t) {
            const Sample& s = samples[t];
            if (s.face < 0 || std::abs(s.distance) > r_.spacing_) continue;
            const double area = r_.surface_.faceArea(int(t));
            Face& f = faces_[size_t(s.face)];
            for (size_t i = 0; i < 3; ++i) {
                f.b[i] += area * double(s.weight[i]) * double(s.distance);
                for (size_t j = 0; j < 3; ++j) f.a[i][j] += area * double(s.weight[i]) * double(s.weight[j]);
            }
        }
    }

    void findAnswers() {
        tbb::parallel_for(size_t(0), vertices_.size(), [&](size_t v) {
            if (held(v)) return;
            Eigen::Matrix3d a = Eigen::Matrix3d::Zero(), &answer = vertices_[v].answer;
            Eigen::Vector3d up = Eigen::Vector3d::Zero();
            for (auto i = connections().cvf_ccwbegin(Remesher::Vertex(int(v))); i.is_valid(); ++i) {
                const Face& f = faces_[size_t(i->idx())];
                const auto& row = f.a[f.cornerAt(v)];
                a += (row[0] + row[1] + row[2]) * eigen(f.normal) * eigen(f.normal).transpose();
                up += eigen(f.across);
            }
            const double trace = a.trace();
            if (!(trace > 0)) return;  // no triangle of the surface asks for anything
            if (r_.kind_[v] != Kind::smooth) {
                a.diagonal().array() += kStiff * trace;
                answer = a.inverse();
            } else if (const double along = up.dot(a * up); along > 0) {
                answer = up * up.transpose() / along;
            }
        });
    }

    void iterate() {
        tbb::parallel_for(size_t(0), faces_.size(), [&](size_t i) {
            Face& f = faces_[i];
            f.left = f.b;
            for (size_t k = 0; k < 3 && f.corner[k] >= 0; ++k) {
                const double height = dot(vertices_[size_t(f.corner[k])].move, f.normal);
                for (size_t j = 0; j < 3; ++j) f.left[j] -= f.a[j][k] * height;
            }
        });
        const double farthest = kFarthest * r_.spacing_;
        tbb::parallel_for(size_t(0), vertices_.size(), [&](size_t v) {
            if (held(v)) return;
            Vec3 asked(0, 0, 0), &move = vertices_[v].move;
            for (auto i = connections().cvf_ccwbegin(Remesher::Vertex(int(v))); i.is_valid(); ++i) {
                const Face& f = faces_[size_t(i->idx())];
                asked += f.left[f.cornerAt(v)] * f.normal;
            }
            const Eigen::Vector3d step = vertices_[v].answer * eigen(asked);
            move += Vec3(step[0], step[1], step[2]);
            if (const double l = length(move); l > farthest) move *= farthest / l;
        });
    }

    void apply() {
        for (size_t v = 0; v < vertices_.size(); ++v) {
            if (held(v)) continue;
            Vec3& place = r_.tri_.place[v];
            const Vec3 after = place + vertices_[v].move;
            const Remesher::Vertex vertex{int(v)};
            if (const double now = r_.sharpestAround(vertex, after);
                now < kSliver || now <= r_.sharpestAround(vertex, place))
                place = after;
        }
    }

    Remesher& r_;
    const std::vector<int>& owner_;
    const std::vector<Vec3>& middle_;
    std::vector<Vertex> vertices_;
    std::vector<Face> faces_;
};

/// Moves vertices to where the squared distance between the triangles and the surface is least (H. Hoppe et al., Mesh
/// optimization, 1993, with places and connectivity fixed): along their normals, or on creases any way. O(triangles).
void Remesher::fitPlaces() {
    assignTriangles();
    PlaceFit(*this).run();
}

}  // namespace pavel
