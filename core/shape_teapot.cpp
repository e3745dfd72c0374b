#include <algorithm>
#include <cmath>

#include "pavel/core/shape_kit.h"
#include "pavel/core/shape_sculptures.h"
#include "pavel/core/teapot_patches.h"

namespace pavel {
namespace {

using teapot::Loop;
using teapot::Ring;

enum Part { kOuter, kKnob, kSpout, kHandle, kOther, kHidden };
const std::vector<std::string> kParts = {"outer", "knob", "spout", "handle", "other", "hidden"};

/// Point of the surface whose rows of control points are four given rings; v in [0,1) goes through its four quarters.
Vec3 pointOnQuarters(const Ring* rings, double s, double v) {
    const double quarter = std::floor(4 * v), w = 4 * v - quarter;
    Vec3 row[4];
    for (int i = 0; i < 4; ++i) {
        const auto [r, k, z] = rings[i];
        row[i] = bezier<Vec3>({{r, 0, z}, {r, k, z}, {k, r, z}, {0, r, z}}, w);
    }
    const Vec3 p = bezier(row, s);
    const int turn = int(quarter) % 4;
    return turn == 0   ? p
           : turn == 1 ? Vec3(-p[1], p[0], p[2])
           : turn == 2 ? Vec3(-p[0], -p[1], p[2])
                       : Vec3(p[1], -p[0], p[2]);
}

/// The seam between rim and lid is open in Newell's data: a flat groove closes it.
TriangleMesh bodyWithLid(double edge) {
    const Ring &rim = teapot::kBody[12], &lid = teapot::kLid[0];
    Ring groove[4];
    for (int i = 0; i < 4; ++i) {
        const double f = i / 3.0;
        groove[i] = {rim.r + f * (lid.r - rim.r), rim.k + f * (lid.k - rim.k), rim.z + f * (lid.z - rim.z)};
    }
    const Ring* const strips[] = {teapot::kBody, teapot::kBody + 3, teapot::kBody + 6, teapot::kBody + 9,
                                  groove,        teapot::kLid,      teapot::kLid + 3};
    const int groups[] = {kOther, kOuter, kOuter, kOuter, kOther, kOuter, kKnob}, n = 7;
    std::vector<SweepBand> bands;
    for (int i = 0; i < n; ++i) bands.push_back({double(i + 1) / n, groups[i]});
    return sweepEvenly(
        edge, bands,
        [&](double u, double v) {
            const int strip = std::min(int(n * u), n - 1);
            return pointOnQuarters(strips[strip], n * u - strip, v);
        },
        kParts);
}

/// Control points of one row at v: its half at negative y first, then the other.
Vec3 pointOnLoop(const Loop& l, double v) {
    const double w = v < 0.5 ? 2 * v : 2 - 2 * v, y = v < 0.5 ? -l.y : l.y;
    return bezier<Vec3>({{l.x0, 0, l.z0}, {l.x0, y, l.z0}, {l.x1, y, l.z1}, {l.x1, 0, l.z1}}, w);
}

/// Point of a tube of two patches each side, s in [0,2].
Vec3 pointOnTube(const Loop* loops, double s, double v) {
    const int strip = s < 1 ? 0 : 1;
    Vec3 row[4];
    for (int i = 0; i < 4; ++i) row[i] = pointOnLoop(loops[3 * strip + i], v);
    return bezier(row, s - strip);
}

/// A tube whose open ends get domes, of the given heights; those that end at the body are sunk into it.
TriangleMesh closedTube(const Loop* loops, double edge, double startDome, double endDome, int group) {
    const auto middle = [](const Loop& l) { return Vec3((l.x0 + l.x1) / 2, 0, (l.z0 + l.z1) / 2); };
    const auto dome = [&](const Loop& end, const Loop& next, double height, double angle, double v) {
        const Vec3 c = middle(end), out = normalized(c - middle(next));
        return c + std::sin(angle) * (pointOnLoop(end, v) - c) + height * std::cos(angle) * out;
    };
    return sweepEvenly(
        edge, {{0.25, group}, {0.5, group}, {0.75, group}, {1, group}},
        [&](double u, double v) {
            if (u < 0.25) return dome(loops[0], loops[1], startDome, 2 * kPi * u, v);
            if (u > 0.75) return dome(loops[6], loops[5], endDome, 2 * kPi * (1 - u), v);
            return pointOnTube(loops, 4 * u - 1, v);
        },
        kParts);
}

}  // namespace

TriangleMesh makeTeapot(double height) {
    const double natural = 3.15, edge = natural / 100, sunk = 0.25;
    // The spout's mouth is level and gets a flat cap, a little below its lip.
    TriangleMesh m = joinParts({bodyWithLid(edge), closedTube(teapot::kSpout, edge, sunk, 0, kSpout),
                                closedTube(teapot::kHandle, edge, sunk, sunk, kHandle)},
                               kHidden);
    scaleMesh(m, height / natural);
    return m;
}

}  // namespace pavel
