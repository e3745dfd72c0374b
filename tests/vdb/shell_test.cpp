// Printable parts: what is promised of their number, their joints and their backs.
#include "pavel/vdb/shell.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/shapes.h"
#include "pavel/seeding/cvt.h"
#include "pavel/vdb/extract.h"
#include "pavel/vdb/thicken.h"
#include "pavel/vdb/voxelize.h"
#include "support/elements.h"

namespace pavel {
namespace {

/// Elements of one unit on a grid of n x n that touch their four neighbours, on a plane.
ShellGraph plane(int n) {
    ShellGraph g;
    for (int x = 0; x < n; ++x)
        for (int y = 0; y < n; ++y) {
            g.id.push_back(int(g.id.size()) + 1);
            g.position.emplace_back(x + 0.5, y + 0.5, 0.5);
            g.normal.emplace_back(0, 0, 1);
            Bounds b;
            b.add({double(x), double(y), 0}), b.add({x + 1.0, y + 1.0, 1});
            g.bounds.push_back(b);
            g.volume.push_back(1);
            g.backNormals.push_back({Vec3(0, 0, 1)});
            std::vector<int> near;
            if (x > 0) near.push_back((x - 1) * n + y);
            if (y > 0) near.push_back(x * n + y - 1);
            if (y + 1 < n) near.push_back(x * n + y + 1);
            if (x + 1 < n) near.push_back((x + 1) * n + y);
            g.neighbours.push_back(near);
        }
    return g;
}

bool isConnected(const ShellGraph& g, const std::vector<int>& members) {
    std::vector<int> open{members[0]}, seen{members[0]};
    while (!open.empty()) {
        const int i = open.back();
        open.pop_back();
        for (int j : g.neighbours[size_t(i)])
            if (std::count(members.begin(), members.end(), j) && !std::count(seen.begin(), seen.end(), j))
                seen.push_back(j), open.push_back(j);
    }
    return seen.size() == members.size();
}

/// Every element once, and every part connected.
void expectPartition(const ShellGraph& g, const std::vector<std::vector<int>>& parts) {
    std::vector<int> times(g.position.size(), 0);
    for (const auto& p : parts) {
        EXPECT_TRUE(isConnected(g, p));
        for (int i : p) ++times[size_t(i)];
    }
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), long(times.size()));
}

TEST(ShellParts, AsFewAsFitTheBed) {
    const ShellGraph g = plane(12);
    ShellOptions options;
    options.bed = Vec3(20, 20, 20);
    EXPECT_EQ(shellParts(g, options).size(), 1u);
    options.bed = Vec3(7, 7, 5);
    const auto parts = shellParts(g, options);
    expectPartition(g, parts);
    EXPECT_GE(parts.size(), 4u);  // 144 / 49 is almost 3, and squares do not tile better
    EXPECT_LE(parts.size(), 7u);
    for (const auto& p : parts) {
        Bounds b;
        for (int i : p) b.add(g.bounds[size_t(i)].min), b.add(g.bounds[size_t(i)].max);
        EXPECT_TRUE(fitsBed(b, options.bed));
    }
}

TEST(ShellParts, CountedOnesAreBalanced) {
    const ShellGraph g = plane(12);
    ShellOptions options;
    options.split = "count";
    options.parts = 5;
    const auto parts = shellParts(g, options);
    expectPartition(g, parts);
    ASSERT_EQ(parts.size(), 5u);
    for (const auto& p : parts) EXPECT_NEAR(double(p.size()), 144 / 5.0, 144 / 5.0 * 0.3);
}

TEST(ShellParts, PlanesCutIntoQuarters) {
    const ShellGraph g = plane(6);
    ShellOptions options;
    options.split = "planes";
    const auto parts = shellParts(g, options);
    expectPartition(g, parts);
    ASSERT_EQ(parts.size(), 4u);
    for (const auto& p : parts) EXPECT_EQ(p.size(), 9u);
}

TEST(ShellParts, WhatCannotBeIsAnError) {
    const ShellGraph g = plane(3);
    ShellOptions options;
    options.bed = Vec3(0.5, 10, 10);
    EXPECT_THROW(checkBed(g, options.bed), InputError);
    options = ShellOptions();
    options.split = "count";
    options.parts = 10;
    EXPECT_THROW(shellParts(g, options), InputError);
}

TEST(Release, AHemisphereComesOffAndMoreDoesNot) {
    ShellGraph g;
    g.backNormals.emplace_back();
    const auto cap = [&](double lowest) {
        g.backNormals[0].clear();
        for (int i = 0; i < 40; ++i)
            for (int k = 0; k < 40; ++k) {
                const double y = lowest + (1 - lowest) * i / 39, a = 2 * kPi * k / 40, r = std::sqrt(1 - y * y);
                g.backNormals[0].emplace_back(r * std::cos(a), y, r * std::sin(a));
            }
        return releaseOf(g, {0});
    };
    const Release half = cap(0.01);
    EXPECT_TRUE(half.free());
    EXPECT_GT(half.direction[1], 0.999);
    EXPECT_FALSE(cap(-0.4).free());
    EXPECT_NEAR(cap(-0.4).undercut, 0.4 / 1.4, 0.05);
}

/// Forty pearls on a ball, packed.
struct BallScene {
    static constexpr double kRadius = 20, kVoxel = 0.5;
    TriangleMesh base = test::sphere(kRadius, {1, 2, 3}, 64);
    std::vector<ElementKind> kinds{1};
    std::vector<PlacedElement> placed;
    Packing packing;
    explicit BallScene(bool twice = false) {
        kinds[0].mesh = makeShape("pearl", {{"radius", 7}});
        kinds[0].footprint = footprintArea(kinds[0].mesh);
        CvtOptions options;
        options.iterations = 30;
        std::vector<Seed> seeds;
        for (const SurfacePoint& p : centroidalSeeds(Surface(base), 45, options)) {
            Seed s;
            s.id = int(seeds.size()) + 1;
            s.position = p.position;
            s.normal = p.normal;
            seeds.push_back(s);
        }
        if (twice) {  // the first place is taken by two
            seeds.push_back(seeds[0]);
            seeds.back().id = int(seeds.size());
        }
        placed = placeElements(seeds, kinds);
        RunContext context;
        PackOptions pack_;
        pack_.voxelSize = kVoxel;
        packing = pack(base, kinds, placed, pack_, context);
    }
};

const BallScene& ballScene() {
    static const BallScene scene;
    return scene;
}

TEST(Shell, PartsAreClosedKeepTheirDistanceAndAddUp) {
    const BallScene& s = ballScene();
    ShellOptions options;
    options.clearance = 0.4;
    options.minThickness = 0;  // so that nothing is added
    const ShellBuilder builder(s.packing, s.base, s.placed, options, 0);
    const auto parts = shellParts(builder.graph(), options);
    EXPECT_GE(parts.size(), 2u);
    std::vector<int> all;
    double sum = 0;
    for (const auto& members : parts) {
        const ShellPart part = builder.build(members);
        const MeshFacts facts = meshFacts(part.mesh);
        EXPECT_TRUE(facts.fit());
        EXPECT_EQ(facts.components, 1u);
        EXPECT_NEAR(facts.volume, part.volume, 1e-6 * facts.volume);
        double nearest = 1e9;
        for (const Vec3& p : part.mesh.points)
            nearest = std::min(nearest, length(p - Vec3(1, 2, 3)) - BallScene::kRadius);
        EXPECT_NEAR(nearest, 0.4, 0.2 * BallScene::kVoxel);
        sum += part.volume;
        for (int i : members) all.push_back(i);
    }
    std::sort(all.begin(), all.end());
    const ShellPart whole = builder.build(all);
    EXPECT_NEAR(sum, whole.volume, 1e-2 * whole.volume);  // fillets between parts are not filled
    EXPECT_FALSE(whole.release.free());
}

TEST(Shell, ThinJointsAreThickened) {
    const BallScene& s = ballScene();
    ShellOptions options;
    std::vector<int> all(s.placed.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = int(i);
    size_t before = 0;
    double volume = 0;
    for (double least : {0.0, 4.0, 6.0}) {
        options.minThickness = least;
        const ShellPart part = ShellBuilder(s.packing, s.base, s.placed, options, 0).build(all);
        EXPECT_GE(part.bonds, before);
        EXPECT_GE(part.volume, volume);
        before = part.bonds, volume = part.volume;
    }
    EXPECT_GT(before, 0u);
}

TEST(Shell, SwallowedElementsAreLeftOut) {
    const BallScene s(true);
    size_t swallowed = 0;
    for (const ElementResult& e : s.packing.elements) swallowed += e.finalVolume == 0;
    ASSERT_EQ(swallowed, 1u);
    const ShellOptions options;
    const ShellBuilder builder(s.packing, s.base, s.placed, options, 0);
    EXPECT_EQ(builder.graph().id.size(), s.placed.size() - 1);
    size_t elements = 0;
    for (const auto& members : shellParts(builder.graph(), options)) {
        const ShellPart part = builder.build(members);
        EXPECT_TRUE(meshFacts(part.mesh).fit());
        elements += part.ids.size();
    }
    EXPECT_EQ(elements, s.placed.size() - 1);
}

TEST(Shell, AClearanceThatTakesAllIsAnError) {
    const BallScene& s = ballScene();
    ShellOptions options;
    options.clearance = 15;
    EXPECT_THROW(ShellBuilder(s.packing, s.base, s.placed, options, 0), InputError);
}

openvdb::FloatTree::Ptr levelSetOf(const TriangleMesh& mesh) {
    openvdb::initialize();
    return narrowBand(mesh, 1, kResultBand)->treePtr();
}

double thicknessAt(const openvdb::FloatTree& tree, const Coord& c) {
    double inside = 0;
    for (int z = -20; z <= 20; ++z) inside += tree.getValue(c.offsetBy(0, 0, z)) < 0;
    return inside;
}

TEST(Thicken, AThinPlateGetsItsThicknessAndAThickOneIsLeftAlone) {
    size_t places = 0;
    const auto thin = levelSetOf(test::box({-30.3, -30.3, -1.2}, {30.3, 30.3, 1.3}));
    const auto thick = thickened(*thin, 4, places);
    ASSERT_TRUE(thick);
    EXPECT_GT(places, 1000u);
    EXPECT_NEAR(thicknessAt(*thick, Coord(0, 0, 0)), 8, 1.1);
    EXPECT_NEAR(thicknessAt(*thick, Coord(20, -15, 0)), 8, 1.1);
    const auto solid = levelSetOf(test::box({-30.3, -30.3, -10.2}, {30.3, 30.3, 10.3}));
    EXPECT_FALSE(thickened(*solid, 4, places));  // its edges are sharp, but not thin
    EXPECT_EQ(places, 0u);
}

}  // namespace
}  // namespace pavel
