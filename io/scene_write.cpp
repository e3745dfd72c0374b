// The writing half of scene_json.h.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pavel/core/shapes.h"
#include "pavel/io/scene_json.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;
using ordered = nlohmann::ordered_json;

ordered parametersJson(const std::string& shape, const ShapeParameters& given) {
    ordered j;
    j["shape"] = shape;
    for (const ShapeParameter& p : findShape(shape)->parameters)
        j[p.name] = given.count(p.name) ? given.at(p.name) : p.value;
    return j;
}

ordered vectorJson(const Vec3& v) {
    return ordered::array({v[0], v[1], v[2]});
}

/// A path that works from `folder`.
std::string pathFrom(const std::string& path, const Scene& scene, const std::string& folder) {
    if (fs::path(path).is_absolute()) return path;
    return fs::proximate(fs::absolute(fs::path(scene.folder) / path), fs::absolute(folder)).string();
}

/// Where vertex values come from: a file is named as it is found from `folder`, a name stays.
std::string valuesPath(const std::string& name, const Scene& scene, const std::string& folder) {
    const bool isFile = fs::exists(fs::path(name).is_absolute() ? fs::path(name) : fs::path(scene.folder) / name);
    return isFile ? pathFrom(name, scene, folder) : name;
}

void addLook(ordered& j, const std::string& color, const std::string& finish) {
    if (!color.empty()) j["color"] = color;
    if (!finish.empty()) j["finish"] = finish;
}

ordered linesJson(const std::vector<std::vector<Vec3>>& lines) {
    ordered j = ordered::array();
    for (const auto& line : lines) {
        j.push_back(ordered::array());
        for (const Vec3& p : line) j.back().push_back(vectorJson(p));
    }
    return j;
}

ordered fieldJson(const FieldOptions& f) {
    ordered j{{"type", f.type}};
    if (f.type == "axis" || f.type == "around") j["axis"] = vectorJson(f.axis);
    if (!f.strokes.empty()) j["strokes"] = linesJson(f.strokes);
    return j;
}

ordered regionJson(const RegionOptions& r, const Scene& scene, const std::string& folder) {
    if (!r.cuts()) return r.part;
    ordered j;
    if (!r.part.empty()) j["group"] = r.part;
    if (r.box) j["box"] = {vectorJson(r.box->min), vectorJson(r.box->max)};
    if (r.sphere) j["sphere"] = {{"center", vectorJson(r.sphere->center)}, {"radius", r.sphere->radius}};
    if (r.height) j["height"] = {r.height->first, r.height->second};
    if (r.curve) j["curve"] = {{"points", linesJson(r.curve->lines)}, {"distance", r.curve->distance}};
    if (!r.mask.empty()) j["vertex_mask"] = valuesPath(r.mask, scene, folder);
    return j;
}

ordered seedingJson(const SeedingOptions& d, const Scene& scene, const std::string& folder) {
    ordered seeding{{"method", d.method}};
    if (d.coverage) seeding["coverage"] = *d.coverage;
    if (d.count) seeding["count"] = *d.count;
    if (d.method == "stripes") {
        if (d.spacing) seeding["spacing"] = {d.spacing->first, d.spacing->second};
        seeding["angle"] = d.angle;
        seeding["fit"] = d.fit;
        seeding["field"] = fieldJson(d.field);
    } else if (d.method == "cvt") {
        seeding["iterations"] = d.iterations;
        seeding["offset"] = d.autoOffset ? ordered("auto") : ordered(d.offset);
        if (d.density)
            seeding["density"] = {{"map", valuesPath(d.density->map, scene, folder)},
                                  {"range", {d.density->least, d.density->most}},
                                  {"resize", d.density->resize}};
        seeding["field"] = fieldJson(d.field);
    } else {
        seeding["snap"] = d.snap;
        if (!d.file.empty()) seeding["file"] = pathFrom(d.file, scene, folder);
        for (const PlacementOptions& p : d.placements) {
            ordered j{{"position", vectorJson(p.position)}};
            if (p.normal) j["normal"] = vectorJson(*p.normal);
            if (p.tangent) j["tangent"] = vectorJson(*p.tangent);
            j["rotation"] = p.rotation;
            j["scale"] = p.scale;
            if (!p.element.empty()) j["element"] = p.element;
            seeding["placements"].push_back(j);
        }
    }
    if (d.region.cuts() || !d.region.part.empty()) seeding["region"] = regionJson(d.region, scene, folder);
    if (!d.elements.empty()) seeding["elements"] = d.elements;
    return seeding;
}

}  // namespace

std::string sceneJson(const Scene& s, const std::string& folder) {
    ordered root;
    root["units"] = s.units;
    if (s.voxelSize)
        root["voxel_size"] = *s.voxelSize;
    else
        root["resolution"] = *s.resolution;
    root["seed"] = s.seed;
    ordered base = s.base.shape.empty() ? ordered{{"mesh", pathFrom(s.base.mesh, s, folder)}}
                                        : parametersJson(s.base.shape, s.base.parameters);
    if (s.base.scaleTo) base["scale_to"] = *s.base.scaleTo;
    base["fill_holes"] = s.base.fillHoles;
    base["thicken"] = s.base.thicken;
    addLook(base, s.base.color, s.base.finish);
    root["base"] = base;
    root["elements"] = ordered::array();
    for (const ElementOptions& e : s.elements) {
        ordered j{{"name", e.name}};
        j.update(e.shape.empty() ? ordered{{"mesh", pathFrom(e.mesh, s, folder)}, {"up", e.up}}
                                 : parametersJson(e.shape, e.parameters));
        j["scale"] = e.scale;
        j["weight"] = e.weight;
        addLook(j, e.color, e.finish);
        j["stiffness"] =
            std::isinf(e.stiffness) ? nlohmann::ordered_json("rigid") : nlohmann::ordered_json(e.stiffness);
        j["sink"] = e.sink;
        j["material"] = {{"a", e.a.value_or(s.material.a)}, {"b", e.b.value_or(s.material.b)}};
        root["elements"].push_back(j);
    }
    if (s.seedings.size() == 1) {
        root["seeding"] = seedingJson(s.seedings[0], s, folder);
    } else {
        for (const SeedingOptions& d : s.seedings) root["seeding"].push_back(seedingJson(d, s, folder));
    }
    root["orientation"] = {
        {"rotation", s.orientation.rotation}, {"angle", s.orientation.angle}, {"jitter", s.orientation.jitter}};
    root["assignment"] = s.assignment;
    root["variation"] = {{"size", s.sizeVariation}};
    root["refine"] = {{"iterations", s.refineIterations}};
    root["material"] = {{"a", s.material.a},
                        {"b", s.material.b},
                        {"contact", s.material.contact},
                        {"gap", s.material.gap},
                        {"base_loss", s.material.baseLoss}};
    root["output"] = {{"vdb", s.output.vdb},
                      {"fog", s.output.fog},
                      {"half", s.output.half},
                      {"elements", s.output.separate ? "separate" : "merged"},
                      {"mesh", s.output.mesh},
                      {"adaptivity", s.output.adaptivity},
                      {"with_base", s.output.withBase},
                      {"preview", s.output.preview},
                      {"figure", s.output.figure},
                      {"view",
                       {{"azimuth", s.output.view.azimuth},
                        {"zoom", s.output.view.zoom},
                        {"width", s.output.view.width},
                        {"height", s.output.view.height}}}};
    if (s.output.view.elevation) root["output"]["view"]["elevation"] = *s.output.view.elevation;
    const ShellOptions& shell = s.shell;
    root["shell"] = {{"parts", shell.split == "count"    ? ordered(shell.parts)
                               : shell.split == "groups" ? ordered{{"groups", true}}
                                                         : ordered(shell.split)},
                     {"bed", vectorJson(shell.bed)},
                     {"clearance", shell.clearance},
                     {"min_thickness", shell.minThickness},
                     {"lay_flat", shell.layFlat}};
    if (s.output.remeshVertices) root["output"]["remesh"] = {{"vertices", *s.output.remeshVertices}};
    return root.dump(2) + "\n";
}

std::string sceneDigest(const Scene& scene) {
    const std::string text = sceneJson(scene, scene.folder);
    // FNV-1a over two seeds: a name, not a proof.
    uint64_t hash[2] = {14695981039346656037ull, 1099511628211ull * 31};
    for (unsigned char c : text)
        for (uint64_t& h : hash) h = (h ^ c) * 1099511628211ull;
    char digits[33];
    std::snprintf(digits, sizeof digits, "%016llx%016llx", (unsigned long long)hash[0], (unsigned long long)hash[1]);
    return digits;
}

std::string seedsJson(const SeedSet& set, const std::vector<ElementKind>& kinds, const std::string& units) {
    ordered root{
        {"units", units}, {"method", set.method}, {"decorated_area", set.decoratedArea}, {"coverage", set.coverage}};
    if (set.spacing) {
        root["spacing"] = {set.spacing->first, set.spacing->second};
        root["singularities"] = set.singularities;
        root["branches"] = set.branches;
    }
    root["seeds"] = ordered::array();
    const auto ids = [](const std::array<int, 2>& pair) {
        ordered j = ordered::array();
        for (int id : pair) j.push_back(id > 0 ? ordered(id) : ordered(nullptr));
        return j;
    };
    for (const Seed& s : set.seeds) {
        root["seeds"].push_back({{"id", s.id},
                                 {"position", vectorJson(s.position)},
                                 {"normal", vectorJson(s.normal)},
                                 {"tangent", vectorJson(s.tangent)},
                                 {"rotation", s.rotation},
                                 {"scale", s.scale},
                                 {"element", kinds[size_t(s.kind)].name}});
        if (!s.stripe) continue;
        root["seeds"].back()["stripe"] = s.stripe->index;
        root["seeds"].back()["links"] = {{"along", ids(s.stripe->along)}, {"across", ids(s.stripe->across)}};
    }
    return root.dump(1) + "\n";
}

}  // namespace pavel
