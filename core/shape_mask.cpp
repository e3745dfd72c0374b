#include <algorithm>
#include <cmath>

#include "pavel/core/shape_kit.h"
#include "pavel/core/shape_sculptures.h"
#include "pavel/core/sheet_mesh.h"

namespace pavel {
namespace {

// z = 55 sqrt(1 - (x/75)^2 - (y/100)^2) + nose; up to the rim's steep end its points are spread by the ellipsoid's
// polar angle.
constexpr double kHalfWidth = 75, kHalfHeight = 100, kDepth = 55, kRim = 5, kEdge = 1.4;

double nose(double x, double y) {
    return 30 * std::exp(-std::pow(x / 12, 2) - std::pow((y + 8) / 28, 2));
}
double noseByX(double x, double y) {
    return -2 * x / (12.0 * 12) * nose(x, y);
}
double noseByY(double x, double y) {
    return -2 * (y + 8) / (28.0 * 28) * nose(x, y);
}

/// Millimetres along the ellipsoid's x and y meridians, on average, for a radian of polar angle.
constexpr double kScaleX = 65, kScaleY = 79;

/// The nose's flanks are steep, so the plane is wider there: this much on each side.
constexpr double kNoseRoom = 8;

Vec3 sheetPoint(const Point2& q) {
    const double room = kNoseRoom * std::exp(-std::pow((q[1] + 8) / 36, 2));
    const double a = (q[0] - room * std::tanh(q[0] / 15)) / kScaleX, b = q[1] / kScaleY,
                 angle = std::sqrt(a * a + b * b);
    const double share = angle > 0 ? std::sin(angle) / angle : 1;
    const double x = kHalfWidth * share * a, y = kHalfHeight * share * b;
    return {x, y, kDepth * std::cos(angle) + nose(x, y)};
}

/// Finite at the rim too, where the height's derivatives grow without bounds.
Vec3 sheetNormal(const Vec3& p) {
    const double root = (p[2] - nose(p[0], p[1])) / kDepth;
    return normalized(Vec3(kDepth * p[0] / (kHalfWidth * kHalfWidth) - root * noseByX(p[0], p[1]),
                           kDepth * p[1] / (kHalfHeight * kHalfHeight) - root * noseByY(p[0], p[1]), root));
}

/// Negative on the sheet, positive below the rim and in the eye holes; each part about a distance in millimetres.
double outsideSheet(const Point2& q) {
    const Vec3 p = sheetPoint(q);
    const double eye = 1 - std::hypot((std::abs(p[0]) - 32) / 18, (p[1] - 25) / 10);
    return std::max(kRim - p[2], 10 * eye);
}

TriangleMesh mask(double thickness) {
    const double reachX = kScaleX * kPi / 2 + kNoseRoom, reachY = kScaleY * kPi / 2;
    const TriangleMesh sheet = meshSheet({outsideSheet, sheetPoint, {-reachX, -reachY}, {reachX, reachY}}, kEdge);
    std::vector<Vec3> normals;
    for (const Vec3& p : sheet.points) normals.push_back(sheetNormal(p));
    return thickenSheet(sheet, normals, thickness, kEdge);
}

// The beak: a circular sweep along a Bezier in the plane x = 0.
const Vec3 kBeak[4] = {{0, -5, 50}, {0, -10, 110}, {0, -50, 150}, {0, -100, 160}};
constexpr double kBeakRoot = 22, kBeakTip = 3;

/// Point of the beak's flank, v around.
Vec3 beakPoint(double s, double v) {
    const Vec3 t = normalized(bezierTangent(kBeak, s)), side(1, 0, 0), up = cross(t, side);
    const double radius = kBeakRoot + s * (kBeakTip - kBeakRoot), angle = 2 * kPi * v;
    return bezier(kBeak, s) + radius * (std::cos(angle) * side + std::sin(angle) * up);
}

/// Height of the middle of the wall.
double middleHeight(double x, double y, double thickness) {
    const double root = std::sqrt(1 - std::pow(x / kHalfWidth, 2) - std::pow(y / kHalfHeight, 2));
    const double byX = noseByX(x, y) - kDepth * x / (kHalfWidth * kHalfWidth * root);
    const double byY = noseByY(x, y) - kDepth * y / (kHalfHeight * kHalfHeight * root);
    return kDepth * root + nose(x, y) - thickness / 2 * std::sqrt(1 + byX * byX + byY * byY);
}

/// Its root is cut along the middle of the mask's wall, so that it shows neither beside nor behind it.
TriangleMesh beak(double thickness, int group, std::vector<std::string> groupNames) {
    const auto foot = [&](double v) {  // by Newton; the flank rises steadily above the wall
        const auto above = [&](double s) {
            const Vec3 p = beakPoint(s, v);
            return p[2] - middleHeight(p[0], p[1], thickness);
        };
        const double h = 1e-5;
        double s = 0.1;
        for (int i = 0; i < 4; ++i) s -= above(s) * 2 * h / (above(s + h) - above(s - h));
        return s;
    };
    const Vec3 axis = beakPoint(0, 0) - Vec3(kBeakRoot, 0, 0), end = bezierTangent(kBeak, 1), ahead = normalized(end);
    // The tip is a ball that touches the flank where that ends.
    const double taper = std::atan((kBeakRoot - kBeakTip) / length(end));
    const Vec3 ball = kBeak[3] - kBeakTip * std::tan(taper) * ahead;
    return sweepEvenly(
        kEdge, {{0.2, group}, {0.9, group}, {1, group}},
        [&](double u, double v) {
            if (u < 0.2) {
                const Vec3 p = axis + u / 0.2 * (beakPoint(foot(v), v) - axis);
                return Vec3(p[0], p[1], middleHeight(p[0], p[1], thickness));
            }
            if (u < 0.9) {
                const double start = foot(v);
                return beakPoint(start + (u - 0.2) / 0.7 * (1 - start), v);
            }
            const double angle = taper + (kPi / 2 - taper) * (u - 0.9) / 0.1;
            return ball + std::cos(angle) / std::cos(taper) * (beakPoint(1, v) - kBeak[3]) +
                   kBeakTip / std::cos(taper) * std::sin(angle) * ahead;
        },
        std::move(groupNames));
}

}  // namespace

TriangleMesh makeMask(double thickness) {
    TriangleMesh m = mask(thickness);
    m.groupNames = {"outer", "other"};
    return m;
}

TriangleMesh makePlagueMask(double thickness) {
    TriangleMesh face = mask(thickness);
    face.groupNames = {"outer", "other", "beak", "hidden"};
    return joinParts({face, beak(thickness, 2, face.groupNames)}, 3);
}

}  // namespace pavel
