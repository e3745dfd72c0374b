#pragma once
#include <OpenMesh/Core/Geometry/VectorT.hh>
#include <cmath>

namespace pavel {

using Vec3 = OpenMesh::Vec3d;
using Vec3f = OpenMesh::Vec3f;

inline double dot(const Vec3& a, const Vec3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Vec3& a) {
    return std::sqrt(dot(a, a));
}
/// Unit vector along a; `fallback` where a has no length.
inline Vec3 normalized(const Vec3& a, const Vec3& fallback = Vec3(0, 0, 1)) {
    const double l = length(a);
    return l > 0 ? a / l : fallback;
}
inline bool isFinite(const Vec3& a) {
    return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

/// A unit vector perpendicular to the unit vector n.
inline Vec3 anyPerpendicular(const Vec3& n) {
    const Vec3 axis = std::abs(n[0]) < 0.9 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
    return normalized(axis - dot(axis, n) * n);
}
/// v turned about the unit axis by an angle in radians (Rodrigues).
inline Vec3 rotatedAbout(const Vec3& v, const Vec3& axis, double radians) {
    const double c = std::cos(radians), s = std::sin(radians);
    return c * v + s * cross(axis, v) + ((1 - c) * dot(axis, v)) * axis;
}

constexpr double kPi = 3.14159265358979323846;
inline double degreesToRadians(double d) {
    return d * kPi / 180;
}

}  // namespace pavel
