#include <cmath>

#include "pavel/core/error.h"
#include "pavel/io/mesh_read.h"
#include "pavel/seeding/curvature.h"
#include "pavel/seeding/direction_field.h"
#include "support/meshes.h"

namespace pavel {
namespace {

int indexSum(const DirectionField& f) {
    int sum = 0;
    for (int i : f.indices()) sum += i;
    return sum;
}

TEST(Curvature, OfASphereAndATorus) {
    for (const Curvature& c : principalCurvatures(test::sphere(5, {0, 0, 0}, 48))) {
        EXPECT_NEAR(c.least, 0.2, 0.01);
        EXPECT_NEAR(c.greatest, 0.2, 0.01);
    }
    // A ring: 1 / minor radius around the tube everywhere, and along the tube on its outside 1 / (major + minor).
    const double major = 10, minor = 3;
    const TriangleMesh ring = test::torus(major, minor);
    const auto all = principalCurvatures(ring);
    for (size_t v = 0; v < all.size(); ++v) {
        const Vec3& p = ring.points[v];
        const double r = std::hypot(p[0], p[1]);
        if (std::abs(p[2]) > 0.2 || r < major) continue;
        EXPECT_NEAR(all[v].greatest, 1 / minor, 0.02 / minor);
        EXPECT_NEAR(all[v].least, 1 / (major + minor), 0.02 / minor);
        EXPECT_GT(std::abs(dot(all[v].alongLeast, Vec3(-p[1] / r, p[0] / r, 0))), 0.99);
    }
}

class FieldOnSphere : public testing::TestWithParam<int> {};

TEST_P(FieldOnSphere, SingularitiesSumToTheEulerNumber) {
    const Surface sphere(test::sphere(1, {0, 0, 0}, 40));
    const DirectionField f(sphere, FieldOptions(), GetParam());
    EXPECT_EQ(std::abs(indexSum(f)), 2 * GetParam());  // Poincare and Hopf: 2 turns
    int singular = 0;
    for (int i : f.indices()) singular += i != 0;
    EXPECT_LE(singular, 2 * GetParam());  // none but what must be
}
INSTANTIATE_TEST_SUITE_P(Symmetries, FieldOnSphere, testing::Values(1, 2, 4));

TEST(Field, IsParallelOnAPlaneAndSmoothOnATorus) {
    const Surface plane(test::square(1, 12));
    const DirectionField f(plane, FieldOptions(), 1);
    const Vec3 first = f.at(plane.closest({0.5, 0.5, 0}));
    for (double x : {0.1, 0.4, 0.9}) EXPECT_GT(dot(f.at(plane.closest({x, 1 - x * x, 0})), first), 1 - 1e-9);
    const Surface torus(test::torus(10, 3));
    const DirectionField around(torus, FieldOptions(), 1);
    for (int i : around.indices()) EXPECT_EQ(i, 0);
}

TEST(Field, FollowsAnAxisAndFillsItsPoles) {
    const Surface sphere(test::sphere(10, {0, 0, 0}, 60));
    FieldOptions o;
    o.type = "axis";
    const DirectionField up(sphere, o, 1);
    o.type = "around";
    const DirectionField around(sphere, o, 1);
    for (double h : {-0.9, -0.3, 0.0, 0.5, 0.95}) {
        const double r = std::sqrt(1 - h * h);
        const SurfacePoint p = sphere.closest({6 * r, 8 * r, 10 * h});
        const Vec3 meridian(-0.6 * h, -0.8 * h, r), parallel(-0.8, 0.6, 0);
        EXPECT_GT(dot(up.at(p), meridian), 0.995);
        EXPECT_GT(dot(around.at(p), parallel), 0.995);
    }
    EXPECT_EQ(std::abs(indexSum(up)), 2);
}

TEST(Field, FollowsCurvatureAndStrokes) {
    const Surface ring(test::torus(10, 3));
    FieldOptions o;
    o.type = "curvature";
    const DirectionField along(ring, o, 2);
    size_t checked = 0;
    for (size_t t = 0; t < ring.mesh().triangles.size(); t += 37) {
        SurfacePoint p;
        p.triangle = int(t);
        p.position = (ring.mesh().corner(t, 0) + ring.mesh().corner(t, 1) + ring.mesh().corner(t, 2)) / 3.0;
        const Vec3 round = normalized({-p.position[1], p.position[0], 0});
        EXPECT_GT(std::abs(dot(along.at(p), round)), 0.99);
        ++checked;
    }
    EXPECT_GT(checked, 20u);
    const Surface plane(test::square(1, 20));
    o.type = "guides";
    o.strokes = {{{0.1, 0.1, 0}, {0.4, 0.2, 0}}};
    const DirectionField guided(plane, o, 1);
    const Vec3 wanted = normalized({0.3, 0.1, 0});
    for (double x : {0.2, 0.5, 0.8}) EXPECT_GT(dot(guided.at(plane.closest({x, 0.7, 0})), wanted), 0.999);
    o.strokes = {{{5, 5, 5}, {6, 5, 5}}};
    EXPECT_THROW(DirectionField(plane, o, 1), Error);
}

TEST(Field, WorksOnTheSurfaceAsDownloaded) {
    PAVEL_NEED_MESH(path, "teapot_utah.obj");
    TriangleMesh teapot = readMesh(path);  // open, four parts, vertices where surfaces touch
    const Surface s(teapot);
    for (const char* type : {"smooth", "curvature", "axis"}) {
        FieldOptions o;
        o.type = type;
        const DirectionField f(s, o, 2);
        for (size_t v = 0; v < f.frames().mesh().points.size(); ++v) ASSERT_TRUE(std::isfinite(f.angle(int(v))));
    }
}

}  // namespace
}  // namespace pavel
