#pragma once
// Ordered seeding: the crossings of two stripe patterns (paper, Stripe-based, anisotropic seeding).
#include <algorithm>
#include <array>
#include <functional>

#include "pavel/seeding/stripe_lines.h"

namespace pavel {

struct StripeOptions {
    double along = 0;   ///< distance between neighbouring seeds on a main stripe
    double across = 0;  ///< perpendicular distance between main stripes
    double angle = 90;  ///< degrees from the main stripes, which follow the field, to the others
    /// Wanted number of seeds: both spacings are scaled until it is met to 1.5 %. 0: as many as the spacings make,
    /// which are scaled only where stripes that converge would make the mean density wrong by more than 3 %.
    size_t count = 0;
};

struct StripeSeed {
    SurfacePoint point;
    Vec3 along;  ///< unit tangent of its main stripe; neighbours' agree where they can
    std::array<int, 2>
        index{};               ///< which main stripe, and which place along it; neighbours differ by one where they can
    int onMain[2] = {-1, -1};  ///< previous and next seed on the main stripe
    int onOther[2] = {-1, -1};  ///< on the other one
};

struct StripeSeeds {
    std::vector<StripeSeed> seeds;
    StripeLines lines;
    double along = 0, across = 0;  ///< the spacings that were used
    size_t dropped = 0;            ///< seeds nearer to another than half the least spacing
    size_t singularities = 0;      ///< of the field
    size_t branches = 0;           ///< where stripes of either pattern begin or end
};

/// Along a field of lines on a surface whose edges are shorter than the spacings (see stripeEdge). Of seeds that are
/// too near to each other that with fewer neighbours is dropped, and its neighbours become each other's.
/// @param preferred a direction at a point, with which the tangents should agree on the whole
StripeSeeds stripeSeeds(const Surface& surface, const DirectionField& field, const StripeOptions& options,
                        const std::function<Vec3(const Vec3&)>& preferred);

/// Edges must not span more than a period: the longest that they should be.
inline double stripeEdge(const StripeOptions& o) {
    return 0.5 * std::min(o.along * std::sin(degreesToRadians(o.angle)), o.across);
}

}  // namespace pavel
