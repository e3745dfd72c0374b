#include "pavel/seeding/seed.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/seeding/cvt.h"
#include "pavel/seeding/nearest.h"

namespace pavel {
namespace {

// One stream of random numbers per purpose, and per seeding.
enum Stream : uint64_t { kKindStream = 2, kRotationStream, kSizeStream, kStreams = 16 };

/// Seeds that are looked at to make neighbours differ.
constexpr size_t kAround = 6;

int kindByWeight(const std::vector<ElementKind>& kinds, const std::vector<int>& of, double u) {
    double sum = 0;
    for (int k : of) sum += kinds[size_t(k)].weight;
    double at = u * sum;
    for (size_t i = 0; i + 1 < of.size(); ++i) {
        if (at < kinds[size_t(of[i])].weight) return of[i];
        at -= kinds[size_t(of[i])].weight;
    }
    return of.back();
}

/// Gives every point a class, one for each weight, that is rare among its neighbours; of equally rare ones that which
/// is behind its share.
std::vector<int> alternating(const std::vector<SurfacePoint>& points, const std::vector<double>& weights) {
    const std::vector<std::vector<size_t>> around = nearestOf(points, kAround);
    std::vector<int> classes(points.size(), -1);
    std::vector<double> used(weights.size(), 0);
    constexpr int kSweeps = 3;  // later ones know all the neighbours
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (size_t i = 0; i < points.size(); ++i) {
            std::vector<int> near(weights.size(), 0);
            for (size_t n : around[i])
                if (classes[n] >= 0) ++near[size_t(classes[n])];
            if (classes[i] >= 0) --used[size_t(classes[i])];
            int best = -1;
            for (size_t c = 0; c < weights.size(); ++c) {
                if (!(weights[c] > 0)) continue;
                const size_t b = size_t(best);
                if (best < 0 || near[c] < near[b] ||
                    (near[c] == near[b] && used[c] / weights[c] < used[b] / weights[b]))
                    best = int(c);
            }
            classes[i] = best;
            ++used[size_t(best)];
        }
    return classes;
}

/// "Up" along the surface where there is such a direction.
Vec3 upTangent(const Vec3& normal) {
    const Vec3 t = Vec3(0, 0, 1) - normal[2] * normal;
    return length(t) > 0.05 ? normalized(t) : anyPerpendicular(normal);
}

size_t seedCount(const Surface& surface, double footprint, const SeedingOptions& seeding) {
    if (seeding.count) return *seeding.count;
    const double wanted = *seeding.coverage * surface.area() / footprint;
    if (wanted < 0.5)
        throw InputError(
            "seeding.coverage: not even one element is needed to cover this area; use smaller elements or a \"count\"");
    if (wanted > 1e7)
        throw InputError("seeding.coverage: this would take more than 10000000 elements; use larger ones");
    return size_t(std::llround(wanted));
}

/// Points as seeds: which kind, how turned, how large. `stream`: first of this seeding's random streams.
void dress(const std::vector<SurfacePoint>& points, const std::vector<ElementKind>& kinds, const std::vector<int>& of,
           const Scene& scene, uint64_t stream, SeedSet& set) {
    Rng kindRng(scene.seed, stream + kKindStream), rotationRng(scene.seed, stream + kRotationStream),
        sizeRng(scene.seed, stream + kSizeStream);
    std::vector<int> classes, turns;
    if (scene.assignment == "alternate") {
        std::vector<double> weights;
        for (int k : of) weights.push_back(kinds[size_t(k)].weight);
        classes = alternating(points, weights);
    }
    const OrientationOptions& o = scene.orientation;
    if (o.rotation == "alternate") turns = alternating(points, {1, 1});
    for (size_t i = 0; i < points.size(); ++i) {
        Seed s;
        s.id = int(set.seeds.size()) + 1;
        s.position = points[i].position;
        s.normal = points[i].normal;
        s.tangent = upTangent(s.normal);
        const double byWeight = kindRng.uniform();
        s.kind = scene.assignment == "random"     ? kindByWeight(kinds, of, byWeight)
                 : scene.assignment == "sequence" ? of[i % of.size()]
                                                  : of[size_t(classes[i])];
        const double u = rotationRng.uniform();
        s.rotation = o.rotation == "random" ? 360 * u : o.angle + o.jitter * (2 * u - 1);
        if (!turns.empty() && turns[i]) s.rotation += 180;
        s.scale = 1 + scene.sizeVariation * sizeRng.uniform(-1, 1);
        set.seeds.push_back(s);
    }
}

/// The kinds that a seeding places.
std::vector<int> kindsOf(const SeedingOptions& seeding, const std::vector<ElementKind>& kinds) {
    std::vector<int> of;
    for (size_t k = 0; k < kinds.size(); ++k)
        if (seeding.elements.empty() ||
            std::find(seeding.elements.begin(), seeding.elements.end(), kinds[k].name) != seeding.elements.end())
            of.push_back(int(k));
    return of;
}

bool inside(const RegionOptions& region, const Vec3& p) {
    if (region.box)
        for (int k = 0; k < 3; ++k)
            if (p[k] < region.box->min[k] || p[k] > region.box->max[k]) return false;
    if (region.sphere && length(p - region.sphere->center) > region.sphere->radius) return false;
    return !region.height || (p[2] >= region.height->first && p[2] <= region.height->second);
}

/// Keeps the triangles whose middle lies in the region.
void cutToRegion(TriangleMesh& mesh, const RegionOptions& region) {
    std::vector<Triangle> kept;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        if (inside(region, (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0))
            kept.push_back(mesh.triangles[t]);
    mesh.triangles = std::move(kept);
    mesh.groups.clear();
    mesh.groupNames.clear();
    removeUnusedVertices(mesh);
}

void manualSeeds(const Surface& surface, const std::vector<ElementKind>& kinds, const SeedingOptions& seeding,
                 const std::vector<PlacementOptions>& manual, SeedSet& set) {
    for (const PlacementOptions& p : manual) {
        Seed s;
        s.id = int(set.seeds.size()) + 1;
        const SurfacePoint q = surface.closest(p.position);
        s.position = seeding.snap ? q.position : p.position;
        s.normal = p.normal ? normalized(*p.normal) : q.normal;
        s.tangent = p.tangent ? *p.tangent : upTangent(s.normal);
        s.rotation = p.rotation;
        s.scale = p.scale;
        for (size_t k = 0; k < kinds.size(); ++k)
            if (kinds[k].name == p.element) s.kind = int(k);
        set.seeds.push_back(s);
    }
}

/// The part of an offset surface whose feet on the base lie in the region.
TriangleMesh aboveRegion(const TriangleMesh& offset, const Surface& base, const Surface& region, double distance) {
    std::vector<char> keep(offset.triangles.size());
    tbb::parallel_for(size_t(0), keep.size(), [&](size_t t) {
        const Vec3 p = (offset.corner(t, 0) + offset.corner(t, 1) + offset.corner(t, 2)) / 3.0;
        keep[t] = region.closest(p).distance < base.closest(p).distance + 1e-3 * distance;
    });
    TriangleMesh kept = offset;
    kept.triangles.clear();
    for (size_t t = 0; t < keep.size(); ++t)
        if (keep[t]) kept.triangles.push_back(offset.triangles[t]);
    removeUnusedVertices(kept);
    if (kept.triangles.empty()) throw InputError("seeding.offset: the offset surface has no point above the region");
    return kept;
}

/// Maps points of the offset surface back to the base. A foot is unique where the way back up along its normal leads to
/// the same point.
std::vector<SurfacePoint> feet(const std::vector<SurfacePoint>& points, const Surface& base, double distance) {
    constexpr double kUnique = 0.35;  // of the offset; facets of the base alone make for a tenth or so
    std::vector<SurfacePoint> all(points.size()), unique;
    tbb::parallel_for(size_t(0), points.size(), [&](size_t i) { all[i] = base.closest(points[i].position); });
    for (size_t i = 0; i < points.size(); ++i)
        if (length(all[i].position + distance * all[i].normal - points[i].position) < kUnique * distance)
            unique.push_back(all[i]);
    return unique;
}

}  // namespace

double samplingOffset(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding) {
    if (!seeding.autoOffset) return seeding.offset;
    double sum = 0, weights = 0;
    for (int k : kindsOf(seeding, kinds)) {
        const ElementKind& kind = kinds[size_t(k)];
        sum += kind.weight * (widestHeight(kind.mesh) - kind.sink);
        weights += kind.weight;
    }
    return weights > 0 ? std::max(0.0, sum / weights) : 0;
}

TriangleMesh decoratedSurface(const TriangleMesh& base, const SeedingOptions& options, double spacing) {
    std::string part = options.region.part;
    const bool hasOuter = std::find(base.groupNames.begin(), base.groupNames.end(), "outer") != base.groupNames.end();
    if (part.empty()) part = hasOuter && options.method != "manual" ? "outer" : "all";
    TriangleMesh mesh = part == "all" ? base : groupSubmesh(base, part);
    if (!options.region.cuts()) return mesh;
    subdivideLongEdges(mesh, std::max(spacing, 4e-3 * meshBounds(mesh).diagonal()) / 4);  // so that the border is fine
    cutToRegion(mesh, options.region);
    if (mesh.triangles.empty()) throw InputError("seeding.region: nothing of the base lies in it");
    return mesh;
}

double meanFootprint(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding, double v) {
    double sum = 0, weights = 0;
    for (int k : kindsOf(seeding, kinds)) {
        sum += kinds[size_t(k)].weight * kinds[size_t(k)].footprint;
        weights += kinds[size_t(k)].weight;
    }
    if (!(weights > 0)) throw InputError("seeding.elements: at least one of them needs a weight above 0");
    return sum / weights * (1 + v * v / 3);
}

double meanSpacing(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const SeedingOptions& seeding,
                   double sizeVariation) {
    if (seeding.coverage) return std::sqrt(meanFootprint(kinds, seeding, sizeVariation) / *seeding.coverage);
    return std::sqrt(meshArea(base) / double(std::max<size_t>(1, seeding.count.value_or(1))));
}

SeedSet makeSeeds(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const Scene& scene,
                  const std::vector<SeedingInput>& inputs, RunContext& context) {
    const StageTimer timer(context, "seeding");
    SeedSet set;
    set.method = scene.seedings[0].method;
    for (size_t i = 0; i < scene.seedings.size(); ++i) {
        const SeedingOptions& seeding = scene.seedings[i];
        const bool cvt = seeding.method == "cvt";
        double spacing = meanSpacing(base, kinds, seeding, scene.sizeVariation);
        TriangleMesh part = decoratedSurface(base, seeding, spacing);
        if (cvt && seeding.count) {  // the region's area, now known, sets the spacing, and how fine its border is
            spacing = meanSpacing(part, kinds, seeding, scene.sizeVariation);
            if (seeding.region.cuts()) part = decoratedSurface(base, seeding, spacing);
        }
        if (cvt) subdivideLongEdges(part, kLongestEdge * std::max(spacing, 1e-3 * meshBounds(part).diagonal()));
        const Surface surface(std::move(part));
        set.decoratedArea += surface.area();
        if (!cvt) {
            manualSeeds(surface, kinds, seeding, i < inputs.size() ? inputs[i].manual : seeding.placements, set);
            continue;
        }
        CvtOptions options;
        options.iterations = seeding.iterations;
        options.seed = scene.seed + i;
        const double share = 1 / double(scene.seedings.size());
        const size_t count = seedCount(surface, meanFootprint(kinds, seeding, scene.sizeVariation), seeding);
        const auto progress = [&](double done) { context.progress("seeding", (double(i) + done) * share); };
        const double offset = samplingOffset(kinds, seeding);
        std::vector<SurfacePoint> points;
        if (offset > 0 && i < inputs.size() && !inputs[i].offsetSurface.triangles.empty()) {
            const Surface whole(base);
            TriangleMesh above = aboveRegion(inputs[i].offsetSurface, whole, surface, offset);
            subdivideLongEdges(above, kLongestEdge * std::max(spacing, 1e-3 * meshBounds(above).diagonal()));
            const auto sampled = centroidalSeeds(Surface(std::move(above)), count, options, progress);
            points = feet(sampled, whole, offset);
            if (points.size() < sampled.size())
                context.warn(std::to_string(sampled.size() - points.size()) +
                             " elements are not placed: the offset surface merges across a gap there");
        } else {
            points = centroidalSeeds(surface, count, options, progress);
        }
        dress(points, kinds, kindsOf(seeding, kinds), scene, i * kStreams, set);
    }
    double footprints = 0;
    for (const Seed& s : set.seeds) footprints += kinds[size_t(s.kind)].footprint * s.scale * s.scale;
    set.coverage = footprints / set.decoratedArea;
    if (scene.sizeVariation > 0.1) context.warn("variation.size above 0.1 leaves uneven overlaps and gaps");
    return set;
}

}  // namespace pavel
