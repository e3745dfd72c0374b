#include "pavel/core/shapes.h"

#include <fstream>
#include <sstream>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/union_find.h"
#include "support/meshes.h"

namespace pavel {
namespace {

class EveryShape : public testing::TestWithParam<std::string> {};

TEST_P(EveryShape, IsAClosedOutwardSolid) {
    const MeshFacts f = meshFacts(makeShape(GetParam()));
    EXPECT_TRUE(f.fit());
    EXPECT_EQ(f.degenerateTriangles, 0u);
    EXPECT_EQ(f.unusedVertices, 0u);
    EXPECT_EQ(f.doubledVertices, 0u);
}

std::vector<std::string> shapeNames() {
    std::vector<std::string> names;
    for (const ShapeInfo& s : builtinShapes()) names.push_back(s.name);
    return names;
}
INSTANTIATE_TEST_SUITE_P(Builtin, EveryShape, testing::ValuesIn(shapeNames()), [](const auto& i) { return i.param; });

// Closed forms, or values by voxel integration of the same formulas (within 1 %).
struct ElementFacts {
    const char* name;
    double footprint, height, volume;
};
class ElementShape : public testing::TestWithParam<ElementFacts> {};

TEST_P(ElementShape, HasItsFootprintAndVolume) {
    const auto [name, footprint, height, volume] = GetParam();
    const TriangleMesh m = makeShape(name);
    EXPECT_NEAR(footprintArea(m) / footprint, 1, 0.01);
    EXPECT_NEAR(meshVolume(m) / volume, 1, 0.01);
    EXPECT_NEAR(meshBounds(m).max[2] / height, 1, 0.03);
}
INSTANTIATE_TEST_SUITE_P(Table, ElementShape,
                         testing::Values(ElementFacts{"pearl", 50.265, 7.2, 268.08},
                                         ElementFacts{"disc", 50.265, 2.4, 106}, ElementFacts{"petal", 53.3, 3.0, 59.6},
                                         ElementFacts{"leaf", 73.5, 2.3, 70.9}, ElementFacts{"scale", 68.5, 3.45, 80.6},
                                         ElementFacts{"bean", 31.416, 4, 83.78}, ElementFacts{"rice", 17.4, 2.2, 28.1},
                                         ElementFacts{"torus", 48.38, 2.2, 83.6},
                                         ElementFacts{"rose_petal", 123, 2.65, 112},
                                         ElementFacts{"pebble", 70.8, 5.2, 249}),
                         [](const auto& i) { return std::string(i.param.name); });

struct BaseFacts {
    const char* name;
    double area, volume, outer;
};
class VesselShape : public testing::TestWithParam<BaseFacts> {};

TEST_P(VesselShape, HasItsAreasAndVolume) {
    const auto [name, area, volume, outer] = GetParam();
    const TriangleMesh m = makeShape(name);
    EXPECT_NEAR(meshArea(m) / area, 1, 2e-3);
    EXPECT_NEAR(meshVolume(m) / volume, 1, 2e-3);
    EXPECT_NEAR(meshArea(groupSubmesh(m, "outer")) / outer, 1, 2e-3);
}
INSTANTIATE_TEST_SUITE_P(Table, VesselShape,
                         testing::Values(BaseFacts{"vase", 112030, 227930, 55672},
                                         BaseFacts{"bottle", 83358, 150510, 40576},
                                         BaseFacts{"glass", 41499, 54185, 19295}, BaseFacts{"tile", 22481, 79297, 9216},
                                         BaseFacts{"sphere", 20106, 268083, 20106}),
                         [](const auto& i) { return std::string(i.param.name); });

TEST(Shapes, HeightScalesAVessel) {
    EXPECT_NEAR(
        meshVolume(makeShape("vase", {{"height", 90}, {"wall", 2}, {"floor", 3}})) * 8 / meshVolume(makeShape("vase")),
        1, 1e-6);
}

double groupArea(const TriangleMesh& m, const std::string& group) {
    return meshArea(groupSubmesh(m, group));
}

/// By solid angles (A. Jacobson et al. 2013), where the shapes themselves count crossings.
double windingNumber(const TriangleMesh& m, const Vec3& p) {
    double solidAngle = 0;
    for (size_t t = 0; t < m.triangles.size(); ++t) {
        const Vec3 a = m.corner(t, 0) - p, b = m.corner(t, 1) - p, c = m.corner(t, 2) - p;
        const double la = length(a), lb = length(b), lc = length(c);
        solidAngle += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return solidAngle / (2 * kPi);
}

class JoinedShape : public testing::TestWithParam<std::string> {};

TEST_P(JoinedShape, HidesJustTheFacesInsideOtherParts) {
    const TriangleMesh m = makeShape(GetParam());
    size_t hidden = 0, shown = 0;
    for (size_t t = 0; t < m.triangles.size(); t += 797) {
        const Vec3 middle = (m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3.0;
        // A face's own part does not reach a point before it; any other that does covers the face.
        const bool covered = windingNumber(m, middle + 1e-6 * triangleNormal(m, t)) > 0.5;
        EXPECT_EQ(m.groupNames[size_t(m.groups[t])] == "hidden", covered) << middle;
        ++(covered ? hidden : shown);
    }
    EXPECT_GT(hidden, 0u);
    EXPECT_GT(shown, hidden);
}
INSTANTIATE_TEST_SUITE_P(Sculptures, JoinedShape, testing::Values("teapot", "plague_mask", "rabbit", "pendant"),
                         [](const auto& i) { return i.param; });

TEST(Teapot, BodyHasTheVolumeOfItsCurves) {
    const TriangleMesh m = makeShape("teapot");
    EXPECT_NEAR(meshBounds(m).min[2], 0, 1e-9);
    EXPECT_NEAR(meshBounds(m).max[2], 120, 1e-9);
    UnionFind pieces(m.points.size());
    for (const Triangle& t : m.triangles)
        for (int k = 1; k < 3; ++k) pieces.join(t[0], t[size_t(k)]);
    TriangleMesh body = m;
    body.triangles.clear();
    for (const Triangle& t : m.triangles)
        if (pieces.find(t[0]) == pieces.find(0)) body.triangles.push_back(t);
    // Profile (r, z) of the body, the groove and the lid; each level section is bounded by four cubics that overshoot
    // a circle a little (0.56 for 0.5523), of the area 4 (1/2 + 3k/5 - 3k^2/20) r^2.
    const double p[][2] = {{0, 0},     {1.425, 0}, {1.5, .075},   {1.5, .15}, {1.5, .225},       {2, .45},
                           {2, .9},    {2, 1.35},  {1.75, 1.875}, {1.5, 2.4}, {1.4375, 2.53125}, {1.3375, 2.53125},
                           {1.4, 2.4}, {1.4, 2.4}, {1.3, 2.4},    {1.3, 2.4}, {1.3, 2.55},       {.4, 2.55},
                           {.2, 2.7},  {0, 2.85},  {.8, 3.15},    {0, 3.15}};
    double squares = 0;  // integral of r^2 dz
    for (size_t i = 0; i + 3 < sizeof p / sizeof p[0]; i += 3) {
        const int steps = 2000;
        for (int s = 0; s < steps; ++s) {
            const auto at = [&](double x, int k) {
                return std::pow(1 - x, 3) * p[i][k] + 3 * x * std::pow(1 - x, 2) * p[i + 1][k] +
                       3 * x * x * (1 - x) * p[i + 2][k] + x * x * x * p[i + 3][k];
            };
            const double r = at((s + 0.5) / steps, 0);
            squares += r * r * (at((s + 1.0) / steps, 1) - at(double(s) / steps, 1));
        }
    }
    const double section = 4 * (0.5 + 0.6 * 0.56 - 0.15 * 0.56 * 0.56), scale = 120 / 3.15;
    EXPECT_NEAR(meshVolume(body) / (section * squares * std::pow(scale, 3)), 1, 1e-3);
}

TEST(Teapot, MeetsATessellationFromElsewhere) {
    PAVEL_NEED_MESH(path, "teapot_utah.obj");
    const TriangleMesh m = makeShape("teapot");
    std::ifstream file(path);
    Bounds theirs;
    size_t number = 0;
    for (std::string line; std::getline(file, line);) {
        if (line.compare(0, 2, "v ") != 0) continue;
        std::istringstream words(line.substr(2));
        double x = 0, up = 0, toward = 0;
        words >> x >> up >> toward;
        const Vec3 p = 120 / 3.15 * Vec3(x, -toward, up);
        theirs.add(p);
        if (number++ % 41) continue;
        double nearest = 1e300;
        for (size_t t = 0; t < m.triangles.size(); ++t)
            nearest = std::min(nearest,
                               length(p - closestPointOnTriangle(p, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2))));
        EXPECT_LT(nearest, 0.08) << p;
    }
    EXPECT_EQ(number, 3644u);
    const Bounds ours = meshBounds(m);
    EXPECT_LT(length(ours.min - theirs.min), 0.3);
    EXPECT_LT(length(ours.max - theirs.max), 0.3);
}

TEST(Teapot, HasPartsByName) {
    const TriangleMesh m = makeShape("teapot", {{"height", 60}});
    const TriangleMesh knob = groupSubmesh(m, "knob");
    EXPECT_NEAR(meshBounds(knob).min[2], 60 * 2.7 / 3.15, 1e-9);
    EXPECT_NEAR(meshBounds(knob).max[2], 60, 1e-9);
    EXPECT_LT(meshBounds(groupSubmesh(m, "handle")).max[0], -60 * 1.5 / 3.15);
    EXPECT_GT(meshBounds(groupSubmesh(m, "spout")).min[0], 60 * 1.7 / 3.15);
    EXPECT_NEAR(meshBounds(groupSubmesh(m, "outer")).min[2], 60 * 0.15 / 3.15, 1e-9);
}

double maskHeight(double x, double y) {
    return 55 * std::sqrt(std::max(0.0, 1 - std::pow(x / 75, 2) - std::pow(y / 100, 2))) +
           30 * std::exp(-std::pow(x / 12, 2) - std::pow((y + 8) / 28, 2));
}
/// Below 1 in the eye holes.
double eyeDistance(double x, double y) {
    return std::pow((std::abs(x) - 32) / 18, 2) + std::pow((y - 25) / 10, 2);
}

TEST(Mask, FaceIsTheFormulasSheet) {
    const TriangleMesh face = groupSubmesh(makeShape("mask"), "outer");
    for (const Vec3& p : face.points) {
        ASSERT_NEAR(p[2], maskHeight(p[0], p[1]), 1e-6);
        ASSERT_GT(p[2], 5 - 1e-6);
        ASSERT_GT(eyeDistance(p[0], p[1]), 1 - 1e-6);
    }
    const auto loops = boundaryLoops(face);
    ASSERT_EQ(loops.size(), 3u);
    for (const auto& loop : loops) {
        double least = 1e300, most = 0;
        for (size_t i = 0; i < loop.size(); ++i) {
            const Vec3 p = face.points[size_t(loop[i])], next = face.points[size_t(loop[(i + 1) % loop.size()])];
            EXPECT_LT(std::min(std::abs(p[2] - 5), std::abs(eyeDistance(p[0], p[1]) - 1)), 1e-6) << p;
            least = std::min(least, length(next - p));
            most = std::max(most, length(next - p));
        }
        EXPECT_LT(most / least, 2.5);
    }
    // The sheet's area by a fine grid of polar angles of its ellipsoid.
    double area = 0;
    const int n = 1500;
    const auto at = [&](double i, double j) {
        const double angle = kPi / 2 * i / n, around = kPi / 2 * (j / n - 0.5) * 2;  // the half with x > 0
        const double x = 75 * std::sin(angle) * std::cos(around), y = 100 * std::sin(angle) * std::sin(around);
        return Vec3(x, y, maskHeight(x, y));
    };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const Vec3 p = at(i + 0.5, j + 0.5);
            if (p[2] < 5 || eyeDistance(p[0], p[1]) < 1) continue;
            area += 2 * length(cross(at(i + 1, j + 0.5) - at(i, j + 0.5), at(i + 0.5, j + 1) - at(i + 0.5, j)));
        }
    EXPECT_NEAR(meshArea(face) / area, 1, 2e-3);
}

class MaskWall : public testing::TestWithParam<double> {};

TEST_P(MaskWall, IsNowhereThinner) {
    const double thickness = GetParam();
    const TriangleMesh m = makeShape("mask", {{"thickness", thickness}});
    EXPECT_TRUE(meshFacts(m).fit());
    EXPECT_EQ(meshFacts(m).euler, -2);  // a disc with two holes, doubled
    const size_t sheet = groupSubmesh(m, "outer").points.size();
    double most = 0;
    size_t plain = 0, looked = 0;
    for (size_t v = sheet; v < 2 * sheet; v += 53) {
        double nearest = 1e300;
        for (size_t k = 0; k < sheet; ++k) nearest = std::min(nearest, length(m.points[v] - m.points[k]));
        EXPECT_GT(nearest, thickness * (1 - 1e-9));
        most = std::max(most, nearest);
        plain += nearest < 1.001 * thickness;
        ++looked;
    }
    EXPECT_LT(most, 1.2 * thickness);
    EXPECT_GT(double(plain), 0.9 * double(looked));
}
INSTANTIATE_TEST_SUITE_P(Thicknesses, MaskWall, testing::Values(1.0, 3.0, 6.0));

TEST(PlagueMask, BeakTapersAlongItsCurveAndStaysInFront) {
    const TriangleMesh m = makeShape("plague_mask"), beak = groupSubmesh(m, "beak");
    const double c[4][2] = {{-5, 50}, {-10, 110}, {-50, 150}, {-100, 160}};
    for (size_t v = 0; v < beak.points.size(); v += 7) {
        const Vec3& p = beak.points[v];
        double nearest = 1e300, share = 0;
        for (int i = 0; i <= 3000; ++i) {
            const double s = i / 3000.0, q = 1 - s;
            const auto at = [&](int k) {
                return q * q * q * c[0][k] + 3 * q * q * s * c[1][k] + 3 * q * s * s * c[2][k] + s * s * s * c[3][k];
            };
            const double d = length(p - Vec3(0, at(0), at(1)));
            if (d < nearest) nearest = d, share = s;
        }
        if (share < 1)
            EXPECT_NEAR(nearest, 22 - 19 * share, 0.01) << p;
        else  // the tip's ball touches the flank a little before the curve's end
            EXPECT_NEAR(nearest, 2.8, 0.21) << p;
    }
    EXPECT_NEAR(meshBounds(beak).min[1], -100 - 3, 1);
    // The beak hides a piece of the face, and none of the back.
    const TriangleMesh face = makeShape("mask");
    EXPECT_NEAR(groupArea(m, "other"), groupArea(face, "other"), 1e-6);
    EXPECT_GT(groupArea(face, "outer") - groupArea(m, "outer"), kPi * 22 * 22);
}

TEST(Rabbit, SitsOnTheGroundAndIsSymmetric) {
    const TriangleMesh m = makeShape("rabbit");
    const Bounds b = meshBounds(m), eyes = meshBounds(groupSubmesh(m, "eyes"));
    EXPECT_NEAR(b.min[2], 0, 1e-9);
    EXPECT_NEAR(b.max[2], 120, 1e-9);
    EXPECT_NEAR(b.min[1], -b.max[1], 0.1);
    EXPECT_NEAR(eyes.min[1], -eyes.max[1], 0.1);
    EXPECT_NEAR(meshVolume(makeShape("rabbit", {{"height", 60}})) * 8 / meshVolume(m), 1, 1e-6);
    Vec3 middle(0, 0, 0);
    for (size_t t = 0; t < m.triangles.size(); ++t)
        middle +=
            triangleArea(m.corner(t, 0), m.corner(t, 1), m.corner(t, 2)) * (m.corner(t, 0) + m.corner(t, 1)) / 2.0;
    EXPECT_LT(std::abs(middle[1] / meshArea(m)), 0.05);
}

TEST(Pendant, HasItsFlatTopAndARoundRim) {
    const double R = 20, t = 2;
    const TriangleMesh m = makeShape("pendant", {{"radius", R}, {"thickness", t}});
    const TriangleMesh top = groupSubmesh(m, "outer");
    EXPECT_NEAR(meshArea(top) / (kPi * std::pow(R - t / 2, 2)), 1, 1e-3);
    for (const Vec3& p : top.points) EXPECT_EQ(p[2], 0);
    const Bounds b = meshBounds(m);
    EXPECT_NEAR(b.min[2], -t, 1e-9);
    EXPECT_NEAR(b.max[2], 0, 1e-9);
    EXPECT_NEAR(b.max[0], R, 0.02);
    EXPECT_NEAR(b.min[1], -R, 0.02);
    EXPECT_GT(b.max[1], R + t);
    // The disc with a half-round rim (Pappus), and the eyelet, whose wire's radius is 0.9 of the rim's.
    const double r = t / 2, flat = R - r, wire = 0.9 * r, bow = 0.14 * R;
    const double disc = kPi * flat * flat * t + kPi * r * r / 2 * 2 * kPi * (flat + 4 * r / (3 * kPi));
    EXPECT_NEAR(meshVolume(m) / (disc + 2 * kPi * kPi * bow * wire * wire), 1, 3e-3);
    EXPECT_THROW(makeShape("pendant", {{"thickness", 15}}), InputError);
}

TEST(ShapeKit, EvenSweepsHaveWellShapedTriangles) {
    const double edge = 0.5;
    const TriangleMesh m =
        sweepEvenly(edge, {{0.3, 0}, {1, 1}},
                    [](double u, double v) {
                        const double t = kPi * u, f = 2 * kPi * v;
                        return 10.0 * Vec3(std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t));
                    },
                    {"cap", "rest"});
    EXPECT_TRUE(meshFacts(m).fit());
    EXPECT_NEAR(meshVolume(m) / (4000 * kPi / 3), 1, 2e-3);
    // Archimedes: a cap's area goes with its height, here 1 - cos(0.3 pi).
    EXPECT_NEAR(groupArea(m, "cap") / (2 * kPi * 100 * (1 - std::cos(0.3 * kPi))), 1, 2e-3);
    for (size_t t = 0; t < m.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const Vec3 a = m.corner(t, k), u = m.corner(t, (k + 1) % 3) - a, v = m.corner(t, (k + 2) % 3) - a;
            EXPECT_LT(length(u), 1.5 * edge);
            EXPECT_GT(length(u), 0.6 * edge);
            EXPECT_LT(dot(u, v) / (length(u) * length(v)), std::cos(degreesToRadians(28)));
        }
}

TEST(Shapes, BadNamesAndValuesAreErrors) {
    EXPECT_THROW(makeShape("vaze"), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radios", 1}}), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radius", -1}}), InputError);
    EXPECT_THROW(makeShape("pearl", {{"radius", std::nan("")}}), InputError);
    EXPECT_THROW(makeShape("glass", {{"wall", 50}}), InputError);
    EXPECT_EQ(didYouMean("petel", {"pearl", "petal"}), " (did you mean \"petal\"?)");
    EXPECT_EQ(didYouMean("zzzzzz", {"pearl", "petal"}), "");
}

}  // namespace
}  // namespace pavel
