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
    EXPECT_NEAR(inBlocks.volume, inTree.volume, 1e-9 * inTree.volume);
    EXPECT_EQ(inBlocks.voxels, inTree.voxels);
    EXPECT_NEAR(inBlocks.volume / (4 * kPi / 3 * kRadius * kRadius * kRadius), 1, 2e-4);
}

TEST(BlockLevelSet, SettlesToItsVolume) {
    BlockLevelSet larger = ball(21), kept = ball(21), smaller = ball(21);
    const double volume = kept.measure().volume, area = 4 * kPi * 21 * 21;
    const double more = volume + 0.03 * area, less = volume - 0.2 * area;
    EXPECT_NEAR(larger.settleVolume(more, true) / more, 1, 2e-5);
    EXPECT_NEAR(measureInside(*larger.compact().tree()).volume / more, 1, 2e-5);
    EXPECT_EQ(kept.settleVolume(more, false), volume);
    EXPECT_NEAR(smaller.settleVolume(less, false) / less, 1, 2e-5);
}

TEST(BlockLevelSet, DoesNotGrowByMoreThanAFewHundredths) {
    BlockLevelSet blocks = ball(21);
    const double volume = blocks.measure().volume, area = 4 * kPi * 21 * 21;
    const double grown = blocks.settleVolume(volume + area, true);
    EXPECT_GT(grown, volume + 0.04 * area);
    EXPECT_LT(grown, volume + 0.06 * area);
}

}  // namespace
}  // namespace pavel
