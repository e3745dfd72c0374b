#include "pavel/vdb/overlap.h"

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetSphere.h>

#include "pavel/vdb/bisector.h"
#include "support/elements.h"

namespace pavel {
namespace {

TEST(Trim, EqualSpheresLoseTheirCapsAndMeetInTheBisector) {
    constexpr double r = 24, d = 36;
    auto e =
        test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0.2, 0.1, -0.3}, {0.2 + d * 0.6, 0.1 + d * 0.8, -0.3}});
    test::resolve(e);
    for (const WorkElement& w : e) {
        EXPECT_NEAR(w.lost() / test::capVolume(r, r - d / 2), 1, 0.01);
        EXPECT_NEAR(w.bodyVolume / (test::ballVolume(r) - test::capVolume(r, r - d / 2)), 1, 2e-3);
        EXPECT_TRUE(w.strays.empty());
    }
    // On the bisector both bodies are at zero; bodies are disjoint.
    const CompactLevelSet first = trimElement(e[0], e, nullptr).compact(),
                          second = trimElement(e[1], e, nullptr).compact();
    const CompactReader a(first), b(second);
    const Vec3 middle = 0.5 * (e[0].centre + e[1].centre), n = normalized(e[1].centre - e[0].centre),
               u = anyPerpendicular(n), v = cross(n, u);
    for (double s = -10; s <= 10; s += 2.5)
        for (double t = -10; t <= 10; t += 2.5) {
            const Vec3 p = middle + s * u + t * v;
            EXPECT_NEAR(sampleAt(a, p), 0, 1e-3);
            EXPECT_NEAR(sampleAt(b, p), 0, 1e-3);
        }
    const WorkTree::Ptr tree = first.tree();
    for (auto it = tree->cbeginValueAll(); it; ++it) {
        if (!it.isVoxelValue() || *it >= 0) continue;
        EXPECT_GE(b.getValue(it.getCoord()), 0);
    }
}

TEST(Trim, AgreesWithTheVdbBooleanOperation) {
    constexpr double r = 20, d = 28;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, 0}, {d, 3, 1}});
    test::resolve(e);
    // The same cut by tools::csgDifference: the part of the other on its side of the bisector.
    const auto gridOf = [](const WorkTree& t) {
        auto g = openvdb::FloatGrid::create(kBand);
        for (auto leaf = t.cbeginLeaf(); leaf; ++leaf) g->tree().addLeaf(new WorkLeaf(*leaf));
        openvdb::tools::signedFloodFill(g->tree());
        return g;
    };
    auto own = gridOf(*e[0].placed.tree()), cutter = gridOf(*e[1].placed.tree());
    const Bisector g(e[0], e[1]);
    auto half = openvdb::FloatGrid::create(kBand);
    const CoordBBox box(Coord(-40), Coord(80));
    for (auto it = box.begin(); it; ++it) {
        const double side = -g(centreOf(*it));
        half->tree().setValue(*it, float(std::clamp(side, -double(kBand), double(kBand))));
    }
    openvdb::tools::csgIntersection(*cutter, *half);
    openvdb::tools::csgDifference(*own, *cutter);
    const CompactLevelSet trimmed = trimElement(e[0], e, nullptr).compact();
    const CompactReader body(trimmed);
    size_t compared = 0;
    for (auto it = own->cbeginValueOn(); it; ++it) {
        if (!it.isVoxelValue() || std::abs(*it) > 1.5) continue;
        EXPECT_NEAR(body.getValue(it.getCoord()), *it, 0.02);
        ++compared;
    }
    EXPECT_GT(compared, 10000u);
}

TEST(Trim, SphereOnAPlane) {
    constexpr double r = 20, sunk = 7;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, r - sunk}});
    const auto base = narrowBand(test::box({-60, -60, -30}, {60, 60, 0}), 1);
    test::resolve(e, &base->tree());
    EXPECT_NEAR(e[0].lost() / test::capVolume(r, sunk), 1, 0.01);
    EXPECT_TRUE(e[0].contacts.empty());
    // Its contact is the circle in the plane z = 0.
    ASSERT_EQ(e[0].contact->rimCount(), 1u);
    const double circle = std::sqrt(r * r - (r - sunk) * (r - sunk));
    for (const Vec3f& p : e[0].contact->rimPoints(0)) {
        EXPECT_NEAR(p[2], 0, 0.05);
        EXPECT_NEAR(std::hypot(p[0], p[1]), circle, 0.1);
    }
}

TEST(Trim, WhatSinksIntoTheBaseIsCutForGoodWhereAsked) {
    constexpr double r = 20, sunk = 7;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, r - sunk}});
    const auto base = narrowBand(test::box({-60, -60, -30}, {60, 60, 0}), 1);
    resolveOverlap(e, &base->tree(), false, RunContext());
    EXPECT_NEAR(e[0].targetVolume / (test::ballVolume(r) - test::capVolume(r, sunk)), 1, 2e-3);
    EXPECT_NEAR(e[0].lost(), 0, 1e-6);
}

TEST(Trim, StifferSphereKeepsMoreAndNothingIsLostBetweenThem) {
    constexpr double r = 20, d = 30;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, 0}, {d, 0, 0}});
    e[0].stiffness = 1.5;
    test::resolve(e);
    const double lens = 2 * test::capVolume(r, r - d / 2);
    EXPECT_NEAR((e[0].lost() + e[1].lost()) / lens, 1, 0.01);
    EXPECT_LT(e[0].lost(), 0.7 * e[1].lost());
    // The face is a sphere of Apollonius: |x - c0| / 1.5 = |x - c1|.
    const CompactLevelSet first = trimElement(e[0], e, nullptr).compact(),
                          second = trimElement(e[1], e, nullptr).compact();
    const CompactReader a(first), b(second);
    const double x = d * 1.5 / 2.5;
    EXPECT_NEAR(sampleAt(a, {x, 0, 0}), 0, 0.02);
    EXPECT_NEAR(sampleAt(b, {x, 0, 0}), 0, 0.02);
}

TEST(Trim, ARigidSphereLosesNothing) {
    constexpr double r = 20, d = 30;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, 0}, {d, 0, 0}});
    e[1].stiffness = std::numeric_limits<double>::infinity();
    test::resolve(e);
    EXPECT_NEAR(e[1].lost(), 0, 1e-6);
    EXPECT_NEAR(e[0].lost() / (2 * test::capVolume(r, r - d / 2)), 1, 0.01);
}

TEST(Trim, CoincidentElementsGoToTheLowerId) {
    auto e = test::elementsAt(test::sphere(12), {{0, 0, 0}, {0, 0, 0}});
    test::resolve(e);
    EXPECT_NEAR(e[0].bodyVolume, e[0].placedVolume, 1e-9);
    EXPECT_EQ(e[1].bodyVoxels, 0u);
}

TEST(Contact, RimOfTwoSpheresAndDistanceToIt) {
    constexpr double r = 24, d = 36;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, 0}, {d, 0, 0}});
    test::resolve(e);
    ASSERT_EQ(e[0].contacts, std::vector<int>{1});
    const double circle = std::sqrt(r * r - d * d / 4);
    for (const Vec3f& p : e[0].contact->rimPoints(0)) {
        EXPECT_NEAR(p[0], d / 2, 0.05);
        EXPECT_NEAR(std::hypot(p[1], p[2]), circle, 0.06);
    }
    const ContactDistance& distance = *e[0].contact;
    EXPECT_NEAR(distance.length() / (2 * kPi * circle), 1, 0.02);
    for (double t = 0; t < 6.2; t += 0.37) {
        const Vec3 radial(0, std::cos(t), std::sin(t));
        EXPECT_NEAR(distance(Vec3(d / 2, 0, 0) + (circle + 3) * radial), 3, 0.08);
        EXPECT_NEAR(distance(Vec3(d / 2 - 8, 0, 0) + (circle + 6) * radial), 10, 0.08);
    }
}

TEST(Contact, RimsAlongTheLatticeHaveNoGaps) {
    // Faces at 45 degrees to the lattice that cross along one of its lines: through voxels, or as far from them as can
    // be.
    const TriangleMesh bar = test::box({-20, -10, -30}, {20, 10, 30});
    const auto field = makeCanonicalField(bar, 1, 1, 1);
    const double s = std::sqrt(0.5);
    Frame a, b;
    a.x = Vec3(s, s, 0), a.y = Vec3(-s, s, 0);
    b.x = a.y * -1.0, b.y = a.x;
    for (const double shift : {0.0, 0.2, 0.5, 0.7}) {
        a.origin = Vec3(20 * s - 13 + shift, shift, 0), b.origin = a.origin + Vec3(0, 26, 0);
        std::vector<WorkElement> e(2);
        for (size_t i = 0; i < 2; ++i) {
            e[i].id = int(i) + 1;
            e[i].indexFromElement = i ? b : a;
            e[i].centre = e[i].indexFromElement.apply(field.centroid);
            e[i].size = field.bounds.diagonal();
            test::place(e[i], field);
        }
        e[1].stiffness = std::numeric_limits<double>::infinity();
        test::resolve(e);
        ASSERT_EQ(e[0].contact->rimCount(), 1u) << shift;
        std::vector<float> along[2];  // of the two lines
        for (const Vec3f& p : e[0].contact->rimPoints(0))
            if (std::abs(p[2]) < 26) along[p[0] > 7].push_back(p[2]);
        for (auto& line : along) {
            std::sort(line.begin(), line.end());
            ASSERT_GE(line.size(), 25u) << shift;
            for (size_t k = 1; k < line.size(); ++k) EXPECT_LT(line[k] - line[k - 1], 2.2f) << shift;
        }
    }
}

TEST(Contact, TellsTheFreeSideFromTheShared) {
    constexpr double r = 20, d = 30;
    auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0, 0, 0}, {d, 0, 0}});
    test::resolve(e);
    const double circle = std::sqrt(r * r - d * d / 4);
    for (double angle = 0.1; angle < 6; angle += 0.7) {
        const Vec3 radial(0, std::cos(angle), std::sin(angle)), x(1, 0, 0),
            rim = d / 2 * x + circle * radial,
            away = (circle * x * -1.0 + d / 2 * radial) / r;  // along the sphere, from the other
        const auto at = [&](const Vec3& p) { return e[0].contact->nearest(p); };
        EXPECT_NEAR(length(rim + 3.0 * away - at(rim + 3.0 * away).rim), 3, 0.1);
        EXPECT_NEAR(at(rim + 3.0 * away).away, 3, 0.05);
        EXPECT_NEAR(at(rim - 2.0 * away).away, -2, 0.05);
        EXPECT_NEAR(at(rim + 2.0 * (rim / r)).away, 0, 0.15);
    }
}

TEST(Contact, RimLiesOnThatOfTheResultsGridAndBendsWithIt) {
    constexpr double r = 9, d = 13.5;
    const TriangleMesh ball = test::sphere(r, {0, 0, 0}, 200);
    auto e = test::elementsAt(ball, {{0.3, 0.2, 0.1}, {d + 0.3, 0.2, 0.1}});
    const CanonicalField fine = makeCanonicalField(ball, 0.125, 1, 1);
    for (WorkElement& element : e) element.fine = &fine;
    test::resolve(e);
    const double circle = std::sqrt(r * r - d * d / 4);
    const Vec3 middle(d / 2 + 0.3, 0.2, 0.1);
    for (const Vec3f& p : e[0].contact->rimPoints(0)) {
        EXPECT_NEAR(p[0], middle[0], 0.01);
        EXPECT_NEAR(std::hypot(p[1] - middle[1], p[2] - middle[2]), circle, 0.01);  // .05 off on the grid at hand
    }
    const ContactDistance::Near near = e[0].contact->near(middle, circle, 2);
    ContactDistance::Near::Queries q;
    for (double t = 0; t < 2 * kPi; t += 0.02) {
        const size_t k = size_t(q.count++);
        q.x[k] = float(middle[0] - 0.3);
        q.y[k] = float(middle[1] + (circle + 0.4) * std::cos(t)),
        q.z[k] = float(middle[2] + (circle + 0.4) * std::sin(t));
    }
    near.nearest(q);
    for (size_t k = 0; k < size_t(q.count); ++k) EXPECT_NEAR(std::sqrt(q.distance2[k]), 0.5, 0.03);
}

TEST(Contact, ManySmoothlyJoined) {
    ContactDistance one, two;
    one.add(ContactDistance::join({{Vec3f(0, 0, 0)}}).own);
    two.add(ContactDistance::join({{Vec3f(0, 0, 0)}}).own);
    two.add(ContactDistance::join({{Vec3f(10, 0, 0)}}).own);
    EXPECT_NEAR(one({3, 4, 0}), 5, 1e-6);
    EXPECT_NEAR(two({5, 0, 0}), 5 * std::pow(2, -0.25), 1e-6);
    EXPECT_EQ(two({10, 0, 0}), 0);
    EXPECT_LT(two({3, 4, 0}), 5);
    EXPECT_GT(ContactDistance()({0, 0, 0}), 1e8);
}

/// Elements as elementsAt makes them, with the distances that the rule of depth asks for.
struct DeepElements {
    std::unique_ptr<CanonicalField> field;
    std::vector<WorkElement> elements;
    DeepElements(const TriangleMesh& mesh, const std::vector<Frame>& frames) {
        openvdb::initialize();
        field = std::make_unique<CanonicalField>(makeCanonicalField(mesh, 1, 1, 1, true));
        for (size_t i = 0; i < frames.size(); ++i) {
            WorkElement e;
            e.id = int(i) + 1;
            e.indexFromElement = frames[i];
            e.centre = frames[i].apply(field->centroid);
            e.size = field->bounds.diagonal();
            e.deep = field.get();
            test::place(e, *field);
            elements.push_back(e);
        }
    }
};

TEST(Depth, IsTheBisectorOfEqualBalls) {
    Frame a, b;
    b.origin = Vec3(22, 5, -3);
    DeepElements deep(test::sphere(16, {0, 0, 0}, 96), {a, b});
    test::resolve(deep.elements);
    const double d = length(b.origin);
    for (const WorkElement& e : deep.elements) EXPECT_NEAR(e.lost() / test::capVolume(16, 16 - d / 2), 1, 0.01) << e.id;
}

TEST(Depth, ATipKeepsItsShareInsideAFlank) {
    // A long box pokes 8 deep into the side of another, 12 thick and high: a square of 6 x 6 x 8 in common.
    const TriangleMesh bar = test::box({-30, -6, -6}, {30, 6, 6});
    Frame flank, tip;
    tip.x = Vec3(0, 1, 0), tip.y = Vec3(-1, 0, 0);
    tip.origin = Vec3(0.2, 30 + 6 - 8, 0.1);
    DeepElements deep(bar, {flank, tip});
    test::resolve(deep.elements);
    const double common = 8 * 12 * 12, byDepth = deep.elements[1].lost();
    EXPECT_NEAR(deep.elements[0].lost() + byDepth, common, 0.08 * common);  // sharp edges, 12 voxels apart
    EXPECT_GT(byDepth, 0.3 * common);
    EXPECT_LT(byDepth, 0.7 * common);
    for (WorkElement& e : deep.elements) e.deep = nullptr, e.contacts.clear();
    test::resolve(deep.elements);
    EXPECT_GT(deep.elements[1].lost(), 0.94 * common);  // the flank's centre is nearer to all of it
}

TEST(Depth, BothSidesSeeTheSameRim) {
    constexpr double r = 16;
    Frame a, b;
    a.origin = Vec3(0.3, 0.1, 0.2), b.origin = a.origin + Vec3(18, 12, -5);
    const Vec3 across = b.origin - a.origin, n = normalized(across);
    const double half = length(across) / 2, circle = std::sqrt(r * r - half * half);
    // Whoever is the stiffer one, and however much.
    for (const double stiffness : {1.0, 0.1, 10.0}) {
        DeepElements deep(test::sphere(r, {0, 0, 0}, 120), {a, b});
        deep.elements[1].stiffness = stiffness;
        test::resolve(deep.elements);
        const ContactDistance &low = *deep.elements[0].contact, &high = *deep.elements[1].contact;
        EXPECT_EQ(deep.elements[0].contacts, std::vector<int>{1});
        EXPECT_EQ(deep.elements[1].contacts, std::vector<int>{0});
        ASSERT_EQ(high.rimCount(), 1u);
        EXPECT_EQ(low.rimPoints(0), high.rimPoints(0));
        const Vec3 u = normalized(cross(n, Vec3(0, 0, 1))), w = cross(n, u);
        for (double angle = 0.2; angle < 6; angle += 0.7) {
            const Vec3 radial = std::cos(angle) * u + std::sin(angle) * w, rim = a.origin + half * n + circle * radial;
            EXPECT_NEAR(low(rim + 3.0 * radial), 3, 0.1);
            // Along each sphere, from the other.
            const Vec3 down = (half * radial - circle * n) / r, up = (half * radial + circle * n) / r;
            EXPECT_NEAR(low.nearest(rim + 3.0 * down).away, 3, 0.07);
            EXPECT_NEAR(high.nearest(rim + 3.0 * up).away, 3, 0.07);
            EXPECT_LT(high.nearest(rim + 3.0 * down).away, 2.5);
        }
    }
}

TEST(Depth, TheSamePlaceGoesToTheLowerId) {
    DeepElements deep(test::sphere(12, {0, 0, 0}, 64), {Frame(), Frame()});
    test::resolve(deep.elements);
    EXPECT_NEAR(deep.elements[0].bodyVolume, deep.elements[0].placedVolume, 1);
    EXPECT_EQ(deep.elements[1].bodyVoxels, 0u);
}

TEST(Bisector, BlocksTellTheSameAsPoints) {
    Frame a, b;
    b.origin = Vec3(11, 5, -3);
    for (const bool byDepth : {false, true})
        for (const double stiffness : {1.0, 1.7}) {
            DeepElements deep(test::sphere(16, {0, 0, 0}, 96), {a, b});
            deep.elements[0].stiffness = stiffness;
            if (!byDepth)
                for (WorkElement& e : deep.elements) e.deep = nullptr;
            for (const int own : {0, 1}) {
                const WorkElement &mine = deep.elements[size_t(own)], &other = deep.elements[size_t(1 - own)];
                const Bisector g(mine, other);
                size_t near = 0;
                forEachBlock(mine.box, [&](const Coord& origin) {
                    float phi[512], theirs[512], values[512];
                    mine.placed.read(mine.placed.at(origin), phi);
                    other.placed.read(other.placed.at(origin), theirs);
                    g.over(origin, 1, phi, theirs, values);
                    for (int v = 0; v < 512; ++v) {
                        if (phi[v] >= kBand || theirs[v] >= kBand) continue;
                        const double exact = g(centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))));
                        if (std::abs(exact) < Bisector::kSure - 0.1) {
                            EXPECT_NEAR(values[v], exact, 0.02);
                            ++near;
                        } else {
                            EXPECT_GT(values[v] * exact, 0);
                            EXPECT_GE(std::abs(values[v]), Bisector::kSure - 0.15f);
                        }
                    }
                });
                EXPECT_GT(near, 1000u);
            }
        }
}

TEST(Islands, TheLargestPieceStays) {
    WorkTree tree(kBand);
    const auto fill = [&](const CoordBBox& b) {
        for (auto it = b.begin(); it; ++it) tree.setValue(*it, -1);
    };
    fill({Coord(0, 0, 0), Coord(20, 6, 6)});
    fill({Coord(30, 0, 0), Coord(32, 2, 2)});
    CompactLevelSet shape(tree);
    const auto strays = findStrays(BlockLevelSet(shape).inside());
    size_t voxels = 0;
    for (const MaskedBlock& m : strays)
        for (int v = 0; v < 512; ++v) voxels += testMask(m.mask, v);
    EXPECT_EQ(voxels, 27u);
    erase(shape, strays);
    EXPECT_LT(shape.getValue(Coord(20, 6, 6)), 0);
    EXPECT_GT(shape.getValue(Coord(31, 1, 1)), 0);
    EXPECT_TRUE(findStrays(BlockLevelSet(shape).inside()).empty());
}

TEST(Islands, WhatIsErasedDeepInsideStaysErased) {
    // Half of a block that lies all inside, and all of another.
    WorkTree tree(kBand);
    tree.fill(CoordBBox(Coord(-24), Coord(23)), -kBand, false);
    tree.touchLeaf(Coord(-24))->fill(1.f, true), tree.touchLeaf(Coord(16))->fill(1.f, true);
    CompactLevelSet shape(tree);
    ASSERT_EQ(shape.at(Coord(0)), CompactLevelSet::kInside);
    MaskedBlock half{Coord(0), {}}, whole{Coord(0, 0, 8), {}};
    std::fill(half.mask.begin() + 32, half.mask.end(), uint8_t(255));
    whole.mask.fill(255);
    erase(shape, {half, whole});
    EXPECT_EQ(shape.getValue(Coord(3, 7, 7)), -kBand);
    EXPECT_EQ(shape.getValue(Coord(4, 0, 0)), kBand);
    EXPECT_EQ(shape.getValue(Coord(0, 0, 8)), kBand);
    EXPECT_EQ(shape.getValue(Coord(0, 0, -1)), -kBand);
    BlockLevelSet blocks(shape);
    blocks.tidy();
    EXPECT_EQ(blocks.compact().getValue(Coord(4, 0, 0)), kBand);
}

TEST(Islands, PiecesJoinedAcrossBlocksAreOne) {
    WorkTree tree(kBand);
    for (int x = -20; x < 40; ++x) tree.setValue(Coord(x, 7, 8), -1);
    EXPECT_TRUE(findStrays(BlockLevelSet(CompactLevelSet(tree)).inside()).empty());
}

}  // namespace
}  // namespace pavel
