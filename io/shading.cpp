#include "pavel/io/shading.h"

#include <algorithm>

namespace pavel {
namespace {

double smoothstep(double from, double to, double x) {
    const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

double power5(double c) {
    const double c2 = c * c;
    return c2 * c2 * c;
}

double fortieth(double c) {
    const double c2 = c * c, c4 = c2 * c2, c8 = c4 * c4;
    return c8 * c8 * c8 * c8 * c8;
}

/// A round lamp seen in a mirror of that roughness.
double lamp(double cosine, double edge, double roughness) {
    const double blur = 0.02 + 0.6 * roughness * roughness;
    return smoothstep(edge - blur, edge + blur, cosine) / (1 + 6 * roughness * roughness);
}

}  // namespace

Studio::Studio(const Camera& c)
    : up_(c.up),
      key_(normalized(-0.55 * c.right + 0.75 * c.up + 0.75 * c.back)),
      fill_(normalized(0.9 * c.right + 0.1 * c.up + 0.6 * c.back)) {}

double Studio::surroundings(const Vec3& d, double roughness) const {
    const double ceiling = 0.24 + 0.62 * smoothstep(-0.5 - roughness, 0.9 + roughness, dot(d, up_));
    return ceiling + 2.2 * lamp(dot(d, key_), 0.93, roughness) + 0.7 * lamp(dot(d, fill_), 0.95, roughness);
}

Vec3 Studio::shade(const Point& p, const FinishLook& look) const {
    const Vec3& n = p.normal;
    const double facing = std::max(0.0, dot(n, p.toEye)), toKey = dot(n, key_);
    const double inside = 0.75 * look.translucency;  // share of the light that goes through the matter
    const double direct =
        (1 - inside) * p.lit * std::max(0.0, toKey) + inside * std::exp(-p.depth) * std::max(0.0, (toKey + 0.6) / 1.6);
    const double open = p.open + 0.35 * look.translucency * (1 - p.open);
    const double diffuse = 0.85 * direct + open * (0.30 + 0.12 * n[2]) + 0.18 * open * std::max(0.0, dot(n, fill_));
    const Vec3 mirrored = 2 * dot(n, p.toEye) * n - p.toEye;
    const double around = surroundings(mirrored, look.roughness) * (0.25 + 0.75 * p.open) * (0.55 + 0.45 * p.lit);
    Vec3 light(0, 0, 0);
    if (look.metallic > 0.5) {
        for (int k = 0; k < 3; ++k) {
            const double f = p.albedo[k] + (1 - p.albedo[k]) * power5(1 - facing);
            light[k] = f * around + 0.12 * p.albedo[k] * diffuse;
        }
        return light;
    }
    const double gloss = 1 - look.roughness;
    const double f = gloss * gloss * (0.045 + 0.6 * power5(1 - facing));
    const double shine = 0.14 * look.roughness * p.lit * fortieth(std::max(0.0, dot(n, normalized(key_ + p.toEye))));
    for (int k = 0; k < 3; ++k) light[k] = (1 - f) * p.albedo[k] * diffuse + f * around + shine;
    return light;
}

}  // namespace pavel
