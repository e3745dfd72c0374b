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
    TriangleMesh torus;
    constexpr int n = 160, m = 64;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            const double u = 2 * kPi * i / n, v = 2 * kPi * j / m, at = R + r * std::cos(v);
            torus.points.emplace_back(at * std::cos(u), at * std::sin(u), r * std::sin(v));
            const int a = i * m + j, b = (i + 1) % n * m + j, c = (i + 1) % n * m + (j + 1) % m,
                      d = i * m + (j + 1) % m;
            torus.triangles.push_back({a, b, c});
            torus.triangles.push_back({a, c, d});
        }
    ASSERT_GT(meshVolume(torus), 0);
    const TriangleMesh outer = offsetSurface(torus, offset, 0.6);
    EXPECT_NEAR(meshArea(outer) / (4 * kPi * kPi * R * (r + offset)), 1, 0.01);
    EXPECT_EQ(meshFacts(outer).components, 1u);
    for (const Vec3& p : outer.points) EXPECT_NEAR(std::hypot(std::hypot(p[0], p[1]) - R, p[2]), r + offset, 0.08);
}

}  // namespace
}  // namespace pavel
