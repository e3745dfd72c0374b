#include <algorithm>
#include <cmath>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/shape_bases.h"
#include "pavel/core/shape_kit.h"

namespace pavel {
namespace {

constexpr int kRows = 96, kColumns = 192;

Vec3 direction(double u, double v) {
    const double t = kPi * u, f = 2 * kPi * v;
    return {std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t)};
}

void stretchToHeight(TriangleMesh& m, double height) {
    if (height <= 0) return;
    const double natural = meshBounds(m).size()[2];
    for (Vec3& p : m.points) p[2] *= height / natural;
}

/// Petal and leaf: elliptic sections of width w(u) and thickness t(u) along x, centre line zc(u, y).
template <class W, class Z>
TriangleMesh blade(double L, double T, double anchor, W width, Z centre) {
    return sweepPoles(160, 128, [&](double s, double v) {
        const double u = 0.5 * (1 - std::cos(kPi * s));
        const double y = -0.5 * width(u) * std::cos(2 * kPi * v);
        const double t = T * std::sqrt(std::max(0.0, 4 * u * (1 - u)));
        return Vec3((u - anchor) * L, y, centre(u, y) + 0.5 * t * std::sin(2 * kPi * v));
    });
}

std::vector<ProfilePoint> discProfile(double a, double h) {
    const double r = h / 2, R = a - r;
    std::vector<ProfilePoint> p;
    const int flat = 24, arc = 32;
    for (int i = 0; i < flat; ++i) p.push_back({R * i / flat, 0, 0});
    for (int i = 0; i <= arc; ++i) {
        const double t = -kPi / 2 + kPi * i / arc;
        p.push_back({R + r * std::cos(t), r + r * std::sin(t), 0});
    }
    for (int i = flat - 1; i >= 0; --i) p.push_back({R * i / flat, h, 0});
    return p;
}

/// rho = a (1 - z/h)^e with the tip rounded by a ball of radius `tip` that touches the flanks.
std::vector<ProfilePoint> coneProfile(double a, double h, double e, double tip) {
    const auto rho = [&](double z) { return a * std::pow(std::max(0.0, 1 - z / h), e); };
    const auto nearest = [&](double zc, double* at) {  // distance from (0, zc) to the flank
        double best = 1e300;
        for (int i = 0; i <= 4000; ++i) {
            const double z = h * i / 4000, d = std::hypot(rho(z), z - zc);
            if (d < best) best = d, *at = z;
        }
        return best;
    };
    double lo = 0, hi = h, touch = 0;
    for (int i = 0; i < 50; ++i) {
        const double zc = 0.5 * (lo + hi);
        (nearest(zc, &touch) > tip ? lo : hi) = zc;
    }
    const double zc = lo;
    nearest(zc, &touch);
    std::vector<ProfilePoint> p;
    for (int i = 0; i < 24; ++i) p.push_back({a * i / 24, 0, 0});
    for (int i = 0; i < 96; ++i) p.push_back({rho(touch * i / 96), touch * i / 96, 0});
    const double start = std::atan2(touch - zc, rho(touch));
    for (int i = 0; i <= 24; ++i) {
        const double t = start + (kPi / 2 - start) * i / 24;
        p.push_back({i == 24 ? 0 : tip * std::cos(t), zc + tip * std::sin(t), 0});
    }
    return p;
}

TriangleMesh pebble(double A, double B, double C, double n, double phase) {
    const auto f = [&](const Vec3& p) {
        const double q = std::pow(std::pow(std::abs(p[0] / A), n) + std::pow(std::abs(p[1] / B), n) +
                                      std::pow(std::abs((p[2] - .85 * C) / C), n),
                                  1 / n);
        return q - 1 -
               .05 * (std::sin(3.4 * p[0] / A + .3 + phase) + std::sin(4.6 * p[1] / B + 1.1 + 2 * phase) +
                      std::sin(3.8 * (p[2] - C) / C + 2 + 3 * phase));
    };
    return sweepPoles(kRows, kColumns, [&](double u, double v) {
        const Vec3 centre(0, 0, .85 * C), d = direction(u, v);
        double lo = 0, hi = 3 * std::max({A, B, C});
        for (int i = 0; i < 60; ++i) {
            const double r = 0.5 * (lo + hi);
            (f(centre + r * d) < 0 ? lo : hi) = r;
        }
        return centre + lo * d;
    });
}

}  // namespace

std::vector<ShapeRecipe> elementRecipes() {
    using P = const ShapeParameters&;
    const ShapeParameter anchor{"anchor", 0,      "place along the length that sits on the seed, 0 (stem) to 1",
                                0,        1.0001, true};
    const ShapeParameter height{"height", 0, "overall height; 0: as thickness and bend make it", 0, 1e9, true};
    std::vector<ShapeRecipe> r;
    r.push_back({{"pearl", false, "sphere, sunk into the surface by a fifth of its radius", {{"radius", 4, "radius"}}},
                 [](P p) {
                     const double a = p.at("radius");
                     return sweepPoles(kRows, kColumns,
                                       [&](double u, double v) { return a * direction(u, v) + Vec3(0, 0, .8 * a); });
                 }});
    r.push_back({{"disc", false, "round disc with a rounded rim", {{"radius", 4, "radius"}, {"height", 2.4, "height"}}},
                 [](P p) {
                     if (p.at("height") >= 2 * p.at("radius"))
                         throw InputError("a disc's height must be less than its diameter");
                     return revolve(discProfile(p.at("radius"), p.at("height")), kColumns, {});
                 }});
    r.push_back({{"petal",
                  false,
                  "petal, its narrow end on the seed",
                  {{"length", 12, "length"},
                   {"width", 8, "width"},
                   {"thickness", 1.6, "thickness"},
                   {"sharpness", 1.61, "exponent of the outline"},
                   {"bend", 2, "rise of the tip", 0, 1e9, true},
                   anchor,
                   height}},
                 [](P p) {
                     const double T = p.at("thickness"), bend = p.at("bend");
                     TriangleMesh m = blade(
                         p.at("length"), T, p.at("anchor"),
                         [&](double u) {
                             return p.at("width") * std::max(0.0, std::sin(kPi * std::pow(u, p.at("sharpness"))));
                         },
                         [&](double u, double) { return T / 2 + bend * u * u; });
                     stretchToHeight(m, p.at("height"));
                     return m;
                 }});
    r.push_back({{"leaf",
                  false,
                  "leaf folded along its middle, its stem on the seed (anchor .46 centres it)",
                  {{"length", 16, "length"},
                   {"width", 7, "width"},
                   {"thickness", 1.4, "thickness"},
                   {"sharpness", .756, "exponent of the outline"},
                   {"fold", 1.5, "rise of the rims", 0, 1e9, true},
                   anchor,
                   height}},
                 [](P p) {
                     const double T = p.at("thickness"), W = p.at("width");
                     TriangleMesh m = blade(
                         p.at("length"), T, p.at("anchor"),
                         [&](double u) { return W * std::max(0.0, std::sin(kPi * std::pow(u, p.at("sharpness")))); },
                         [&](double, double y) { return T / 2 + p.at("fold") * 4 * y * y / (W * W); });
                     stretchToHeight(m, p.at("height"));
                     return m;
                 }});
    r.push_back(
        {{"scale",
          false,
          "fish scale: a tilted disc, its rear edge on the seed",
          {{"radius", 5, "radius"}, {"height", 1.2, "thickness"}, {"tilt", 15, "angle in degrees", 0, 80, true}}},
         [](P p) {
             const double a = p.at("radius"), h = p.at("height"), t = degreesToRadians(p.at("tilt"));
             if (h >= 2 * a) throw InputError("a scale's height must be less than its diameter");
             TriangleMesh m = revolve(discProfile(a, h), kColumns, {});
             for (Vec3& q : m.points) {
                 const double x = q[0] + a - h / 2;
                 q = Vec3(x * std::cos(t) - q[2] * std::sin(t), .9 * q[1], x * std::sin(t) + q[2] * std::cos(t));
             }
             return m;
         }});
    r.push_back(
        {{"rose_petal",
          false,
          "cup-shaped petal of a rose",
          {{"radius", 6, "radius of the cup"},
           {"opening", 60, "half opening angle in degrees", 0, 120},
           {"thickness", 1.2, "thickness"}}},
         [](P p) {
             const double rho = p.at("radius"), alpha = degreesToRadians(p.at("opening")), T = p.at("thickness");
             if (T >= rho) throw InputError("a rose petal's thickness must be less than its radius");
             std::vector<ProfilePoint> profile;
             const int n = 96;
             for (int i = -n; i <= n; ++i) {  // outer side out to the rim, inner side back
                 const double v = std::sin(kPi / 2 * (n - std::abs(i)) / n), side = i < 0 ? 1 : -1;
                 const double d = rho * (1 + .12 * v * v * v * v) + side * T / 2 * std::sqrt(std::max(0.0, 1 - v * v));
                 profile.push_back({std::abs(i) == n ? 0 : d * std::sin(alpha * v), rho - d * std::cos(alpha * v), 0});
             }
             TriangleMesh m = revolve(profile, kColumns, {});
             for (Vec3& q : m.points) q[1] *= 1.15;
             return m;
         }});
    r.push_back({{"bean",
                  false,
                  "bent bean",
                  {{"length", 10, "length"},
                   {"thickness", 4, "thickness"},
                   {"bend", .06, "curvature of the middle line", 0, 10, true}}},
                 [](P p) {
                     const double L = p.at("length") / 2, b = p.at("thickness") / 2, k = p.at("bend");
                     return sweepPoles(kRows, kColumns, [&](double u, double v) {
                         const Vec3 d = direction(u, v);
                         const double x = L * d[0];
                         return Vec3(x, b * d[1] + k * (x * x - L * L / 5), b * d[2] + b);
                     });
                 }});
    r.push_back(
        {{"rice",
          false,
          "rice grain",
          {{"length", 8, "length"},
           {"width", 2.6, "width"},
           {"height", 2.2, "height"},
           {"exponent", 2.4, "roundness; 2 is an ellipsoid", 1, 20}}},
         [](P p) {
             const double A = p.at("length") / 2, B = p.at("width") / 2, C = p.at("height") / 2, n = p.at("exponent");
             return sweepPoles(kRows, kColumns, [&](double u, double v) {
                 const Vec3 d = direction(u, v);
                 const double q = std::pow(
                     std::pow(std::abs(d[0]), n) + std::pow(std::abs(d[1]), n) + std::pow(std::abs(d[2]), n), -1 / n);
                 return Vec3(A * q * d[0], B * q * d[1], C * q * d[2] + C);
             });
         }});
    r.push_back({{"star",
                  false,
                  "domed star with a flat base, sunk by a twentieth of its height",
                  {{"radius", 5, "outer radius"},
                   {"height", 2.5, "height"},
                   {"depth", .45, "depth of the notches, 0 to 1", 0, 1, true},
                   {"points", 5, "number of points", 1, 64}}},
                 [](P p) {
                     const double a = p.at("radius"), h = p.at("height"), m = p.at("depth");
                     const int n = int(std::lround(p.at("points")));
                     return sweepPoles(kRows, 240, [&](double u, double v) {
                         const double f = 2 * kPi * v, R = a * (1 - m / 2 + m / 2 * std::cos(n * f));
                         const double s = u < 0.75 ? std::sin(kPi / 2 * u / 0.75) : (1 - u) / 0.25;
                         const double z = (u < 0.75 ? h * (1 - s * s) : 0) - .05 * h;
                         return Vec3(s * R * std::cos(f), s * R * std::sin(f), z);
                     });
                 }});
    r.push_back({{"cone",
                  false,
                  "cone or spike with a rounded tip, sunk by a twentieth of its height",
                  {{"radius", 3, "radius of the foot"},
                   {"height", 8, "height before the tip is rounded"},
                   {"exponent", 1, "1: cone, 1.5: thorn", .2, 5}}},
                 [](P p) {
                     const double a = p.at("radius"), h = p.at("height");
                     TriangleMesh m = revolve(coneProfile(a, h, p.at("exponent"), .1 * a), kColumns, {});
                     for (Vec3& q : m.points) q[2] -= .05 * h;
                     return m;
                 }});
    r.push_back({{"torus",
                  false,
                  "ring lying on the surface",
                  {{"radius", 3.5, "radius of the middle circle"}, {"thickness", 2.2, "thickness"}}},
                 [](P p) {
                     const double a = p.at("radius"), b = p.at("thickness") / 2;
                     if (b >= a) throw InputError("a torus' thickness must be less than twice its radius");
                     return sweepPeriodic(kColumns, 96, [&](double u, double v) {
                         const double q = a + b * std::cos(2 * kPi * v);
                         return Vec3(q * std::cos(2 * kPi * u), q * std::sin(2 * kPi * u),
                                     b + b * std::sin(2 * kPi * v));
                     });
                 }});
    r.push_back({{"pebble",
                  false,
                  "irregular pebble",
                  {{"length", 10, "length"},
                   {"width", 8, "width"},
                   {"height", 5.5, "height before the bumps"},
                   {"exponent", 2.3, "roundness", 1, 20},
                   {"phase", 0, "another pebble for every value", 0, 1e6, true}}},
                 [](P p) {
                     return pebble(p.at("length") / 2, p.at("width") / 2, p.at("height") / 2, p.at("exponent"),
                                   p.at("phase"));
                 }});
    return r;
}

}  // namespace pavel
