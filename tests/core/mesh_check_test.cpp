#include "pavel/core/mesh_check.h"
#include "pavel/core/footprint.h"

#include "pavel/core/error.h"
#include "support/meshes.h"

namespace pavel {
namespace {

TEST(MeshFacts, Box) {
    const MeshFacts f = meshFacts(test::box({0, 0, 0}, {1, 2, 3}));
    EXPECT_TRUE(f.fit());
    EXPECT_DOUBLE_EQ(f.volume, 6);
    EXPECT_DOUBLE_EQ(f.area, 22);
    EXPECT_EQ(f.euler, 2);
    EXPECT_EQ(f.components, 1u);
}

TEST(MakeSolid, WeldsAndTurnsFacesOutward) {
    TriangleMesh soup;
    const TriangleMesh b = test::box({0, 0, 0}, {1, 1, 1});
    for (size_t t = 0; t < b.triangles.size(); ++t) {
        const int n = int(soup.points.size());
        for (int k = 0; k < 3; ++k) soup.points.push_back(b.corner(t, k));
        if (t % 3 == 0)
            soup.triangles.push_back({n, n + 2, n + 1});
        else
            soup.triangles.push_back({n, n + 1, n + 2});
    }
    const auto done = makeSolid(soup, "soup");
    EXPECT_EQ(done.size(), 3u);  // welded, dropped the unused, turned
    EXPECT_EQ(soup.points.size(), 8u);
    EXPECT_NEAR(meshVolume(soup), 1, 1e-12);
}

TEST(MakeSolid, OpenMeshNamesItsLoopsOrIsClosedWhereAsked) {
    TriangleMesh open = test::box({0, 0, 0}, {1, 1, 1});
    open.triangles.resize(10);  // without the side x = 1
    TriangleMesh copy = open;
    try {
        makeSolid(copy, "lid.obj");
        FAIL();
    } catch (const InputError& e) {
        EXPECT_NE(std::string(e.what()).find("1 boundary loop (4 edges around (1, 0.5, 0.5))"), std::string::npos)
            << e.what();
    }
    RepairOptions fill;
    fill.fillHoles = true;
    makeSolid(open, "lid.obj", fill);
    EXPECT_NEAR(meshVolume(open), 1, 1e-12);
}

TEST(MakeSolid, ThickensASheet) {
    TriangleMesh sheet = test::square(10, 5);
    RepairOptions thicken;
    thicken.thicken = 0.5;
    makeSolid(sheet, "sheet", thicken);
    EXPECT_NEAR(meshVolume(sheet), 50, 1e-9);
    EXPECT_NEAR(meshArea(groupSubmesh(sheet, "outer")), 100, 1e-9);
}

TEST(MakeSolid, RefusesWhatIsNoSolid) {
    TriangleMesh empty;
    EXPECT_THROW(makeSolid(empty, "empty"), InputError);
    TriangleMesh bad = test::box({0, 0, 0}, {1, 1, 1});
    bad.points[3][1] = std::nan("");
    EXPECT_THROW(makeSolid(bad, "nan"), InputError);
    TriangleMesh fin = test::box({0, 0, 0}, {1, 1, 1});
    fin.points.emplace_back(0.5, 0.5, 5);
    fin.triangles.push_back({0, 1, 8});  // a third face on an edge
    EXPECT_THROW(makeSolid(fin, "fin"), InputError);
}

TEST(Footprint, CountsOverlapsOnceAndConcaveOutlines) {
    TriangleMesh two = test::box({0, 0, 0}, {2, 1, 1});
    append(two, test::box({1, 0, 2}, {4, 1, 3}));
    EXPECT_NEAR(footprintArea(two), 4, 4e-3);
    TriangleMesh l = test::box({0, 0, 0}, {3, 1, 1});
    append(l, test::box({0, 0, 0}, {1, 3, 1}));
    EXPECT_NEAR(footprintArea(l), 5, 5e-3);
}

TEST(Mesh, ClosestPointOnTriangle) {
    const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
    EXPECT_LT(length(closestPointOnTriangle({0.5, 0.5, 3}, a, b, c) - Vec3(0.5, 0.5, 0)), 1e-12);
    EXPECT_LT(length(closestPointOnTriangle({2, 2, 0}, a, b, c) - Vec3(1, 1, 0)), 1e-12);
    EXPECT_LT(length(closestPointOnTriangle({-1, -1, 1}, a, b, c) - a), 1e-12);
}

}  // namespace
}  // namespace pavel
