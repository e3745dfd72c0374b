#include "pavel/vdb/mesh_band.h"

#include <gtest/gtest.h>

#include <array>
#include <map>

#include "pavel/core/rng.h"
#include "pavel/core/shapes.h"
#include "support/meshes.h"

namespace pavel {
namespace {

double brute(const TriangleMesh& mesh, const Vec3& p) {
    double least = 1e300;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        least = std::min(
            least, length(p - closestPointOnTriangle(p, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2))));
    return least;
}

double voxelsInside(const openvdb::FloatTree& tree) {
    double inside = 0;
    for (auto v = tree.cbeginValueAll(); v; ++v)
        if (*v < 0) inside += double(v.getVoxelCount());
    return inside;
}

double toBox(const Vec3& p, const Vec3& lo, const Vec3& hi) {
    double outside2 = 0, inside = -1e300;
    for (int k = 0; k < 3; ++k) {
        const double d = std::max(lo[k] - p[k], p[k] - hi[k]);
        inside = std::max(inside, d);
        outside2 += std::pow(std::max(d, 0.0), 2);
    }
    return inside > 0 ? std::sqrt(outside2) : inside;
}

TEST(MeshBand, IsTheDistanceToABoxWithItsSide) {
    const Vec3 lo(-20.3, -7.1, 3.4), hi(25.2, 12.6, 30.9);
    const auto tree = meshBand(test::box(lo, hi), 3);
    ASSERT_TRUE(tree);
    size_t least = 0, most = 0;  // rounding decides about some
    for (int x = -26; x <= 31; ++x)
        for (int y = -13; y <= 18; ++y)
            for (int z = -3; z <= 37; ++z) {
                const double expected = toBox(Vec3(x, y, z), lo, hi);
                least += std::abs(expected) < 3 - 1e-9;
                most += std::abs(expected) < 3 + 1e-9;
                ASSERT_NEAR(tree->getValue(Coord(x, y, z)), std::clamp(expected, -3.0, 3.0), 1e-5)
                    << x << " " << y << " " << z;
            }
    EXPECT_GE(tree->activeVoxelCount(), least);
    EXPECT_LE(tree->activeVoxelCount(), most);
}

TEST(MeshBand, VoxelsOnTheSurfaceAreOutsideOnAllSides) {
    const auto tree = meshBand(test::box(Vec3(-8, -5, 2), Vec3(9, 6, 14)), 3);
    ASSERT_TRUE(tree);
    EXPECT_EQ(voxelsInside(*tree), 16 * 10 * 11);
    for (auto v = tree->cbeginValueOn(); v; ++v) EXPECT_NE(*v, 0);
}

TEST(MeshBand, MatchesTheNearestOfAllTriangles) {
    TriangleMesh mesh = test::sphere(23.7);
    for (Vec3& p : mesh.points)
        p = Vec3(p[0] * 0.4 + p[1] * 0.9, p[1] - 0.3 * p[2], 0.5 * p[2]) + Vec3(1000.2, -3, 7.7);
    ASSERT_GT(meshVolume(mesh), 0);
    const auto tree = meshBand(mesh, 2);
    ASSERT_TRUE(tree);
    size_t seen = 0;
    for (auto v = tree->cbeginValueOn(); v; ++v) {
        const Coord c = v.getCoord();
        if ((c[0] + 3 * c[1] + 7 * c[2]) % 11 != 0) continue;
        ++seen;
        ASSERT_NEAR(std::abs(*v), brute(mesh, centreOf(c)), 1e-5);
    }
    EXPECT_GT(seen, 300u);
    const Coord middle(1000, -3, 8);
    EXPECT_LT(tree->getValue(middle), 0);
}

/// How often the mesh winds around a point (A. van Oosterom and J. Strackee 1983).
double winding(const TriangleMesh& mesh, const Vec3& p) {
    double angles = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 a = mesh.corner(t, 0) - p, b = mesh.corner(t, 1) - p, c = mesh.corner(t, 2) - p;
        const double la = length(a), lb = length(b), lc = length(c);
        angles += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    return angles / (4 * kPi);
}

/// Compares all voxels around, those that are not in the band, too.
void expectDistances(const TriangleMesh& mesh, int step) {
    const auto tree = meshBand(mesh, 3);
    ASSERT_TRUE(tree);
    const Bounds b = meshBounds(mesh);
    size_t near = 0;
    for (int x = int(b.min[0]) - 5; x < b.max[0] + 5; x += step)
        for (int y = int(b.min[1]) - 5; y < b.max[1] + 5; ++y)
            for (int z = int(b.min[2]) - 5; z < b.max[2] + 5; ++z) {
                const Coord c(x, y, z);
                const double size = brute(mesh, centreOf(c));
                near += size < 3;
                // The sum of angles costs as much again: where it matters.
                const bool inside = size < 3 && size > 1e-4 ? winding(mesh, centreOf(c)) > 0.5 : tree->getValue(c) < 0;
                const double expected = std::min(size, 3.0) * (inside ? -1 : 1);
                ASSERT_NEAR(tree->getValue(c), expected, 1e-5) << c;
            }
    EXPECT_GT(near, 500u);
}

TEST(MeshBand, IsTheDistanceWhereEveryCornerIsAnother) {
    // Spikes, dents and saddles of all angles, on triangles of all sizes: which of them a corner is nearest over.
    for (const double rough : {0.02, 0.2, 0.8}) {
        TriangleMesh mesh = test::sphere(14.3, {0.2, 0.1, 0.3}, 16);
        Rng rng(7, 0);
        for (Vec3& p : mesh.points) p *= 1 - rough * rng.uniform();
        SCOPED_TRACE(rough);
        expectDistances(mesh, 3);
    }
}

TEST(MeshBand, IsTheDistanceOverFlatFacetsThatEndWithBlocks) {
    // Nothing leans over flat edges: each facet is asked over itself only.
    TriangleMesh mesh;
    std::map<std::array<double, 3>, int> known;
    const auto add = [&](const Vec3& corner, const Vec3& u, const Vec3& v) {
        const TriangleMesh face = test::square(1, 4);
        std::vector<int> number;
        for (const Vec3& at : face.points) {
            const Vec3 p = corner + at[0] * u + at[1] * v;
            const auto [place, isNew] = known.insert({{p[0], p[1], p[2]}, int(mesh.points.size())});
            if (isNew) mesh.points.push_back(p);
            number.push_back(place->second);
        }
        for (const Triangle& t : face.triangles)
            mesh.triangles.push_back({number[size_t(t[0])], number[size_t(t[1])], number[size_t(t[2])]});
    };
    const Vec3 x(32, 0, 0), y(0, 32, 0), z(0, 0, 32), o(0, 0, 0);
    add(o, y, x), add(z, x, y), add(o, x, z), add(y, z, x), add(o, z, y), add(x, y, z);
    ASSERT_NEAR(meshVolume(mesh), 32 * 32 * 32, 1e-6);
    expectDistances(mesh, 1);
}

TEST(MeshBand, IsTheDistanceToConesThatShareTheirTips) {
    // The corner's normal is none, and its edges lie all about.
    TriangleMesh mesh;
    constexpr int kSides = 7;
    mesh.points.emplace_back(0.3, 0.2, 0.1);
    for (int cone = 0; cone < 2; ++cone) {
        const double up = cone ? 12.6 : -12.6;
        const int first = int(mesh.points.size());
        for (int k = 0; k < kSides; ++k)
            mesh.points.emplace_back(8 * std::cos(2 * kPi * k / kSides), 8 * std::sin(2 * kPi * k / kSides), up);
        mesh.points.emplace_back(0.1, 0.4, up);
        for (int k = 0; k < kSides; ++k) {
            const int a = first + k, b = first + (k + 1) % kSides, middle = first + kSides;
            mesh.triangles.push_back(cone ? Triangle{0, b, a} : Triangle{0, a, b});
            mesh.triangles.push_back(cone ? Triangle{middle, a, b} : Triangle{middle, b, a});
        }
    }
    ASSERT_GT(meshVolume(mesh), 0);
    expectDistances(mesh, 1);
}

TEST(MeshBand, TellsWhereItCannotTellTheSides) {
    const TriangleMesh box = test::box({0, 0, 0}, {20, 20, 20});
    TriangleMesh open = box;
    open.triangles.pop_back();
    EXPECT_FALSE(meshBand(open, 2));
    TriangleMesh crossing = box;  // one solid that cuts itself: two that share a vertex
    append(crossing, test::box({10, 10, 10}, {35, 35, 35}));
    for (Triangle& t : crossing.triangles)
        for (int& v : t)
            if (v == 8) v = 0;
    crossing.points[0] = {15, 15, 15};
    EXPECT_FALSE(meshBand(crossing, 2));
    TriangleMesh inverted = box;
    for (Triangle& t : inverted.triangles) std::swap(t[0], t[1]);
    EXPECT_FALSE(meshBand(inverted, 2));
}

TEST(MeshBand, UnitesSolids) {
    TriangleMesh mesh = test::box({0.2, 0.2, 0.2}, {20.2, 20.2, 20.2});
    append(mesh, test::box({10.4, 10.4, 10.4}, {35.4, 35.4, 35.4}));  // crosses it
    append(mesh, test::box({4.2, 4.2, 4.2}, {9.2, 9.2, 9.2}));        // within it
    append(mesh, test::box({60.2, 0.2, 0.2}, {80.2, 20.2, 20.2}));    // apart
    const auto tree = meshBand(mesh, 3);
    ASSERT_TRUE(tree);
    EXPECT_EQ(voxelsInside(*tree), 8000 + 15625 - 1000 + 8000);
    EXPECT_NEAR(tree->getValue(Coord(21, 5, 5)), 0.8, 1e-5);
    EXPECT_EQ(tree->getValue(Coord(7, 7, 7)), -3);
}

TEST(MeshBand, TellsTheSidesOfTheBuiltInBasesRight) {
    // Thin walls, sharp rims, handles and ears that overlap the body.
    for (const char* name : {"vase", "mug", "teapot", "glass", "ring", "tile", "amphora", "rabbit", "mask"}) {
        TriangleMesh mesh = makeShape(name);
        scaleMesh(mesh, 150 / meshBounds(mesh).longestSide());
        for (Vec3& p : mesh.points) p += Vec3(0.31, 0.27, 0.37);
        const auto tree = meshBand(mesh, 2);
        ASSERT_TRUE(tree) << name;
        size_t k = 0;
        for (auto v = tree->cbeginValueOn(); v; ++v) {
            if (++k % 4999 != 0) continue;
            ASSERT_EQ(*v<0, winding(mesh, centreOf(v.getCoord()))> 0.5) << name << " at " << v.getCoord();
        }
    }
}

}  // namespace
}  // namespace pavel
