#include "pavel/seeding/seed.h"

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/seeding/cvt.h"

namespace pavel {
namespace {

// One stream of random numbers per purpose.
enum Stream : uint64_t { kKindStream = 2, kRotationStream, kSizeStream };

int kindByWeight(const std::vector<ElementKind>& kinds, double u) {
    double sum = 0;
    for (const ElementKind& k : kinds) sum += k.weight;
    double at = u * sum;
    for (size_t k = 0; k + 1 < kinds.size(); ++k) {
        if (at < kinds[k].weight) return int(k);
        at -= kinds[k].weight;
    }
    return int(kinds.size()) - 1;
}

/// "Up" along the surface where there is such a direction.
Vec3 upTangent(const Vec3& normal) {
    const Vec3 t = Vec3(0, 0, 1) - normal[2] * normal;
    return length(t) > 0.05 ? normalized(t) : anyPerpendicular(normal);
}

size_t seedCount(const Surface& surface, const std::vector<ElementKind>& kinds, const Scene& scene) {
    if (scene.seeding.count) return *scene.seeding.count;
    const double wanted = *scene.seeding.coverage * surface.area() / meanFootprint(kinds, scene.sizeVariation);
    if (wanted < 0.5)
        throw InputError(
            "seeding.coverage: not even one element is needed to cover this area; use smaller elements or a \"count\"");
    if (wanted > 1e7)
        throw InputError("seeding.coverage: this would take more than 10000000 elements; use larger ones");
    return size_t(std::llround(wanted));
}

void cvtSeeds(const Surface& surface, const std::vector<ElementKind>& kinds, const Scene& scene,
              const RunContext& context, SeedSet& set) {
    CvtOptions options;
    options.iterations = scene.seeding.iterations;
    options.seed = scene.seed;
    const auto points = centroidalSeeds(surface, seedCount(surface, kinds, scene), options,
                                        [&](double done) { context.progress("seeding", done); });
    Rng kindRng(scene.seed, kKindStream), rotationRng(scene.seed, kRotationStream), sizeRng(scene.seed, kSizeStream);
    for (const SurfacePoint& p : points) {
        Seed s;
        s.id = int(set.seeds.size()) + 1;
        s.position = p.position;
        s.normal = p.normal;
        s.tangent = upTangent(p.normal);
        s.kind = kindByWeight(kinds, kindRng.uniform());
        const OrientationOptions& o = scene.orientation;
        const double u = rotationRng.uniform();
        s.rotation = o.rotation == "random" ? 360 * u : o.angle + o.jitter * (2 * u - 1);
        s.scale = 1 + scene.sizeVariation * sizeRng.uniform(-1, 1);
        set.seeds.push_back(s);
    }
}

void manualSeeds(const Surface& surface, const std::vector<ElementKind>& kinds, const Scene& scene,
                 const std::vector<PlacementOptions>& manual, SeedSet& set) {
    for (const PlacementOptions& p : manual) {
        Seed s;
        s.id = int(set.seeds.size()) + 1;
        const SurfacePoint q = surface.closest(p.position);
        s.position = scene.seeding.snap ? q.position : p.position;
        s.normal = p.normal ? normalized(*p.normal) : q.normal;
        s.tangent = p.tangent ? *p.tangent : upTangent(s.normal);
        s.rotation = p.rotation;
        s.scale = p.scale;
        for (size_t k = 0; k < kinds.size(); ++k)
            if (kinds[k].name == p.element) s.kind = int(k);
        set.seeds.push_back(s);
    }
}

}  // namespace

TriangleMesh decoratedSurface(const TriangleMesh& base, const SeedingOptions& options) {
    std::string region = options.region;
    const bool hasOuter = std::find(base.groupNames.begin(), base.groupNames.end(), "outer") != base.groupNames.end();
    if (region.empty()) region = hasOuter && options.method != "manual" ? "outer" : "all";
    return region == "all" ? base : groupSubmesh(base, region);
}

double meanFootprint(const std::vector<ElementKind>& kinds, double v) {
    double sum = 0, weights = 0;
    for (const ElementKind& k : kinds) {
        sum += k.weight * k.footprint;
        weights += k.weight;
    }
    return sum / weights * (1 + v * v / 3);
}

SeedSet makeSeeds(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const Scene& scene,
                  const std::vector<PlacementOptions>& manual, RunContext& context) {
    const StageTimer timer(context, "seeding");
    TriangleMesh part = decoratedSurface(base, scene.seeding);
    const bool cvt = scene.seeding.method == "cvt";
    if (cvt) {  // triangles much larger than cells would make each meet many seeds
        const double footprint = meanFootprint(kinds, scene.sizeVariation);
        const double spacing = scene.seeding.count ? std::sqrt(meshArea(part) / double(*scene.seeding.count))
                                                   : std::sqrt(footprint / *scene.seeding.coverage);
        const double longest = std::max(spacing, 1e-3 * meshBounds(part).diagonal());
        subdivideLongEdges(part, longest);
    }
    const Surface surface(std::move(part));
    SeedSet set;
    set.method = scene.seeding.method;
    set.decoratedArea = surface.area();
    if (cvt)
        cvtSeeds(surface, kinds, scene, context, set);
    else
        manualSeeds(surface, kinds, scene, manual, set);
    double footprints = 0;
    for (const Seed& s : set.seeds) footprints += kinds[size_t(s.kind)].footprint * s.scale * s.scale;
    set.coverage = footprints / set.decoratedArea;
    if (scene.sizeVariation > 0.1) context.warn("variation.size above 0.1 leaves uneven overlaps and gaps");
    return set;
}

}  // namespace pavel
