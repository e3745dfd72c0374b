#include "pavel/core/shape_sculptures.h"

#include <algorithm>
#include <cmath>

#include "pavel/core/error.h"
#include "pavel/core/shape_bases.h"
#include "pavel/core/shape_kit.h"

namespace pavel {

TriangleMesh makePendant(double radius, double thickness) {
    enum { kOuter, kOther, kHidden };
    const std::vector<std::string> parts = {"outer", "other", "hidden"};
    const double round = thickness / 2, flat = radius - round;
    TriangleMesh disc = sweepEvenly(
        radius / 45, {{0.4, kOuter}, {0.6, kOther, 10}, {1, kOther}},
        [&](double u, double v) {
            const double angle = u < 0.4 ? 0 : u > 0.6 ? kPi : kPi * (u - 0.4) / 0.2;  // around the rim, from the top
            const double r = u < 0.4 ? flat * u / 0.4 : u > 0.6 ? flat * (1 - u) / 0.4 : flat + round * std::sin(angle);
            return Vec3(r * std::cos(2 * kPi * v), r * std::sin(2 * kPi * v), round * (std::cos(angle) - 1));
        },
        parts);
    // The wire is a little thinner than the disc, and sunk into its rim so far that it does not reach the flat top.
    const double wire = 0.9 * round, bow = std::max(0.14 * radius, 2 * wire), middle = flat + wire + bow;
    TriangleMesh eyelet = sweepPeriodic(72, 24, [&](double u, double v) {
        const double r = bow + wire * std::cos(2 * kPi * v), f = 2 * kPi * u;
        return Vec3(r * std::cos(f), middle + r * std::sin(f), wire * std::sin(2 * kPi * v) - round);
    });
    eyelet.groupNames = parts;
    eyelet.groups.assign(eyelet.triangles.size(), kOther);
    return joinParts({disc, eyelet}, kHidden);
}

std::vector<ShapeRecipe> sculptureRecipes() {
    std::vector<ShapeRecipe> r;
    r.push_back({{"teapot", true, "Newell's teapot, its lid on", {{"height", 120, "height to the knob's top"}}},
                 [](const ShapeParameters& p) { return makeTeapot(p.at("height")); }});
    const ShapeParameter thickness{"thickness", 3, "of the wall, inward from the face", 0.2, 6, true};
    r.push_back({{"mask", true, "face mask with eye holes, looking along +z", {thickness}},
                 [](const ShapeParameters& p) { return makeMask(p.at("thickness")); }});
    r.push_back({{"plague_mask", true, "plague doctor's mask", {thickness}},
                 [](const ShapeParameters& p) { return makePlagueMask(p.at("thickness")); }});
    r.push_back({{"rabbit", true, "sitting rabbit", {{"height", 120, "height to the ears' tips"}}},
                 [](const ShapeParameters& p) { return makeRabbit(p.at("height")); }});
    r.push_back({{"pendant",
                  true,
                  "disc with an eyelet; its flat top, at z = 0, is decorated",
                  {{"radius", 14, "radius of the disc"}, {"thickness", 1.5, "thickness of the disc"}}},
                 [](const ShapeParameters& p) {
                     if (p.at("thickness") >= p.at("radius"))
                         throw InputError("a pendant's thickness must be less than its radius");
                     return makePendant(p.at("radius"), p.at("thickness"));
                 }});
    return r;
}

}  // namespace pavel
