#include "pavel/seeding/tangent_frames.h"

#include <metis.h>

#include <algorithm>
#include <cmath>

namespace pavel {
namespace {

constexpr int after(int k) {
    return (k + 1) % 3;
}
constexpr int before(int k) {
    return (k + 2) % 3;
}
int cornerOf(const Triangle& t, int vertex) {
    return t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
}

double cornerAngle(const TriangleMesh& m, size_t t, int k) {
    const Vec3 u = normalized(m.corner(t, after(k)) - m.corner(t, k)),
               v = normalized(m.corner(t, before(k)) - m.corner(t, k));
    return std::atan2(length(cross(u, v)), dot(u, v));
}

}  // namespace

TangentFrames::TangentFrames(const TriangleMesh& mesh) : mesh_(mesh), neighbours_(triangleNeighbours(mesh)) {
    mesh_.groups.clear();
    mesh_.groupNames.clear();
    mesh_.points.clear();
    const size_t n = mesh.triangles.size();
    angle_.assign(3 * n, 0);
    opening_.assign(3 * n, 0);
    std::vector<char> done(3 * n, 0);
    std::vector<size_t> fan;
    for (size_t t = 0; t < n; ++t)
        for (int k = 0; k < 3; ++k) {
            if (done[3 * t + size_t(k)]) continue;
            const int v = mesh.triangles[t][size_t(k)];
            // Clockwise to the fan's first triangle, then once around.
            size_t first = t;
            bool closed = false;
            for (size_t steps = 0; steps <= n; ++steps) {
                const int next = neighbours_[first][size_t(cornerOf(mesh.triangles[first], v))];
                if (next < 0) break;
                first = size_t(next);
                if (first == t) {
                    closed = true;
                    break;
                }
            }
            fan.clear();
            double sum = 0;
            for (size_t at = first;;) {
                const int c = cornerOf(mesh.triangles[at], v);
                const size_t corner = 3 * at + size_t(c);
                if (done[corner]) break;
                done[corner] = 1;
                fan.push_back(corner);
                angle_[corner] = sum;
                opening_[corner] = cornerAngle(mesh, at, c);
                sum += opening_[corner];
                const int next = neighbours_[at][size_t(before(c))];
                if (next < 0) break;
                at = size_t(next);
            }
            const double scale = closed && sum > 0 ? 2 * kPi / sum : 1;
            const int own = int(mesh_.points.size());
            mesh_.points.push_back(mesh.points[size_t(v)]);
            Vec3 normal(0, 0, 0);
            for (size_t corner : fan) {
                normal += opening_[corner] * triangleNormal(mesh, corner / 3);
                angle_[corner] *= scale;
                opening_[corner] *= scale;
                mesh_.triangles[corner / 3][corner % 3] = own;
            }
            normal = normalized(normal);
            normal_.push_back(normal);
            const size_t c0 = fan[0];
            const Vec3 side = mesh.corner(c0 / 3, after(int(c0 % 3))) - mesh.points[size_t(v)];
            x_.push_back(normalized(side - dot(side, normal) * normal, anyPerpendicular(normal)));
            y_.push_back(cross(normal, x_.back()));
            firstSpoke_.push_back(int(spokes_.size()));
            double seen = 0;
            const auto addSpoke = [&](double angle, const Vec3& to) {
                const Vec3 d = to - mesh.points[size_t(v)];
                const double now = std::atan2(dot(d, y_.back()), dot(d, x_.back()));
                seen += std::max(0.0, std::remainder(now - seen, 2 * kPi));
                spokes_.push_back({angle, seen});
            };
            for (size_t corner : fan) addSpoke(angle_[corner], mesh.corner(corner / 3, after(int(corner % 3))));
            if (!closed)
                addSpoke(angle_[fan.back()] + opening_[fan.back()],
                         mesh.corner(fan.back() / 3, before(int(fan.back() % 3))));
            // Where the surface is folded sharply the plane shows no order: angles are then taken as they are.
            const bool folded = seen >= 2 * kPi || spokes_.back().angle >= 2 * kPi;
            if (folded) spokes_.resize(size_t(firstSpoke_.back()) + 1);
            spokes_.push_back({2 * kPi, 2 * kPi});
            endSpoke_.push_back(int(spokes_.size()));
        }
    renumber();
}

void TangentFrames::renumber() {
    const size_t n = mesh_.points.size();
    std::vector<std::vector<int>> around(n);
    for (const Triangle& t : mesh_.triangles)
        for (size_t k = 0; k < 3; ++k) {
            around[size_t(t[k])].push_back(t[(k + 1) % 3]);
            around[size_t(t[(k + 1) % 3])].push_back(t[k]);
        }
    std::vector<idx_t> first(1, 0), neighbours, order(n), rank(n);
    for (auto& a : around) {
        std::sort(a.begin(), a.end());
        a.erase(std::unique(a.begin(), a.end()), a.end());
        neighbours.insert(neighbours.end(), a.begin(), a.end());
        first.push_back(idx_t(neighbours.size()));
    }
    idx_t count = idx_t(n);
    if (n < 3 ||
        METIS_NodeND(&count, first.data(), neighbours.data(), nullptr, nullptr, order.data(), rank.data()) != METIS_OK)
        return;
    const auto reorder = [&](auto& values) {
        auto old = values;
        for (size_t v = 0; v < n; ++v) values[size_t(rank[v])] = old[v];
    };
    reorder(mesh_.points);
    reorder(normal_);
    reorder(x_);
    reorder(y_);
    reorder(firstSpoke_);
    reorder(endSpoke_);
    for (Triangle& t : mesh_.triangles)
        for (int& v : t) v = int(rank[size_t(v)]);
}

Vec3 TangentFrames::direction(int v, double angle) const {
    double a = std::fmod(angle, 2 * kPi);
    if (a < 0) a += 2 * kPi;
    int k = firstSpoke_[size_t(v)];
    while (k + 2 < endSpoke_[size_t(v)] && spokes_[size_t(k) + 1].angle <= a) ++k;
    const Spoke &p = spokes_[size_t(k)], &q = spokes_[size_t(k) + 1];
    const double seen = q.angle > p.angle ? p.seen + (a - p.angle) / (q.angle - p.angle) * (q.seen - p.seen) : p.seen;
    return std::cos(seen) * x_[size_t(v)] + std::sin(seen) * y_[size_t(v)];
}

double TangentFrames::angle(int v, const Vec3& direction) const {
    double seen = std::atan2(dot(direction, y_[size_t(v)]), dot(direction, x_[size_t(v)]));
    if (seen < 0) seen += 2 * kPi;
    int k = firstSpoke_[size_t(v)];
    while (k + 2 < endSpoke_[size_t(v)] && spokes_[size_t(k) + 1].seen <= seen) ++k;
    const Spoke &p = spokes_[size_t(k)], &q = spokes_[size_t(k) + 1];
    return q.seen > p.seen ? p.angle + (seen - p.seen) / (q.seen - p.seen) * (q.angle - p.angle) : p.angle;
}

double TangentFrames::weight(size_t t, int k) const {
    const Vec3 p = mesh_.corner(t, before(k)), u = mesh_.corner(t, k) - p, v = mesh_.corner(t, after(k)) - p;
    constexpr double kLeast = 1e-3, kMost = 1e3;
    return std::clamp(0.5 * dot(u, v) / std::max(length(cross(u, v)), 1e-300), kLeast, kMost);
}

std::vector<double> TangentFrames::vertexAreas() const {
    std::vector<double> area(mesh_.points.size(), 0);
    for (size_t t = 0; t < mesh_.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k)
            area[size_t(vertex(t, k))] += triangleArea(mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2)) / 3;
    return area;
}

}  // namespace pavel
