#pragma once
// Seeds and placed elements: what seeding hands to packing.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pavel/core/finish.h"
#include "pavel/core/frame.h"
#include "pavel/core/mesh.h"

namespace pavel {

/// A decorative element as loaded: a closed solid in its own frame (origin on the surface, +z the surface's normal, +x
/// the main direction), in scene units.
struct ElementKind {
    std::string name;
    TriangleMesh mesh;
    double weight = 1;
    double stiffness = 1;       ///< share of an overlap that it keeps; infinity: rigid, it neither loses nor grows
    double sink = 0;            ///< depth of the origin below the surface
    double footprint = 0;       ///< area of the projection along +z
    Vec3 color{0.8, 0.8, 0.8};  ///< sRGB in [0, 1]
    Finish finish = Finish::clay;
};

/// A place on the surface and what stands there. World frame, scene units.
struct Seed {
    int id = 0;  ///< 1..n, the element's id everywhere
    Vec3 position, normal{0, 0, 1};
    Vec3 tangent{1, 0, 0};  ///< unit; the field's direction before `rotation`
    double rotation = 0;    ///< degrees about the normal
    double scale = 1;
    int kind = 0;
    struct Stripe {
        std::array<int, 2> index{};            ///< which main stripe, and which place along it
        std::array<int, 2> along{}, across{};  ///< ids of the previous and next seed; 0: there is none
    };
    std::optional<Stripe> stripe;  ///< where it was placed by stripes
};

struct SeedSet {
    std::vector<Seed> seeds;
    std::string method;
    double decoratedArea = 0;
    double coverage = 0;                               ///< sum of the placed footprints / decorated area
    std::optional<std::pair<double, double>> spacing;  ///< of stripes, along and across, as used
    struct Line {
        std::vector<Vec3> points;
        bool closed = false, main = true;
    };
    std::vector<Line> stripes;
    size_t singularities = 0;  ///< of the stripes' field
    size_t branches = 0;       ///< places where stripes begin or end, each with its number of stripes
};

struct PlacedElement {
    int id = 0;
    int kind = 0;
    Frame worldFromElement;
};

std::vector<PlacedElement> placeElements(const std::vector<Seed>& seeds, const std::vector<ElementKind>& kinds);

}  // namespace pavel
