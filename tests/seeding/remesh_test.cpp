// Remeshing keeps what it promises: number, topology, shape, creases, and well-shaped triangles.
#include "pavel/seeding/remesh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <map>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/shapes.h"
#include "pavel/seeding/surface.h"
#include "support/meshes.h"

namespace pavel {
namespace {

double leastAngleDegrees(const TriangleMesh& mesh, size_t t) {
    double least = 180;
    for (int k = 0; k < 3; ++k) {
        const Vec3 p = mesh.corner(t, k), a = normalized(mesh.corner(t, (k + 1) % 3) - p),
                   b = normalized(mesh.corner(t, (k + 2) % 3) - p);
        least = std::min(least, std::acos(std::clamp(dot(a, b), -1.0, 1.0)) * 180 / kPi);
    }
    return least;
}

struct Quality {
    double meanAngle = 0, worstAngle = 180, sixShare = 0;
};

Quality qualityOf(const TriangleMesh& mesh) {
    Quality q;
    std::vector<int> valence(mesh.points.size());
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double angle = leastAngleDegrees(mesh, t);
        q.meanAngle += angle / double(mesh.triangles.size());
        q.worstAngle = std::min(q.worstAngle, angle);
        for (int v : mesh.triangles[t]) ++valence[size_t(v)];
    }
    q.sixShare = double(std::count(valence.begin(), valence.end(), 6)) / double(valence.size());
    return q;
}

TEST(Remesh, ASphereBecomesRegularAndStaysASphere) {
    constexpr double kRadius = 10;
    const TriangleMesh sphere = test::sphere(kRadius, Vec3(0, 0, 0), 200);
    const Remeshed r = remeshed(sphere, 4000);
    EXPECT_EQ(r.mesh.points.size(), 4000u);
    const MeshFacts facts = meshFacts(r.mesh);
    EXPECT_TRUE(facts.fit());
    EXPECT_EQ(facts.euler, 2);
    const Quality q = qualityOf(r.mesh);
    EXPECT_GT(q.meanAngle, 53.5);
    EXPECT_GT(q.worstAngle, 26);
    EXPECT_GT(q.sixShare, 0.8);
    // Triangles with their corners on the sphere would lose 2e-3.
    EXPECT_NEAR(facts.volume / meshVolume(sphere), 1, 1e-4);
    for (const Vec3& p : r.mesh.points) EXPECT_NEAR(length(p), kRadius, 0.012);
}

TEST(Remesh, ACubeKeepsItsEdgesAndCorners) {
    TriangleMesh cube = test::box(Vec3(0, 0, 0), Vec3(10, 10, 10));
    subdivideLongEdges(cube, 0.25);
    const Remeshed r = remeshed(cube, 1500);
    EXPECT_EQ(r.mesh.points.size(), 1500u);
    EXPECT_NEAR(meshVolume(r.mesh), 1000, 0.5);
    EXPECT_NEAR(meshArea(r.mesh), 600, 1.0);
    // A vertex in every corner, and a row of them along every edge.
    int corners = 0, onEdges = 0;
    for (const Vec3& p : r.mesh.points) {
        int sides = 0;
        for (int k = 0; k < 3; ++k) sides += std::min(std::abs(p[k]), std::abs(p[k] - 10)) < 0.02;
        corners += sides == 3;
        onEdges += sides == 2;
    }
    EXPECT_EQ(corners, 8);
    EXPECT_GT(onEdges, 12 * 10);
}

TEST(Remesh, PartsHandlesAndBoundariesStay) {
    TriangleMesh mesh = makeShape("ring", {});
    TriangleMesh ball = test::sphere(0.4, Vec3(0, 0, 0), 24);
    append(mesh, ball);
    const MeshFacts before = meshFacts(mesh);
    const Remeshed r = remeshed(mesh, 1200);
    const MeshFacts after = meshFacts(r.mesh);
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.euler, before.euler);
    EXPECT_EQ(after.boundaryEdges + after.nonManifoldEdges + after.degenerateTriangles, 0u);

    TriangleMesh sheet = test::square(10, 60);
    const Remeshed open = remeshed(sheet, 500);
    EXPECT_NEAR(meshArea(open.mesh), meshArea(sheet), 1e-6);
    EXPECT_EQ(meshFacts(open.mesh).euler, 1);
    for (const Vec3& p : open.mesh.points) EXPECT_NEAR(p[2], sheet.points[0][2], 1e-9);
}

TEST(Remesh, SmallPartsGetMoreThanTheirShareOfTheArea) {
    TriangleMesh mesh = test::sphere(10, Vec3(0, 0, 0), 160);
    append(mesh, test::sphere(1, Vec3(20, 0, 0), 60));
    const Remeshed r = remeshed(mesh, 4000);
    EXPECT_EQ(r.mesh.points.size(), 4000u);
    EXPECT_EQ(meshFacts(r.mesh).components, 2u);
    const auto isSmall = [](const Vec3& p) { return p[0] > 15; };
    const auto small = std::count_if(r.mesh.points.begin(), r.mesh.points.end(), isSmall);
    EXPECT_NEAR(double(small), 64, 3);  // 40 by the area, 360 by the curvature
    for (size_t t = 0; t < r.source.size(); ++t) {
        const int from = mesh.triangles[size_t(r.source[t])][0];
        EXPECT_EQ(isSmall(mesh.points[size_t(from)]), isSmall(r.mesh.corner(t, 0)));
    }
}

TEST(Remesh, EdgesAreShorterWhereTheSurfaceBends) {
    TriangleMesh ellipsoid = test::sphere(1, Vec3(0, 0, 0), 240);
    for (Vec3& p : ellipsoid.points) p = Vec3(20 * p[0], 6 * p[1], 6 * p[2]);
    const TriangleMesh out = remeshed(ellipsoid, 3000).mesh;
    double tips = 0, waist = 0;
    int tipEdges = 0, waistEdges = 0;
    for (size_t t = 0; t < out.triangles.size(); ++t) {
        const Vec3 a = out.corner(t, 0), b = out.corner(t, 1);
        if (const double x = std::abs(a[0] + b[0]) / 2; x > 18)
            tips += length(b - a), ++tipEdges;
        else if (x < 8)
            waist += length(b - a), ++waistEdges;
    }
    tips /= tipEdges, waist /= waistEdges;
    EXPECT_LT(tips, 0.85 * waist);
    EXPECT_GT(tips, 0.5 * waist);
    EXPECT_GT(qualityOf(out).meanAngle, 53);
}

TEST(Remesh, SourcesLieUnderTheirTriangles) {
    const TriangleMesh torus = test::torus(10, 4, 160);
    const Remeshed r = remeshed(torus, 800);
    ASSERT_EQ(r.source.size(), r.mesh.triangles.size());
    for (size_t t = 0; t < r.source.size(); ++t) {
        const Vec3 c = (r.mesh.corner(t, 0) + r.mesh.corner(t, 1) + r.mesh.corner(t, 2)) / 3;
        EXPECT_LT(length(torus.points[size_t(torus.triangles[size_t(r.source[t])][0])] - c), 2.5);
    }
}

TEST(Remesh, DoesNotDependOnThreads) {
    const TriangleMesh mesh = makeShape("pebble", {});
    const Remeshed many = remeshed(mesh, 700);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Remeshed single = remeshed(mesh, 700);
    EXPECT_EQ(many.mesh.triangles, single.mesh.triangles);
    EXPECT_EQ(many.mesh.points, single.mesh.points);
}

TEST(Remesh, NamesWhatItCannotDo) {
    const TriangleMesh ball = test::sphere(1, Vec3(0, 0, 0), 16);
    EXPECT_THROW(remeshed(ball, 0), InputError);
    EXPECT_THROW(remeshed(ball, 3), InputError);
    EXPECT_THROW(remeshed(ball, ball.points.size()), InputError);
    TriangleMesh fin = ball;  // a third triangle at an edge
    fin.points.push_back(Vec3(0, 0, 5));
    fin.triangles.push_back({ball.triangles[0][0], ball.triangles[0][1], int(ball.points.size())});
    EXPECT_THROW(remeshed(fin, 20), InputError);
}

}  // namespace
}  // namespace pavel
