#include "pavel/core/scene.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pavel/core/error.h"

namespace pavel {
namespace {

void need(bool ok, const std::string& message) {
    if (!ok) throw InputError(message);
}

bool positive(double v) {
    return std::isfinite(v) && v > 0;
}

void checkMaterial(double a, double b, const std::string& where) {
    need(positive(a) && std::isfinite(b) && b > a && b <= 3, where + ": a and b must satisfy 0 < a < b <= 3");
}

void checkSeeding(const SeedingOptions& d, const std::set<std::string>& names, const std::string& at) {
    if (d.method != "manual") {
        const bool stripes = d.method == "stripes";
        if (stripes) {
            need(!(d.spacing && (d.coverage || d.count)), at + ": give spacing, coverage or count, only one of them");
            if (d.spacing)
                need(positive(d.spacing->first) && positive(d.spacing->second),
                     at + ".spacing must be two lengths above 0: along the stripes and across");
            need(d.angle >= 15 && d.angle <= 165, at + ".angle must be from 15 to 165 degrees");
            need(d.offset == 0 && !d.autoOffset, at + ".offset: stripes lie on the surface; leave it out");
            need(!d.density, at + ".density: stripes are evenly spaced; leave it out");
        } else {
            need(!d.spacing && !d.fit, at + ": spacing and fit are for the method \"stripes\"");
        }
        need(!(d.coverage && d.count), at + ": give coverage or count, not both");
        need(d.coverage || d.count || d.spacing,
             at + ": give \"coverage\" (1.2 to 1.6 suits most) or \"count\"" + (stripes ? " or \"spacing\"" : ""));
        if (d.coverage)
            need(positive(*d.coverage) && *d.coverage <= 10, at + ".coverage must be above 0 and at most 10");
        if (d.count) need(*d.count >= 1 && *d.count <= 1000000, at + ".count must be from 1 to 1000000");
        need(d.iterations >= 0 && d.iterations <= 100000, at + ".iterations must be from 0 to 100000");
    } else {
        need(d.placements.empty() != d.file.empty(), at + ": method \"manual\" needs \"placements\" or \"file\"");
        for (size_t i = 0; i < d.placements.size(); ++i)
            checkPlacement(d.placements[i], {names.begin(), names.end()},
                           at + ".placements[" + std::to_string(i) + "]");
    }
    for (const std::string& name : d.elements)
        need(names.count(name), at + ".elements: there is no element \"" + name + "\"" +
                                    didYouMean(name, std::vector<std::string>(names.begin(), names.end())));
    need(std::isfinite(d.offset) && d.offset >= 0, at + ".offset must be at least 0, or \"auto\"");
    if (d.density)
        need(positive(d.density->least) && std::isfinite(d.density->most) && d.density->most <= 1e4 &&
                 d.density->least >= 1e-4 && d.density->most > 0,
             at + ".density.range must be two numbers from 0.0001 to 10000");
    need(isFinite(d.field.axis) && length(d.field.axis) > 0, at + ".field.axis must not be zero");
    if (d.field.type == "guides") need(!d.field.strokes.empty(), at + ".field: \"guides\" need \"strokes\"");
    for (const auto& stroke : d.field.strokes) {
        need(stroke.size() >= 2, at + ".field.strokes: each needs at least two points");
        for (const Vec3& p : stroke) need(isFinite(p), at + ".field.strokes must be finite");
    }
    const RegionOptions& r = d.region;
    if (r.curve) {
        need(positive(r.curve->distance), at + ".region.curve needs a distance above 0");
        for (const auto& line : r.curve->lines)
            for (const Vec3& p : line) need(isFinite(p), at + ".region.curve.points must be finite");
    }
    if (r.box)
        need(isFinite(r.box->min) && isFinite(r.box->max) && (r.box->size()).min() > 0,
             at + ".region.box must be two corners, the least first");
    if (r.sphere)
        need(isFinite(r.sphere->center) && positive(r.sphere->radius), at + ".region.sphere needs a radius above 0");
    if (r.height)
        need(std::isfinite(r.height->first) && std::isfinite(r.height->second) && r.height->first < r.height->second,
             at + ".region.height must be two heights, the lower first");
}

}  // namespace

void checkPlacement(const PlacementOptions& p, const std::vector<std::string>& names, const std::string& where) {
    need(isFinite(p.position), where + ".position must be finite");
    need(positive(p.scale), where + ".scale must be above 0");
    need(std::isfinite(p.rotation), where + ".rotation must be finite");
    if (p.normal) need(isFinite(*p.normal) && length(*p.normal) > 0, where + ".normal must not be zero");
    if (p.tangent) need(isFinite(*p.tangent) && length(*p.tangent) > 0, where + ".tangent must not be zero");
    need(p.element.empty() || std::find(names.begin(), names.end(), p.element) != names.end(),
         where + ".element: there is no element \"" + p.element + "\"" + didYouMean(p.element, names));
}

double metresPerUnit(const std::string& units) {
    const std::pair<const char*, double> known[] = {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}, {"in", 0.0254}};
    for (const auto& [name, metres] : known)
        if (units == name) return metres;
    throw InputError("units: \"" + units + "\" is unknown; use mm, cm, m or in");
}

void validate(const Scene& s) {
    metresPerUnit(s.units);
    need(!(s.voxelSize && s.resolution), "give voxel_size or resolution, not both");
    need(s.voxelSize || s.resolution, "give voxel_size (a length) or resolution (voxels across an element)");
    if (s.voxelSize) need(positive(*s.voxelSize), "voxel_size must be above 0");
    if (s.resolution)
        need(std::isfinite(*s.resolution) && *s.resolution >= 4,
             "resolution must be at least 4 voxels across an element");
    need(s.base.mesh.empty() != s.base.shape.empty(), "base: give either \"mesh\" (a file) or \"shape\" (a built-in)");
    if (s.base.scaleTo) need(positive(*s.base.scaleTo), "base.scale_to must be above 0");
    need(std::isfinite(s.base.thicken) && s.base.thicken >= 0, "base.thicken must be at least 0");
    need(!s.elements.empty(), "elements: at least one is needed");
    std::set<std::string> names;
    double weights = 0;
    for (size_t i = 0; i < s.elements.size(); ++i) {
        const ElementOptions& e = s.elements[i];
        const std::string where = "elements[" + std::to_string(i) + "]";
        need(e.mesh.empty() != e.shape.empty(), where + ": give either \"mesh\" (a file) or \"shape\" (a built-in)");
        need(names.insert(e.name).second,
             where + ": the name \"" + e.name + "\" is taken; give each element its own \"name\"");
        need(positive(e.scale), where + ".scale must be above 0");
        need(std::isfinite(e.weight) && e.weight >= 0, where + ".weight must be at least 0");
        need(std::isfinite(e.sink), where + ".sink must be a finite number");
        static const std::set<std::string> axes = {"x", "y", "z", "-x", "-y", "-z"};
        need(axes.count(e.up), where + ".up must be one of x, y, z, -x, -y, -z");
        checkMaterial(e.a.value_or(s.material.a), e.b.value_or(s.material.b), where + ".material");
        need(e.stiffness > 0, where + ".stiffness must be above 0, or \"rigid\"");
        weights += e.weight;
    }
    need(weights > 0, "elements: at least one weight must be above 0");
    for (size_t i = 0; i < s.seedings.size(); ++i)
        checkSeeding(s.seedings[i], names, s.seedings.size() > 1 ? "seeding[" + std::to_string(i) + "]" : "seeding");
    need(std::isfinite(s.orientation.angle) && std::isfinite(s.orientation.jitter) && s.orientation.jitter >= 0,
         "orientation: angle and jitter must be finite, jitter at least 0");
    need(s.refineIterations >= 0 && s.refineIterations <= 1000, "refine.iterations must be from 0 to 1000");
    need(std::isfinite(s.sizeVariation) && s.sizeVariation >= 0 && s.sizeVariation < 1,
         "variation.size must be at least 0 and below 1");
    checkMaterial(s.material.a, s.material.b, "material");
    need(std::isfinite(s.material.gap) && s.material.gap >= 0, "material.gap must be at least 0");
    need(isFinite(s.shell.bed) && s.shell.bed.min() > 0, "shell.bed must be three lengths above 0");
    need(std::isfinite(s.shell.clearance) && s.shell.clearance >= 0, "shell.clearance must be at least 0");
    need(std::isfinite(s.shell.minThickness) && s.shell.minThickness >= 0, "shell.min_thickness must be at least 0");
    need(s.shell.split != "count" || (s.shell.parts >= 1 && s.shell.parts <= 1000),
         "shell.parts must be from 1 to 1000, or \"auto\", \"planes\" or { \"groups\": true }");
    need(!s.output.remeshVertices || *s.output.remeshVertices >= 4, "output.remesh.vertices must be at least 4");
    need(s.output.adaptivity >= 0 && s.output.adaptivity <= 1, "output.adaptivity must lie in [0, 1]");
}

}  // namespace pavel
