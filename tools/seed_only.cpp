#include "pavel/tools/seed_only.h"

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/preview.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/seed_files.h"
#include "pavel/seeding/simplify.h"
#include "pavel/tools/load.h"
#include "pavel/tools/objects.h"

namespace pavel {

namespace {

/// A stripe as a thin tube, three-sided.
void appendTube(const SeedSet::Line& line, double radius, TriangleMesh& mesh) {
    const size_t n = line.points.size();
    if (n < 2) return;
    const int first = int(mesh.points.size());
    for (size_t i = 0; i < n; ++i) {
        const bool inner = line.closed || (i > 0 && i + 1 < n);
        const Vec3 d = normalized(inner ? line.points[(i + 1) % n] - line.points[(i + n - 1) % n]
                                  : i   ? line.points[i] - line.points[i - 1]
                                        : line.points[1] - line.points[0]);
        const Vec3 x = anyPerpendicular(d), y = cross(d, x);
        for (int k = 0; k < 3; ++k) {
            const double a = 2 * kPi * k / 3;
            mesh.points.push_back(line.points[i] + radius * (std::cos(a) * x + std::sin(a) * y));
        }
    }
    for (size_t i = 0; i + (line.closed ? 0 : 1) < n; ++i)
        for (int k = 0; k < 3; ++k) {
            const int a = first + 3 * int(i), b = first + 3 * int((i + 1) % n), l = (k + 1) % 3;
            mesh.triangles.push_back({a + k, a + l, b + l});
            mesh.triangles.push_back({a + k, b + l, b + k});
        }
}

}  // namespace

SeedSet seedOnly(const Scene& scene, const std::string& folder, bool force, RunContext& context) {
    AtomicOutput out(folder, true, force);
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    const SeedSet set = loadSeeds(scene, base, kinds, context);
    const StageTimer timer(context, "write");
    MeshObject ground;
    ground.name = "base";
    ground.mesh = base;
    ground.color = kBaseColor;
    std::vector<MeshObject> objects{ground}, picture{ground};
    std::vector<TriangleMesh> shapes;
    constexpr size_t kPictured = 300000, kLeast = 150, kMost = 2000;
    const size_t triangles = std::clamp(kPictured / std::max<size_t>(1, set.seeds.size()), kLeast, kMost);
    for (const ElementKind& k : kinds) shapes.push_back(simplified(k.mesh, triangles));
    for (const ElementKind& k : kinds) {
        objects.emplace_back();
        objects.back().name = k.name;
        objects.back().mesh = k.mesh;
        objects.back().color = k.color;
    }
    for (const PlacedElement& p : placeElements(set.seeds, kinds)) {
        const ElementKind& kind = kinds[size_t(p.kind)];
        objects[size_t(p.kind) + 1].instances.emplace_back(objectName(p.id, kind.name), p.worldFromElement);
        MeshObject o;
        o.mesh = shapes[size_t(p.kind)];
        for (Vec3& v : o.mesh.points) v = p.worldFromElement.apply(v);
        o.color = elementColor(kind, p.id);
        picture.push_back(std::move(o));
    }
    if (set.spacing) {
        const Vec3 colors[2] = {{0.25, 0.32, 0.45}, {0.62, 0.66, 0.72}};  // main, across
        const double radius = 0.03 * std::min(set.spacing->first, set.spacing->second);
        for (bool main : {true, false}) {
            picture.emplace_back();
            picture.back().color = colors[main ? 0 : 1];
            for (const SeedSet::Line& line : set.stripes)
                if (line.main == main) appendTube(line, radius, picture.back().mesh);
        }
        writeStripesObj(out.place("stripes.obj"), set);
    }
    // A kind that is placed nowhere has no place in the file either.
    for (size_t k = objects.size(); k-- > 1;)
        if (objects[k].instances.empty()) objects.erase(objects.begin() + long(k));
    writeText(out.place("seeds.json"), seedsJson(set, kinds, scene.units));
    writeSeedsPly(out.place("seeds.ply"), set);
    VdbOptions vdb;
    vdb.units = scene.units;
    vdb.digest = sceneDigest(scene);
    writeSeedsVdb(out.place("seeds.vdb"), set, vdb);
    writeMesh(out.place("placed.glb"), objects, {metresPerUnit(scene.units)});
    if (scene.output.preview) renderPng(out.place("preview.png"), picture);
    context.check();
    out.commit();
    return set;
}

}  // namespace pavel
