#pragma once

namespace pavel {

/// The volume recovery function of the paper (Fast marching approach), with the printed formula's signs mended: three
/// parabolas joined with continuous slope, zero at the contact, 1 at a, zero from b on.
/// @param x distance to the contact surface as a share of the element's size; 0 < a < b
template <class Real>
[[gnu::always_inline]] inline Real recoveryFunction(Real x, Real a, Real b) {
    // Without branches, so that loops over it vectorise; what divides, only by a and b.
    const Real w = b - a, perA = 1 / a, perW = 2 / (w * w), rising = x * perA * (2 - x * perA),
               falling = 1 - perW * (x - a) * (x - a), fading = perW * (x - b) * (x - b),
               beyond = x <= Real(0.5) * (a + b) ? falling : fading, any = x <= a ? rising : beyond,
               before = x < b ? any : 0;
    return x > 0 ? before : 0;
}

}  // namespace pavel
