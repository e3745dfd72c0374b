#include "pavel/seeding/refine.h"

#include <algorithm>
#include <cmath>

#include "pavel/core/footprint.h"
#include "pavel/core/shapes.h"
#include "pavel/seeding/seed.h"
#include "support/meshes.h"

namespace pavel {
namespace {

ElementKind kindOf(const char* shape) {
    ElementKind k;
    k.name = shape;
    k.mesh = makeShape(shape);
    k.footprint = footprintArea(k.mesh);
    return k;
}

TEST(Footprint, CoversWhatIsUnderTheShape) {
    // An L of 2 x 2 and 1 x 1 with a hole between two boxes beside it.
    TriangleMesh m = test::box({0, 0, 0}, {2, 2, 1});
    append(m, test::box({2, 0, 3}, {3, 1, 4}));
    append(m, test::box({5, 0, 0}, {6, 1, 1}));
    const Footprint f(m);
    EXPECT_NEAR(f.area(), 6, 0.02);
    EXPECT_TRUE(f.covers(1, 1.9));
    EXPECT_TRUE(f.covers(2.5, 0.5));
    EXPECT_FALSE(f.covers(2.5, 1.5));
    EXPECT_FALSE(f.covers(4, 0.5));
    EXPECT_TRUE(f.covers(5.5, 0.5));
    EXPECT_FALSE(f.covers(-0.1, 1));
    EXPECT_FALSE(f.covers(1, 2.1));
    EXPECT_NEAR(f.radius(), std::hypot(6, 1), 1e-9);
}

TEST(Cover, OfASquareLatticeOfDiscs) {
    // Discs of radius r at distance d: 1 - pi r^2 / d^2 uncovered where they do not touch.
    const ElementKind pearl = kindOf("pearl");
    const double r = std::sqrt(pearl.footprint / kPi), d = 2.5 * r;
    const Surface square(test::square(20 * d, 40));
    std::vector<Seed> seeds;
    for (int i = 0; i < 20; ++i)
        for (int j = 0; j < 20; ++j) {
            Seed s;
            s.position = Vec3((i + 0.5) * d, (j + 0.5) * d, 0);
            seeds.push_back(s);
        }
    const double covered = pearl.footprint / (d * d);
    const CoverMeasure m = measureCover(square, seeds, {pearl});
    EXPECT_NEAR(m.uncovered, 1 - covered, 0.01);
    EXPECT_NEAR(m.deviation, std::sqrt(covered * (1 - covered)), 0.01);
}

class RefineKinds : public testing::TestWithParam<const char*> {};

TEST_P(RefineKinds, ClosesHolesAndEvensOverlap) {
    Scene scene;
    scene.seedings[0].coverage = 1.4;
    const ElementKind kind = kindOf(GetParam());
    const TriangleMesh base = makeShape("sphere");
    RunContext context;
    const SeedSet before = makeSeeds(base, {kind}, scene, {}, context);
    scene.refineIterations = 15;
    const SeedSet after = makeSeeds(base, {kind}, scene, {}, context);
    ASSERT_EQ(after.seeds.size(), before.seeds.size());
    const Surface surface(base);
    const CoverMeasure a = measureCover(surface, before.seeds, {kind}), b = measureCover(surface, after.seeds, {kind});
    EXPECT_LT(b.uncovered, 0.4 * a.uncovered);
    EXPECT_LT(b.deviation, 0.8 * a.deviation);
    for (size_t i = 0; i < after.seeds.size(); ++i) {
        const Seed& s = after.seeds[i];
        EXPECT_NEAR(length(s.position), 40, 0.05);
        EXPECT_NEAR(dot(s.normal, s.tangent), 0, 1e-9);
        EXPECT_EQ(s.scale, before.seeds[i].scale);
    }
}
INSTANTIATE_TEST_SUITE_P(NotRound, RefineKinds, testing::Values("bean", "leaf", "petal"));

TEST(Refine, KeepsDirectionsThatWereChosenAndStaysInItsRegion) {
    Scene scene;
    scene.seedings[0].count = 60;
    scene.seedings[0].region.height = {-10, 20};
    scene.seedings[0].field.type = "around";
    scene.orientation.rotation = "field";
    scene.refineIterations = 10;
    RunContext context;
    const SeedSet set = makeSeeds(makeShape("sphere"), {kindOf("leaf")}, scene, {}, context);
    for (const Seed& s : set.seeds) {
        EXPECT_EQ(s.rotation, 0);
        EXPECT_GT(s.position[2], -10 - 1e-6);
        EXPECT_LT(s.position[2], 20 + 1e-6);
        EXPECT_GT(dot(s.tangent, normalized({-s.position[1], s.position[0], 0})), 0.97);
    }
}

}  // namespace
}  // namespace pavel
