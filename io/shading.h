#pragma once
// Light on finishes: a studio with a large lamp from the upper left, a strip on the right and a bright ceiling.
#include "pavel/core/finish.h"
#include "pavel/io/raster.h"

namespace pavel {

class Studio {
  public:
    explicit Studio(const Camera& camera);
    const Vec3& key() const { return key_; }

    struct Point {
        Vec3 normal, toEye;  ///< unit
        Vec3 albedo;         ///< linear
        double open = 1;     ///< share of the sky that is seen from it (ambient occlusion)
        double lit = 1;      ///< share of the lamp that is seen
        double depth = 0;  ///< way of the lamp's light inside things, in units after which jade has lost 1 - 1/e of it
    };
    /// Linear light towards the eye.
    Vec3 shade(const Point& point, const FinishLook& look) const;

  private:
    double surroundings(const Vec3& direction, double roughness) const;
    Vec3 up_, key_, fill_;
};

}  // namespace pavel
