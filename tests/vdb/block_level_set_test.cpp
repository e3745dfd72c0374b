#include "pavel/vdb/block_level_set.h"

#include <gtest/gtest.h>

#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

/// A ball that is wide enough to have blocks inside.
BlockLevelSet ball(double radius) {
    const int reach = int(radius) + 8;
    const CoordBBox box(Coord(-reach), Coord(reach));
    Region raw(box);
    float own[512], clip[512], slope[512];
    std::fill(clip, clip + 512, -kBand);
    std::fill(slope, slope + 512, 0.f);
    forEachBlock(box, [&](const Coord& origin) {
        bool near = false;
        for (int v = 0; v < 512; ++v) {
            const Vec3 p = centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
            own[v] = float(std::clamp(length(p - Vec3(0.3, -0.2, 0.4)) - radius, -double(kBand), double(kBand)));
            near |= std::abs(own[v]) < Region::kNear;
        }
        if (near)
            raw.add(origin, own, clip, slope);
        else if (own[0] < 0)
            raw.fill(origin);
    });
    return redistanced(raw);
}

TEST(BlockLevelSet, IsMeasuredAsItsTreeIs) {
    constexpr double kRadius = 21;
    const BlockLevelSet blocks = ball(kRadius);
    const InsideMeasure inBlocks = blocks.measure(), inTree = measureInside(*blocks.compact().tree());
    EXPECT_NEAR(inBlocks.volume, inTree.volume, 1e-6 * inTree.volume);
    EXPECT_EQ(inBlocks.voxels, inTree.voxels);
    EXPECT_NEAR(inBlocks.volume / (4 * kPi / 3 * kRadius * kRadius * kRadius), 1, 2e-4);
}

TEST(BlockLevelSet, SettlesToItsVolume) {
    BlockLevelSet larger = ball(21), kept = ball(21), smaller = ball(21);
    const double volume = kept.measure().volume, area = 4 * kPi * 21 * 21;
    const double more = volume + 0.03 * area, less = volume - 0.2 * area;
    EXPECT_NEAR(larger.settleVolume(more, true) / more, 1, 2e-5);
    EXPECT_NEAR(measureInside(*larger.compact().tree()).volume / more, 1, 2e-5);
    EXPECT_NEAR(kept.settleVolume(more, false), volume, 1e-9 * volume);
    EXPECT_NEAR(smaller.settleVolume(less, false) / less, 1, 2e-5);
}

TEST(BlockLevelSet, ShrinksInRoundsAndTellsHowFarItCame) {
    const double volume = ball(21).measure().volume, area = 4 * kPi * 21 * 21;
    for (const double by : {0.02, 0.5, 0.7}) {
        BlockLevelSet blocks = ball(21);
        const double target = volume - by * area, settled = blocks.settleVolume(target, false);
        EXPECT_NEAR(settled / target, 1, 2e-5) << by;
        EXPECT_NEAR(blocks.measure().volume / settled, 1, 1e-6) << by;
    }
    BlockLevelSet blocks = ball(21);
    const double left = blocks.settleVolume(volume - 3 * area, false);
    EXPECT_NEAR(blocks.measure().volume / left, 1, 1e-6);
    EXPECT_NEAR(std::cbrt(left / volume) * 21, 21 - 0.75, 0.01);
}

TEST(BlockLevelSet, DoesNotGrowByMoreThanAFewHundredths) {
    BlockLevelSet blocks = ball(21);
    const double volume = blocks.measure().volume, area = 4 * kPi * 21 * 21;
    const double grown = blocks.settleVolume(volume + area, true);
    EXPECT_GT(grown, volume + 0.04 * area);
    EXPECT_LT(grown, volume + 0.06 * area);
}

TEST(BlockLevelSet, IsSpreadOutAndPutAwayAgain) {
    const BlockLevelSet first = ball(37);
    const CompactLevelSet rest = first.compact();
    const BlockLevelSet again(rest);
    EXPECT_EQ(again.measure().voxels, first.measure().voxels);
    EXPECT_NEAR(again.measure().volume, first.measure().volume, 1e-6 * first.measure().volume);
    const BlockMasks inside = again.inside();
    uint64_t voxels = 0;
    for (auto c = rest.box().begin(); c; ++c) {
        ASSERT_EQ(inside.isOn(*c), rest.getValue(*c) < 0) << *c;
        voxels += inside.isOn(*c);
    }
    EXPECT_EQ(voxels, first.measure().voxels);
}

TEST(BlockLevelSet, BlocksAreOpenedClearedAndTidiedAway) {
    BlockLevelSet blocks(ball(37).compact());
    const CompactLevelSet before = blocks.compact();
    const InsideMeasure whole = blocks.measure();
    const Coord middle(0, 0, 0), beside(8, 0, 0);
    ASSERT_EQ(before.at(middle), CompactLevelSet::kInside);
    ASSERT_EQ(before.at(beside), CompactLevelSet::kInside);
    EXPECT_FALSE(blocks.values(middle));
    float* values = blocks.open(middle);
    EXPECT_EQ(values[100], -kResultBand);
    EXPECT_EQ(blocks.values(middle), values);
    EXPECT_EQ(blocks.measure().voxels, whole.voxels);
    blocks.tidy();  // unchanged, it lies inside again
    EXPECT_FALSE(blocks.values(middle));
    EXPECT_EQ(blocks.compact().size(), before.size());
    blocks.open(middle)[100] = 1;
    blocks.clear(beside);
    blocks.tidy();
    EXPECT_EQ(blocks.measure().voxels, whole.voxels - 513);
    EXPECT_EQ(blocks.compact().size(), before.size() + 1);
    EXPECT_EQ(blocks.compact().getValue(beside), kResultBand);
    EXPECT_FALSE(blocks.inside().isOn(Coord(1, 4, 4)));  // 100 = 64 + 4 * 8 + 4
    EXPECT_TRUE(blocks.inside().isOn(Coord(1, 4, 5)));
    blocks.clear(before.origin(0));
    blocks.tidy();
    EXPECT_EQ(blocks.compact().size(), before.size());
    EXPECT_EQ(blocks.compact().at(before.origin(0)), CompactLevelSet::kOutside);
}

}  // namespace
}  // namespace pavel
