#pragma once

namespace pavel {

/// The volume recovery function of the paper (Fast marching approach), with the printed formula's signs mended: three
/// parabolas joined with continuous slope, zero at the contact, 1 at a, zero from b on.
/// @param x distance to the contact surface as a share of the element's size; 0 < a < b
inline double recoveryFunction(double x, double a, double b) {
    if (x <= 0 || x >= b) return 0;
    if (x <= a) return x / a * (2 - x / a);
    const double w = b - a;
    if (x <= 0.5 * (a + b)) return 1 - 2 * (x - a) * (x - a) / (w * w);
    return 2 * (x - b) * (x - b) / (w * w);
}

}  // namespace pavel
