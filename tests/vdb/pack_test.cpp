#include "pavel/vdb/pack.h"

#include <tbb/global_control.h>

#include <map>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/rng.h"
#include "pavel/core/shapes.h"
#include "pavel/seeding/cvt.h"
#include "pavel/vdb/extract.h"
#include "pavel/vdb/packed_grids.h"
#include "support/elements.h"

namespace pavel {
namespace {

std::vector<WorkTree::Ptr> treesOf(const Packing& p) {
    return treesOf(p.grids->elements);
}

struct SmallScene {
    TriangleMesh base = test::sphere(26, {1, 2, 3}, 64);
    std::vector<ElementKind> kinds{2};
    std::vector<PlacedElement> placed;
    SmallScene() {
        kinds[0].mesh = makeShape("pearl", {{"radius", 9}});
        kinds[1].mesh = makeShape("pebble", {{"length", 20}, {"width", 17}, {"height", 14}});
        for (ElementKind& k : kinds) k.footprint = footprintArea(k.mesh);
        const Surface surface(base);
        CvtOptions options;
        options.iterations = 30;
        std::vector<Seed> seeds;
        for (const SurfacePoint& p : centroidalSeeds(surface, 64, options)) {
            Seed s;
            s.id = int(seeds.size()) + 1;
            s.kind = s.id % 2;
            s.position = p.position;
            s.normal = p.normal;
            s.rotation = 31 * s.id;
            seeds.push_back(s);
        }
        placed = placeElements(seeds, kinds);
    }
    Packing run() const {
        RunContext context;
        PackOptions options;
        options.voxelSize = 0.55;  // 33 voxels across
        options.solidWithBase = true;
        return pack(base, kinds, placed, options, context);
    }
};

const Packing& packedOnce() {
    static const Packing p = SmallScene().run();
    return p;
}

TEST(Pack, EveryElementKeepsItsVolume) {
    const Packing& p = packedOnce();
    double lost = 0, initial = 0;
    for (const ElementResult& e : p.elements) {
        EXPECT_NEAR((e.finalVolume + e.unrecoveredVolume) / e.targetVolume, 1, 2e-3) << e.id;
        EXPECT_EQ(e.unrecoveredVolume, 0) << e.id;
        EXPECT_GE(e.contacts.size(), 1u) << e.id;
        lost += e.lostVolume;
        initial += e.initialVolume;
    }
    EXPECT_GT(lost / initial, 0.05);  // else the scene tests nothing
    EXPECT_LT(lost / initial, 0.4);
}

/// The elements around the north pole, 50 voxels across.
Packing packCap(double marchAcross, int threads = 2) {
    SmallScene scene;
    std::vector<PlacedElement> cap;
    for (const PlacedElement& p : scene.placed)
        if (p.worldFromElement.origin[2] > 3 + 18) cap.push_back(p);
    for (size_t i = 0; i < cap.size(); ++i) cap[i].id = int(i) + 1;
    RunContext context;
    PackOptions options;
    options.voxelSize = 0.28;  // the thinnest is 50 voxels across: fronts march on a grid twice as coarse
    options.surface = false;
    options.marchAcross = marchAcross;
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(threads));
    return pack(scene.base, scene.kinds, cap, options, context);
}

TEST(Pack, FrontsMarchAsCoarseAsTheirWayAllows) {
    EXPECT_EQ(marchingFactor(11, 50), 1);
    EXPECT_EQ(marchingFactor(24, 50), 2);
    EXPECT_EQ(marchingFactor(40, 50), 3);  // 12 voxels across
    EXPECT_EQ(marchingFactor(400, 8.9), 2);
    EXPECT_EQ(marchingFactor(400, 9), 3);                                  // 3 voxels to the fastest growth
    EXPECT_EQ(marchingFactor(400, 9, PackOptions().marchAcross, 0.4), 2);  // more where the front goes far
    EXPECT_EQ(marchingFactor(400, 12, PackOptions().marchAcross, 1.8), 2);
    EXPECT_EQ(marchingFactor(1000, 1000), 8);
    EXPECT_EQ(marchingFactor(1000, 1000, 1e9), 1);
}

TEST(Pack, MarchingOnACoarserGridGivesTheSameShapes) {
    const Packing fast = packCap(24), plain = packCap(1e9);
    ASSERT_GE(fast.elements.size(), 6u);
    const std::vector<WorkTree::Ptr> fastTrees = treesOf(fast), plainTrees = treesOf(plain);
    uint64_t differ = 0;
    double gradient = 0;
    for (size_t i = 0; i < fast.elements.size(); ++i) {
        for (const Packing* p : {&fast, &plain}) {
            const ElementResult& e = p->elements[i];
            EXPECT_NEAR(e.finalVolume / e.targetVolume, 1, 5e-4) << e.id;
            EXPECT_EQ(e.unrecoveredVolume, 0) << e.id;
            EXPECT_EQ(meshFacts(extractElement(*p, e.id)).components, 1u) << e.id;  // neither crumbs nor bubbles
        }
        gradient = std::max(gradient, test::gradientError(*fastTrees[i]));
        const WorkReader a(*fastTrees[i]), b(*plainTrees[i]);
        CoordBBox box;
        fastTrees[i]->evalLeafBoundingBox(box);
        for (auto it = box.begin(); it; ++it) differ += (a.getValue(*it) < 0) != (b.getValue(*it) < 0);
    }
    EXPECT_LT(gradient, 0.03);
    EXPECT_LT(double(differ) / double(plain.counts.grownVoxels), 0.08);
    EXPECT_NEAR(double(fast.counts.grownVoxels) / double(plain.counts.grownVoxels), 1, 0.05);
    // No voxel lies inside two.
    std::map<Coord, int> seen;
    for (const auto& tree : fastTrees)
        for (auto it = tree->cbeginValueOn(); it; ++it)
            if (*it < -0.1) {
                EXPECT_EQ(seen[it.getCoord()]++, 0);
            }
}

TEST(Pack, CoarseGrowthDoesNotDependOnThreads) {
    const Packing one = packCap(24, 1), two = packCap(24, 2);
    const std::vector<WorkTree::Ptr> first = treesOf(one), second = treesOf(two);
    for (size_t i = 0; i < one.elements.size(); ++i) {
        EXPECT_EQ(one.elements[i].finalVolume, two.elements[i].finalVolume);
        const WorkTree &a = *first[i], &b = *second[i];
        ASSERT_TRUE(a.hasSameTopology(b));
        for (auto x = a.cbeginLeaf(), y = b.cbeginLeaf(); x; ++x, ++y)
            ASSERT_TRUE(std::equal(x->buffer().data(), x->buffer().data() + 512, y->buffer().data()));
    }
}

TEST(Pack, IdsCountTheVolumes) {
    const Packing& p = packedOnce();
    std::map<int, double> voxels;
    for (auto it = p.grids->ids->cbeginValueOn(); it; ++it) voxels[*it] += double(it.getVoxelCount());
    ASSERT_EQ(voxels.size(), p.elements.size());
    const double h3 = std::pow(p.voxelSize, 3);
    for (const ElementResult& e : p.elements) EXPECT_NEAR(voxels[e.id] * h3 / e.finalVolume, 1, 0.01);
}

TEST(Pack, NoPointInsideTwoElementsOrTheBase) {
    const Packing& p = packedOnce();
    const std::vector<WorkTree::Ptr> trees = treesOf(p);
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> base(*p.grids->base);
    for (size_t i = 0; i < p.elements.size(); ++i)
        for (auto it = trees[i]->cbeginValueOn(); it; ++it) {
            if (*it >= -0.1) continue;
            EXPECT_GT(base.getValue(it.getCoord()), -0.1);
            for (int other : p.elements[i].contacts) {
                if (other > int(i)) continue;
                EXPECT_GT(trees[size_t(other) - 1]->getValue(it.getCoord()), -0.1);
            }
        }
}

TEST(Pack, LevelSetsAreDistances) {
    const Packing& p = packedOnce();
    double sum = 0;
    for (const auto& e : treesOf(p)) sum += test::gradientError(*e);
    EXPECT_LT(sum / double(p.elements.size()), 0.03);
    EXPECT_LT(test::gradientError(*p.grids->surface), 0.05);
}

TEST(Pack, MeshesAreClosedAndHoldTheVolume) {
    const Packing& p = packedOnce();
    for (int id = 1; id <= int(p.elements.size()); ++id) {
        const MeshFacts f = meshFacts(extractElement(p, id));
        EXPECT_TRUE(f.fit());
        EXPECT_EQ(f.components, 1u);
        EXPECT_NEAR(f.volume / p.elements[size_t(id) - 1].finalVolume, 1, 0.02);
    }
    double elements = 0;
    for (const ElementResult& e : p.elements) elements += e.finalVolume;
    const LabelledMesh solid = extractFused(p, true);
    const MeshFacts f = meshFacts(solid.mesh);
    EXPECT_EQ(f.boundaryEdges, 0u);
    EXPECT_EQ(f.nonManifoldEdges, 0u);
    EXPECT_GT(f.volume, 0);
    // Fillets in the creases take nothing away and add nothing; chords of the mesh a little.
    EXPECT_NEAR(f.volume / (elements + meshVolume(SmallScene().base)), 1, 2e-3);
    EXPECT_NEAR(meshFacts(extractFused(p, false).mesh).volume / elements, 1, 4e-3);
    size_t decorated = 0;
    for (int id : solid.ids) decorated += id > 0;
    EXPECT_GT(double(decorated) / double(solid.ids.size()), 0.8);
    // At its seams the mesh is whose level set it lies on, but for the fillets.
    const std::vector<WorkTree::Ptr> trees = treesOf(p);
    size_t ofBase = 0, ofElements = 0;
    for (const SeamVertex& s : solid.seams) {
        const Vec3 at = solid.mesh.points[size_t(s.vertex)] / p.voxelSize;
        const double d = s.id == 0 ? sampleAt(*p.grids->base, at) : sampleAt(*trees[size_t(s.id) - 1], at);
        EXPECT_LT(std::abs(d), 2) << s.id;
        (s.id == 0 ? ofBase : ofElements) += 1;
    }
    EXPECT_GT(ofBase, 100u);
    EXPECT_GT(ofElements, ofBase);
}

TEST(Pack, AdaptiveMeshesAreClosedAndSmaller) {
    const Packing& p = packedOnce();
    const MeshFacts plain = meshFacts(extractFused(p, true).mesh);
    for (double adaptivity : {0.02, 0.5}) {
        const LabelledMesh adaptive = extractFused(p, true, adaptivity);
        const MeshFacts f = meshFacts(adaptive.mesh);
        EXPECT_TRUE(f.fit());
        EXPECT_EQ(f.euler, plain.euler);
        EXPECT_EQ(adaptive.ids.size(), f.triangles);
        EXPECT_LT(f.triangles, plain.triangles * 0.75);
        EXPECT_NEAR(f.volume / plain.volume, 1, 0.02);
    }
}

TEST(Pack, DoesNotDependOnThreads) {
    const SmallScene scene;
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Packing a = scene.run();
    const Packing& b = packedOnce();
    const std::vector<WorkTree::Ptr> first = treesOf(a), second = treesOf(b);
    for (size_t i = 0; i < a.elements.size(); ++i) {
        EXPECT_EQ(a.elements[i].finalVolume, b.elements[i].finalVolume);
        ASSERT_TRUE(first[i]->hasSameTopology(*second[i]));
        auto x = first[i]->cbeginValueOn(), y = second[i]->cbeginValueOn();
        for (; x; ++x, ++y) ASSERT_EQ(*x, *y);
    }
    ASSERT_TRUE(a.grids->surface->hasSameTopology(*b.grids->surface));
    auto x = a.grids->surface->cbeginValueOn(), y = b.grids->surface->cbeginValueOn();
    for (; x; ++x, ++y) ASSERT_EQ(*x, *y);
}

/// Elements of random kinds, sizes, turns and stiffness, thrown on a ball without any order.
class RandomScene : public testing::TestWithParam<uint64_t> {};

TEST_P(RandomScene, KeepsVolumesApartOnAnyNumberOfThreads) {
    Rng rng(GetParam(), 11);
    std::vector<ElementKind> kinds(4);
    kinds[0].mesh = makeShape("pearl", {{"radius", rng.uniform(4, 7)}});
    kinds[1].mesh = makeShape("bean", {{"length", rng.uniform(12, 18)}, {"thickness", rng.uniform(6, 8)}});
    kinds[2].mesh = makeShape("pebble", {{"length", 13}, {"width", 11}, {"height", rng.uniform(7, 9)}});
    kinds[3].mesh = makeShape("disc", {{"radius", rng.uniform(4, 6)}, {"height", rng.uniform(6, 8)}});
    kinds[1].stiffness = rng.uniform(0.5, 2);
    std::vector<Seed> seeds;
    for (int i = 0; i < 24; ++i) {
        Seed s;
        s.id = i + 1;
        s.normal = normalized(Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)));
        s.position = 20.0 * s.normal;
        s.tangent = anyPerpendicular(s.normal);
        s.rotation = rng.uniform(0, 360);
        s.scale = rng.uniform(0.85, 1.15);
        s.kind = int(rng.uniform(0, 4));
        seeds.push_back(s);
    }
    PackOptions options;
    options.voxelSize = 0.5;
    options.surface = false;
    options.contactByDepth = GetParam() % 2 == 0;
    options.recoverBaseLoss = GetParam() % 3 != 0;
    const TriangleMesh base = test::sphere(20, {0, 0, 0}, 64);
    Packing runs[2];
    for (int threads = 1; threads <= 2; ++threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(threads));
        RunContext context;
        runs[threads - 1] = pack(base, kinds, placeElements(seeds, kinds), options, context);
    }
    const std::vector<WorkTree::Ptr> first = treesOf(runs[0]), second = treesOf(runs[1]);
    std::map<Coord, int> seen;
    size_t twice = 0, inside = 0;
    for (size_t i = 0; i < seeds.size(); ++i) {
        const ElementResult &e = runs[0].elements[i], &f = runs[1].elements[i];
        EXPECT_EQ(e.finalVolume, f.finalVolume) << e.id;
        EXPECT_EQ(e.unrecoveredVolume, f.unrecoveredVolume) << e.id;
        // Nothing invented, nothing lost without a word.
        EXPECT_NEAR((e.finalVolume + e.unrecoveredVolume) / e.targetVolume, 1, 2e-3) << e.id;
        EXPECT_LE(e.finalVolume, e.targetVolume * 1.002) << e.id;
        const WorkTree::Ptr &a = first[i], &b = second[i];
        ASSERT_EQ(a == nullptr, b == nullptr);
        if (!a) continue;
        ASSERT_TRUE(a->hasSameTopology(*b));
        auto x = a->cbeginValueOn(), y = b->cbeginValueOn();
        for (; x; ++x, ++y) {
            ASSERT_EQ(*x, *y);
            if (*x >= -0.2f) continue;
            ++inside;
            twice += seen[x.getCoord()]++ > 0;
        }
    }
    EXPECT_LT(double(twice), 1e-4 * double(inside));
}
INSTANTIATE_TEST_SUITE_P(Seeds, RandomScene, testing::Values(1, 2, 3, 4));

/// From a voxel to the nearest place where the surface crosses an edge between two voxels: beyond sharp corners, level
/// sets may tell half a voxel less.
double wayToSurface(const WorkTree& tree, const Coord& from) {
    double nearest = 1e9;
    for (auto it = tree.cbeginValueOn(); it; ++it)
        for (int axis = 0; axis < 3; ++axis) {
            const Coord c = it.getCoord();
            const double a = *it, b = tree.getValue(c.offsetBy(axis == 0, axis == 1, axis == 2));
            if ((a < 0) == (b < 0)) continue;
            Vec3 p = centreOf(c);
            p[axis] += a / (a - b);
            nearest = std::min(nearest, length(p - centreOf(from)));
        }
    return nearest;
}

TEST(Pack, GapIsLeftEverywhere) {
    SmallScene scene;
    scene.placed.resize(20);
    RunContext context;
    PackOptions options;
    options.voxelSize = 0.55;
    options.gap = 1.3;
    const Packing p = pack(scene.base, scene.kinds, scene.placed, options, context);
    const double gap = options.gap / options.voxelSize;  // voxels
    const std::vector<WorkTree::Ptr> trees = treesOf(p);
    openvdb::tree::ValueAccessor<const openvdb::FloatTree, false> base(*p.grids->base);
    double nearest = 100;
    for (size_t i = 0; i < p.elements.size(); ++i) {
        const ElementResult& e = p.elements[i];
        EXPECT_NEAR((e.finalVolume + e.unrecoveredVolume) / e.targetVolume, 1, 2e-3) << e.id;
        EXPECT_LT(e.targetVolume, 0.99 * e.initialVolume) << e.id;  // the base's gap at least
        EXPECT_EQ(trees[i]->background(), kResultBand);
        for (auto it = trees[i]->cbeginValueOn(); it; ++it) {
            if (std::abs(*it) > 0.5) continue;
            // A surface voxel's way to the surface, and on over the gap.
            const double outside = std::max(*it, 0.f);
            EXPECT_GT(base.getValue(it.getCoord()) + outside, gap - 0.4);
            for (size_t j = 0; j < p.elements.size(); ++j) {
                if (j == i) continue;
                double d = trees[j]->getValue(it.getCoord());
                if (d + outside <= gap - 0.4) d = wayToSurface(*trees[j], it.getCoord());
                EXPECT_GT(d + outside, gap - 0.4) << i << " " << j;
                nearest = std::min(nearest, d + outside);
            }
        }
    }
    EXPECT_LT(nearest, gap + 0.3);  // and no wider than asked for
}

TEST(Pack, FlatFacesAtTheEndsOfBlocksGrowLikeOthers) {
    // Where a body's last layer of voxels ends a leaf, the front starts in leaves that know nothing of the body. The
    // faces fall towards the contact by a voxel, so that the first to start are far from all others.
    std::vector<ElementKind> kinds(1);
    kinds[0].mesh = test::box({0, 0, 0}, {44, 44, 25.5});
    const double bottom = -1.55, fall = 0.9 / 44;
    const auto topAt = [&](double x) { return 23.95 - fall * (x + 40.3); };
    std::vector<PlacedElement> placed(2);
    for (int i = 0; i < 2; ++i) {
        placed[size_t(i)].id = i + 1;
        placed[size_t(i)].worldFromElement.origin = Vec3(-40.3 + 36 * i, -20.6, bottom);
    }
    placed[0].worldFromElement.x = normalized(Vec3(1, 0, -fall));
    placed[0].worldFromElement.z = normalized(Vec3(fall, 0, 1));
    PackOptions options;
    options.voxelSize = 1;
    options.marchAcross = 1e9;  // on the result's own grid
    options.b = 0.6;
    RunContext context;
    const Packing p = pack(test::box({-80, -60, -12}, {80, 60, 0}), kinds, placed, options, context);
    const WorkTree::Ptr tree = treesOf(p)[0];
    const auto heightAt = [&](int x, int y) {
        for (int z = 35; z > 20; --z)
            if (const double in = tree->getValue(Coord(x, y, z)); in < 0) {
                const double out = tree->getValue(Coord(x, y, z + 1));
                return double(z) + in / (in - out);
            }
        return 0.0;
    };
    double most = 0;
    for (int x = -34; x < -17; ++x)
        for (int y = -14; y < 14; ++y) {
            const double height = heightAt(x, y);
            EXPECT_GT(height, topAt(x) - 0.05);
            EXPECT_LT(std::abs(heightAt(x + 1, y) - height), 0.4) << x << " " << y;
            EXPECT_LT(std::abs(heightAt(x, y + 1) - height), 0.4) << x << " " << y;
            most = std::max(most, height);
        }
    EXPECT_GT(most, topAt(-17) + 1);
}

TEST(Pack, SwallowedAndWalledInElementsAreNamed) {
    SmallScene scene;
    ElementKind tiny;
    tiny.mesh = makeShape("pearl", {{"radius", 3}});
    scene.kinds.push_back(tiny);
    scene.placed.resize(1);
    scene.placed[0].kind = 0;
    PlacedElement inside = scene.placed[0];
    inside.id = 2;
    inside.worldFromElement.origin -= 12.0 * inside.worldFromElement.z;  // wholly below the surface
    inside.kind = 2;
    scene.placed.push_back(inside);
    RunContext context;
    PackOptions options;
    options.voxelSize = 0.6;
    const Packing p = pack(scene.base, scene.kinds, scene.placed, options, context);
    EXPECT_EQ(p.elements[1].finalVolume, 0);
    EXPECT_NEAR(p.elements[1].unrecoveredVolume, p.elements[1].targetVolume, 1e-12);
    ASSERT_EQ(context.warnings.size(), 1u);
    EXPECT_NE(context.warnings[0].find("swallowed"), std::string::npos);
    EXPECT_NE(context.warnings[0].find("2"), std::string::npos);
}

TEST(Pack, CancelStopsTheRun) {
    const SmallScene scene;
    RunContext context;
    context.onProgress = [&](const std::string& stage, double) {
        if (stage == "overlap") context.cancelled = true;
    };
    PackOptions options;
    options.voxelSize = 0.55;
    EXPECT_THROW(pack(scene.base, scene.kinds, scene.placed, options, context), Interrupted);
}

}  // namespace
}  // namespace pavel
