#pragma once

namespace pavel {

/// The volume recovery function of the paper (Fast marching approach), with the printed formula's signs mended: three
/// parabolas joined with continuous slope, zero at the contact, 1 at a, zero from b on.
/// @param x distance to the contact surface as a share of the element's size; 0 < a < b
template <class Real>
[[gnu::always_inline]] inline Real recoveryFunction(Real x, Real a, Real b) {
    // Without branches, so that loops over it vectorise.
    const Real w = b - a, rising = x / a * (2 - x / a), falling = 1 - 2 * (x - a) * (x - a) / (w * w),
               fading = 2 * (x - b) * (x - b) / (w * w), beyond = x <= Real(0.5) * (a + b) ? falling : fading,
               any = x <= a ? rising : beyond;
    return (x <= 0) | (x >= b) ? 0 : any;
}

}  // namespace pavel
