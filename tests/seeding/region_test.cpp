#include <cmath>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/shapes.h"
#include "pavel/seeding/decorated_surface.h"
#include "pavel/seeding/seed.h"
#include "support/meshes.h"

namespace pavel {
namespace {

ElementKind pearl(double radius) {
    ElementKind k;
    k.name = "pearl";
    k.mesh = makeShape("pearl", {{"radius", radius}});
    k.footprint = footprintArea(k.mesh);
    return k;
}

double areaOf(const TriangleMesh& base, const RegionOptions& region, const SurfaceMap* mask = nullptr) {
    SeedingOptions s;
    s.region = region;
    return meshArea(decoratedSurface(base, s, 1, mask));
}

TEST(Region, PlanesCutExactly) {
    const TriangleMesh square = test::square(10, 7);  // its edges do not lie on the border
    RegionOptions r;
    r.box = Bounds{{1.3, 2.1, -1}, {6.8, 9.25, 1}};
    EXPECT_NEAR(areaOf(square, r), 5.5 * 7.15, 1e-9);
    const TriangleMesh cube = test::box({0, 0, 0}, {10, 10, 10});
    RegionOptions band;
    band.height = {2.5, 3.25};
    EXPECT_NEAR(areaOf(cube, band), 40 * 0.75, 1e-9);
}

TEST(Region, RoundBordersAreFollowed) {
    const TriangleMesh square = test::square(20, 3);
    RegionOptions ball;
    ball.sphere = RegionOptions::Ball{{10, 10, 3}, 5};
    EXPECT_NEAR(areaOf(square, ball) / (kPi * 16), 1, 1e-3);
    RegionOptions curve;
    curve.curve.emplace();
    curve.curve->lines = {{{5, 10, 0}, {15, 10, 0}}};
    curve.curve->distance = 2;
    EXPECT_NEAR(areaOf(square, curve) / (40 + kPi * 4), 1, 1e-3);
}

TEST(Region, MaskIsCutWhereItPassesOneHalf) {
    const TriangleMesh square = test::square(10, 5);
    std::vector<double> values;
    for (const Vec3& p : square.points) values.push_back(p[0] / 10);
    const SurfaceMap map(square, values);
    RegionOptions r;
    r.mask = "painted";
    EXPECT_NEAR(areaOf(square, r, &map), 50, 1e-9);
    EXPECT_THROW(areaOf(square, r), InputError);
    // Both sides of a sheet keep their own values.
    TriangleMesh plate = test::box({0, 0, 0}, {10, 10, 0.1});
    std::vector<double> above;
    for (const Vec3& p : plate.points) above.push_back(p[2] > 0.05);
    subdivideLongEdges(plate, 1);
    const SurfaceMap top(test::box({0, 0, 0}, {10, 10, 0.1}), above);
    EXPECT_NEAR(areaOf(plate, r, &top), 100 + 40 * 0.05, 1e-6);
}

TEST(Region, NeighbouringRegionsKeepTheirDistance) {
    Scene scene;
    scene.seedings.resize(2);
    scene.seedings[0].count = 100;
    scene.seedings[0].region.height = {-100, 3};
    scene.seedings[1].count = 90;
    scene.seedings[1].region.height = {3, 100};
    RunContext context;
    const SeedSet set = makeSeeds(makeShape("sphere"), {pearl(3)}, scene, {}, context);
    double least = 1e9;
    for (const Seed& a : set.seeds)
        for (const Seed& b : set.seeds)
            if (a.id < b.id) least = std::min(least, length(a.position - b.position));
    EXPECT_GT(least, 0.6 * std::sqrt(set.decoratedArea / 190));
    EXPECT_NEAR(set.decoratedArea / (4 * kPi * 1600), 1, 2e-3);
}

TEST(Density, SeedsFollowItAndKeepTheCoverage) {
    Scene scene;
    scene.seedings[0].coverage = 1.3;
    scene.seedings[0].density = DensityOptions{"x", 1, 3, true};
    const TriangleMesh square = test::square(100, 50);
    std::vector<double> values;
    for (const Vec3& p : square.points) values.push_back(p[0] < 50 ? 0 : 1);
    std::vector<SeedingInput> inputs(1);
    inputs[0].density = std::make_shared<SurfaceMap>(square, values);
    RunContext context;
    for (bool resize : {true, false}) {
        scene.seedings[0].density->resize = resize;
        const SeedSet set = makeSeeds(square, {pearl(2)}, scene, inputs, context);
        double sparse = 0, dense = 0;
        for (const Seed& s : set.seeds) {
            (s.position[0] < 49 ? sparse : dense) += 1;
            const double scale = s.position[0] < 48 ? std::sqrt(2) : std::sqrt(2.0 / 3);
            if (std::abs(s.position[0] - 49) > 1.5) {
                EXPECT_NEAR(s.scale, resize ? scale : 1, 0.02);
            }
        }
        EXPECT_NEAR(dense / 51 / (sparse / 49), 3, 0.2);
        EXPECT_NEAR(set.coverage, 1.3, 0.02);
    }
}

TEST(Rotation, FollowsTheField) {
    Scene scene;
    scene.seedings[0].count = 60;
    scene.seedings[0].field.type = "around";
    scene.orientation.rotation = "field";
    scene.orientation.angle = 15;
    RunContext context;
    const SeedSet set = makeSeeds(makeShape("sphere"), {pearl(2)}, scene, {}, context);
    for (const Seed& s : set.seeds) {
        EXPECT_DOUBLE_EQ(s.rotation, 15);
        EXPECT_NEAR(dot(s.tangent, s.normal), 0, 1e-9);
        if (std::abs(s.position[2]) < 35) {
            EXPECT_GT(dot(s.tangent, normalized({-s.position[1], s.position[0], 0})), 0.99);
        }
    }
}

TEST(Coverage, IsReachedWithMixedKindsAndSizes) {
    Scene scene;
    scene.sizeVariation = 0.1;
    RunContext context;
    std::vector<ElementKind> kinds = {pearl(2), pearl(3), pearl(4)};
    kinds[0].weight = 3;
    for (double coverage : {1.2, 1.5}) {
        scene.seedings[0].coverage = coverage;
        scene.seedings[0].iterations = 5;
        const SeedSet set = makeSeeds(makeShape("vase"), kinds, scene, {}, context);
        EXPECT_NEAR(set.coverage / coverage, 1, 5e-3);
    }
}

TEST(Walk, FollowsStraightestGeodesicsOfASphereAndSlidesAlongBorders) {
    const Surface sphere(test::sphere(10, {0, 0, 0}, 96));
    const SurfacePoint start = sphere.closest({10, 0, 0.03});
    const SurfacePoint end = sphere.walked(start, 10 * kPi / 2 * normalized({0, 1, 1}));
    EXPECT_LT(length(end.position - 10.0 * normalized({0, 1, 1})), 0.1);
    EXPECT_LT(sphere.closest(end.position).distance, 1e-9);
    const Surface square(test::square(1, 4));
    const SurfacePoint border = square.walked(square.closest({0.5, 0.6, 0}), {0.2, 0.9, 0});
    EXPECT_NEAR(border.position[1], 1, 1e-9);
    EXPECT_NEAR(border.position[0], 0.7, 1e-9);
}

}  // namespace
}  // namespace pavel
