#include "pavel/tools/decorate.h"

#include <algorithm>
#include <filesystem>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/io/report_json.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/load.h"
#include "pavel/tools/output_meshes.h"
#include "pavel/tools/pictures.h"
#include "pavel/vdb/extract.h"

namespace pavel {
namespace {

namespace fs = std::filesystem;
void writeVdb(const AtomicOutput& out, const Scene& scene, const Packing& packing,
              const std::vector<ElementKind>& kinds, const std::vector<PlacedElement>& placed, RunContext& context) {
    const auto warn = [&](const std::vector<std::string>& faults) {
        for (const std::string& f : faults) context.warn(f);
    };
    VdbOptions vdb;
    vdb.half = scene.output.half;
    vdb.fog = scene.output.fog;
    vdb.units = scene.units;
    vdb.digest = sceneDigest(scene);
    warn(writeDecorationVdb(out.place("decoration.vdb"), packing, vdb));
    writeElementIdVdb(out.place("element_id.vdb"), packing, vdb);
    if (!scene.output.separate) return;
    std::vector<std::string> names;
    for (const PlacedElement& p : placed) names.push_back(kinds[size_t(p.kind)].name);
    warn(writeElementsVdb(out.place("elements.vdb"), packing, names, vdb));
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

    PackOptions options = packOptions(scene, h);
    const OutputOptions& output = scene.output;
    options.solidWithBase = output.withBase;
    options.surface = output.vdb || output.preview || (!output.mesh.empty() && !output.separate);
    const Packing packing = pack(base, kinds, placed, options, context);

    Report report;
    report.voxelSize = h;
    report.threads = threads;
    const OutputMeshes meshes = extractMeshes(packing, kinds, placed, baseLook(scene.base), scene.output, context);
    report.extractedTriangles = meshes.extractedTriangles;
    for (const MeshObject& o : meshes.objects) report.finalTriangles += o.mesh.triangles.size();
    {
        const StageTimer timer(context, "write");
        writeText(out.place("seeds.json"), seedsJson(seeds, kinds, scene.units));
        writeText(out.place("scene.json"), sceneJson(scene, folder));
        View view = sceneView(scene);
        view.sharpCreases = scene.output.remeshVertices.has_value();
        if (scene.output.preview)
            renderPicture(out.place("preview.png"), meshes.fused ? *meshes.fused : meshes.objects, view);
        if (scene.output.figure) {
            std::vector<MeshObject> elements = elementObjects(packing, kinds, placed);
            writeFigure(out.place("figure.jpg"), scene, base, kinds, seeds, extractBase(packing), std::move(elements));
        }
        context.progress("write", 0.3);
        writeMeshes(out, scene.output, meshes.objects, metresPerUnit(scene.units));
        context.progress("write", 0.6);
        if (scene.output.vdb) writeVdb(out, scene, packing, kinds, placed, context);
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
