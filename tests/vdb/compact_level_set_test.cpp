#include "pavel/vdb/compact_level_set.h"

#include <gtest/gtest.h>

#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

/// A ball that is wide enough to have tiles in its middle.
WorkTree::Ptr ball(const Vec3& centre, double radius) {
    WorkTree raw(kBand);
    const int reach = int(radius) + 6;
    for (int x = -reach; x <= reach; ++x)
        for (int y = -reach; y <= reach; ++y)
            for (int z = -reach; z <= reach; ++z) {
                const double d = length(Vec3(x, y, z) - centre) - radius;
                if (std::abs(d) < kBand) raw.setValue(Coord(x, y, z), float(d));
            }
    openvdb::tools::signedFloodFillWithValues(raw, kBand, -kBand);
    return redistanced(raw);
}

constexpr float kStep = kResultBand / 32767;

TEST(CompactLevelSet, GivesTheSameTreeBack) {
    const WorkTree::Ptr before = ball({0.3, -0.2, 0.4}, 21);
    const CompactLevelSet compact(*before);
    EXPECT_EQ(compact.activeVoxels(), before->activeVoxelCount());
    const WorkTree::Ptr after = compact.tree();
    ASSERT_TRUE(after);
    EXPECT_EQ(after->background(), before->background());
    ASSERT_TRUE(after->hasSameTopology(*before));
    CoordBBox box;
    before->evalLeafBoundingBox(box);
    for (auto at = box.begin(); at; ++at) {
        const float value = after->getValue(*at), was = before->getValue(*at);
        ASSERT_NEAR(value, was, kStep) << *at;
        ASSERT_EQ(value < 0, was < 0) << *at;
        ASSERT_NE(value, 0) << *at;
    }
    // What has been put away once does not change any more.
    const WorkTree::Ptr again = CompactLevelSet(*after).tree();
    for (auto at = box.begin(); at; ++at) ASSERT_EQ(again->getValue(*at), after->getValue(*at)) << *at;
    EXPECT_LT(after->getValue(Coord(0, 0, 0)), 0);
}

/// Every block, within and without, read by itself, and the inside told in boxes.
TEST(CompactLevelSet, IsReadByBlocks) {
    const WorkTree::Ptr tree = ball({0.3, -0.2, 0.4}, 37);
    const CompactLevelSet compact(*tree);
    CoordBBox leaves;
    tree->evalLeafBoundingBox(leaves);
    EXPECT_EQ(compact.box(), leaves);
    EXPECT_EQ(compact.size(), tree->leafCount());
    size_t filled = 0;
    const CompactReader reader(compact);
    forEachBlock(CoordBBox(leaves.min().offsetBy(-8), leaves.max().offsetBy(8)), [&](const Coord& origin) {
        float values[512];
        const WorkLeaf* leaf = tree->probeConstLeaf(origin);
        const int block = compact.at(origin);
        compact.read(block, values);
        ASSERT_EQ(block >= 0, leaf != nullptr) << origin;
        ASSERT_EQ(reader.probe(origin) != nullptr, leaf != nullptr) << origin;
        if (leaf)
            EXPECT_EQ(compact.origin(block), origin);
        else
            filled += values[0] < 0 ? 512 : 0;
        for (int v = 0; v < 512; ++v) {
            const Coord c = origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
            ASSERT_NEAR(values[v], tree->getValue(c), kStep) << c;
            ASSERT_EQ(compact.value(block, v), values[v]) << c;
            ASSERT_EQ(compact.getValue(c), values[v]) << c;
            ASSERT_EQ(reader.getValue(c), values[v]) << c;
        }
    });
    EXPECT_GT(filled, 0u);
    compact.forEachFilled([&](const Coord& lo, const Coord& hi) {
        const CoordBBox box(lo, hi);
        EXPECT_EQ(tree->getValue(lo), -kResultBand);
        EXPECT_EQ(tree->getValue(hi), -kResultBand);
        EXPECT_FALSE(tree->probeConstLeaf(lo));
        filled -= size_t(box.volume());
    });
    EXPECT_EQ(filled, 0u);
}

TEST(CompactLevelSet, OfNothingIsNothing) {
    EXPECT_TRUE(CompactLevelSet().empty());
    EXPECT_TRUE(CompactLevelSet().box().empty());
    EXPECT_EQ(CompactLevelSet().at(Coord(0, 0, 0)), CompactLevelSet::kOutside);
    EXPECT_GE(CompactLevelSet().getValue(Coord(0, 0, 0)), 0);
    EXPECT_FALSE(CompactLevelSet().tree());
}

TEST(CompactLevelSet, TreesAreTakenOutAndPutBack) {
    std::vector<CompactLevelSet> compact(3);
    compact[1] = CompactLevelSet(*ball({0, 0, 0}, 9));
    const uint64_t active = compact[1].activeVoxels();
    std::vector<WorkTree::Ptr> trees = takeTrees(compact);
    EXPECT_TRUE(compact[1].empty());
    EXPECT_FALSE(trees[0]);
    ASSERT_TRUE(trees[1]);
    compact = putAway(std::move(trees));
    EXPECT_EQ(compact[1].activeVoxels(), active);
    EXPECT_TRUE(compact[2].empty());
}

}  // namespace
}  // namespace pavel
