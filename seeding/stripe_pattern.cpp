#include "pavel/seeding/stripe_pattern.h"

#include <Eigen/Sparse>
#include <cmath>

#include "pavel/core/error.h"

namespace pavel {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

double wrapped(double angle) {
    return std::remainder(angle, 2 * kPi);
}

/// What a phase does along the side of a triangle from corner k to corner k + 1, in the sheet of the former.
struct Step {
    double growth = 0;  ///< wanted
    int sheet = 1;      ///< -1: the other corner's phase is in the mirrored sheet
};

Step stepAlong(const DirectionField& field, size_t t, int k, double turned, double frequency) {
    const TangentFrames& f = field.frames();
    const int i = f.vertex(t, k), j = f.vertex(t, (k + 1) % 3);
    const double a = field.angle(i) + turned - f.sideAngle(t, k), b = field.angle(j) + turned - f.backAngle(t, k) - kPi;
    const double l = length(f.mesh().points[size_t(j)] - f.mesh().points[size_t(i)]);
    Step s;
    s.sheet = std::cos(a - b) >= 0 ? 1 : -1;
    s.growth = frequency * l / 2 * (std::cos(a) + s.sheet * std::cos(b));
    return s;
}

/// Solves L^T x = x for a lower triangle without its diagonal of ones. The library adds up each row's terms one after
/// the other, and waits.
void solveTransposed(const Matrix& l, Eigen::VectorXd& x) {
    for (Eigen::Index row = l.cols(); row-- > 0;) {
        double sums[4] = {};
        int at = l.outerIndexPtr()[row];
        const int end = l.outerIndexPtr()[row + 1];
        for (; at + 4 <= end; at += 4)
            for (int k = 0; k < 4; ++k) sums[k] += l.valuePtr()[at + k] * x[l.innerIndexPtr()[at + k]];
        for (; at < end; ++at) sums[0] += l.valuePtr()[at] * x[l.innerIndexPtr()[at]];
        x[row] -= (sums[0] + sums[1]) + (sums[2] + sums[3]);
    }
}

}  // namespace

int TrianglePhases::turns() const {
    return flipped ? 0 : int(std::lround((corner[3] - corner[0]) / (2 * kPi)));
}

StripeSolver::StripeSolver(const DirectionField& field) : field_(field), mass_(field.frames().vertexAreas()) {}

std::vector<TrianglePhases> StripeSolver::solve(double turned, double spacing) const {
    const TangentFrames& f = field_.frames();
    const double frequency = 2 * kPi / spacing;
    const size_t triangles = f.mesh().triangles.size();
    const Eigen::Index n = Eigen::Index(mass_.size());
    // Energy: sum over sides of w |psi_j - e^(i growth) psi_i|^2, psi_j mirrored where the sheet changes.
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(triangles * 36);
    for (size_t t = 0; t < triangles; ++t)
        for (int k = 0; k < 3; ++k) {
            const int i = f.vertex(t, k), j = f.vertex(t, (k + 1) % 3);
            const Step s = stepAlong(field_, t, k, turned, frequency);
            const double w = f.weight(t, k), c = w * std::cos(s.growth), sn = w * std::sin(s.growth);
            for (int d = 0; d < 2; ++d) {
                entries.emplace_back(2 * i + d, 2 * i + d, w);
                entries.emplace_back(2 * j + d, 2 * j + d, w);
            }
            const double block[2][2] = {{-c, sn}, {-s.sheet * sn, -s.sheet * c}};
            for (int r = 0; r < 2; ++r)
                for (int q = 0; q < 2; ++q) {
                    entries.emplace_back(2 * j + r, 2 * i + q, block[r][q]);
                    entries.emplace_back(2 * i + q, 2 * j + r, block[r][q]);
                }
        }
    // Steps of diffusion, after each of which all values get length 1 again (as in Ginzburg and Landau's energy). The
    // smallest eigenvector alone fades where stripes do not fit, and what is left there is the pattern of elsewhere,
    // carried on: a third too many stripes around a vase's neck. Diffusion reaches over many stripes, and yet the shift
    // against the mass keeps the matrix regular, whatever the mesh's scale.
    constexpr double kReach = 0.01;  // 1 / (stripes that a step reaches over), or so
    constexpr int kSteps = 25;
    constexpr double kStill = 1e-4;
    const double shift = std::pow(kReach * frequency, 2);
    for (Eigen::Index v = 0; v < n; ++v)
        for (int d = 0; d < 2; ++d) entries.emplace_back(2 * v + d, 2 * v + d, shift * mass_[size_t(v)] + 1e-14);
    Matrix a(2 * n, 2 * n);
    a.setFromTriplets(entries.begin(), entries.end());
    Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> solver(a);
    if (solver.info() != Eigen::Success) throw RunError("the stripes' equations could not be solved");

    Eigen::VectorXd x(2 * n), mass(2 * n);
    for (Eigen::Index v = 0; v < n; ++v) {
        const double angle = 2.399963 * double(v);  // the same on every run
        x(2 * v) = std::cos(angle), x(2 * v + 1) = std::sin(angle);
        mass(2 * v) = mass(2 * v + 1) = mass_[size_t(v)];
    }
    const Eigen::VectorXd diagonal = solver.vectorD();
    for (int step = 0; step < kSteps; ++step) {
        const Eigen::VectorXd before = x;
        x = mass.cwiseProduct(x);
        solver.matrixL().solveInPlace(x);
        x = x.cwiseQuotient(diagonal);
        solveTransposed(solver.matrixL().nestedExpression(), x);
        for (Eigen::Index v = 0; v < n; ++v) {
            const double l = std::hypot(x(2 * v), x(2 * v + 1));
            if (l > 0) x.segment<2>(2 * v) /= l;
        }
        if ((x - before).lpNorm<Eigen::Infinity>() < kStill) break;
    }
    std::vector<double> phase(static_cast<size_t>(n));
    for (Eigen::Index v = 0; v < n; ++v) {
        double& p = phase[size_t(v)];
        p = std::atan2(x(2 * v + 1), x(2 * v));
        constexpr double kClear = 1e-7;  // no vertex lies on a stripe: which triangle has it would be left to rounding
        if (std::abs(p) < kClear) p = kClear;
    }

    std::vector<TrianglePhases> result(triangles);
    for (size_t t = 0; t < triangles; ++t) {
        TrianglePhases& p = result[t];
        int sheet = 1;
        p.corner[0] = phase[size_t(f.vertex(t, 0))];
        for (int k = 0; k < 3; ++k) {
            const Step s = stepAlong(field_, t, k, turned, frequency);
            const double wanted = p.corner[size_t(k)] + sheet * s.growth;
            sheet *= s.sheet;
            p.corner[size_t(k) + 1] = wanted + wrapped(sheet * phase[size_t(f.vertex(t, (k + 1) % 3))] - wanted);
        }
        p.flipped = sheet < 0;
    }
    return result;
}

}  // namespace pavel
