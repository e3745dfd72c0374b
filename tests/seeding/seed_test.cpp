#include "pavel/seeding/seed.h"

#include "pavel/core/error.h"
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
    scene.seeding.coverage = 1.4;
    scene.seeding.iterations = 5;
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
    scene.seeding.count = 200;
    scene.seeding.iterations = 0;
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
    scene.seeding.method = "manual";
    PlacementOptions p;
    p.position = Vec3(60, 0, 0);
    p.rotation = 30;
    p.element = "b";
    RunContext context;
    const std::vector<ElementKind> kinds = {pearl("a", 4, 1), pearl("b", 3, 1)};
    SeedSet set = makeSeeds(makeShape("sphere"), kinds, scene, {p}, context);
    EXPECT_NEAR(set.seeds[0].position[0], 40, 0.02);
    EXPECT_EQ(set.seeds[0].kind, 1);
    scene.seeding.snap = false;
    set = makeSeeds(makeShape("sphere"), kinds, scene, {p}, context);
    EXPECT_EQ(set.seeds[0].position[0], 60);
}

TEST(Seeds, BadRegionAndCoverage) {
    Scene scene;
    scene.seeding.coverage = 1;
    scene.seeding.region = "lid";
    RunContext context;
    EXPECT_THROW(makeSeeds(makeShape("vase"), {pearl("a", 4, 1)}, scene, {}, context), InputError);
    scene.seeding.region = "";
    EXPECT_THROW(makeSeeds(makeShape("ring"), {pearl("a", 400, 1)}, scene, {}, context), InputError);
}

}  // namespace
}  // namespace pavel
