#include <algorithm>
#include <cmath>

#include "pavel/core/shapes.h"
#include "pavel/io/mesh_read.h"
#include "pavel/seeding/stripe_lines.h"
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

}  // namespace
}  // namespace pavel
