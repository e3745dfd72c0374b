#include "pavel/seeding/seed.h"

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "support/meshes.h"

namespace pavel {
namespace {

ElementKind pearl(const std::string& name, double radius, double weight) {
    ElementKind k;
    k.name = name;
    k.mesh = makeShape("pearl", {{"radius", radius}});
    k.weight = weight;
    k.footprint = footprintArea(k.mesh);
    return k;
}

TEST(Seeds, CoverageSetsTheCount) {
    Scene scene;
    scene.seedings[0].coverage = 1.4;
    scene.seedings[0].iterations = 5;
    RunContext context;
    const TriangleMesh base = makeShape("sphere");
    const std::vector<ElementKind> kinds = {pearl("a", 4, 3), pearl("b", 3, 1)};
    const SeedSet set = makeSeeds(base, kinds, scene, {}, context);
    EXPECT_NEAR(double(set.seeds.size()), 1.4 * meshArea(base) / (kPi * (0.75 * 16 + 0.25 * 9)), 1.5);
    size_t first = 0;
    for (size_t i = 0; i < set.seeds.size(); ++i) {
        EXPECT_EQ(set.seeds[i].id, int(i) + 1);
        first += set.seeds[i].kind == 0;
        EXPECT_NEAR(length(set.seeds[i].position), 40, 0.02);
        EXPECT_GT(dot(set.seeds[i].normal, normalized(set.seeds[i].position)), 0.999);
    }
    const double share = double(first) / double(set.seeds.size()), n = double(set.seeds.size());
    EXPECT_NEAR(share, 0.75, 4 * std::sqrt(0.75 * 0.25 / n));
}

TEST(Seeds, SizeVariationAndRotation) {
    Scene scene;
    scene.seedings[0].count = 200;
    scene.seedings[0].iterations = 0;
    scene.sizeVariation = 0.1;
    RunContext context;
    const SeedSet set = makeSeeds(makeShape("sphere"), {pearl("a", 4, 1)}, scene, {}, context);
    double lo = 2, hi = 0, turn = 0;
    for (const Seed& s : set.seeds)
        lo = std::min(lo, s.scale), hi = std::max(hi, s.scale), turn = std::max(turn, s.rotation);
    EXPECT_GE(lo, 0.9);
    EXPECT_LT(lo, 0.92);
    EXPECT_LE(hi, 1.1);
    EXPECT_GT(hi, 1.08);
    EXPECT_GT(turn, 340);
    EXPECT_LT(turn, 360);
}

TEST(Seeds, ManualPlacementsSnap) {
    Scene scene;
    scene.seedings[0].method = "manual";
    PlacementOptions p;
    p.position = Vec3(60, 0, 0);
    p.rotation = 30;
    p.element = "b";
    RunContext context;
    const std::vector<ElementKind> kinds = {pearl("a", 4, 1), pearl("b", 3, 1)};
    SeedSet set = makeSeeds(makeShape("sphere"), kinds, scene, {{{p}, {}}}, context);
    EXPECT_NEAR(set.seeds[0].position[0], 40, 0.02);
    EXPECT_EQ(set.seeds[0].kind, 1);
    scene.seedings[0].snap = false;
    set = makeSeeds(makeShape("sphere"), kinds, scene, {{{p}, {}}}, context);
    EXPECT_EQ(set.seeds[0].position[0], 60);
}

TEST(Seeds, RegionsWithKindsOfTheirOwn) {
    Scene scene;
    scene.seedings.resize(3);
    scene.seedings[0].coverage = 1.3;
    scene.seedings[0].region.height = {-100, 0};
    scene.seedings[0].elements = {"a"};
    scene.seedings[1].coverage = 1.1;
    scene.seedings[1].region.height = {0, 100};
    scene.seedings[1].region.box = Bounds{{0, -100, -100}, {100, 100, 100}};
    scene.seedings[1].elements = {"b"};
    scene.seedings[2].count = 7;
    scene.seedings[2].region.sphere = RegionOptions::Ball{{-40, 0, 30}, 20};
    RunContext context;
    const TriangleMesh base = makeShape("sphere");  // radius 40
    const std::vector<ElementKind> kinds = {pearl("a", 3, 1), pearl("b", 4, 1)};
    const SeedSet set = makeSeeds(base, kinds, scene, {}, context);
    size_t below = 0, quarter = 0, ball = 0;
    double nearest = 1e9;
    for (size_t i = 0; i < set.seeds.size(); ++i) {
        const Seed& s = set.seeds[i];
        EXPECT_EQ(s.id, int(i) + 1);
        EXPECT_NEAR(length(s.position), 40, 0.02);
        if (s.position[2] < 0) {
            ++below;
            EXPECT_EQ(s.kind, 0);
        } else if (s.position[0] > 0) {
            ++quarter;
            EXPECT_EQ(s.kind, 1);
        } else {
            ++ball;
            EXPECT_LT(length(s.position - Vec3(-40, 0, 30)), 20.5);
        }
        for (size_t j = 0; j < i; ++j) nearest = std::min(nearest, length(s.position - set.seeds[j].position));
    }
    const double area = 4 * kPi * 40 * 40;
    EXPECT_NEAR(double(below), 1.3 * area / 2 / (kPi * 9), 8);
    EXPECT_NEAR(double(quarter), 1.1 * area / 4 / (kPi * 16), 4);
    EXPECT_EQ(ball, 7u);
    EXPECT_GT(nearest, 2.5);  // borders are no exception: neighbours are about 4.6 apart
    scene.seedings[2].region.sphere->center = Vec3(0, 0, 200);
    EXPECT_THROW(makeSeeds(base, kinds, scene, {}, context), InputError);
}

TEST(Seeds, AlternatingKindsAndTurnsDifferFromTheirNeighbours) {
    Scene scene;
    scene.seedings[0].count = 300;
    scene.seedings[0].iterations = 20;
    scene.assignment = "alternate";
    scene.orientation.rotation = "alternate";
    scene.orientation.angle = 30;
    RunContext context;
    const std::vector<ElementKind> kinds = {pearl("a", 4, 1), pearl("b", 4, 1), pearl("c", 4, 1), pearl("d", 4, 0)};
    const auto sameAsNearest = [](const SeedSet& set) {
        double same = 0;
        for (const Seed& s : set.seeds) {
            const Seed* nearest = nullptr;
            for (const Seed& t : set.seeds)
                if (t.id != s.id &&
                    (!nearest || length(t.position - s.position) < length(nearest->position - s.position)))
                    nearest = &t;
            same += nearest->kind == s.kind;
        }
        return same / double(set.seeds.size());
    };
    SeedSet set = makeSeeds(makeShape("sphere"), kinds, scene, {}, context);
    EXPECT_LT(sameAsNearest(set), 0.15);  // by chance a third
    int count[4] = {}, turned = 0;
    for (const Seed& s : set.seeds) {
        ++count[s.kind];
        turned += s.rotation > 180;
        EXPECT_TRUE(s.rotation == 30 || s.rotation == 210);
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(count[k], 100, 15);
    EXPECT_EQ(count[3], 0);  // it has no weight
    EXPECT_NEAR(turned, 150, 15);
    scene.assignment = "random";
    EXPECT_GT(sameAsNearest(makeSeeds(makeShape("sphere"), kinds, scene, {}, context)), 0.2);
    scene.assignment = "sequence";
    set = makeSeeds(makeShape("sphere"), kinds, scene, {}, context);
    for (size_t i = 0; i < set.seeds.size(); ++i) EXPECT_EQ(set.seeds[i].kind, int(i % 4));
}

TEST(Seeds, OffsetSamplingMapsBackAndLeavesOutWhatHasNoFoot) {
    // Two balls, 4 apart: at an offset of 6 their offset surfaces merge.
    TriangleMesh base = test::sphere(20, {-22, 0, 0});
    append(base, test::sphere(20, {22, 0, 0}));
    TriangleMesh above = test::sphere(26, {-22, 0, 0});
    append(above, test::sphere(26, {22, 0, 0}));
    std::vector<Triangle> outside;
    for (const Triangle& t : above.triangles) {
        const Vec3 p = above.points[size_t(t[0])];
        if (std::min(length(p - Vec3(-22, 0, 0)), length(p - Vec3(22, 0, 0))) > 25.9) outside.push_back(t);
    }
    above.triangles = outside;
    removeUnusedVertices(above);
    Scene scene;
    scene.seedings[0].count = 200;
    scene.seedings[0].offset = 6;
    RunContext context;
    const SeedSet set = makeSeeds(base, {pearl("a", 4, 1)}, scene, {{{}, above}}, context);
    EXPECT_GT(set.seeds.size(), 180u);
    for (const Seed& s : set.seeds) {
        const Vec3 c(s.position[0] < 0 ? -22 : 22, 0, 0);
        EXPECT_NEAR(length(s.position - c), 20, 0.02);
        // The offset surfaces meet in the plane between, 22 from each middle of 26: no foot lies beyond.
        EXPECT_LT((s.position[0] < 0 ? 1 : -1) * (s.position[0] - c[0]), 20 * 22 / 26.0 + 0.5);
    }
}

TEST(Sections, OfABallAndATorus) {
    const TriangleMesh ball = test::sphere(10, {1, 2, 3});
    EXPECT_NEAR(sectionArea(ball, 3.01), kPi * 100, 0.3);
    EXPECT_NEAR(sectionArea(ball, 9), kPi * (100 - 36), 0.3);
    EXPECT_EQ(sectionArea(ball, 14), 0);
    EXPECT_NEAR(widestHeight(ball), 3, 0.2);
}

TEST(Seeds, BadRegionAndCoverage) {
    Scene scene;
    scene.seedings[0].coverage = 1;
    scene.seedings[0].region.part = "lid";
    RunContext context;
    EXPECT_THROW(makeSeeds(makeShape("vase"), {pearl("a", 4, 1)}, scene, {}, context), InputError);
    scene.seedings[0].region.part = "";
    EXPECT_THROW(makeSeeds(makeShape("ring"), {pearl("a", 400, 1)}, scene, {}, context), InputError);
}

}  // namespace
}  // namespace pavel
