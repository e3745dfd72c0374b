#include "pavel/seeding/tangent_frames.h"

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
        }
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
