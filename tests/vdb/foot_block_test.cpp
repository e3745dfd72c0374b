#include "pavel/vdb/foot_block.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "pavel/core/rng.h"
#include "pavel/core/vec.h"

namespace pavel {
namespace {

/// Blocks in a cube, and feet in some of their voxels.
struct Blocks {
    static constexpr int kSide = 2;
    std::vector<FootBlock> blocks{size_t(kSide * kSide * kSide)};
    std::vector<Vec3> feet;

    Blocks() {
        for (FootBlock& b : blocks) b.clear();
    }
    static size_t blockOf(const int v[3]) { return size_t(((v[0] >> 3) * kSide + (v[1] >> 3)) * kSide + (v[2] >> 3)); }
    static int indexOf(const int v[3]) { return (v[0] & 7) * 64 + (v[1] & 7) * 8 + (v[2] & 7); }
    void put(const int v[3], const Vec3& foot) {
        FootBlock& b = blocks[blockOf(v)];
        const int i = indexOf(v);
        b.x[i] = float(v[0] - foot[0]), b.y[i] = float(v[1] - foot[1]), b.z[i] = float(v[2] - foot[2]);
        b.foot[i] = int(feet.size());
        feet.push_back(foot);
    }
    void spread(int block, int twosAlong) {
        const int at[3] = {block / (kSide * kSide), block / kSide % kSide, block % kSide},
                  step[3] = {kSide * kSide, kSide, 1};
        const FootBlock* beside[6];
        for (int side = 0; side < 6; ++side) {
            const int n = at[side / 2] + (side % 2 ? 1 : -1);
            beside[side] =
                n < 0 || n == kSide ? nullptr : &blocks[size_t(block + (side % 2 ? 1 : -1) * step[side / 2])];
        }
        blocks[size_t(block)].spread(beside, twosAlong);
    }
    template <class F>
    void forEachVoxel(F f) const {
        int v[3];
        for (v[0] = 0; v[0] < 8 * kSide; ++v[0])
            for (v[1] = 0; v[1] < 8 * kSide; ++v[1])
                for (v[2] = 0; v[2] < 8 * kSide; ++v[2]) f(v, blocks[blockOf(v)], indexOf(v));
    }
    double nearest(const Vec3& p) const {
        double least = 1e9;
        for (const Vec3& foot : feet) least = std::min(least, length(p - foot));
        return least;
    }
};

/// How far a voxel's foot is, over how far the nearest one is, in the band around the feet.
struct Detours {
    int voxels = 0, longer = 0;
    double mean = 0, most = 0;
    explicit Detours(const Blocks& b) {
        b.forEachVoxel([&](const int v[3], const FootBlock& block, int i) {
            const Vec3 p(v[0], v[1], v[2]), way(block.x[i], block.y[i], block.z[i]);
            const double exact = b.nearest(p);
            if (exact > 3) return;
            ++voxels;
            ASSERT_GE(block.foot[i], 0) << v[0] << " " << v[1] << " " << v[2];
            EXPECT_LT(length(p - way - b.feet[size_t(block.foot[i])]), 1e-5);
            const double detour = length(way) - exact;
            longer += detour > 0.1;
            mean += detour;
            most = std::max(most, detour);
        });
        mean /= voxels;
    }
};

TEST(FootBlock, OnePassUpAndDownFillsTheBandOfASheet) {
    // Slanted planes, as re-distancing meets them: a foot for each voxel beside the sheet.
    for (const Vec3& slope : {Vec3(0, 0, 1), Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(1, 2, 3), Vec3(3, -1, 1)}) {
        const Vec3 n = normalized(slope);
        const double offset = dot(n, Vec3(7.7, 7.6, 7.3));
        Blocks b;
        b.forEachVoxel([&](const int v[3], const FootBlock&, int) {
            const Vec3 p(v[0], v[1], v[2]);
            const double d = dot(n, p) - offset;
            if (std::abs(d) < 0.8) b.put(v, p - d * n);
        });
        Blocks on = b;
        for (int k = 0; k < 8; ++k) b.spread(k, 1);
        for (int k = 8; k-- > 0;) b.spread(k, 1);
        for (int pass = 0; pass < 10; ++pass)
            for (int k = 0; k < 8; ++k) on.spread(k, 4);
        const Detours once(b), ended(on);
        EXPECT_GT(once.voxels, 1000);
        EXPECT_LT(once.longer, once.voxels / 20);
        EXPECT_LT(once.mean, 0.03);
        EXPECT_LT(once.most, 0.3);
        EXPECT_LE(ended.mean, once.mean);
        EXPECT_LT(ended.most, 0.16);  // feet that no neighbour hands on
    }
}

TEST(FootBlock, SpreadingOnAndOnFindsNearlyAllNearestFeet) {
    Rng rng(5, 0);
    Blocks b;
    for (int k = 0; k < 40; ++k) {
        int v[3];
        for (int& x : v) x = std::min(15, int(rng.uniform(0, 16)));
        b.put(v, Vec3(v[0] + rng.uniform(-0.5, 0.5), v[1] + rng.uniform(-0.5, 0.5), v[2] + rng.uniform(-0.5, 0.5)));
    }
    for (int pass = 0; pass < 6; ++pass)
        for (int k = 0; k < 8; ++k) b.spread(pass % 2 ? 7 - k : k, 4);
    const Detours ended(b);
    EXPECT_LT(ended.longer, ended.voxels / 20);  // feet that no neighbour hands on
    EXPECT_LT(ended.most, 1);
}

TEST(FootBlock, TellsWhereItsFeetReachBeyondAFace) {
    FootBlock block{};
    block.clear();
    for (int side = 0; side < 6; ++side) EXPECT_FALSE(block.reaches(side, 1e6f));
    const int v = 6 * 64 + 3 * 8;  // (6, 3, 0)
    block.x[v] = 0.5f, block.y[v] = 0, block.z[v] = 0, block.foot[v] = 0;
    const FootBlock* alone[6] = {};
    block.spread(alone, 0);
    EXPECT_TRUE(block.reaches(1, 6.3f));  // 2.5 beyond the face +x
    EXPECT_FALSE(block.reaches(1, 6.2f));
    EXPECT_TRUE(block.reaches(4, 1.3f));  // beside it at -z
    EXPECT_FALSE(block.reaches(4, 1.2f));
    EXPECT_FALSE(block.reaches(5, 64));
}

}  // namespace
}  // namespace pavel
