#include "pavel/tools/seed_only.h"

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/seed_files.h"
#include "pavel/tools/load.h"
#include "pavel/tools/objects.h"
#include "pavel/tools/pictures.h"

namespace pavel {

SeedSet seedOnly(const Scene& scene, const std::string& folder, bool force, RunContext& context) {
    AtomicOutput out(folder, true, force);
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    const SeedSet set = loadSeeds(scene, base, kinds, context);
    const StageTimer timer(context, "write");
    std::vector<MeshObject> objects{baseObject(scene, base)};
    for (const ElementKind& k : kinds) {
        objects.emplace_back();
        objects.back().name = k.name;
        objects.back().mesh = k.mesh;
        objects.back().color = k.color;
        objects.back().finish = k.finish;
        objects.back().material = k.name;
    }
    const std::vector<PlacedElement> placed = placeElements(set.seeds, kinds);
    for (const PlacedElement& p : placed) {
        const ElementKind& kind = kinds[size_t(p.kind)];
        objects[size_t(p.kind) + 1].instances.emplace_back(objectName(p.id, kind.name), p.worldFromElement);
    }
    if (set.spacing) writeStripesObj(out.place("stripes.obj"), set);
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
    if (scene.output.preview) {
        std::vector<MeshObject> picture = seededBase(scene, base, set);
        for (MeshObject& o : placedElements(kinds, placed)) picture.push_back(std::move(o));
        renderPicture(out.place("preview.png"), picture, sceneView(scene));
    }
    context.check();
    out.commit();
    return set;
}

}  // namespace pavel
