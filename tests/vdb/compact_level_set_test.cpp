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
    for (auto at = box.begin(); at; ++at) ASSERT_EQ(after->getValue(*at), before->getValue(*at)) << *at;
    EXPECT_LT(after->getValue(Coord(0, 0, 0)), 0);
}

TEST(CompactLevelSet, OfNothingIsNothing) {
    EXPECT_TRUE(CompactLevelSet().empty());
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
