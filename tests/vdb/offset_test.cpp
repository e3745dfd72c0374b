#include "pavel/vdb/offset_surface.h"

#include "pavel/core/mesh_check.h"
#include "pavel/core/shapes.h"
#include "support/elements.h"

namespace pavel {
namespace {

TEST(OffsetSurface, OfABallAndATorus) {
    const TriangleMesh ball = offsetSurface(test::sphere(20, {3, 4, 5}), 7, 0.7);
    for (const Vec3& p : ball.points) EXPECT_NEAR(length(p - Vec3(3, 4, 5)), 27, 0.05);
    EXPECT_TRUE(meshFacts(ball).fit());
    EXPECT_NEAR(meshArea(ball) / (4 * kPi * 27 * 27), 1, 0.01);

    constexpr double R = 30, r = 8, offset = 5;
    const TriangleMesh torus = test::torus(R, r, 200);
    ASSERT_GT(meshVolume(torus), 0);
    const TriangleMesh outer = offsetSurface(torus, offset, 0.6);
    EXPECT_NEAR(meshArea(outer) / (4 * kPi * kPi * R * (r + offset)), 1, 0.01);
    EXPECT_EQ(meshFacts(outer).components, 1u);
    for (const Vec3& p : outer.points) EXPECT_NEAR(std::hypot(std::hypot(p[0], p[1]) - R, p[2]), r + offset, 0.08);
}

}  // namespace
}  // namespace pavel
