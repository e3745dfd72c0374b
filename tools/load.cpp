#include "pavel/tools/load.h"

#include <filesystem>
#include <fstream>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/mesh_check.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/seed_files.h"
#include "pavel/seeding/seed.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/offset_surface.h"

namespace pavel {
namespace {

std::string resolved(const Scene& scene, const std::string& path) {
    const std::filesystem::path p(path);
    return p.is_absolute() ? path : (std::filesystem::path(scene.folder) / p).string();
}

double baseScale(const BaseOptions& b, const TriangleMesh& mesh) {
    if (!b.scaleTo) return 1;
    const double side = meshBounds(mesh).longestSide();
    if (!(side > 0) || !std::isfinite(side)) throw InputError(b.mesh + ": the mesh has no finite size to scale");
    return *b.scaleTo / side;
}

/// Turns the axis named by `up` to +z.
void turnUp(TriangleMesh& mesh, const std::string& up) {
    const int axis = up.back() - 'x';
    const double sign = up[0] == '-' ? -1 : 1;
    Vec3 z(0, 0, 0);
    z[axis] = sign;
    Vec3 x(0, 0, 0);
    x[(axis + 1) % 3] = 1;
    const Vec3 y = cross(z, x);
    for (Vec3& p : mesh.points) p = Vec3(dot(p, x), dot(p, y), dot(p, z));
}

void report(const std::string& name, const std::vector<std::string>& done, RunContext& context) {
    for (const std::string& d : done) context.warn(name + ": " + d);
}

const char* const kPalette[] = {"#d9a78c", "#8fb3a8", "#c9b26b", "#9a8fb8", "#c98f9b", "#8fa6c9", "#b5c48f", "#bf8f6b"};

}  // namespace

TriangleMesh loadBase(const Scene& scene, RunContext& context) {
    const BaseOptions& b = scene.base;
    TriangleMesh mesh = b.shape.empty() ? readMesh(resolved(scene, b.mesh)) : makeShape(b.shape, b.parameters);
    if (b.scaleTo) scaleMesh(mesh, baseScale(b, mesh));
    RepairOptions repair;
    repair.fillHoles = b.fillHoles;
    repair.thicken = b.thicken;
    report(b.shape.empty() ? b.mesh : b.shape, makeSolid(mesh, b.shape.empty() ? b.mesh : "base", repair), context);
    return mesh;
}

std::vector<ElementKind> loadKinds(const Scene& scene, RunContext& context) {
    std::vector<ElementKind> kinds;
    for (const ElementOptions& e : scene.elements) {
        ElementKind k;
        k.name = e.name;
        k.mesh = e.shape.empty() ? readMesh(resolved(scene, e.mesh)) : makeShape(e.shape, e.parameters);
        if (e.shape.empty()) turnUp(k.mesh, e.up);
        scaleMesh(k.mesh, e.scale);
        report(e.name, makeSolid(k.mesh, e.shape.empty() ? e.mesh : e.name), context);
        k.mesh.groups.clear();
        k.mesh.groupNames.clear();
        k.weight = e.weight;
        k.stiffness = e.stiffness;
        k.sink = e.sink;
        k.footprint = footprintArea(k.mesh);
        const std::string plain = kPalette[kinds.size() % std::size(kPalette)];
        k.finish = e.finish.empty() ? Finish::clay : finishNamed(e.finish, "elements.finish");
        k.color = parseColor(!e.color.empty()   ? e.color
                             : e.finish.empty() ? plain
                                                : look(k.finish).color,
                             "elements.color");
        kinds.push_back(std::move(k));
    }
    return kinds;
}

std::vector<std::vector<PlacementOptions>> loadPlacements(const Scene& scene) {
    std::vector<std::vector<PlacementOptions>> all;
    std::vector<std::string> names;
    for (const ElementOptions& e : scene.elements) names.push_back(e.name);
    for (const SeedingOptions& s : scene.seedings) {
        all.push_back(s.placements);
        if (s.file.empty()) continue;
        const std::string path = resolved(scene, s.file);
        all.back() = std::filesystem::path(path).extension() == ".ply" ? readSeedsPly(path, names)
                                                                       : readSeeds(path, scene.units);
        if (all.back().empty()) throw InputError(path + ": holds no seeds");
        for (size_t i = 0; i < all.back().size(); ++i)
            checkPlacement(all.back()[i], names, path + ": seeds[" + std::to_string(i) + "]");
    }
    return all;
}

namespace {

/// A map by its name in the scene: vertex values of the base's file, a mesh with vertex colours or one property of its
/// own that lies on the base, or a text file with one number for each vertex of the base's file.
std::shared_ptr<const SurfaceMap> loadMap(const Scene& scene, const std::string& name, const std::string& key) {
    const std::string path = resolved(scene, name);
    VertexValues own;
    TriangleMesh mesh;
    if (scene.base.shape.empty()) mesh = readMesh(resolved(scene, scene.base.mesh), &own);
    const double factor = scene.base.shape.empty() ? baseScale(scene.base, mesh) : 1;
    std::vector<double> values;
    if (own.count(name)) {
        values = own[name];
    } else if (!std::filesystem::is_regular_file(path)) {
        std::string list;
        for (const auto& [known, v] : own) list += (list.empty() ? "" : ", ") + known;
        throw InputError(key + ": \"" + name + "\" is neither a file nor vertex values of the base" +
                         (list.empty() ? " (its file has none)" : "; there are " + list));
    } else if (std::ifstream text(path); isMeshFile(path)) {
        VertexValues given;
        mesh = readMesh(path, &given);
        if (given.empty() || (given.size() > 1 && !given.count("color")))
            throw InputError(path + ": needs vertex colours, or one property of the vertices, to serve as " + key);
        values = given.count("color") ? given["color"] : given.begin()->second;
    } else {
        for (double v; text >> v;) values.push_back(v);
        if (mesh.triangles.empty())
            throw InputError(key + ": numbers need a base from a file; give a mesh with vertex colours instead");
        if (values.size() != mesh.points.size() || !text.eof())
            throw InputError(path + ": must hold one number for each of the " + std::to_string(mesh.points.size()) +
                             " vertices of the base, and nothing else; " + std::to_string(values.size()) +
                             " were read");
    }
    for (double v : values)
        if (!std::isfinite(v)) throw InputError(key + ": \"" + name + "\" holds a value that is not finite");
    scaleMesh(mesh, factor);
    return std::make_shared<SurfaceMap>(std::move(mesh), std::move(values));
}

}  // namespace

std::shared_ptr<const SurfaceMap> loadMask(const Scene& scene, const SeedingOptions& seeding) {
    if (seeding.region.mask.empty()) return nullptr;
    return loadMap(scene, seeding.region.mask, "seeding.region.vertex_mask");
}

SeedSet loadSeeds(const Scene& scene, const TriangleMesh& base, const std::vector<ElementKind>& kinds,
                  RunContext& context) {
    std::vector<SeedingInput> inputs(scene.seedings.size());
    const auto manual = loadPlacements(scene);
    for (size_t i = 0; i < inputs.size(); ++i) {
        const SeedingOptions& d = scene.seedings[i];
        inputs[i].manual = manual[i];
        inputs[i].mask = loadMask(scene, d);
        if (d.density && d.density->map == "curvature")
            inputs[i].density = std::make_shared<SurfaceMap>(curvatureMap(base));
        else if (d.density)
            inputs[i].density = loadMap(scene, d.density->map, "seeding.density.map");
        const double offset = d.method == "cvt" ? samplingOffset(kinds, d) : 0;
        if (!(offset > 0)) continue;
        const StageTimer timer(context, "seeding");
        const double spacing = meanSpacing(base, kinds, d, scene.sizeVariation), size = meshBounds(base).diagonal();
        // Some hundred triangles a seed: searching and simplifying them is half of the time.
        inputs[i].offsetSurface = offsetSurface(base, offset, std::max(std::min(offset, spacing) / 2.5, size / 1500));
    }
    return makeSeeds(base, kinds, scene, inputs, context);
}

PackOptions packOptions(const Scene& scene, double voxelSize) {
    PackOptions options;
    options.voxelSize = voxelSize;
    for (const ElementOptions& e : scene.elements)
        options.kindMaterial.emplace_back(e.a.value_or(scene.material.a), e.b.value_or(scene.material.b));
    options.contactByDepth = scene.material.contact == "depth";
    options.gap = scene.material.gap;
    options.recoverBaseLoss = scene.material.baseLoss == "recover";
    return options;
}

double sceneVoxelSize(const Scene& scene, const std::vector<ElementKind>& kinds) {
    if (scene.voxelSize) return *scene.voxelSize;
    return 2 * std::sqrt(meanFootprint(kinds, {}, scene.sizeVariation) / kPi) / *scene.resolution;
}

}  // namespace pavel
