#include "pavel/core/frame.h"

namespace pavel {

Frame frameFromNormal(const Vec3& origin, const Vec3& normal, const Vec3& tangent, double degrees, double scale) {
    Frame f;
    f.z = normalized(normal);
    Vec3 x = tangent - dot(tangent, f.z) * f.z;
    x = length(x) > 1e-9 ? normalized(x) : anyPerpendicular(f.z);
    f.x = normalized(rotatedAbout(x, f.z, degreesToRadians(degrees)));
    f.y = cross(f.z, f.x);
    f.origin = origin;
    f.scale = scale;
    return f;
}

}  // namespace pavel
