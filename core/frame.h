#pragma once
#include "pavel/core/vec.h"

namespace pavel {

/// A similarity: rotation with orthonormal columns x, y, z, uniform scale, origin. Named target-from-source where used,
/// as in worldFromElement.
struct Frame {
    Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    Vec3 origin{0, 0, 0};
    double scale = 1;

    Vec3 apply(const Vec3& p) const { return origin + scale * (p[0] * x + p[1] * y + p[2] * z); }
    Vec3 applyInverse(const Vec3& p) const {
        const Vec3 d = (p - origin) / scale;
        return {dot(d, x), dot(d, y), dot(d, z)};
    }
};

/// Frame at `origin` with z along `normal` and x along `tangent` (made perpendicular), turned about z by `degrees`.
Frame frameFromNormal(const Vec3& origin, const Vec3& normal, const Vec3& tangent, double degrees, double scale);

}  // namespace pavel
