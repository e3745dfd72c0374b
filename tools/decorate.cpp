#include "pavel/tools/decorate.h"

#include <algorithm>
#include <filesystem>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/preview.h"
#include "pavel/io/report_json.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/load.h"
#include "pavel/tools/objects.h"
#include "pavel/vdb/extract.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;
MeshObject fusedObject(LabelledMesh fused, const std::vector<ElementKind>& kinds,
                       const std::vector<PlacedElement>& placed) {
    MeshObject object;
    object.name = "decoration";
    object.mesh = std::move(fused.mesh);
    object.vertexColors.assign(object.mesh.points.size(), kBaseColor);
    std::vector<char> decorated(object.mesh.points.size(), 0);
    for (size_t t = 0; t < fused.ids.size(); ++t) {
        const int id = fused.ids[t];
        if (id == 0) continue;
        const Vec3 c = elementColor(kinds[size_t(placed[size_t(id) - 1].kind)], id);
        for (int v : object.mesh.triangles[t])
            if (!decorated[size_t(v)]) object.vertexColors[size_t(v)] = c, decorated[size_t(v)] = 1;
    }
    return object;
}

std::vector<MeshObject> separateObjects(const Packing& packing, const std::vector<ElementKind>& kinds,
                                        const std::vector<PlacedElement>& placed, bool withBase) {
    std::vector<MeshObject> objects;
    for (const PlacedElement& p : placed) {
        MeshObject o;
        o.mesh = extractElement(packing, p.id);
        if (o.mesh.triangles.empty()) continue;
        o.name = objectName(p.id, kinds[size_t(p.kind)].name);
        o.color = kinds[size_t(p.kind)].color;
        objects.push_back(std::move(o));
    }
    if (withBase) {
        MeshObject base;
        base.name = "base";
        base.mesh = extractBase(packing);
        base.color = kBaseColor;
        objects.push_back(std::move(base));
    }
    return objects;
}

size_t triangleCount(const std::vector<MeshObject>& objects) {
    size_t n = 0;
    for (const MeshObject& o : objects) n += o.mesh.triangles.size();
    return n;
}

void writeMeshes(const AtomicOutput& out, const OutputOptions& options, const std::vector<MeshObject>& objects,
                 double metres) {
    for (const std::string& format : options.mesh) {
        if (format == "stl" && options.separate) {  // STL has no objects
            for (const MeshObject& o : objects) writeMesh(out.place(o.name + ".stl"), {o}, metres);
        } else {
            writeMesh(out.place("decoration." + format), objects, metres);
        }
    }
}

void writeVdb(const AtomicOutput& out, const Scene& scene, const Packing& packing,
              const std::vector<ElementKind>& kinds, const std::vector<PlacedElement>& placed) {
    VdbOptions vdb;
    vdb.half = scene.output.half;
    vdb.fog = scene.output.fog;
    vdb.units = scene.units;
    vdb.digest = sceneDigest(scene);
    writeDecorationVdb(out.place("decoration.vdb"), packing, vdb);
    writeElementIdVdb(out.place("element_id.vdb"), packing, vdb);
    if (!scene.output.separate) return;
    std::vector<std::string> names;
    for (const PlacedElement& p : placed) names.push_back(kinds[size_t(p.kind)].name);
    writeElementsVdb(out.place("elements.vdb"), packing, names, vdb);
}

}  // namespace

DecorateResult decorate(const Scene& scene, const std::string& folder, bool force, int threads, RunContext& context) {
    AtomicOutput out(folder, true, force);
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    const double h = sceneVoxelSize(scene, kinds);
    checkVoxelSize(base, kinds, h, scene.material.gap, context);
    const SeedSet seeds = loadSeeds(scene, base, kinds, context);
    const std::vector<PlacedElement> placed = placeElements(seeds.seeds, kinds);

    PackOptions options;
    options.voxelSize = h;
    for (const ElementOptions& e : scene.elements)
        options.kindMaterial.emplace_back(e.a.value_or(scene.material.a), e.b.value_or(scene.material.b));
    options.solidWithBase = scene.output.withBase;
    options.contactByDepth = scene.material.contact == "depth";
    options.gap = scene.material.gap;
    options.recoverBaseLoss = scene.material.baseLoss == "recover";
    const Packing packing = pack(base, kinds, placed, options, context);

    Report report;
    report.voxelSize = h;
    report.threads = threads;
    std::vector<MeshObject> objects;
    MeshObject fused;
    const bool meshes = !scene.output.mesh.empty();
    {
        const StageTimer timer(context, "extract");
        if ((meshes && !scene.output.separate) || scene.output.preview)
            fused = fusedObject(extractFused(packing, scene.output.withBase), kinds, placed);
        if (meshes && scene.output.separate) objects = separateObjects(packing, kinds, placed, scene.output.withBase);
        report.extractedTriangles = scene.output.separate ? triangleCount(objects) : fused.mesh.triangles.size();
        report.finalTriangles = report.extractedTriangles;
    }
    {
        const StageTimer timer(context, "write");
        writeText(out.place("seeds.json"), seedsJson(seeds, kinds, scene.units));
        writeText(out.place("scene.json"), sceneJson(scene, folder));
        std::vector<MeshObject> single;
        single.push_back(std::move(fused));
        if (scene.output.preview) renderPng(out.place("preview.png"), single);
        context.progress("write", 0.3);
        if (meshes)
            writeMeshes(out, scene.output, scene.output.separate ? objects : single, metresPerUnit(scene.units));
        context.progress("write", 0.6);
        if (scene.output.vdb) writeVdb(out, scene, packing, kinds, placed);
    }
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(out.place())) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& f : files) report.outputs.push_back({f.filename().string(), fs::file_size(f)});
    writeText(out.place("report.json"), reportJson(scene, seeds, kinds, packing, report, context));
    context.check();
    out.commit();

    DecorateResult result;
    result.folder = folder;
    result.elements = packing.elements.size();
    result.coverage = seeds.coverage;
    result.decorationVoxels = packing.counts.decorationVoxels;
    for (const ElementResult& e : packing.elements)
        if (e.targetVolume > 0)
            result.maxRelativeError =
                std::max(result.maxRelativeError,
                         std::abs(e.finalVolume + e.unrecoveredVolume - e.targetVolume) / e.targetVolume);
    return result;
}

}  // namespace pavel
