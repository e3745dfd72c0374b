#include "pavel/vdb/claims.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

namespace pavel {
namespace {

TEST(Claims, OrderByTimeThenById) {
    EXPECT_LT(makeClaim(0.5f, 9), makeClaim(0.75f, 1));
    EXPECT_LT(makeClaim(0.5f, 1), makeClaim(0.5f, 2));
    EXPECT_LT(makeClaim(1e20f, 1), kFree);
    EXPECT_EQ(claimOwner(makeClaim(0.5f, 20000)), 20000);
    EXPECT_EQ(claimTime(makeClaim(0.5f, 20000)), 0.5f);
}

TEST(Claims, BodiesComeBeforeEveryClaim) {
    VoxelMask bodies;
    bodies.setOn(77);
    ClaimBlock block(bodies);
    EXPECT_EQ(claimTime(block.at(77)), 0);
    EXPECT_EQ(block.at(76), kFree);
    EXPECT_EQ(block.at(78), kFree);
}

TEST(Claims, TheEarliestHoldsWhateverTheOrder) {
    ClaimBlock block{VoxelMask()};
    block.enter(300, makeClaim(2, 1));
    block.enter(300, makeClaim(1, 5));
    block.enter(300, makeClaim(1, 7));
    EXPECT_EQ(block.at(300), makeClaim(1, 5));
    EXPECT_EQ(block.at(301), kFree);
    block.free(300);
    EXPECT_EQ(block.at(300), kFree);
}

TEST(Claims, ManyThreadsLeaveTheEarliestOfAll) {
    constexpr int kClaimants = 64;
    ClaimBlock block{VoxelMask()};
    const auto claim = [](int id, int v) { return makeClaim(float(1 + (id * 37 + v) % kClaimants), id); };
    tbb::parallel_for(1, kClaimants + 1, [&](int id) {
        for (int k = 0; k < 512; ++k) block.enter((k + 8 * id) % 512, claim(id, (k + 8 * id) % 512));
    });
    for (int v = 0; v < 512; ++v) {
        Claim least = kFree;
        for (int id = 1; id <= kClaimants; ++id) least = std::min(least, claim(id, v));
        EXPECT_EQ(block.at(v), least) << v;
    }
}

}  // namespace
}  // namespace pavel
