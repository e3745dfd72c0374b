#include "pavel/core/shape_kit.h"

#include <algorithm>
#include <cmath>

namespace pavel {

TriangleMesh sweepPoles(int rows, int columns, const std::function<Vec3(double, double)>& at) {
    TriangleMesh m;
    m.points.push_back(at(0, 0));
    for (int i = 1; i < rows; ++i)
        for (int j = 0; j < columns; ++j) m.points.push_back(at(double(i) / rows, double(j) / columns));
    m.points.push_back(at(1, 0));
    const int last = int(m.points.size()) - 1;
    const auto index = [&](int i, int j) {
        return i == 0 ? 0 : i == rows ? last : 1 + (i - 1) * columns + j % columns;
    };
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            const int a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
            if (i + 1 < rows)
                m.triangles.push_back({a, b, c});
            else
                m.triangles.push_back({a, b, d});
            if (i > 0 && i + 1 < rows) m.triangles.push_back({a, c, d});
        }
    }
    return m;
}

TriangleMesh sweepPeriodic(int rows, int columns, const std::function<Vec3(double, double)>& at) {
    TriangleMesh m;
    for (int i = 0; i < rows; ++i)
        for (int j = 0; j < columns; ++j) m.points.push_back(at(double(i) / rows, double(j) / columns));
    const auto index = [&](int i, int j) { return (i % rows) * columns + j % columns; };
    for (int i = 0; i < rows; ++i) {
        for (int j = 0; j < columns; ++j) {
            m.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
            m.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
        }
    }
    return m;
}

TriangleMesh revolve(const std::vector<ProfilePoint>& profile, int steps, std::vector<std::string> groupNames) {
    const int rows = int(profile.size()) - 1;
    TriangleMesh m = sweepPoles(rows, steps, [&](double u, double v) {
        const ProfilePoint& p = profile[size_t(std::lround(u * rows))];
        return Vec3(p.r * std::cos(2 * kPi * v), p.r * std::sin(2 * kPi * v), p.z);
    });
    // The profile runs from the bottom up, so the sweep's poles are reversed: turn the triangles.
    for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    if (groupNames.empty()) return m;
    m.groupNames = std::move(groupNames);
    for (int i = 0; i < rows; ++i) {
        const bool cap = i == 0 || i + 1 == rows;
        m.groups.insert(m.groups.end(), size_t(cap ? steps : 2 * steps), profile[size_t(i)].group);
    }
    return m;
}

namespace {

/// Cumulated lengths of a curve, at(i) for i in [0, n], that count for more where it bends more sharply than `radius`.
template <class At>
std::vector<double> lengthsAlong(int n, double radius, At at) {
    std::vector<Vec3> steps;
    Vec3 before = at(0);
    for (int i = 1; i <= n; ++i) {
        const Vec3 p = at(i);
        steps.push_back(p - before);
        before = p;
    }
    const auto turn = [&](size_t i) {  // between steps i and i + 1
        return i + 1 < steps.size() ? std::atan2(length(cross(steps[i], steps[i + 1])), dot(steps[i], steps[i + 1]))
                                    : 0;
    };
    std::vector<double> sum{0};
    for (size_t i = 0; i < steps.size(); ++i)
        sum.push_back(sum.back() + std::hypot(length(steps[i]), radius * (turn(i) + (i > 0 ? turn(i - 1) : 0)) / 2));
    return sum;
}

/// Where, as a share of the samples, the cumulated length reaches `target`.
double shareAtLength(const std::vector<double>& sum, double target) {
    const size_t n = sum.size() - 1;
    const size_t i = std::min(size_t(std::upper_bound(sum.begin(), sum.end(), target) - sum.begin()), n);
    const double step = sum[i] - sum[i - 1];
    return (double(i - 1) + (step > 0 ? (target - sum[i - 1]) / step : 0)) / double(n);
}

struct Row {
    double u;
    int group;  // of the triangles between this row and the next
};

/// Rings get denser where the way between the poles bends more sharply than this many edges.
constexpr double kSharp = 1.5;

std::vector<Row> evenRows(double edge, const std::vector<SweepBand>& bands,
                          const std::function<Vec3(double, double)>& at) {
    const int samples = 64, meridians = 8;
    std::vector<Row> rows;
    double start = 0;
    for (const SweepBand& band : bands) {
        std::vector<double> mean(size_t(samples) + 1, 0.0);
        for (int k = 0; k < meridians; ++k) {
            const std::vector<double> sum = lengthsAlong(samples, kSharp * edge, [&](int i) {
                return at(start + (band.end - start) * i / samples, (k + 0.5) / meridians);
            });
            for (size_t i = 0; i < sum.size(); ++i) mean[i] += sum[i] / meridians;
        }
        const int count = std::max(band.least, int(std::lround(mean.back() / (0.87 * edge))));
        for (int i = 0; i < count; ++i)
            rows.push_back({start + (band.end - start) * shareAtLength(mean, mean.back() * i / count), band.group});
        start = band.end;
    }
    return rows;
}

/// Points around at one u; place(i) is where point i lies, as a share of the way round, and goes on past a full turn.
struct Ring {
    int first, count;
    double phase;
    int index(int i) const { return first + i % count; }
    double place(int i) const { return (i + phase) / count; }
};

Ring addRing(TriangleMesh& m, double edge, double phase, const std::function<Vec3(double)>& at) {
    const int samples = 128;
    const std::vector<double> sum = lengthsAlong(samples, 0, [&](int i) { return at(double(i % samples) / samples); });
    const Ring ring{int(m.points.size()), std::max(6, int(std::lround(sum.back() / edge))), phase};
    for (int i = 0; i < ring.count; ++i) m.points.push_back(at(shareAtLength(sum, ring.place(i) * sum.back())));
    return ring;
}

/// The strip between two rings, always going on where that gives the shorter step around.
void stitch(TriangleMesh& m, const Ring& a, const Ring& b) {
    for (int i = 0, k = 0; i < a.count || k < b.count;) {
        const bool alongA = k == b.count || (i < a.count && a.place(i) + a.place(i + 1) <= b.place(k) + b.place(k + 1));
        if (alongA) {
            m.triangles.push_back({a.index(i), b.index(k), a.index(i + 1)});
            ++i;
        } else {
            m.triangles.push_back({a.index(i), b.index(k), b.index(k + 1)});
            ++k;
        }
    }
}

}  // namespace

TriangleMesh sweepEvenly(double edge, const std::vector<SweepBand>& bands,
                         const std::function<Vec3(double, double)>& at, std::vector<std::string> groupNames) {
    const std::vector<Row> rows = evenRows(edge, bands, at);
    TriangleMesh m;
    m.groupNames = std::move(groupNames);
    m.points.push_back(at(0, 0));
    Ring before{};
    for (size_t r = 1; r < rows.size(); ++r) {
        const Ring ring = addRing(m, edge, r % 2 ? 0.5 : 0, [&](double v) { return at(rows[r].u, v); });
        if (r == 1)
            for (int i = 0; i < ring.count; ++i) m.triangles.push_back({0, ring.index(i), ring.index(i + 1)});
        else
            stitch(m, before, ring);
        m.groups.resize(m.triangles.size(), rows[r - 1].group);
        before = ring;
    }
    const int pole = int(m.points.size());
    m.points.push_back(at(1, 0));
    for (int i = 0; i < before.count; ++i) m.triangles.push_back({before.index(i), pole, before.index(i + 1)});
    m.groups.resize(m.triangles.size(), rows.back().group);
    if (meshVolume(m) < 0)
        for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    return m;
}

InsideTest::InsideTest(const TriangleMesh& mesh)
    : mesh_(mesh), bounds_(meshBounds(mesh)), n_(size_t(std::sqrt(double(mesh.triangles.size()) / 2)) + 1) {
    columns_.resize(n_ * n_);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        Bounds b;
        for (int k = 0; k < 3; ++k) b.add(mesh.corner(t, k));
        for (size_t i = column(b.min[0], 0); i <= column(b.max[0], 0); ++i)
            for (size_t j = column(b.min[1], 1); j <= column(b.max[1], 1); ++j) columns_[i * n_ + j].push_back(int(t));
    }
}

size_t InsideTest::column(double v, int axis) const {
    const double share = (v - bounds_.min[axis]) / (bounds_.max[axis] - bounds_.min[axis]);
    return size_t(std::clamp(share * double(n_), 0.0, double(n_ - 1)));
}

bool InsideTest::operator()(const Vec3& p) const {
    if ((p - bounds_.min).min() < 0 || (bounds_.max - p).min() < 0) return false;
    // Symmetric shapes have edges and vertices right above each other: an uneven nudge keeps the ray off them.
    const double nudge = 1e-7 * bounds_.diagonal(), x = p[0] + 0.7310 * nudge, y = p[1] + 0.3127 * nudge;
    int winding = 0;
    for (int t : columns_[column(x, 0) * n_ + column(y, 1)]) {
        Vec3 c[3];
        for (int k = 0; k < 3; ++k) c[k] = mesh_.corner(size_t(t), k);
        double w[3], sum = 0;  // signed areas opposite to the corners, seen from above
        for (int k = 0; k < 3; ++k) {
            const Vec3 &a = c[(k + 1) % 3], &b = c[(k + 2) % 3];
            w[k] = (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x);
            sum += w[k];
        }
        const bool up = w[0] >= 0 && w[1] >= 0 && w[2] >= 0, down = w[0] <= 0 && w[1] <= 0 && w[2] <= 0;
        if (sum == 0 || (!up && !down)) continue;
        if ((w[0] * c[0][2] + w[1] * c[1][2] + w[2] * c[2][2]) / sum > p[2]) winding += up ? 1 : -1;
    }
    return winding > 0;
}

void hideCovered(TriangleMesh& mesh, const InsideTest& cover, int hidden) {
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        if (cover((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0)) mesh.groups[t] = hidden;
}

TriangleMesh joinParts(std::vector<TriangleMesh> parts, int hidden) {
    std::vector<InsideTest> inside;
    for (const TriangleMesh& p : parts) inside.emplace_back(p);
    TriangleMesh all;
    for (size_t i = 0; i < parts.size(); ++i) {
        for (size_t k = 0; k < parts.size(); ++k)
            if (k != i) hideCovered(parts[i], inside[k], hidden);
        append(all, parts[i]);
    }
    return all;
}

}  // namespace pavel
