#include <algorithm>
#include <cmath>
#include <tuple>

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"
#include "pavel/io/mesh_read.h"
#include "pavel/seeding/seed.h"
#include "pavel/seeding/stripes.h"
#include "support/meshes.h"

namespace pavel {
namespace {

FieldOptions axisField(const char* type, const Vec3& axis) {
    FieldOptions o;
    o.type = type;
    o.axis = axis;
    return o;
}

struct Stripes {
    DirectionField field;
    std::vector<TrianglePhases> phases[2];
    StripeLines lines;
    /// Main stripes along the field, `across` apart; seeds `along` apart on them; crossing at an angle in degrees.
    Stripes(const Surface& surface, const FieldOptions& options, double along, double across, double angle = 90)
        : field(surface, options, 2) {
        StripeSolver solver(field);
        const double a = degreesToRadians(angle);
        phases[0] = solver.solve(kPi / 2, across);
        phases[1] = solver.solve(a + kPi / 2, along * std::sin(a));
        lines = traceStripes(field.frames(), phases[0], phases[1], 1e-4 * std::min(along, across));
    }
};

TEST(Stripes, AreExactOnAPlane) {
    const Surface plane(test::square(10, 23));
    const Stripes s(plane, axisField("axis", {1, 0, 0}), 0.8, 1.25);
    const size_t n = s.lines.crossings.size();
    EXPECT_GE(n, 12u * 7);
    EXPECT_LE(n, 13u * 9);
    size_t linked = 0;
    for (const Crossing& c : s.lines.crossings) {
        EXPECT_NEAR(std::abs(c.along[0]), 1, 1e-9);
        EXPECT_NEAR(std::abs(c.across[1]), 1, 1e-9);
        if (c.next[0] >= 0) {
            EXPECT_NEAR(length(s.lines.crossings[size_t(c.next[0])].position - c.position), 0.8, 1e-6);
            ++linked;
        }
        if (c.next[1] >= 0) {
            EXPECT_NEAR(length(s.lines.crossings[size_t(c.next[1])].position - c.position), 1.25, 1e-6);
            ++linked;
        }
    }
    EXPECT_GT(linked, 2 * n - 2 * 13 - 2);
    // Sixty degrees: the next row is shifted by half the spacing where across is that times tan(60) / 2.
    const double across = 0.8 * std::tan(kPi / 3) / 2;
    const Stripes t(plane, axisField("axis", {1, 0, 0}), 0.8, across, 60);
    for (const Crossing& c : t.lines.crossings)
        for (int pattern : {0, 1})
            if (c.next[pattern] >= 0) {
                EXPECT_NEAR(length(t.lines.crossings[size_t(c.next[pattern])].position - c.position), 0.8, 1e-6);
            }
}

/// An open cylinder of `sides` flat sides about z.
TriangleMesh cylinder(int sides, double radius, double height, int rows) {
    TriangleMesh m;
    for (int i = 0; i < sides; ++i)
        for (int j = 0; j <= rows; ++j)
            m.points.emplace_back(radius * std::cos(2 * kPi * i / sides), radius * std::sin(2 * kPi * i / sides),
                                  height * j / rows);
    for (int i = 0; i < sides; ++i)
        for (int j = 0; j < rows; ++j) {
            const int a = i * (rows + 1) + j, b = (i + 1) % sides * (rows + 1) + j;
            m.triangles.push_back({a, b, b + 1});
            m.triangles.push_back({a, b + 1, a + 1});
        }
    return m;
}

TEST(Stripes, RoundACylinderFitAWholeNumber) {
    const int sides = 90;
    const double radius = 5, girth = 2 * sides * radius * std::sin(kPi / sides);
    const Surface tube(cylinder(sides, radius, 20, 40));
    for (double asked : {girth / 16, girth / 16.3, girth / 15.6}) {
        const Stripes s(tube, axisField("around", {0, 0, 1}), asked, 2.0);
        ASSERT_GE(s.lines.lines[0].size(), 9u);
        for (const StripeLine& l : s.lines.lines[0]) {
            EXPECT_TRUE(l.closed);
            ASSERT_EQ(l.crossings.size(), 16u);
            double sum = 0;
            for (size_t i = 0; i < l.points.size(); ++i)
                sum += length(l.points[(i + 1) % l.points.size()] - l.points[i]);
            EXPECT_NEAR(sum, girth, 1e-6);
        }
        // Evenly spread: chords of girth / 16.
        double least = 1e9, most = 0;
        for (const Crossing& c : s.lines.crossings) {
            const double d = length(s.lines.crossings[size_t(c.next[0])].position - c.position);
            least = std::min(least, d), most = std::max(most, d);
        }
        EXPECT_NEAR(least, most, 2e-3 * most);
    }
}

TEST(Stripes, LoseNoCrossingInSingularTriangles) {
    // The surface's area over a cell's is what an even pattern has; and every crossing is found from both patterns.
    const Surface ball(test::sphere(10, {0, 0, 0}, 60));
    const Stripes s(ball, FieldOptions(), 1.0, 1.0);
    size_t singular = 0, turns = 0;
    for (const TrianglePhases& p : s.phases[0]) singular += p.flipped, turns += p.turns() != 0;
    EXPECT_GE(singular, 4u);  // half turns
    EXPECT_GT(turns, 4u);
    EXPECT_NEAR(double(s.lines.crossings.size()) / (4 * kPi * 100), 1, 0.1);
    size_t both = 0;
    for (const Crossing& c : s.lines.crossings) both += c.line[0] >= 0 && c.line[1] >= 0;
    EXPECT_EQ(both, s.lines.crossings.size());
    // Lines end in dislocations and singularities only: two ends for each at most, and a few at each half turn.
    for (int pattern : {0, 1}) {
        size_t open = 0, defects = 0;
        for (const StripeLine& l : s.lines.lines[pattern]) open += !l.closed;
        for (const TrianglePhases& p : s.phases[pattern]) defects += size_t(std::abs(p.turns())) + 3 * p.flipped;
        EXPECT_LE(2 * open, defects);
    }
}

TEST(Stripes, CrossingsMatchBruteForceWherePhasesAreLinear) {
    const Surface ball(test::sphere(10, {0, 0, 0}, 48));
    const Stripes s(ball, FieldOptions(), 1.3, 1.1, 70);
    // In the plane of both phases a triangle holds the points of the lattice of whole turns that it covers.
    std::vector<int> wanted(ball.mesh().triangles.size(), 0), found(wanted);
    size_t checked = 0;
    for (size_t t = 0; t < wanted.size(); ++t) {
        const TrianglePhases &p = s.phases[0][t], &q = s.phases[1][t];
        if (p.flipped || p.turns() || q.turns()) {
            wanted[t] = -1;
            continue;
        }
        double x[3], y[3];
        for (size_t k = 0; k < 3; ++k) x[k] = p.corner[k] / (2 * kPi), y[k] = q.corner[k] / (2 * kPi);
        const double det = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
        for (int m = int(std::floor(*std::min_element(x, x + 3))); m <= *std::max_element(x, x + 3); ++m)
            for (int n = int(std::floor(*std::min_element(y, y + 3))); n <= *std::max_element(y, y + 3); ++n) {
                const double b = ((m - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (n - y[0])) / det,
                             c = ((x[1] - x[0]) * (n - y[0]) - (m - x[0]) * (y[1] - y[0])) / det;
                wanted[t] += b >= 0 && c >= 0 && b + c <= 1;
            }
        ++checked;
    }
    EXPECT_GT(checked, wanted.size() * 9 / 10);
    for (const Crossing& c : s.lines.crossings) ++found[size_t(c.triangle)];
    size_t wrong = 0, total = 0;
    for (size_t t = 0; t < wanted.size(); ++t)
        if (wanted[t] >= 0) wrong += wanted[t] != found[t], total += size_t(wanted[t]);
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(total, 700u);
}

class StripeCounts : public testing::TestWithParam<std::tuple<const char*, const char*>> {};

TEST_P(StripeCounts, AreMetAndLinksAreMutual) {
    const std::string name = std::get<0>(GetParam()), type = std::get<1>(GetParam());
    TriangleMesh mesh;
    if (name == "vase") {
        mesh = groupSubmesh(makeShape("vase"), "outer");
    } else if (name == "torus") {
        mesh = test::torus(10, 4);
    } else {
        PAVEL_NEED_MESH(path, name);
        mesh = readMesh(path);
    }
    for (size_t count : {400, 2000}) {
        StripeOptions o;
        o.count = count;
        o.along = std::sqrt(1.5 * meshArea(mesh) / double(count));
        o.across = o.along / 1.5;
        TriangleMesh fine = mesh;
        subdivideLongEdges(fine, stripeEdge(o));
        const Surface surface(std::move(fine));
        FieldOptions f;
        f.type = type;
        const DirectionField field(surface, f, 2);
        const StripeSeeds s = stripeSeeds(surface, field, o, [](const Vec3&) { return Vec3(0, 0, 1); });
        EXPECT_NEAR(double(s.seeds.size()) / double(count), 1, 0.03);
        double least = 1e300;
        for (size_t i = 0; i < s.seeds.size(); ++i) {
            const StripeSeed& a = s.seeds[i];
            EXPECT_NEAR(length(a.along), 1, 1e-9);
            EXPECT_NEAR(dot(a.along, a.point.normal), 0, 1e-9);
            if (a.onOther[1] >= 0) {
                EXPECT_EQ(s.seeds[size_t(a.onOther[1])].onOther[0], int(i));
            }
            if (a.onMain[1] < 0) continue;
            EXPECT_EQ(s.seeds[size_t(a.onMain[1])].onMain[0], int(i));
            least = std::min(least, length(s.seeds[size_t(a.onMain[1])].point.position - a.point.position));
        }
        EXPECT_GE(least, 0.5 * std::min(s.along, s.across) * 0.999);
    }
}
INSTANTIATE_TEST_SUITE_P(Surfaces, StripeCounts,
                         testing::Values(std::tuple("vase", "around"), std::tuple("torus", "smooth"),
                                         std::tuple("bunny_60k.obj", "smooth"), std::tuple("spot.obj", "smooth"),
                                         std::tuple("teapot_utah.obj", "curvature")));

TEST(StripeSeeds, AlternateAlongTheMainStripe) {
    Scene scene;
    scene.seedings[0].method = "stripes";
    scene.seedings[0].spacing = {8, 6};
    scene.seedings[0].field.type = "around";
    scene.orientation.rotation = "alternate";
    scene.assignment = "alternate";
    RunContext context;
    std::vector<ElementKind> kinds(2);
    for (ElementKind& k : kinds) {
        k.name = &k == &kinds[0] ? "a" : "b";
        k.mesh = makeShape("bean");
        k.footprint = 30;
    }
    const SeedSet set = makeSeeds(makeShape("vase"), kinds, scene, {}, context);
    ASSERT_TRUE(set.spacing);
    EXPECT_NEAR(set.spacing->first * set.spacing->second / 48, 1, 0.06);
    EXPECT_NEAR(double(set.seeds.size()) * set.spacing->first * set.spacing->second / set.decoratedArea, 1, 0.05);
    EXPECT_GT(set.stripes.size(), 20u);
    size_t links = 0, alike = 0, tangents = 0;
    for (const Seed& s : set.seeds) {
        ASSERT_TRUE(s.stripe);
        tangents += dot(s.tangent, normalized({-s.position[1], s.position[0], 0})) > 0.9;
        if (const int next = s.stripe->along[1]) {
            const Seed& t = set.seeds[size_t(next) - 1];
            EXPECT_EQ(t.id, next);
            EXPECT_EQ(t.stripe->along[0], s.id);
            ++links;
            alike += s.rotation == t.rotation || s.kind == t.kind;
        }
    }
    EXPECT_GT(links, set.seeds.size() * 9 / 10);
    EXPECT_LT(alike, links / 15);  // only where a closed stripe has an odd number, or a branch is near
    EXPECT_GT(tangents, set.seeds.size() * 97 / 100);
    scene.seedings[0].fit = true;
    const SeedSet fit = makeSeeds(makeShape("vase"), kinds, scene, {}, context);
    ASSERT_EQ(fit.seeds.size(), set.seeds.size());
    size_t scaled = 0;
    for (size_t i = 0; i < fit.seeds.size(); ++i) {
        const Seed& s = fit.seeds[i];
        if (!s.stripe->along[0] || !s.stripe->along[1]) continue;
        double sum = 0;
        for (int id : s.stripe->along) sum += length(fit.seeds[size_t(id) - 1].position - s.position);
        EXPECT_NEAR(s.scale, std::clamp(sum / 2 / fit.spacing->first, 0.7, 1.4), 1e-9);
        scaled += std::abs(s.scale - 1) > 0.02;
    }
    EXPECT_GT(scaled, 20u);
    scene.seedings[0].fit = false;
    scene.seedings[0].spacing = {500, 500};
    EXPECT_THROW(makeSeeds(makeShape("vase"), kinds, scene, {}, context), InputError);
}

}  // namespace
}  // namespace pavel
