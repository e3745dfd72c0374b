#include "pavel/seeding/seed.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <tuple>

#include "pavel/core/error.h"
#include "pavel/seeding/cvt.h"
#include "pavel/seeding/dressing.h"
#include "pavel/seeding/refine.h"
#include "pavel/seeding/stripes.h"

namespace pavel {
namespace {

size_t seedCount(const Surface& surface, double footprint, const SeedingOptions& seeding) {
    if (seeding.count) return *seeding.count;
    const double wanted = *seeding.coverage * surface.area() / footprint;
    if (wanted < 0.5)
        throw InputError(
            "seeding.coverage: not even one element is needed to cover this area; use smaller elements or a \"count\"");
    if (wanted > 1e6) throw InputError("seeding.coverage: this would take more than 1000000 elements; use larger ones");
    return size_t(std::llround(wanted));
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

void manualSeeds(const Surface& surface, const std::vector<ElementKind>& kinds, const SeedingOptions& seeding,
                 const std::vector<PlacementOptions>& manual, const DirectionField* field, SeedSet& set) {
    for (const PlacementOptions& p : manual) {
        Seed s;
        s.id = int(set.seeds.size()) + 1;
        const SurfacePoint q = surface.closest(p.position);
        s.position = seeding.snap ? q.position : p.position;
        s.normal = p.normal ? normalized(*p.normal) : q.normal;
        const Vec3 t = p.tangent ? *p.tangent : field ? field->at(q) : upTangent(s.normal);
        s.tangent = normalized(t - dot(t, s.normal) * s.normal, upTangent(s.normal));
        s.rotation = p.rotation;
        s.scale = p.scale;
        for (size_t k = 0; k < kinds.size(); ++k)
            if (kinds[k].name == p.element) s.kind = int(k);
        set.seeds.push_back(s);
    }
}

double densityAt(const SurfaceMap& map, const DensityOptions& o, const Vec3& p, const Vec3& normal) {
    return o.least + (o.most - o.least) * std::clamp(map.at(p, normal), 0.0, 1.0);
}

/// Wanted elements per area on a surface's triangles, 1 in the mean; empty where the scene asks for no density.
std::vector<double> densities(const Surface& surface, const SeedingOptions& seeding, const SurfaceMap* map) {
    std::vector<double> d(seeding.density && map ? surface.mesh().triangles.size() : 0);
    const TriangleMesh& m = surface.mesh();
    tbb::parallel_for(size_t(0), d.size(), [&](size_t t) {
        d[t] = densityAt(*map, *seeding.density, (m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3.0,
                         surface.faceNormal(int(t)));
    });
    double mean = 0;
    for (size_t t = 0; t < d.size(); ++t) mean += d[t] * surface.faceArea(int(t)) / surface.area();
    for (double& x : d) x /= mean;
    return d;
}

/// The part of an offset surface whose feet on the base lie in the region.
TriangleMesh aboveRegion(const TriangleMesh& offset, const Surface& base, const Surface& region, double distance) {
    std::vector<char> above(offset.points.size());
    // Two indices are made at the same time.
    if (!above.empty())
        tbb::parallel_invoke([&] { region.closest(offset.points[0]); }, [&] { base.closest(offset.points[0]); });
    tbb::parallel_for(size_t(0), above.size(), [&](size_t i) {
        const Vec3& p = offset.points[i];
        above[i] = region.closest(p).distance < base.closest(p).distance + 1e-3 * distance;
    });
    TriangleMesh kept = offset;
    kept.triangles.clear();
    for (const Triangle& t : offset.triangles)
        if (above[size_t(t[0])] + above[size_t(t[1])] + above[size_t(t[2])] >= 2) kept.triangles.push_back(t);
    removeUnusedVertices(kept);
    if (kept.triangles.empty()) throw InputError("seeding.offset: the offset surface has no point above the region");
    return kept;
}

/// Maps points of the offset surface back to the base, and drops the values of those that have no foot. A foot is
/// unique where the way back up along its normal leads to the same point.
std::vector<SurfacePoint> feet(const std::vector<SurfacePoint>& points, const Surface& base, double distance,
                               std::vector<double>& values) {
    constexpr double kUnique = 0.35;  // of the offset; facets of the base alone make for a tenth or so
    std::vector<SurfacePoint> all(points.size()), unique;
    std::vector<double> kept;
    tbb::parallel_for(size_t(0), points.size(), [&](size_t i) { all[i] = base.closest(points[i].position); });
    for (size_t i = 0; i < points.size(); ++i)
        if (length(all[i].position + distance * all[i].normal - points[i].position) < kUnique * distance) {
            unique.push_back(all[i]);
            if (!values.empty()) kept.push_back(values[i]);
        }
    values = std::move(kept);
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
    if (seeding.spacing) return std::sqrt(seeding.spacing->first * seeding.spacing->second);
    if (seeding.coverage) return std::sqrt(meanFootprint(kinds, seeding, sizeVariation) / *seeding.coverage);
    return std::sqrt(meshArea(base) / double(std::max<size_t>(1, seeding.count.value_or(1))));
}

namespace {

/// Mean length and width of a seeding's elements.
std::pair<double, double> meanExtent(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding) {
    Vec3 sum(0, 0, 0);
    double weights = 0;
    for (int k : kindsOf(seeding, kinds)) {
        sum += kinds[size_t(k)].weight * meshBounds(kinds[size_t(k)].mesh).size();
        weights += kinds[size_t(k)].weight;
    }
    return {sum[0] / weights, sum[1] / weights};
}

/// Each element's scale by the distance to its neighbours on the main stripe.
std::vector<double> fitted(const StripeSeeds& stripes) {
    constexpr double kLeast = 0.7, kMost = 1.4;
    std::vector<double> scale;
    for (const StripeSeed& s : stripes.seeds) {
        double sum = 0;
        int n = 0;
        for (int other : s.onMain)
            if (other >= 0) sum += length(stripes.seeds[size_t(other)].point.position - s.point.position), ++n;
        scale.push_back(n ? std::clamp(sum / n / stripes.along, kLeast, kMost) : 1);
    }
    return scale;
}

/// Which way along a line is forward: along or around the axis that a field follows, else upwards.
std::function<Vec3(const Vec3&)> preferredDirection(const FieldOptions& field, const TriangleMesh& mesh) {
    const Bounds b = meshBounds(mesh);
    const Vec3 axis = normalized(field.axis), centre = 0.5 * (b.min + b.max);
    if (field.type == "around") return [=](const Vec3& p) { return normalized(cross(axis, p - centre)); };
    const Vec3 up = field.type == "axis" ? axis : Vec3(0, 0, 1);
    return [=](const Vec3&) { return up; };
}

/// The spacings that a seeding asks for, for what is known of it: by its coverage or count, in the elements'
/// proportions.
StripeOptions stripeOptions(const std::vector<ElementKind>& kinds, const SeedingOptions& seeding, double area,
                            double sizeVariation) {
    StripeOptions o;
    o.angle = seeding.angle;
    if (seeding.spacing) {
        std::tie(o.along, o.across) = *seeding.spacing;
        return o;
    }
    const double footprint = meanFootprint(kinds, seeding, sizeVariation);
    const auto [length, width] = meanExtent(kinds, seeding);
    o.count = seeding.count.value_or(size_t(std::llround(seeding.coverage.value_or(0) * area / footprint)));
    const double cell = area / double(std::max<size_t>(1, o.count));
    o.along = std::sqrt(cell * length / width);
    o.across = cell / o.along;
    return o;
}

}  // namespace

SeedSet makeSeeds(const TriangleMesh& base, const std::vector<ElementKind>& kinds, const Scene& scene,
                  const std::vector<SeedingInput>& inputs, RunContext& context) {
    const StageTimer timer(context, "seeding");
    SeedSet set;
    set.method = scene.seedings[0].method;
    for (size_t i = 0; i < scene.seedings.size(); ++i) {
        const SeedingOptions& seeding = scene.seedings[i];
        static const SeedingInput none;
        const SeedingInput& input = i < inputs.size() ? inputs[i] : none;
        const bool cvt = seeding.method == "cvt", stripes = seeding.method == "stripes",
                   manual = seeding.method == "manual";
        double spacing = meanSpacing(base, kinds, seeding, scene.sizeVariation);
        TriangleMesh part = decoratedSurface(base, seeding, spacing, input.mask.get());
        if (!manual && seeding.count) {  // the region's area, now known, sets the spacing, and how fine its border is
            spacing = meanSpacing(part, kinds, seeding, scene.sizeVariation);
            if (seeding.region.cuts()) part = decoratedSurface(base, seeding, spacing, input.mask.get());
        }
        if (cvt) subdivideLongEdges(part, kLongestEdge * std::max(spacing, 1e-3 * meshBounds(part).diagonal()));
        StripeOptions striped;
        if (stripes) {
            striped = stripeOptions(kinds, seeding, meshArea(part), scene.sizeVariation);
            subdivideLongEdges(part, std::max(stripeEdge(striped), 1e-3 * meshBounds(part).diagonal()));
        }
        const Surface surface(std::move(part));
        set.decoratedArea += surface.area();
        const bool alongField = scene.orientation.rotation == "field";
        std::unique_ptr<DirectionField> field;
        if (manual) {
            if (alongField) field = std::make_unique<DirectionField>(surface, seeding.field, 1);
            manualSeeds(surface, kinds, seeding, i < inputs.size() ? input.manual : seeding.placements, field.get(),
                        set);
            continue;
        }
        const double footprint = meanFootprint(kinds, seeding, scene.sizeVariation);
        if (footprint > surface.area()) {
            const std::string what = "its elements (footprint " + std::to_string(footprint) +
                                     ") are larger than the region that they decorate (area " +
                                     std::to_string(surface.area()) + "); scale them";
            if (!seeding.count) throw InputError("seeding: " + what);
            context.warn(what);
        }
        CvtOptions options;
        options.iterations = seeding.iterations;
        options.seed = scene.seed + i;
        const double share = 1 / double(scene.seedings.size());
        const size_t count = cvt ? seedCount(surface, footprint, seeding) : 0;
        const auto progress = [&](double done) { context.progress("seeding", (double(i) + done) * share); };
        const double offset = samplingOffset(kinds, seeding);
        std::vector<SurfacePoint> points;
        std::vector<double> density;  // at the points
        const auto sample = [&](const Surface& ground) {
            options.density = densities(ground, seeding, input.density.get());
            const auto seeds = centroidalSeeds(ground, count, options, progress);
            for (const SurfacePoint& p : seeds)
                if (!options.density.empty()) density.push_back(options.density[size_t(p.triangle)]);
            return seeds;
        };
        std::unique_ptr<Surface> whole;
        if (offset > 0 && !input.offsetSurface.triangles.empty()) {
            whole = std::make_unique<Surface>(base);
            const bool everywhere = surface.area() > (1 - 1e-9) * whole->area();
            TriangleMesh above =
                everywhere ? input.offsetSurface : aboveRegion(input.offsetSurface, *whole, surface, offset);
            subdivideLongEdges(above, kLongestEdge * std::max(spacing, 1e-3 * meshBounds(above).diagonal()));
            const std::vector<SurfacePoint> sampled = sample(Surface(std::move(above)));
            points = feet(sampled, *whole, offset, density);
            if (points.size() < sampled.size())
                context.warn(std::to_string(sampled.size() - points.size()) +
                             " elements are not placed: the offset surface merges across a gap there");
        } else if (cvt) {
            points = sample(surface);
        }
        Dressing dressing{kinds, kindsOf(seeding, kinds), scene, i * kStreams, nullptr, {}, nullptr};
        StripeSeeds crossings;
        if (stripes) {
            field = std::make_unique<DirectionField>(surface, seeding.field, 2);
            progress(0.4);
            crossings = stripeSeeds(surface, *field, striped, preferredDirection(seeding.field, surface.mesh()));
            if (crossings.seeds.empty())
                throw InputError("seeding: no stripes cross here; the spacing is too large for the surface");
            for (const StripeSeed& s : crossings.seeds) points.push_back(s.point);
            dressing.stripes = &crossings.seeds;
            if (seeding.fit) dressing.scale = fitted(crossings);
            set.spacing = {crossings.along, crossings.across};
            for (int pattern : {0, 1})
                for (const StripeLine& l : crossings.lines.lines[pattern])
                    set.stripes.push_back({l.points, l.closed, pattern == 0});
            set.singularities += crossings.singularities;
            set.branches += crossings.branches;
            if (crossings.dropped)
                context.warn(std::to_string(crossings.dropped) +
                             " crossings are left out: nearer to another than half the spacing");
        } else if (alongField) {
            field = std::make_unique<DirectionField>(whole ? *whole : surface, seeding.field, 1);
            dressing.field = field.get();
        }
        if (seeding.density && seeding.density->resize)
            for (double d : density) dressing.scale.push_back(1 / std::sqrt(d));
        const size_t first = set.seeds.size();
        dress(points, dressing, set.seeds);
        RefineOptions refinement;
        refinement.iterations = scene.refineIterations;
        refinement.turn = scene.orientation.rotation == "random";
        refinement.seed = scene.seed + i;
        refine(whole ? *whole : surface, surface, kinds, refinement, points, set.seeds.data() + first);
    }
    double footprints = 0;
    for (const Seed& s : set.seeds) footprints += kinds[size_t(s.kind)].footprint * s.scale * s.scale;
    set.coverage = footprints / set.decoratedArea;
    if (scene.sizeVariation > 0.1) context.warn("variation.size above 0.1 leaves uneven overlaps and gaps");
    return set;
}

}  // namespace pavel
