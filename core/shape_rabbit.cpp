#include <algorithm>
#include <cmath>

#include "pavel/core/shape_kit.h"
#include "pavel/core/shape_sculptures.h"

namespace pavel {
namespace {

enum Part { kOuter, kEyes, kHidden };
const std::vector<std::string> kParts = {"outer", "eyes", "hidden"};

constexpr double kEdge = 1.3;  // before scaling to the height

/// A round body along a Bezier spine.
struct Limb {
    Vec3 spine[4];
    double radii[4];       ///< along the spine, a cubic Bezier too
    double bluntness = 2;  ///< exponent: 2 closes like an ellipsoid, more like a sausage
    double flatness = 1;   ///< of the sections: their thickness as a share of their width, which lies along `side`
    Vec3 side{0, 1, 0};
    double curl = 0;  ///< how far the sections' ends bend up, as a share of half their width
    double edge = kEdge;
};

/// Point of its surface, s along the spine, at an angle from `side`.
Vec3 limbPoint(const Limb& l, double s, double angle) {
    const double close = std::pow(1 - std::pow(std::abs(2 * s - 1), l.bluntness), 1 / l.bluntness);
    const Vec3 t = normalized(bezierTangent(l.spine, s));
    const Vec3 side = normalized(l.side - dot(l.side, t) * t), up = cross(t, side);
    const double radius = close * bezier(l.radii, s), across = std::cos(angle);
    return bezier(l.spine, s) +
           radius * (across * side + (l.flatness * std::sin(angle) + l.curl * across * across) * up);
}

TriangleMesh limb(const Limb& l) {
    return sweepEvenly(
        l.edge, {{1, kOuter}},
        [&](double u, double v) { return limbPoint(l, 0.5 - 0.5 * std::cos(kPi * u), 2 * kPi * v); }, kParts);
}

TriangleMesh ellipsoid(const Vec3& middle, const Vec3& half, double pitchDegrees = 0, int group = kOuter) {
    const double c = std::cos(degreesToRadians(pitchDegrees)), s = std::sin(degreesToRadians(pitchDegrees));
    return sweepEvenly(
        std::min(kEdge, half.min() / 3), {{1, group}},
        [&](double u, double v) {
            const double t = kPi * u, f = 2 * kPi * v;
            const Vec3 p(half[0] * std::cos(t), half[1] * std::sin(t) * std::cos(f),
                         half[2] * std::sin(t) * std::sin(f));
            return middle + Vec3(c * p[0] - s * p[2], p[1], s * p[0] + c * p[2]);
        },
        kParts);
}

}  // namespace

TriangleMesh makeRabbit(double height) {
    const Limb body{{{-44, 0, 27}, {-36, 0, 40}, {-8, 0, 40}, {20, 0, 30}}, {24, 31, 28, 20}, 2.3};
    const Limb chest{{{2, 0, 14}, {16, 0, 28}, {20, 0, 44}, {13, 0, 66}}, {15, 25, 19, 11}, 2.3};
    const Limb head{{{0, 0, 71}, {12, 0, 79}, {30, 0, 73}, {41, 0, 63}}, {15, 22, 17, 10}, 2.3};
    std::vector<TriangleMesh> parts{limb(body), limb(chest), limb(head)};
    parts.push_back(ellipsoid({-51, 0, 26}, {9.5, 9.5, 9.5}));                 // tail
    parts.push_back(ellipsoid({41.4, 0, 68.5}, {2.6, 3.8, 2.6}, -40, kEyes));  // nose
    for (double side : {-1.0, 1.0}) {
        const auto at = [&](double x, double y, double z) { return Vec3(x, side * y, z); };
        parts.push_back(ellipsoid(at(-20, 17, 23), {23, 13, 20}, 20));  // haunch
        parts.push_back(
            limb({{at(-18, 21, 6), at(-6, 22, 6.5), at(6, 22.5, 6), at(17, 23, 5.5)}, {7, 6.5, 6, 6}, 3.5}));
        parts.push_back(
            limb({{at(14, 11, 42), at(22, 11, 28), at(24, 9.5, 16), at(24, 9, 3)}, {9, 9, 6, 5}, 3}));  // leg
        parts.push_back(ellipsoid(at(29, 9, 5), {9, 6, 5}));                                            // paw
        parts.push_back(ellipsoid(at(33, 5, 62.5), {9, 7, 6.5}, -30));                                  // cheek
        const double above = degreesToRadians(22);
        const Vec3 eye = limbPoint(head, 0.56, side > 0 ? above : kPi - above);
        parts.push_back(ellipsoid(eye - Vec3(0, side, 0), {3.6, 2.8, 3.9}, 0, kEyes));
        Limb ear{{at(10, 7, 80), at(8, 8, 98), at(1, 13, 115), at(-6, 18, 131)}, {5, 7, 14, 8}, 2.4, 0.42};
        ear.side = normalized(at(0.35, 1, 0)) * side;
        ear.curl = -0.3;
        ear.edge = 0.85;  // for their thin rims
        parts.push_back(limb(ear));
    }
    TriangleMesh m = joinParts(std::move(parts), kHidden);
    const Bounds b = meshBounds(m);
    for (Vec3& p : m.points) p[2] -= b.min[2];
    scaleMesh(m, height / b.size()[2]);
    return m;
}

}  // namespace pavel
