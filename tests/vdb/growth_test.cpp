#include "pavel/vdb/grow.h"

#include <map>
#include <numeric>

#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/packed_grids.h"
#include "pavel/vdb/recovery_function.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/region_builder.h"
#include "support/elements.h"

namespace pavel {
namespace {

TEST(Redistance, MakesATrueDistanceOfADistortedOne) {
    // Right zero set, wrong slopes: f = (r - R)(1.6 + 0.5 sin 3x), cut at the band.
    constexpr double R = 22;
    const Vec3 c(0.3, 0.1, -0.2);
    WorkTree raw(kBand);
    for (auto it = CoordBBox(Coord(-32), Coord(32)).begin(); it; ++it) {
        const Vec3 p = centreOf(*it) - c;
        const double f = (length(p) - R) * (1.6 + 0.5 * std::sin(0.3 * p[0]));
        raw.setValue(*it, float(std::clamp(f, -4.0, 4.0)));
    }
    const auto tree = redistanced(raw);
    EXPECT_LT(test::gradientError(*tree), 0.02);
    double worst = 0, sum = 0;
    size_t n = 0;
    for (auto it = tree->cbeginValueOn(); it; ++it) {
        const double d = length(centreOf(it.getCoord()) - c) - R;
        worst = std::max(worst, std::abs(*it - d));
        sum += std::abs(*it - d);
        ++n;
    }
    EXPECT_LT(worst, 0.45);
    EXPECT_LT(sum / double(n), 0.03);
    EXPECT_LT(tree->getValue(Coord(0)), 0);
    EXPECT_GT(tree->getValue(Coord(100)), 0);
    EXPECT_EQ(tree->background(), kResultBand);
}

struct Pair {
    std::vector<WorkElement> elements;
    std::unique_ptr<Growth> growth;
    std::vector<WorkTree::Ptr> packed;
};

Pair grownPair(double distance, Material material) {
    Pair p;
    p.elements = test::elementsAt(test::sphere(20, {0, 0, 0}, 128), {{0.1, 0.2, 0.3}, {0.1 + distance, 0.2, 1.3}});
    test::resolve(p.elements);
    p.growth = std::make_unique<Growth>(p.elements, nullptr, std::vector<Material>{material});
    RunContext context;
    p.growth->march(context);
    p.growth->solveStopTimes({p.elements[0].placedVolume, p.elements[1].placedVolume}, 0.02, 1e-3, context);
    p.growth->catchUp();
    const RegionBuilder builder(p.elements, nullptr, p.growth->fronts());
    for (int i = 0; i < 2; ++i) p.packed.push_back(redistanced(builder.build(i)).compact().tree());
    return p;
}

class GrownPair : public testing::TestWithParam<Material> {};

TEST_P(GrownPair, RecoversVolumeDisjointWithoutGap) {
    const Pair p = grownPair(30, GetParam());
    for (int i = 0; i < 2; ++i) {
        EXPECT_FALSE(p.growth->front(i)->exhausted);
        EXPECT_NEAR(measureInside(*p.packed[size_t(i)]).volume / p.elements[size_t(i)].placedVolume, 1, 2.5e-3);
        EXPECT_LT(test::gradientError(*p.packed[size_t(i)]), 0.03);
    }
    const WorkReader a(*p.packed[0]), b(*p.packed[1]);
    for (auto it = p.packed[0]->cbeginValueOn(); it; ++it) {
        if (*it >= -0.1) continue;
        EXPECT_GT(b.getValue(it.getCoord()), -0.1);
    }
    // Across the contact disc the two surfaces are the same.
    const Vec3 middle = 0.5 * (p.elements[0].centre + p.elements[1].centre),
               n = normalized(p.elements[1].centre - p.elements[0].centre);
    const Vec3 u = anyPerpendicular(n), v = cross(n, u);
    double gap = 0;
    int count = 0;
    for (double s = -8; s <= 8; s += 1)
        for (double t = -8; t <= 8; t += 1, ++count)
            gap += std::abs(sampleAt(a, middle + s * u + t * v) + sampleAt(b, middle + s * u + t * v));
    EXPECT_LT(gap / count, 0.05);
}
INSTANTIATE_TEST_SUITE_P(Materials, GrownPair,
                         testing::Values(Material{0.05, 0.15}, Material{0.1, 0.3}, Material{0.2, 0.6}));

TEST(Growth, BulgesNearTheContactAndNowhereElse) {
    const Pair p = grownPair(30, Material{0.1, 0.3});
    const WorkElement& e = p.elements[0];
    // b = 0.3 of the diagonal (69 voxels): nothing moves 21 voxels away from the contact.
    const Vec3 away = normalized(e.centre - p.elements[1].centre);
    EXPECT_NEAR(sampleAt(WorkReader(*p.packed[0]), e.centre + 20.0 * away), 0, 0.05);
    double most = 0;
    for (auto it = p.packed[0]->cbeginValueOn(); it; ++it)
        if (*it < 0) most = std::max(most, length(centreOf(it.getCoord()) - e.centre));
    EXPECT_GT(most, 20.5);  // the collar stands out
    EXPECT_LT(most, 27);
}

TEST(Growth, TimesAreKnownOnBothSidesOfTheEndHoweverSlowTheFront) {
    const Pair p = grownPair(30, Material{0.1, 0.3});
    const Front& front = *p.growth->front(0);
    const auto hasTime = [&](const Coord& c) {
        const GrowthBlock* block = front.probe(leafOrigin(c));
        const int v = int(WorkLeaf::coordToOffset(c));
        GrowthCell spread;
        const GrowthCell* cell = block ? front.look(*block, cellOf(v), spread) : nullptr;
        return cell && cell->time[inCell(v)] < GrowthBlock::kNever;
    };
    size_t slow = 0;
    GrowthCell spread;
    for (const GrowthBlock& block : front.blocks)
        for (int k = 0; k < 512; ++k) {
            const int i = k & 63, v = GrowthBlock::voxelOf(k >> 6, i);
            const GrowthCell* cell = front.look(block, k >> 6, spread);
            if (!cell || cell->state[i] != kReal || cell->time[i] > front.stopTime) continue;
            for (int axis = 0; axis < 3; ++axis)
                for (const int way : {-2, -1, 1, 2}) {
                    Coord c = block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
                    c[axis] += way;
                    const double speed =
                        recoveryFunction((*front.element.contact)(centreOf(c)) / front.element.size, front.a, front.b);
                    // It does not go where its speed ends, nor far into what the other holds.
                    if (speed <= 0 || sampleAt(p.elements[0].placed, centreOf(c)) < 0 ||
                        sampleAt(*p.packed[1], centreOf(c)) < 1)
                        continue;
                    ASSERT_TRUE(hasTime(c)) << c;
                    slow += speed < 0.1;
                }
        }
    EXPECT_GT(slow, 50u);
}

/// Angles between the normals of faces that share an edge, degrees, sorted; of edges that `keep` takes by their middle.
template <class Keep>
std::vector<double> dihedralAngles(const TriangleMesh& mesh, Keep keep) {
    std::map<std::pair<int, int>, Vec3> seen;
    std::vector<double> angles;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 n = normalized(cross(mesh.corner(t, 1) - mesh.corner(t, 0), mesh.corner(t, 2) - mesh.corner(t, 0)));
        for (int k = 0; k < 3; ++k) {
            const int a = mesh.triangles[t][size_t(k)], b = mesh.triangles[t][size_t((k + 1) % 3)];
            if (!keep(0.5 * (mesh.points[size_t(a)] + mesh.points[size_t(b)]))) continue;
            const auto [it, isNew] = seen.emplace(std::minmax(a, b), n);
            if (!isNew) angles.push_back(std::acos(std::clamp(dot(n, it->second), -1.0, 1.0)) * 180 / kPi);
        }
    }
    std::sort(angles.begin(), angles.end());
    return angles;
}

TEST(Growth, FreeSurfaceIsAsSmoothAsAnUngrownOne) {
    const Pair p = grownPair(30, Material{0.1, 0.3});
    const WorkElement &e = p.elements[0], &other = p.elements[1];
    const Vec3 toward = normalized(other.centre - e.centre);
    const auto grown = [&](const Vec3& q) {  // the collar, away from its rim
        const double along = dot(q - e.centre, toward);
        return along > 2 && along < 11;
    };
    const auto angles = [&](const WorkTree& tree) {
        return dihedralAngles(levelSetMesh(*toFloatGrid(tree), 1), grown);
    };
    const std::vector<double> after = angles(*p.packed[0]), before = angles(*e.placed.tree());
    ASSERT_GT(after.size(), 1000u);
    const auto mean = [](const std::vector<double>& a) {
        return std::accumulate(a.begin(), a.end(), 0.0) / double(a.size());
    };
    const auto at = [](const std::vector<double>& a, double share) { return a[size_t(share * double(a.size()))]; };
    EXPECT_LT(mean(after), 1.2 * mean(before)) << mean(before);
    EXPECT_LT(at(after, 0.99), 1.5 * at(before, 0.99)) << at(before, 0.99);
}

TEST(Growth, WindowsDoNotChangeWhoGetsWhat) {
    // Seven balls around one another, so that most fronts compete.
    std::vector<Vec3> places{{0, 0, 0}};
    for (int i = 0; i < 6; ++i)
        places.emplace_back(25 * std::cos(kPi * i / 3), 25 * std::sin(kPi * i / 3), 1.5 * (i % 3));
    std::vector<std::vector<WorkTree::Ptr>> packed;
    double grownVoxels = 0;
    for (const double window : {1.5, 0.05}) {
        auto elements = test::elementsAt(test::sphere(15, {0, 0, 0}, 96), places);
        test::resolve(elements);
        Growth growth(elements, nullptr, {Material{0.1, 0.3}});
        const RunContext context;
        growth.march(context, window);
        std::vector<double> targets;
        for (const WorkElement& e : elements) targets.push_back(e.targetVolume);
        growth.solveStopTimes(targets, 0.02, 1e-3, context);
        growth.catchUp();
        grownVoxels = double(growth.grownVoxels());
        const RegionBuilder builder(elements, nullptr, growth.fronts());
        packed.emplace_back();
        for (size_t i = 0; i < elements.size(); ++i)
            packed.back().push_back(redistanced(builder.build(int(i))).compact().tree());
    }
    size_t differ = 0;
    for (size_t i = 0; i < places.size(); ++i) {
        const WorkTree &a = *packed[0][i], &b = *packed[1][i];
        EXPECT_NEAR(measureInside(a).volume / measureInside(b).volume, 1, 1e-3) << i;
        CoordBBox box;
        a.evalLeafBoundingBox(box);
        for (auto it = box.begin(); it; ++it) differ += (a.getValue(*it) < 0) != (b.getValue(*it) < 0);
    }
    EXPECT_LT(double(differ), 0.01 * grownVoxels) << grownVoxels;
}

TEST(Growth, SpheresApartDoNotChange) {
    const Pair p = grownPair(45, Material{});
    EXPECT_EQ(p.growth->front(0), nullptr);
    EXPECT_NEAR(measureInside(*p.packed[0]).volume / p.elements[0].placedVolume, 1, 1e-3);
}

TEST(Region, CountsAFilledBlockOnce) {
    Region region(CoordBBox(Coord(0), Coord(31)));
    const Coord origin(8, 0, 16);
    region.fill(origin);
    region.fill(origin);
    EXPECT_EQ(region.filledVoxels(), 512u);
    const std::vector<float> in(512, -1.f), none(512, 0.f);
    EXPECT_EQ(region.add(origin, in.data(), in.data(), none.data()), 0);
    EXPECT_EQ(region.filledVoxels(), 0u);
    EXPECT_EQ(region.at(origin), 0);
    region.fill(Coord(0));
    region.clear(Coord(0));
    EXPECT_EQ(region.filledVoxels(), 0u);
    EXPECT_EQ(region.at(Coord(0)), Region::kOutside);
}

TEST(RegionBuilder, FollowsTheSurfaceBeyondTheOutline) {
    constexpr int kFactor = 2;
    const TriangleMesh sphere = test::sphere(20, {0, 0, 0}, 128);
    auto elements = test::elementsAt(sphere, {{0.1, 0.2, 0.3}, {28.1, 0.2, 1.3}});
    test::resolve(elements);
    Growth growth(elements, nullptr, {Material{0.1, 0.3}});
    const RunContext context;
    growth.march(context);
    const double target = elements[0].placedVolume;
    growth.solveStopTimes({target, target}, 0.02, 1e-3, context);
    growth.lookBeyond();
    const CanonicalField field = makeCanonicalField(sphere, 1.0 / kFactor, 1, 1);
    FineShapes shapes(2, [&](int i) {
        Frame frame = elements[size_t(i)].indexFromElement;
        frame.origin *= double(kFactor);
        frame.scale *= kFactor;
        return std::make_unique<FineShape>(elements[size_t(i)], growth.front(i), field, frame, kFactor);
    });
    for (int i = 0; i < 2; ++i) shapes.expect(i), shapes.acquire(i);
    const Region coarse = RegionBuilder(elements, nullptr, growth.fronts()).build(0);
    const RegionBuilder builder(elements, nullptr, growth.fronts(), kFactor, &shapes);
    const auto volumeFrom = [&](double later) {
        const Region region = builder.refine(0, Outline(coarse, later, kFactor));
        return RegionMeasure(region)(0).volume;
    };
    const RegionMeasure front(coarse);
    const double right = volumeFrom(0), reach = front.frontVoxels() / front.frontSlopes();
    EXPECT_NEAR(right / (kFactor * kFactor * kFactor * target), 1, 2e-3);
    // Outlines of a front that stopped three voxels earlier and later.
    EXPECT_NEAR(volumeFrom(-3 * reach) / right, 1, 1e-5);
    EXPECT_NEAR(volumeFrom(3 * reach) / right, 1, 1e-5);
}

}  // namespace
}  // namespace pavel
