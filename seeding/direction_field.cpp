#include "pavel/seeding/direction_field.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <complex>
#include <limits>

#include "pavel/core/error.h"
#include "pavel/seeding/curvature.h"

namespace pavel {
namespace {

using Complex = std::complex<double>;
using Matrix = Eigen::SparseMatrix<Complex>;
using Vector = Eigen::VectorXcd;

/// Energy of a field's turning, sum over sides of w |u_j - r_ij u_i|^2.
Matrix connectionLaplacian(const TangentFrames& f, int symmetry) {
    std::vector<Eigen::Triplet<Complex>> entries;
    for (size_t t = 0; t < f.mesh().triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const int i = f.vertex(t, k), j = f.vertex(t, (k + 1) % 3);
            const double w = f.weight(t, k);
            const Complex r = std::polar(1.0, symmetry * f.transport(t, k));
            entries.emplace_back(i, i, w);
            entries.emplace_back(j, j, w);
            entries.emplace_back(j, i, -w * r);
            entries.emplace_back(i, j, -w * std::conj(r));
        }
    Matrix a(Eigen::Index(f.mesh().points.size()), Eigen::Index(f.mesh().points.size()));
    a.setFromTriplets(entries.begin(), entries.end());
    return a;
}

/// Wanted directions at vertices, as powers of the field's symmetry, and how much each is wanted.
struct Wish {
    Vector direction;
    Eigen::VectorXd weight;
    explicit Wish(size_t n)
        : direction(Vector::Zero(Eigen::Index(n))), weight(Eigen::VectorXd::Zero(Eigen::Index(n))) {}
    void set(int v, const TangentFrames& f, const Vec3& d, int symmetry, double w) {
        direction(v) += w * std::polar(1.0, symmetry * f.angle(v, d));
        weight(v) += w;
    }
};

/// A matrix with something added to its diagonal, factored.
class Factored {
  public:
    Factored(Matrix a, const Eigen::VectorXd& diagonal) {
        for (Eigen::Index i = 0; i < a.rows(); ++i) a.coeffRef(i, i) += diagonal(i);
        solver_.compute(a);
        if (solver_.info() != Eigen::Success) throw RunError("the direction field's equations could not be solved");
    }
    Vector solve(const Vector& b) const { return solver_.solve(b); }

  private:
    // The vertices are numbered in a good order already.
    Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> solver_;
};

Vector smoothest(const Matrix& a, const Eigen::VectorXd& mass) {
    const double shift = 1e-4 / mass.sum();  // keeps the matrix regular where a perfectly smooth field exists
    const Factored solver(a, shift * mass);
    Vector u(a.rows());
    for (Eigen::Index i = 0; i < u.size(); ++i) u(i) = std::polar(1.0, 2.399963 * double(i));  // the same on every run
    constexpr int kSteps = 20;
    for (int step = 0; step < kSteps; ++step) {
        u = solver.solve(mass.asDiagonal() * u);
        u /= std::sqrt(std::abs(u.dot(mass.asDiagonal() * u)));
    }
    return u;
}

/// The smoothest field with given values where the weight is 1.
Vector filled(const Matrix& a, const Wish& wish) {
    // A penalty large against the matrix keeps one factorisation simple; directions are unit afterwards anyhow.
    const double penalty = 1e6 * a.diagonal().real().mean();
    const Eigen::VectorXd w = penalty * wish.weight;
    if (!(wish.weight.sum() > 0)) throw InputError("seeding.field: its axis has no direction along the surface");
    return Factored(a, w).solve(w.asDiagonal() * wish.direction);
}

Wish alongAxis(const TangentFrames& f, const FieldOptions& o, int symmetry) {
    Bounds bounds;
    for (const Vec3& p : f.mesh().points) bounds.add(p);
    const Vec3 axis = normalized(o.axis), centre = 0.5 * (bounds.min + bounds.max);
    constexpr double kSteep = 0.2;  // sine of the angle to the normal under which a direction means nothing
    Wish wish(f.mesh().points.size());
    for (size_t v = 0; v < f.mesh().points.size(); ++v) {
        const Vec3 d = o.type == "axis" ? axis : normalized(cross(axis, f.mesh().points[v] - centre), Vec3(0, 0, 0));
        const Vec3& n = f.normal(int(v));
        const Vec3 tangent = d - dot(d, n) * n;
        if (length(tangent) > kSteep) wish.set(int(v), f, tangent, symmetry, 1);
    }
    return wish;
}

Wish alongStrokes(const Surface& surface, const TangentFrames& f, const FieldOptions& o, int symmetry) {
    Wish wish(f.mesh().points.size());
    const double step = std::sqrt(surface.area() / double(std::max<size_t>(1, surface.mesh().triangles.size())));
    const double reach = 0.05 * meshBounds(surface.mesh()).diagonal();
    for (const auto& stroke : o.strokes)
        for (size_t i = 0; i + 1 < stroke.size(); ++i) {
            const Vec3 d = stroke[i + 1] - stroke[i];
            const int steps = int(std::min(1e5, 1 + length(d) / step));
            for (int s = 0; s <= steps; ++s) {
                const SurfacePoint p = surface.closest(stroke[i] + (double(s) / steps) * d);
                if (p.distance > reach) continue;
                for (int k = 0; k < 3; ++k) {
                    const int v = f.vertex(size_t(p.triangle), k);
                    const Vec3 tangent = d - dot(d, f.normal(v)) * f.normal(v);
                    if (length(tangent) > 1e-3 * length(d)) wish.set(v, f, tangent, symmetry, 1);
                }
            }
        }
    if (!(wish.weight.sum() > 0)) throw InputError("seeding.field.strokes: none of them comes near the surface");
    for (Eigen::Index v = 0; v < wish.weight.size(); ++v)
        if (wish.weight(v) > 0) {
            wish.direction(v) /= wish.weight(v);
            wish.weight(v) = 1;
        }
    return wish;
}

/// Follows the direction of least curvature where there is one, smoothly.
Vector alongCurvature(const TangentFrames& f, const Matrix& a, const Eigen::VectorXd& mass, int symmetry) {
    const std::vector<Curvature> curvature = principalCurvatures(f.mesh());
    Vector q(a.rows());
    double mean = 0;
    for (Eigen::Index v = 0; v < q.size(); ++v) {
        const Curvature& c = curvature[size_t(v)];
        // As lines: a principal direction has no sign.
        q(v) = std::abs(c.greatest - c.least) * std::polar(1.0, 2 * f.angle(int(v), c.alongLeast));
        mean += mass(v) * std::abs(q(v));
    }
    if (!(mean > 0)) return smoothest(a, mass);  // a plane
    q *= mass.sum() / mean;
    for (Eigen::Index v = 0; v < q.size(); ++v) {  // noise and sharp edges count no more than clear ones
        constexpr double kMost = 2;
        q(v) *= std::min(1.0, kMost / std::max(std::abs(q(v)), 1e-12));
        if (symmetry == 4) q(v) = q(v) * q(v);
    }
    const double radius = 0.02 * std::sqrt(mass.sum());  // over which directions are evened out
    const Eigen::VectorXd pull = mass / (radius * radius);
    return Factored(a, pull).solve(pull.asDiagonal() * q);
}

}  // namespace

DirectionField::DirectionField(const Surface& surface, const FieldOptions& options, int symmetry)
    : symmetry_(symmetry), frames_(surface.mesh()) {
    const std::vector<double> areas = frames_.vertexAreas();
    Eigen::VectorXd mass = Eigen::Map<const Eigen::VectorXd>(areas.data(), Eigen::Index(areas.size()));
    mass.array() += 1e-12 * mass.sum() / double(mass.size());
    // A principal direction has no sign, so it is first found as a line.
    const bool lines = options.type == "curvature" && symmetry == 1;
    const int solved = lines ? 2 : symmetry;
    const Matrix a = connectionLaplacian(frames_, solved);
    const Vector u = options.type == "smooth"      ? smoothest(a, mass)
                     : options.type == "curvature" ? alongCurvature(frames_, a, mass, solved)
                     : options.type == "guides"    ? filled(a, alongStrokes(surface, frames_, options, solved))
                                                   : filled(a, alongAxis(frames_, options, solved));
    angle_.resize(areas.size());
    for (size_t v = 0; v < angle_.size(); ++v) {
        angle_[v] = std::arg(u(Eigen::Index(v))) / solved;
        if (lines && frames_.direction(int(v), angle_[v])[2] < 0) angle_[v] += kPi;  // upwards
    }
}

Vec3 DirectionField::at(const SurfacePoint& p) const {
    const size_t t = size_t(p.triangle);
    const TriangleMesh& m = frames_.mesh();
    Vec3 w;
    closestPointOnTriangle(p.position, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2), &w);
    const Vec3 n = triangleNormal(m, t), x = normalized(m.corner(t, 1) - m.corner(t, 0), anyPerpendicular(n)),
               y = cross(n, x);
    Complex sum = 0;
    double angles[3];
    for (int k = 0; k < 3; ++k) {
        const int v = frames_.vertex(t, k);
        const Vec3 d = frames_.direction(v, angle_[size_t(v)]);
        angles[k] = std::atan2(dot(d, y), dot(d, x));
        sum += w[k] * std::polar(1.0, symmetry_ * angles[k]);
    }
    // Of the equal directions that which the nearest corner has, so that they agree among neighbours.
    const int nearest = w[0] >= w[1] && w[0] >= w[2] ? 0 : w[1] >= w[2] ? 1 : 2;
    const double period = 2 * kPi / symmetry_;
    double angle = std::abs(sum) > 1e-9 ? std::arg(sum) / symmetry_ : angles[nearest];
    angle += period * std::round((angles[nearest] - angle) / period);
    return std::cos(angle) * x + std::sin(angle) * y;
}

std::vector<int> DirectionField::indices() const {
    std::vector<int> result(frames_.mesh().triangles.size());
    for (size_t t = 0; t < result.size(); ++t) {
        double turned = 0, holonomy = 0;
        for (int k = 0; k < 3; ++k) {
            const int i = frames_.vertex(t, k), j = frames_.vertex(t, (k + 1) % 3);
            const double r = frames_.transport(t, k);
            turned += std::remainder(symmetry_ * (angle_[size_t(j)] - angle_[size_t(i)] - r), 2 * kPi);
            holonomy += r;
        }
        // The triangle's own curvature turns a parallel field, too.
        result[t] = int(std::lround((turned + symmetry_ * std::remainder(holonomy, 2 * kPi)) / (2 * kPi)));
    }
    return result;
}

}  // namespace pavel
