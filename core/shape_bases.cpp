#include "pavel/core/shape_bases.h"

#include <algorithm>
#include <cmath>

#include "pavel/core/error.h"
#include "pavel/core/shape_kit.h"

namespace pavel {
namespace {

struct P2 {
    double r, z;
};
P2 operator+(P2 a, P2 b) {
    return {a.r + b.r, a.z + b.z};
}
P2 operator-(P2 a, P2 b) {
    return {a.r - b.r, a.z - b.z};
}
P2 operator*(double s, P2 a) {
    return {s * a.r, s * a.z};
}
double norm(P2 a) {
    return std::hypot(a.r, a.z);
}

/// Centripetal Catmull-Rom through the points (P. Barry and R. Goldman 1988), end tangents by reflection.
std::vector<P2> smoothCurve(const std::vector<P2>& points, double spacing) {
    std::vector<P2> p = points;
    p.insert(p.begin(), 2 * points[0] - points[1]);
    p.push_back(2 * points.back() - points[points.size() - 2]);
    std::vector<P2> curve{points[0]};
    for (size_t i = 1; i + 2 < p.size(); ++i) {
        double t[4] = {0, 0, 0, 0};
        for (int k = 1; k < 4; ++k) t[k] = t[k - 1] + std::sqrt(norm(p[i + size_t(k) - 1] - p[i + size_t(k) - 2]));
        const auto mix = [](P2 a, P2 b, double ta, double tb, double x) {
            return ((tb - x) / (tb - ta)) * a + ((x - ta) / (tb - ta)) * b;
        };
        const int steps = std::max(4, int(std::ceil(norm(p[i + 1] - p[i]) / spacing)));
        for (int s = 1; s <= steps; ++s) {
            const double x = t[1] + (t[2] - t[1]) * s / steps;
            const P2 a1 = mix(p[i - 1], p[i], t[0], t[1], x), a2 = mix(p[i], p[i + 1], t[1], t[2], x),
                     a3 = mix(p[i + 1], p[i + 2], t[2], t[3], x);
            const P2 b1 = mix(a1, a2, t[0], t[2], x), b2 = mix(a2, a3, t[1], t[3], x);
            curve.push_back(mix(b1, b2, t[1], t[2], x));
        }
    }
    return curve;
}

std::vector<P2> straightCurve(const std::vector<P2>& points, double spacing) {
    std::vector<P2> curve{points[0]};
    for (size_t i = 1; i < points.size(); ++i) {
        const int steps = std::max(1, int(std::ceil(norm(points[i] - points[i - 1]) / spacing)));
        for (int s = 1; s <= steps; ++s)
            curve.push_back(points[i - 1] + (double(s) / steps) * (points[i] - points[i - 1]));
    }
    return curve;
}

enum Part { kOuter, kOther, kHandle, kHidden };
const std::vector<std::string> kVesselParts = {"outer", "other", "handle", "hidden"};

/// Shell of revolution: foot disc, outer curve, lip half-circle, inner curve (the outer one offset by the wall), floor.
TriangleMesh vessel(const std::vector<P2>& outer, double wall, double floorHeight, double spacing) {
    std::vector<ProfilePoint> profile;
    const auto lineTo = [&](P2 a, P2 b, int group) {  // points from a on, without b
        const int steps = std::max(1, int(std::ceil(norm(b - a) / spacing)));
        for (int s = 0; s < steps; ++s) {
            const P2 p = a + (double(s) / steps) * (b - a);
            profile.push_back({p.r, p.z, group});
        }
    };
    lineTo({0, 0}, outer[0], kOther);
    std::vector<P2> inner;  // from the lip down
    for (size_t i = 0; i < outer.size(); ++i) {
        const P2 before = outer[i == 0 ? 0 : i - 1], after = outer[std::min(i + 1, outer.size() - 1)];
        const P2 t = (1 / norm(after - before)) * (after - before);
        inner.push_back({outer[i].r - wall * t.z, outer[i].z + wall * t.r});
        profile.push_back({outer[i].r, outer[i].z, i + 1 < outer.size() ? kOuter : kOther});
    }
    const P2 end = outer.back(), lip = 0.5 * (end + inner.back()), arm = end - lip, up{-arm.z, arm.r};
    for (int s = 1; s < 8; ++s) {
        const double a = kPi * s / 8;
        const P2 p = lip + std::cos(a) * arm + std::sin(a) * up;
        profile.push_back({p.r, p.z, kOther});
    }
    size_t i = inner.size();
    while (i > 0 && inner[i - 1].z > floorHeight) {
        --i;
        profile.push_back({inner[i].r, inner[i].z, kOther});
    }
    if (i == 0) throw InputError("the floor is so high, or the wall so thick, that no hollow remains");
    const double f = (inner[i].z - floorHeight) / (inner[i].z - inner[i - 1].z);
    const P2 corner{inner[i].r + f * (inner[i - 1].r - inner[i].r), floorHeight};
    lineTo(corner, {0, floorHeight}, kOther);
    profile.push_back({0, floorHeight, kOther});
    for (const ProfilePoint& p : profile)
        if (p.r < 0) throw InputError("the wall is thicker than the vessel's neck");
    return revolve(profile, 192, kVesselParts);
}

double polylineSpacing(const std::vector<P2>& points) {
    double r = 0;
    for (const P2& p : points) r = std::max(r, p.r);
    return 0.92 * 2 * kPi * r / 192;
}

/// Ellipse (half axes a tangential, b in the plane) along a cubic Bezier in the x-z plane; mirror: on the -x side.
TriangleMesh handle(const P2 (&c)[4], double a, double b, double size, bool mirror) {
    const int rows = 96, columns = 48;
    TriangleMesh m = sweepPoles(rows, columns, [&](double u, double v) {
        const double s = std::clamp((u - 1e-3) / (1 - 2e-3), 0.0, 1.0);
        const P2 p = bezier(c, s);
        P2 t = bezierTangent(c, s);
        t = (1 / norm(t)) * t;
        const double w = u == 0 || u == 1 ? 0 : 1;  // the end caps close to a point; they lie inside the wall
        const double across = w * b * std::cos(2 * kPi * v), aside = w * a * std::sin(2 * kPi * v);
        const Vec3 x(p.r + across * t.z, aside, p.z - across * t.r);
        return size * (mirror ? Vec3(-x[0], -x[1], x[2]) : x);
    });
    if (meshVolume(m) < 0)
        for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    m.groupNames = kVesselParts;
    m.groups.assign(m.triangles.size(), kHandle);
    return m;
}

void addHandle(TriangleMesh& body, const TriangleMesh& grip) {
    hideCovered(body, InsideTest(grip), kHidden);
    append(body, grip);
}

TriangleMesh scaledVessel(std::vector<P2> points, bool smooth, double wall, double floorHeight, double height) {
    const double natural = points.back().z, size = height / natural;
    const double spacing = polylineSpacing(points);
    TriangleMesh m = vessel(smooth ? smoothCurve(points, spacing) : straightCurve(points, spacing), wall / size,
                            floorHeight / size, spacing);
    scaleMesh(m, size);
    return m;
}

TriangleMesh ring(double middle, double a, double b) {
    const auto power = [](double x, double e) { return std::copysign(std::pow(std::abs(x), e), x); };
    const int around = 256, section = 96;
    // |x/a|^3 + |z/b|^3 = 1, points spread evenly enough by the superellipse's own angle
    TriangleMesh m = sweepPeriodic(around, section, [&](double u, double v) {
        const double c = std::cos(2 * kPi * v), s = std::sin(2 * kPi * v);
        const double r = middle + a * power(c, 2.0 / 3), z = b * power(s, 2.0 / 3);
        return Vec3(r * std::cos(2 * kPi * u), r * std::sin(2 * kPi * u), z);
    });
    m.groupNames = {"outer", "other"};
    for (size_t t = 0; t < m.triangles.size(); ++t) {
        const Vec3 p = (m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3.0;
        m.groups.push_back(dot(triangleNormal(m, t), normalized(Vec3(p[0], p[1], 0))) > 0.3 ? 0 : 1);
    }
    return m;
}

/// Rounded box around the origin; the top is the part to decorate.
TriangleMesh tile(const Vec3& half, double r) {
    // A subdivided cube whose points are pushed out from the inner box by the rounding radius.
    TriangleMesh m;
    const Vec3 inner = half - Vec3(r, r, r);
    const auto coordinates = [&](int axis) {  // finer along the rounded rims
        std::vector<double> c;
        for (int i = 0; i <= 8; ++i) c.push_back(-half[axis] + r * i / 8);
        const int steps = std::max(1, int(std::ceil(2 * inner[axis] / (half.max() / 48))));
        for (int i = 1; i < steps; ++i) c.push_back(-inner[axis] + 2 * inner[axis] * i / steps);
        for (int i = 0; i <= 8; ++i) c.push_back(inner[axis] + r * i / 8);
        return c;
    };
    const std::vector<double> c[3] = {coordinates(0), coordinates(1), coordinates(2)};
    std::map<std::array<int, 3>, int> index;
    const auto vertex = [&](std::array<int, 3> ijk) {
        const auto [it, isNew] = index.emplace(ijk, int(m.points.size()));
        if (isNew) {
            const Vec3 p(c[0][size_t(ijk[0])], c[1][size_t(ijk[1])], c[2][size_t(ijk[2])]);
            const Vec3 core(std::clamp(p[0], -inner[0], inner[0]), std::clamp(p[1], -inner[1], inner[1]),
                            std::clamp(p[2], -inner[2], inner[2]));
            // radial angle map of the cube onto the rounding, so that the rim's points are evenly spread
            Vec3 d = (p - core) / r;
            const double most = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
            for (int k = 0; k < 3; ++k) d[k] = std::tan(d[k] / std::max(most, 1e-30) * kPi / 4) * most;
            m.points.push_back(most > 0 ? core + (r * most) * normalized(d) : p);
        }
        return it->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (int side = 0; side < 2; ++side) {
            const int w = side ? int(c[axis].size()) - 1 : 0;
            for (int i = 0; i + 1 < int(c[u].size()); ++i) {
                for (int j = 0; j + 1 < int(c[v].size()); ++j) {
                    int q[4];
                    const int di[4] = {0, 1, 1, 0}, dj[4] = {0, 0, 1, 1};
                    for (int k = 0; k < 4; ++k) {
                        std::array<int, 3> ijk{};
                        ijk[size_t(axis)] = w;
                        ijk[size_t(u)] = i + di[k];
                        ijk[size_t(v)] = j + dj[k];
                        q[k] = vertex(ijk);
                    }
                    if (!side) std::swap(q[1], q[3]);
                    m.triangles.push_back({q[0], q[1], q[2]});
                    m.triangles.push_back({q[0], q[2], q[3]});
                }
            }
        }
    }
    m.groupNames = {"outer", "other"};
    for (size_t t = 0; t < m.triangles.size(); ++t) {
        bool top = true;
        for (int k = 0; k < 3; ++k) top &= m.corner(t, k)[2] > half[2] - 1e-9 * half[2];
        m.groups.push_back(top ? 0 : 1);
    }
    return m;
}

}  // namespace

std::vector<ShapeRecipe> baseRecipes() {
    const auto vesselInfo = [](const char* name, const char* help, double height, double wall, double floorHeight) {
        return ShapeInfo{name,
                         true,
                         help,
                         {{"height", height, "overall height to the rim's curve"},
                          {"wall", wall, "wall thickness"},
                          {"floor", floorHeight, "thickness of the floor"}}};
    };
    std::vector<ShapeRecipe> r;
    r.push_back(
        {{"sphere", true, "sphere around the origin", {{"radius", 40, "radius"}}}, [](const ShapeParameters& p) {
             const double radius = p.at("radius");
             TriangleMesh m = sweepPoles(160, 320, [&](double u, double v) {
                 const double t = kPi * u, f = 2 * kPi * v;
                 return radius * Vec3(std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t));
             });
             m.groupNames = {"outer"};
             m.groups.assign(m.triangles.size(), 0);
             return m;
         }});
    r.push_back({vesselInfo("vase", "ovoid vase", 180, 4, 6), [](const ShapeParameters& p) {
                     return scaledVessel({{30, 0}, {46, 30}, {58, 75}, {52, 120}, {30, 155}, {27, 168}, {33, 180}},
                                         true, p.at("wall"), p.at("floor"), p.at("height"));
                 }});
    r.push_back({vesselInfo("bottle", "bottle vase with a narrow neck", 200, 3.5, 5), [](const ShapeParameters& p) {
                     return scaledVessel({{35, 0}, {40, 40}, {38, 100}, {22, 150}, {16, 175}, {20, 200}}, true,
                                         p.at("wall"), p.at("floor"), p.at("height"));
                 }});
    r.push_back(
        {vesselInfo("amphora", "amphora with two handles", 260, 5, 8), [](const ShapeParameters& p) {
             TriangleMesh m = scaledVessel(
                 {{24, 0}, {20, 12}, {46, 70}, {68, 130}, {60, 178}, {30, 212}, {22, 228}, {24, 250}, {30, 260}}, true,
                 p.at("wall"), p.at("floor"), p.at("height"));
             const P2 curve[4] = {{19, 240}, {70, 262}, {84, 205}, {60, 172}};
             for (bool mirror : {false, true}) addHandle(m, handle(curve, 7, 4.5, p.at("height") / 260, mirror));
             return m;
         }});
    r.push_back({vesselInfo("mug", "mug with a handle", 95, 4, 5), [](const ShapeParameters& p) {
                     TriangleMesh m = scaledVessel({{37, 0}, {40, 1}, {41, 4}, {41, 95}}, false, p.at("wall"),
                                                   p.at("floor"), p.at("height"));
                     const P2 curve[4] = {{39, 76}, {78, 84}, {76, 18}, {39, 24}};
                     addHandle(m, handle(curve, 6, 4, p.at("height") / 95, false));
                     return m;
                 }});
    r.push_back({vesselInfo("glass", "conical drinking glass", 92, 2.5, 4), [](const ShapeParameters& p) {
                     return scaledVessel({{26, 0}, {40, 92}}, false, p.at("wall"), p.at("floor"), p.at("height"));
                 }});
    const auto ringInfo = [](const char* name, const char* help, double middle, double a, double b) {
        return ShapeInfo{name,
                         true,
                         help,
                         {{"radius", middle, "radius of the section's middle"},
                          {"thickness", 2 * a, "radial thickness"},
                          {"width", 2 * b, "width along the axis"}}};
    };
    const auto makeRing = [](const ShapeParameters& p) {
        if (p.at("thickness") >= 2 * p.at("radius"))
            throw InputError("a ring's thickness must be less than twice its radius");
        return ring(p.at("radius"), p.at("thickness") / 2, p.at("width") / 2);
    };
    r.push_back({ringInfo("ring", "finger ring", 10, 1, 3), makeRing});
    r.push_back({ringInfo("bracelet", "bracelet", 32, 2.5, 9), makeRing});
    r.push_back({{"tile",
                  true,
                  "rounded tile around the origin; its flat top is decorated",
                  {{"width", 100, "size along x"},
                   {"depth", 100, "size along y"},
                   {"height", 8, "thickness"},
                   {"rounding", 2, "radius of the edges"}}},
                 [](const ShapeParameters& p) {
                     const Vec3 half(p.at("width") / 2, p.at("depth") / 2, p.at("height") / 2);
                     if (p.at("rounding") >= half.min())
                         throw InputError("a tile's rounding must be less than half its smallest side");
                     return tile(half, p.at("rounding"));
                 }});
    return r;
}

}  // namespace pavel
