#include "pavel/seeding/stripe_pattern.h"

#include <Eigen/LU>
#include <Eigen/SparseCore>
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

/// A = L D L^T in blocks of 2 x 2, row after row (T. A. Davis, Algorithm 849: a concise sparse Cholesky factorization
/// package, 2005): several times as fast as the library's way along single entries.
class BlockFactor {
  public:
    /// @param a symmetric, positive definite, its entries in full blocks; ordered so that little fills in
    explicit BlockFactor(const Matrix& a) : start_(size_t(a.cols()) / 2 + 1, 0), inverse_(size_t(a.cols()) / 2) {
        const size_t count = inverse_.size();
        const int n = int(count);
        const int* rows = a.innerIndexPtr();
        const auto begin = [&](int c) { return a.outerIndexPtr()[2 * c]; };
        const auto end = [&](int c) { return a.outerIndexPtr()[2 * c + 1]; };
        std::vector<int> parent(count, -1), mark(count, -1);
        for (int k = 0; k < n; ++k) {
            mark[size_t(k)] = k;
            for (int p = begin(k); p < end(k) && rows[p] < 2 * k; p += 2)
                for (size_t i = size_t(rows[p] / 2); mark[i] != k; i = size_t(parent[i])) {
                    if (parent[i] < 0) parent[i] = k;
                    ++start_[i + 1];
                    mark[i] = k;
                }
        }
        for (size_t c = 0; c < count; ++c) start_[c + 1] += start_[c];
        row_.resize(start_.back());
        block_.resize(start_.back());
        std::vector<size_t> next(start_.begin(), start_.end() - 1);
        std::vector<int> pattern(count), path;
        std::vector<Eigen::Matrix2d> y(count, Eigen::Matrix2d::Zero());
        mark.assign(count, -1);
        for (int k = 0; k < n; ++k) {
            size_t top = count;
            mark[size_t(k)] = k;
            for (int p = begin(k); p < end(k) && rows[p] <= 2 * k; p += 2) {
                const int q = p + end(k) - begin(k);  // the same rows in the right column
                y[size_t(rows[p] / 2)] << a.valuePtr()[p], a.valuePtr()[q], a.valuePtr()[p + 1], a.valuePtr()[q + 1];
                path.clear();
                for (int i = rows[p] / 2; mark[size_t(i)] != k; i = parent[size_t(i)]) {
                    path.push_back(i);
                    mark[size_t(i)] = k;
                }
                while (!path.empty()) pattern[--top] = path.back(), path.pop_back();
            }
            Eigen::Matrix2d d = y[size_t(k)];
            y[size_t(k)].setZero();
            for (; top < count; ++top) {
                const size_t i = size_t(pattern[top]);
                const Eigen::Matrix2d yi = y[i];
                y[i].setZero();
                for (size_t p = start_[i]; p < next[i]; ++p) y[size_t(row_[p])].noalias() -= block_[p] * yi;
                const Eigen::Matrix2d l = yi.transpose() * inverse_[i];
                d.noalias() -= l * yi;
                row_[next[i]] = k;
                block_[next[i]++] = l;
            }
            if (!(d(0, 0) > 0 && d.determinant() > 0)) throw RunError("the stripes' equations could not be solved");
            inverse_[size_t(k)] = d.inverse();
        }
    }

    /// Replaces x by the solution of A y = x.
    void solve(Eigen::VectorXd& x) const {
        const size_t n = inverse_.size();
        const auto at = [&](size_t v) { return x.segment<2>(Eigen::Index(2 * v)); };
        for (size_t c = 0; c < n; ++c) {
            const Eigen::Vector2d own = at(c);
            for (size_t p = start_[c]; p < start_[c + 1]; ++p) at(size_t(row_[p])).noalias() -= block_[p] * own;
        }
        for (size_t c = n; c-- > 0;) {
            Eigen::Vector2d sum = Eigen::Vector2d::Zero();
            for (size_t p = start_[c]; p < start_[c + 1]; ++p)
                sum.noalias() += block_[p].transpose() * at(size_t(row_[p]));
            const Eigen::Vector2d own = inverse_[c] * at(c);
            at(c) = own - sum;
        }
    }

  private:
    std::vector<size_t> start_;  // of each column of blocks
    std::vector<int> row_;
    std::vector<Eigen::Matrix2d> block_, inverse_;  // of L below its diagonal; of D's blocks
};

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
        for (int d = 0; d < 2; ++d) {
            entries.emplace_back(2 * v + d, 2 * v + d, shift * mass_[size_t(v)] + 1e-14);
            entries.emplace_back(2 * v + d, 2 * v + 1 - d, 0);  // a full block
        }
    Matrix a(2 * n, 2 * n);
    a.setFromTriplets(entries.begin(), entries.end());
    const BlockFactor factor(a);

    Eigen::VectorXd x(2 * n), mass(2 * n);
    for (Eigen::Index v = 0; v < n; ++v) {
        const double angle = 2.399963 * double(v);  // the same on every run
        x(2 * v) = std::cos(angle), x(2 * v + 1) = std::sin(angle);
        mass(2 * v) = mass(2 * v + 1) = mass_[size_t(v)];
    }
    for (int step = 0; step < kSteps; ++step) {
        const Eigen::VectorXd before = x;
        x = mass.cwiseProduct(x);
        factor.solve(x);
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
