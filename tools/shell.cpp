#include "pavel/tools/shell.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/preview.h"
#include "pavel/io/scene_json.h"
#include "pavel/seeding/surface.h"
#include "pavel/tools/load.h"
#include "pavel/tools/output_meshes.h"
#include "pavel/vdb/shell.h"

namespace pavel {
namespace {

std::string partName(size_t number) {
    char name[32];
    std::snprintf(name, sizeof name, "part_%02zu", number);
    return name;
}

/// The face group of the base under each element.
std::vector<int> groupsUnder(const TriangleMesh& base, const ShellGraph& graph) {
    if (base.groupNames.size() < 2)
        throw InputError("shell.parts: the base has no groups; use \"auto\", \"planes\" or a number");
    const Surface surface(base);
    std::vector<int> part;
    for (size_t i = 0; i < graph.position.size(); ++i)
        part.push_back(base.groups[size_t(surface.closest(graph.position[i], &graph.normal[i]).triangle)]);
    return part;
}

/// Turned so that its back lies down, about the vertical so that it takes least room, and moved to z = 0.
void layFlat(TriangleMesh& mesh, const Vec3& up) {
    const Vec3 x = anyPerpendicular(up), y = cross(up, x);
    for (Vec3& p : mesh.points) p = Vec3(dot(p, x), dot(p, y), dot(p, up));
    double best = 0, least = 1e300;
    constexpr int kTurns = 36;
    for (int k = 0; k < kTurns; ++k) {
        const double angle = 0.5 * kPi * k / kTurns, c = std::cos(angle), s = std::sin(angle);
        Bounds b;
        for (const Vec3& p : mesh.points) b.add({c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]});
        if (const double area = b.size()[0] * b.size()[1]; area < least) least = area, best = angle;
    }
    const double c = std::cos(best), s = std::sin(best);
    for (Vec3& p : mesh.points) p = Vec3(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]);
    const Bounds b = meshBounds(mesh);
    const Vec3 foot(0.5 * (b.min[0] + b.max[0]), 0.5 * (b.min[1] + b.max[1]), b.min[2]);
    for (Vec3& p : mesh.points) p -= foot;
}

/// Both sides of the parts, moved apart a little, each with its number.
void writeAssembly(const std::string& path, const std::vector<ShellPart>& parts) {
    const Vec3 palette[] = {{.85, .65, .55}, {.56, .70, .66}, {.79, .70, .42}, {.60, .56, .72},
                            {.79, .56, .61}, {.56, .65, .79}, {.71, .77, .56}, {.75, .56, .42}};
    Bounds all;
    for (const ShellPart& p : parts)
        for (const Vec3& q : p.mesh.points) all.add(q);
    std::vector<MeshObject> objects;
    View front;
    for (size_t i = 0; i < parts.size(); ++i) {
        MeshObject o;
        o.mesh = parts[i].mesh;
        o.color = palette[i % std::size(palette)];
        for (Vec3& p : o.mesh.points) p += 0.06 * all.diagonal() * parts[i].release.direction;
        objects.push_back(std::move(o));
        front.labels.push_back(std::to_string(i + 1));
    }
    View back = front;
    back.azimuthDegrees += 180;
    renderPicture(path, {Panel{&objects, front}, Panel{&objects, back}}, 2);
}

std::string shellJson(const Scene& scene, const std::vector<ShellPart>& parts, const std::vector<Bounds>& bounds,
                      const RunContext& context) {
    using json = nlohmann::ordered_json;
    const auto vec = [](const Vec3& v) { return json::array({v[0], v[1], v[2]}); };
    json root{{"version", version()},
              {"units", scene.units},
              {"bed", vec(scene.shell.bed)},
              {"clearance", scene.shell.clearance},
              {"min_thickness", scene.shell.minThickness},
              {"warnings", context.warnings}};
    root["parts"] = json::array();
    for (size_t i = 0; i < parts.size(); ++i) {
        const ShellPart& p = parts[i];
        root["parts"].push_back({{"file", partName(i + 1) + ".stl"},
                                 {"elements", p.ids},
                                 {"volume", p.volume},
                                 {"size", vec(bounds[i].size())},
                                 {"triangles", p.mesh.triangles.size()},
                                 {"comes_off", p.release.free()},
                                 {"direction", vec(p.release.direction)},
                                 {"undercut_share", p.release.undercut},
                                 {"bonds_thickened", p.bonds},
                                 {"thin_voxels_thickened", p.thickened},
                                 {"crumbs_volume", p.lostVolume}});
    }
    return root.dump(1) + "\n";
}

void checkClearance(const std::vector<ElementKind>& kinds, const ShellOptions& options) {
    for (const ElementKind& k : kinds)
        if (options.clearance >= meshBounds(k.mesh).size().min())
            throw InputError("shell.clearance is larger than element \"" + k.name + "\" is thick; make it smaller");
}

}  // namespace

ShellResult makeShell(const Scene& scene, const std::string& folder, bool force, RunContext& context) {
    AtomicOutput out(folder, true, force);
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    checkClearance(kinds, scene.shell);
    const double h = sceneVoxelSize(scene, kinds);
    checkVoxelSize(base, kinds, h, scene.material.gap, context);
    const SeedSet seeds = loadSeeds(scene, base, kinds, context);
    const std::vector<PlacedElement> placed = placeElements(seeds.seeds, kinds);
    PackOptions options = packOptions(scene, h);
    options.surface = false;
    const Packing packing = pack(base, kinds, placed, options, context);

    std::vector<ShellPart> parts;
    {
        const StageTimer timer(context, "extract");
        const ShellBuilder builder(packing, base, placed, scene.shell, scene.material.gap);
        checkBed(builder.graph(), scene.shell.bed);
        const std::vector<std::vector<int>> members =
            scene.shell.split == "groups" ? connected(builder.graph(), groupsUnder(base, builder.graph()))
                                          : shellParts(builder.graph(), scene.shell);
        for (const auto& m : members) {
            parts.push_back(builder.build(m));
            context.progress("extract", double(parts.size()) / double(members.size()));
        }
    }
    if (scene.output.remeshVertices) {
        const StageTimer timer(context, "remesh");
        std::vector<MeshObject> objects(parts.size());
        for (size_t i = 0; i < parts.size(); ++i) objects[i].mesh = std::move(parts[i].mesh);
        remeshObjects(objects, *scene.output.remeshVertices, context);
        for (size_t i = 0; i < parts.size(); ++i) parts[i].mesh = std::move(objects[i].mesh);
    }
    ShellResult result;
    result.parts = parts.size();
    {
        const StageTimer timer(context, "write");
        std::vector<Bounds> bounds;
        for (size_t i = 0; i < parts.size(); ++i) {
            const ShellPart& p = parts[i];
            MeshObject o;
            o.name = partName(i + 1);
            o.mesh = p.mesh;
            if (scene.shell.layFlat) layFlat(o.mesh, p.release.direction);
            bounds.push_back(meshBounds(o.mesh));
            const std::string name = "part " + std::to_string(i + 1);
            if (!fitsBed(bounds.back(), scene.shell.bed)) context.warn(name + " is larger than the bed");
            if (!p.release.free()) context.warn(name + " is undercut: it does not come off the base in one direction");
            if (p.lostVolume > 1e-3 * p.volume) context.warn(name + ": crumbs that touch nothing were left away");
            writeMesh(out.place(o.name + ".stl"), {o});
            result.elements += p.ids.size();
            result.bonds += p.bonds;
            result.locked += !p.release.free();
            result.volume += p.volume;
        }
        writeAssembly(out.place("assembly.png"), parts);
        writeText(out.place("shell.json"), shellJson(scene, parts, bounds, context));
        writeText(out.place("scene.json"), sceneJson(scene, folder));
        context.progress("write", 1);
    }
    context.check();
    out.commit();
    return result;
}

}  // namespace pavel
