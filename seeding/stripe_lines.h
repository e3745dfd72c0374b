#pragma once
// Stripes as polylines, and the points where two patterns cross.
#include <vector>

#include "pavel/seeding/stripe_pattern.h"

namespace pavel {

/// A stripe: points in order along it.
struct StripeLine {
    std::vector<Vec3> points;
    bool closed = false;         ///< the last point is joined to the first
    std::vector<int> crossings;  ///< indices of the crossings along it, in order
};

struct Crossing {
    Vec3 position;
    int triangle = -1;
    Vec3 along, across;                              ///< unit directions of the two stripes, as their lines run
    int line[2] = {-1, -1};                          ///< of the first and the second pattern
    int previous[2] = {-1, -1}, next[2] = {-1, -1};  ///< crossings along each of these lines
};

struct StripeLines {
    std::vector<StripeLine> lines[2];
    std::vector<Crossing> crossings;
};

/// Traces where the phases of two patterns are whole turns, through singular triangles, too: there phases are
/// interpolated from the triangle's border to its middle, around which they turn. What lies nearer to each other along
/// a stripe than `tolerance` is one crossing. O(triangles + crossings log crossings)
StripeLines traceStripes(const TangentFrames& frames, const std::vector<TrianglePhases>& first,
                         const std::vector<TrianglePhases>& second, double tolerance);

}  // namespace pavel
