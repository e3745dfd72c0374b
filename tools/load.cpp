#include "pavel/tools/load.h"

#include <filesystem>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/scene_json.h"
#include "pavel/seeding/seed.h"
#include "pavel/vdb/offset_surface.h"

namespace pavel {
namespace {

std::string resolved(const Scene& scene, const std::string& path) {
    const std::filesystem::path p(path);
    return p.is_absolute() ? path : (std::filesystem::path(scene.folder) / p).string();
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

Vec3 parseColor(const std::string& hex) {
    const long v = std::stol(hex.substr(1), nullptr, 16);
    return Vec3(double(v >> 16 & 255), double(v >> 8 & 255), double(v & 255)) / 255.0;
}

const char* const kPalette[] = {"#d9a78c", "#8fb3a8", "#c9b26b", "#9a8fb8", "#c98f9b", "#8fa6c9", "#b5c48f", "#bf8f6b"};

}  // namespace

TriangleMesh loadBase(const Scene& scene, RunContext& context) {
    const BaseOptions& b = scene.base;
    TriangleMesh mesh = b.shape.empty() ? readMesh(resolved(scene, b.mesh)) : makeShape(b.shape, b.parameters);
    if (b.scaleTo) {
        const double side = meshBounds(mesh).longestSide();
        if (!(side > 0) || !std::isfinite(side)) throw InputError(b.mesh + ": the mesh has no finite size to scale");
        scaleMesh(mesh, *b.scaleTo / side);
    }
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
        k.color = parseColor(e.color.empty() ? kPalette[kinds.size() % std::size(kPalette)] : e.color);
        kinds.push_back(std::move(k));
    }
    return kinds;
}

std::vector<std::vector<PlacementOptions>> loadPlacements(const Scene& scene) {
    std::vector<std::vector<PlacementOptions>> all;
    for (const SeedingOptions& s : scene.seedings)
        all.push_back(s.file.empty() ? s.placements : readSeeds(resolved(scene, s.file), scene.units));
    return all;
}

SeedSet loadSeeds(const Scene& scene, const TriangleMesh& base, const std::vector<ElementKind>& kinds,
                  RunContext& context) {
    std::vector<SeedingInput> inputs(scene.seedings.size());
    const auto manual = loadPlacements(scene);
    for (size_t i = 0; i < inputs.size(); ++i) {
        const SeedingOptions& d = scene.seedings[i];
        inputs[i].manual = manual[i];
        const double offset = d.method == "cvt" ? samplingOffset(kinds, d) : 0;
        if (!(offset > 0)) continue;
        const StageTimer timer(context, "seeding");
        const double spacing = meanSpacing(base, kinds, d, scene.sizeVariation), size = meshBounds(base).diagonal();
        inputs[i].offsetSurface = offsetSurface(base, offset, std::max(std::min(offset, spacing) / 3, size / 1500));
    }
    return makeSeeds(base, kinds, scene, inputs, context);
}

double sceneVoxelSize(const Scene& scene, const std::vector<ElementKind>& kinds) {
    if (scene.voxelSize) return *scene.voxelSize;
    return 2 * std::sqrt(meanFootprint(kinds, {}, scene.sizeVariation) / kPi) / *scene.resolution;
}

}  // namespace pavel
