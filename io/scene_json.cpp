#include "pavel/io/scene_json.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <tuple>

#include "pavel/core/finish.h"
#include "pavel/io/json_reader.h"
#include "pavel/io/mesh_write.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string slurp(const std::string& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) throw InputError(path + ": is a folder; name a file");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw InputError(path + ": cannot be read; is the path right?");
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

json parseJson(const std::string& text, const std::string& name) {
    try {
        return json::parse(text, nullptr, true, true);
    } catch (const json::out_of_range& e) {
        const std::string what = e.what();
        throw InputError(name + ": " + what.substr(what.find("] ") + 2));
    } catch (const json::parse_error& e) {
        const std::string what = e.what();
        const size_t line =
            1 + size_t(std::count(text.begin(), text.begin() + long(std::min(e.byte, text.size())), '\n'));
        throw InputError(name + ", line " + std::to_string(line) + ": not valid JSON (" +
                         what.substr(what.find("] ") + 2) + ")");
    }
}

/// A value as one types it: text needs no quotes, and .5 is a number, too.
json typedValue(const std::string& text) {
    std::string number = text;
    const size_t point = number.find_first_not_of("-");
    if (point != std::string::npos && number[point] == '.') number.insert(point, "0");
    return json::accept(number) ? json::parse(number) : json(text);
}

void applyOverride(json& root, const std::string& text) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) throw InputError("--set " + text + ": write key.path=value");
    const std::string path = text.substr(0, equals), value = text.substr(equals + 1);
    json* at = &root;
    json* parent = nullptr;
    std::stringstream keys(path);
    std::string key;
    while (std::getline(keys, key, '.')) {
        const bool number = !key.empty() && key.find_first_not_of("0123456789") == std::string::npos;
        if (at->is_array() && number) {
            const size_t i = std::stoul(key);
            if (i >= at->size())
                throw InputError("--set " + path + ": there are only " + std::to_string(at->size()) + " entries");
            at = &(*at)[i];
        } else {
            parent = at;
            if (at->is_null()) *at = json::object();
            if (!at->is_object())
                throw InputError("--set " + path + ": \"" + key + "\" lies below a value that holds no keys");
            at = &(*at)[key];
        }
    }
    if (value == "null" && parent)
        parent->erase(key);
    else
        *at = typedValue(value);
}

/// Keys of a shape's parameters; unknown ones are errors of the caller's reader.
void readShape(JsonReader& r, std::string& shape, ShapeParameters& parameters, bool base) {
    r.get("shape", shape);
    if (shape.empty()) return;
    const ShapeInfo* info = findShape(shape);
    std::vector<std::string> names;
    for (const ShapeInfo& s : builtinShapes())
        if (s.isBase == base) names.push_back(s.name);
    if (!info || info->isBase != base) {
        std::string list;
        for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
        throw InputError(r.at("shape") + ": there is no built-in " + (base ? "base" : "element") + " \"" + shape +
                         "\"" + didYouMean(shape, names) + "; there are " + list);
    }
    for (const ShapeParameter& p : info->parameters) {
        std::optional<double> v;
        r.get(p.name, v);
        if (v) parameters[p.name] = *v;
    }
    makeShape(shape, parameters);  // checks the ranges
}

void readLook(JsonReader& r, std::string& color, std::string& finish) {
    r.get("color", color);
    if (!color.empty()) parseColor(color, r.at("color"));
    r.get("finish", finish);
    if (!finish.empty()) finishNamed(finish, r.at("finish"));
}

ElementOptions readElement(const json& j, const std::string& path) {
    JsonReader r(j, path);
    ElementOptions e;
    readShape(r, e.shape, e.parameters, false);
    r.get("mesh", e.mesh);
    e.name = !e.shape.empty() ? e.shape : fs::path(e.mesh).stem().string();
    r.get("name", e.name);
    r.get("scale", e.scale);
    r.get("up", e.up);
    r.get("weight", e.weight);
    readLook(r, e.color, e.finish);
    r.get("sink", e.sink);
    if (const json* k = r.find("stiffness")) {
        const bool rigid = k->is_string() && k->get<std::string>() == "rigid";
        if (!rigid && !k->is_number()) throw InputError(path + ".stiffness: must be a number above 0, or \"rigid\"");
        e.stiffness = rigid ? std::numeric_limits<double>::infinity() : k->get<double>();
    }
    if (const json* m = r.find("material")) {
        JsonReader material(*m, path + ".material");
        material.get("a", e.a);
        material.get("b", e.b);
        material.finish();
    }
    r.finish();
    return e;
}

PlacementOptions readPlacement(const json& j, const std::string& path) {
    JsonReader r(j, path);
    PlacementOptions p;
    if (!r.has("position")) throw InputError(path + ".position: is missing");
    r.get("position", p.position);
    r.get("normal", p.normal);
    r.get("tangent", p.tangent);
    r.get("rotation", p.rotation);
    r.get("scale", p.scale);
    r.get("element", p.element);
    for (const char* key : {"id", "links", "stripe"}) r.find(key);  // what a written seeds.json says besides
    r.finish();
    return p;
}

/// Two numbers or two points, as a list.
template <class T>
std::pair<T, T> readPair(const json& j, const std::string& where) {
    if (!j.is_array() || j.size() != 2) throw InputError(where + ": must be a list of two");
    return {JsonReader::as<T>(j[0], where), JsonReader::as<T>(j[1], where)};
}

/// A polyline as a list of points, or a list of polylines.
std::vector<std::vector<Vec3>> readLines(const json& j, const std::string& where) {
    const bool one = j.is_array() && !j.empty() && j[0].is_array() && !j[0].empty() && j[0][0].is_number();
    const json list = one ? json::array({j}) : j;
    if (!list.is_array()) throw InputError(where + ": must be a list of points [[x, y, z], ...], or of such lists");
    std::vector<std::vector<Vec3>> lines;
    for (const json& line : list) {
        if (!line.is_array() || line.empty())
            throw InputError(where + ": must be a list of points [[x, y, z], ...], or of such lists");
        lines.emplace_back();
        for (const json& p : line) lines.back().push_back(JsonReader::as<Vec3>(p, where));
    }
    return lines;
}

RegionOptions readRegion(const json& j, const std::string& where) {
    RegionOptions region;
    if (j.is_string()) {
        region.part = j.get<std::string>();
        return region;
    }
    JsonReader r(j, where);
    r.get("group", region.part);
    if (const json* box = r.find("box")) {
        const auto [lo, hi] = readPair<Vec3>(*box, where + ".box");
        region.box = Bounds{lo, hi};
    }
    if (const json* sphere = r.find("sphere")) {
        JsonReader s(*sphere, where + ".sphere");
        region.sphere.emplace();
        s.get("center", region.sphere->center);
        s.get("radius", region.sphere->radius);
        s.finish();
    }
    if (const json* height = r.find("height")) region.height = readPair<double>(*height, where + ".height");
    if (const json* curve = r.find("curve")) {
        JsonReader c(*curve, where + ".curve");
        region.curve.emplace();
        if (const json* points = c.find("points")) region.curve->lines = readLines(*points, where + ".curve.points");
        c.get("distance", region.curve->distance);
        c.finish();
        if (region.curve->lines.empty()) throw InputError(where + ".curve.points: is missing");
    }
    r.get("vertex_mask", region.mask);
    r.finish();
    return region;
}

FieldOptions readField(const json& j, const std::string& where) {
    JsonReader r(j, where);
    FieldOptions f;
    r.choice("type", f.type, {"smooth", "curvature", "axis", "around", "guides"});
    r.get("axis", f.axis);
    if (const json* strokes = r.find("strokes")) f.strokes = readLines(*strokes, where + ".strokes");
    r.finish();
    return f;
}

DensityOptions readDensity(const json& j, const std::string& where) {
    JsonReader r(j, where);
    DensityOptions d;
    r.get("map", d.map);
    if (d.map.empty())
        throw InputError(where + ".map: is missing; name \"curvature\", vertex values of the base's file, or a file");
    if (const json* range = r.find("range")) std::tie(d.least, d.most) = readPair<double>(*range, where + ".range");
    r.get("resize", d.resize);
    r.finish();
    return d;
}

SeedingOptions readSeeding(const json& j, const std::string& where) {
    JsonReader r(j, where);
    SeedingOptions s;
    r.choice("method", s.method, {"cvt", "stripes", "manual"});
    r.get("coverage", s.coverage);
    r.get("count", s.count);
    r.get("iterations", s.iterations);
    if (const json* offset = r.find("offset")) {
        s.autoOffset = *offset == "auto";
        if (!s.autoOffset) s.offset = JsonReader::as<double>(*offset, where + ".offset");
    }
    if (const json* region = r.find("region")) s.region = readRegion(*region, where + ".region");
    r.get("snap", s.snap);
    r.get("file", s.file);
    if (const json* list = r.find("placements")) {
        if (!list->is_array()) throw InputError(where + ".placements: must be a list");
        for (size_t i = 0; i < list->size(); ++i)
            s.placements.push_back(readPlacement((*list)[i], where + ".placements[" + std::to_string(i) + "]"));
    }
    if (const json* list = r.find("elements")) {
        if (!list->is_array()) throw InputError(where + ".elements: must be a list of names");
        for (const json& name : *list) s.elements.push_back(JsonReader::as<std::string>(name, where + ".elements"));
    }
    if (const json* density = r.find("density")) s.density = readDensity(*density, where + ".density");
    if (const json* field = r.find("field")) s.field = readField(*field, where + ".field");
    if (const json* spacing = r.find("spacing")) s.spacing = readPair<double>(*spacing, where + ".spacing");
    r.get("angle", s.angle);
    r.get("fit", s.fit);
    r.finish();
    return s;
}

ShellOptions readShell(const json& j) {
    JsonReader r(j, "shell");
    ShellOptions o;
    if (const json* parts = r.find("parts")) {
        if (parts->is_number_integer()) {
            o.split = "count";
            o.parts = parts->get<int>();
        } else if (parts->is_object()) {
            JsonReader g(*parts, "shell.parts");
            bool groups = false;
            g.get("groups", groups);
            g.finish();
            if (groups) o.split = "groups";
        } else {
            o.split = JsonReader::as<std::string>(*parts, "shell.parts");
            if (o.split != "auto" && o.split != "planes")
                throw InputError("shell.parts: must be \"auto\", \"planes\", a number or { \"groups\": true }");
        }
    }
    r.get("bed", o.bed);
    r.get("clearance", o.clearance);
    r.get("min_thickness", o.minThickness);
    r.get("lay_flat", o.layFlat);
    r.finish();
    return o;
}

OutputOptions readOutput(const json& j) {
    JsonReader r(j, "output");
    OutputOptions o;
    r.get("vdb", o.vdb);
    r.get("fog", o.fog);
    r.get("half", o.half);
    std::string elements = "merged";
    r.choice("elements", elements, {"merged", "separate"});
    o.separate = elements == "separate";
    if (const json* list = r.find("mesh")) {
        if (!list->is_array()) throw InputError("output.mesh: must be a list, such as [\"glb\", \"ply\"]");
        o.mesh.clear();
        for (const json& f : *list) {
            const std::string format = JsonReader::as<std::string>(f, "output.mesh");
            const auto& known = meshFormats();
            if (std::find(known.begin(), known.end(), format) == known.end())
                throw InputError("output.mesh: \"" + format + "\" is unknown; use " + meshFormatList());
            o.mesh.push_back(format);
        }
    }
    if (const json* remesh = r.find("remesh")) {
        JsonReader m(*remesh, "output.remesh");
        m.get("vertices", o.remeshVertices);
        m.finish();
    }
    r.get("adaptivity", o.adaptivity);
    r.get("with_base", o.withBase);
    r.get("preview", o.preview);
    r.get("figure", o.figure);
    if (const json* v = r.find("view")) {
        JsonReader view(*v, r.at("view"));
        view.get("azimuth", o.view.azimuth);
        view.get("elevation", o.view.elevation);
        view.get("zoom", o.view.zoom);
        view.get("width", o.view.width);
        view.get("height", o.view.height);
        view.finish();
        for (int side : {o.view.width, o.view.height})
            if (side < 16 || side > 8192) throw InputError(r.at("view") + ": width and height must be 16 to 8192");
        if (!(o.view.zoom > 0)) throw InputError(r.at("view.zoom") + ": must be above 0");
        if (o.view.elevation && !(std::abs(*o.view.elevation) <= 89))
            throw InputError(r.at("view.elevation") + ": must be from -89 to 89 degrees");
    }
    r.finish();
    return o;
}

}  // namespace

Scene parseScene(const std::string& text, const std::string& name, const std::string& folder,
                 const std::vector<std::string>& overrides) {
    json root = parseJson(text, name);
    for (const std::string& o : overrides) applyOverride(root, o);
    Scene s;
    s.folder = folder;
    try {
        JsonReader r(root, "");
        r.get("units", s.units);
        r.get("voxel_size", s.voxelSize);
        r.get("resolution", s.resolution);
        r.get("seed", s.seed);
        if (const json* j = r.find("base")) {
            JsonReader b(*j, "base");
            b.get("mesh", s.base.mesh);
            readShape(b, s.base.shape, s.base.parameters, true);
            b.get("scale_to", s.base.scaleTo);
            b.get("fill_holes", s.base.fillHoles);
            b.get("thicken", s.base.thicken);
            readLook(b, s.base.color, s.base.finish);
            b.finish();
        }
        if (const json* j = r.find("elements")) {
            if (!j->is_array()) throw InputError("elements: must be a list");
            for (size_t i = 0; i < j->size(); ++i)
                s.elements.push_back(readElement((*j)[i], "elements[" + std::to_string(i) + "]"));
        }
        if (const json* j = r.find("seeding")) {
            s.seedings.clear();
            if (!j->is_array()) s.seedings.push_back(readSeeding(*j, "seeding"));
            for (size_t i = 0; j->is_array() && i < j->size(); ++i)
                s.seedings.push_back(readSeeding((*j)[i], "seeding[" + std::to_string(i) + "]"));
            if (s.seedings.empty()) throw InputError("seeding: the list is empty; give at least one");
        }
        if (const json* j = r.find("orientation")) {
            JsonReader o(*j, "orientation");
            o.choice("rotation", s.orientation.rotation, {"random", "fixed", "field", "alternate"});
            o.get("angle", s.orientation.angle);
            o.get("jitter", s.orientation.jitter);
            o.finish();
        }
        r.choice("assignment", s.assignment, {"random", "alternate", "sequence"});
        if (const json* j = r.find("variation")) {
            JsonReader v(*j, "variation");
            v.get("size", s.sizeVariation);
            v.finish();
        }
        if (const json* j = r.find("refine")) {
            JsonReader v(*j, "refine");
            v.get("iterations", s.refineIterations);
            v.finish();
        }
        if (const json* j = r.find("material")) {
            JsonReader m(*j, "material");
            m.get("a", s.material.a);
            m.get("b", s.material.b);
            m.choice("contact", s.material.contact, {"center", "depth"});
            m.get("gap", s.material.gap);
            m.choice("base_loss", s.material.baseLoss, {"recover", "cut"});
            m.finish();
        }
        if (const json* j = r.find("output")) s.output = readOutput(*j);
        if (const json* j = r.find("shell")) s.shell = readShell(*j);
        r.finish();
        validate(s);
    } catch (const InputError& e) {
        throw InputError(name + ": " + e.what());
    } catch (const json::exception& e) {
        throw InputError(name + ": " + e.what());
    }
    return s;
}

Scene readScene(const std::string& path, const std::vector<std::string>& overrides) {
    const fs::path folder = fs::path(path).parent_path();
    return parseScene(slurp(path), path, folder.empty() ? "." : folder.string(), overrides);
}

std::vector<PlacementOptions> readSeeds(const std::string& path, const std::string& units) {
    const json root = parseJson(slurp(path), path);
    std::vector<PlacementOptions> result;
    try {
        JsonReader r(root, "");
        std::string own = units;
        r.get("units", own);
        const double factor = metresPerUnit(own) / metresPerUnit(units);
        for (const char* key : {"method", "spacing", "singularities", "branches", "decorated_area", "coverage"})
            r.find(key);
        const json* seeds = r.find("seeds");
        if (!seeds || !seeds->is_array()) throw InputError("seeds: a list is missing");
        for (size_t i = 0; i < seeds->size(); ++i) {
            result.push_back(readPlacement((*seeds)[i], "seeds[" + std::to_string(i) + "]"));
            result.back().position *= factor;
        }
        r.finish();
    } catch (const InputError& e) {
        throw InputError(path + ": " + e.what());
    }
    return result;
}

}  // namespace pavel
