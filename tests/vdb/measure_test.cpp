#include "pavel/vdb/measure.h"

#include "pavel/core/rng.h"
#include "pavel/vdb/recovery_function.h"
#include "pavel/vdb/redistance.h"
#include "pavel/vdb/voxelize.h"
#include "support/elements.h"

namespace pavel {
namespace {

TEST(RecoveryFunction, ValuesAndSlopes) {
    constexpr double a = 0.1, b = 0.3;
    EXPECT_EQ(recoveryFunction(0.0, a, b), 0);
    EXPECT_EQ(recoveryFunction(-1.0, a, b), 0);
    EXPECT_DOUBLE_EQ(recoveryFunction(a, a, b), 1);
    EXPECT_DOUBLE_EQ(recoveryFunction((a + b) / 2, a, b), 0.5);
    EXPECT_EQ(recoveryFunction(b, a, b), 0);
    EXPECT_EQ(recoveryFunction(1.0, a, b), 0);
    const auto slope = [&](double x) {
        return (recoveryFunction(x + 1e-7, a, b) - recoveryFunction(x - 1e-7, a, b)) / 2e-7;
    };
    EXPECT_NEAR(slope(a), 0, 1e-4);
    EXPECT_NEAR(slope((a + b) / 2), -2 / (b - a), 1e-4);
    EXPECT_NEAR(slope(b), 0, 1e-4);
}

TEST(CubeShare, MatchesSampling) {
    Rng rng(5, 0);
    for (int trial = 0; trial < 40; ++trial) {
        const Vec3 n = normalized(Vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)));
        const double d = rng.uniform(-0.9, 0.9);
        constexpr int k = 60;
        int inside = 0;
        for (int x = 0; x < k; ++x)
            for (int y = 0; y < k; ++y)
                for (int z = 0; z < k; ++z)
                    inside += dot(n, Vec3((x + .5) / k - .5, (y + .5) / k - .5, (z + .5) / k - .5)) + d < 0;
        EXPECT_NEAR(cubeShareUnderPlane(d, n), inside / double(k * k * k), 3e-3);
    }
    EXPECT_NEAR(cubeShareUnderPlane(0, Vec3(0, 0, 1)), 0.5, 2e-6);
    EXPECT_NEAR(cubeShareUnderPlane(0.25, Vec3(0, 1, 0)), 0.25, 2e-6);
}

class BallVolume : public testing::TestWithParam<double> {};
TEST_P(BallVolume, IsMeasuredToATenthOfAPerCent) {
    const double r = GetParam();
    const auto e = test::elementsAt(test::sphere(r, {0, 0, 0}, 160), {{0.3, -0.2, 0.45}});
    EXPECT_NEAR(e[0].placedVolume / test::ballVolume(r), 1, 1.5e-3 * 15 * 15 / (r * r) + 3e-4);
    EXPECT_NEAR(double(e[0].placedVoxels) / test::ballVolume(r), 1, 5e-3);
}
INSTANTIATE_TEST_SUITE_P(Radii, BallVolume, testing::Values(15.0, 30.0, 60.0));

TEST(Redistanced, BandIsWholeAroundCornersThatJustEnterABlock) {
    // All eight corners lie half a voxel in from a block's, so that the band is in blocks which no face leads to.
    const Vec3 middle(11.5, 11.5, 11.5);
    WorkTree raw(kBand);
    for (const Coord& c : {Coord(-4, -4, -4), Coord(27, 27, 27)}) raw.touchLeaf(c);
    const auto beyond = [&](const Coord& c) {
        Vec3 d;
        for (int k = 0; k < 3; ++k) d[k] = std::abs(c[k] - middle[k]) - 11;
        return d;
    };
    const CoordBBox box(Coord(-8, -8, -8), Coord(31, 31, 31));
    for (auto it = box.begin(); it; ++it) raw.setValue(*it, float(std::clamp(beyond(*it).max(), -4.0, 4.0)));
    const auto tree = redistanced(raw);
    size_t corners = 0;
    for (auto it = box.begin(); it; ++it) {
        Vec3 out = beyond(*it);
        for (int k = 0; k < 3; ++k) out[k] = std::max(0.0, out[k]);
        const double exact = length(out);
        if (exact == 0 || exact > 2.9) continue;
        EXPECT_TRUE(tree->isValueOn(*it)) << *it;
        EXPECT_NEAR(tree->getValue(*it), exact, 0.5) << *it;
        corners += out[0] > 0 && out[1] > 0 && out[2] > 0;
    }
    EXPECT_GT(corners, 8u * 6);
}

TEST(Widened, BandReachesAsFarAsAskedOnEachSide) {
    const Vec3 half(30.3, 22.7, 18.4);
    const auto narrow = narrowBand(test::box(-half, half), 1, kResultBand);
    const auto tree = widened(narrow->tree(), 12, 9);
    EXPECT_EQ(tree->background(), 12);
    EXPECT_EQ(tree->getValue({0, 0, 0}), -9);
    EXPECT_EQ(tree->getValue({60, 0, 0}), 12);
    Rng rng(3, 0);
    double sum = 0, most = 0;
    constexpr int kPoints = 20000;
    for (int i = 0; i < kPoints; ++i) {
        Coord c;
        Vec3 out, in;
        for (int k = 0; k < 3; ++k) {
            c[k] = int(rng.uniform(-half[k] - 14, half[k] + 14));
            out[k] = std::max(0.0, std::abs(double(c[k])) - half[k]);
            in[k] = std::abs(double(c[k])) - half[k];
        }
        const double exact = length(out) > 0 ? length(out) : in.max();
        const double error = std::abs(double(tree->getValue(c)) - std::clamp(exact, -9.0, 12.0));
        sum += error;
        most = std::max(most, error);
    }
    EXPECT_LT(sum / kPoints, 0.03);
    EXPECT_LT(most, 0.5);  // beyond the sharp corners
}

TEST(Voxelize, RotatedPlacementIsTheSameSolid) {
    const TriangleMesh box = test::box({-12, -8, 0}, {12, 8, 10});
    const CanonicalField field = makeCanonicalField(box, 1, 0.9, 1.1);
    Frame f = frameFromNormal({3.3, 4.4, 5.5}, {1, 2, 3}, {1, 0, 0}, 33, 1.1);
    const BlockLevelSet blocks = voxelizePlacement(field, f);
    EXPECT_NEAR(blocks.measure().volume / (24 * 16 * 10 * 1.1 * 1.1 * 1.1), 1, 4e-3);
    // distance to a face's plane, at a point outside its middle
    const CompactLevelSet shape = blocks.compact();
    const CompactReader reader(shape);
    EXPECT_NEAR(sampleAt(reader, f.apply({0, 0, 10 + 2 / 1.1})), 2, 0.05);
    EXPECT_NEAR(sampleAt(reader, f.apply({0, 0, 10 - 2 / 1.1})), -2, 0.05);
    EXPECT_LT(shape.getValue(Coord(int(f.apply({0, 0, 5})[0]), int(f.apply({0, 0, 5})[1]), int(f.apply({0, 0, 5})[2]))),
              0);
}

}  // namespace
}  // namespace pavel
