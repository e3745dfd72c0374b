#include "pavel/tools/decorate.h"

#include <tbb/task_group.h>

#include <algorithm>
#include <filesystem>
#include <functional>

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

/// Files that have nothing to do with each other are made side by side.
class Jobs {
  public:
    void add(std::function<void()> job) { jobs_.push_back(std::move(job)); }
    /// Those that take longest should come first.
    void run() {
        tbb::task_group group;
        for (size_t i = jobs_.size(); i-- > 0;) group.run(jobs_[i]);  // the last is taken first
        group.wait();
        jobs_.clear();
    }

  private:
    std::vector<std::function<void()>> jobs_;
};

VdbOptions vdbOptions(const Scene& scene) {
    VdbOptions vdb;
    vdb.half = scene.output.half;
    vdb.fog = scene.output.fog;
    vdb.units = scene.units;
    vdb.digest = sceneDigest(scene);
    return vdb;
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
    Packing packing = pack(base, kinds, placed, options, context);

    Report report;
    report.voxelSize = h;
    report.threads = threads;
    const BaseLook look = baseLook(scene.base);
    const double metres = metresPerUnit(scene.units);
    const bool merged = !output.mesh.empty() && !output.separate, separate = !output.mesh.empty() && output.separate;
    View view = sceneView(scene);
    view.sharpCreases = output.remeshVertices.has_value();
    std::vector<MeshObject> fused;
    // Here and below: what is done with makes room.
    returnFreedMemory();
    if (merged || output.preview) fused.push_back(fusedMesh(packing, kinds, placed, look, output, context));
    dropSolid(packing);
    returnFreedMemory();
    MeshCounts triangles;
    if (merged) {
        triangles.extracted = fused[0].mesh.triangles.size();
        if (output.remeshVertices) {
            const StageTimer timer(context, "remesh");
            remeshFused(packing, fused, output, context);
        }
        triangles.final = fused[0].mesh.triangles.size();
    }
    if (!output.separate && !output.figure) dropElements(packing);
    returnFreedMemory();
    if (output.figure) {
        const StageTimer timer(context, "write");
        std::vector<MeshObject> elements = elementObjects(packing, kinds, placed);
        writeFigure(out.place("figure.jpg"), scene, base, kinds, seeds, extractBase(packing), std::move(elements));
    }
    const auto picture = [&] { renderPicture(out.place("preview.png"), fused, view); };
    if (separate) {
        if (output.preview) {
            const StageTimer timer(context, "write");
            picture();
            fused = {};
        }
        triangles = writeSeparate(out, packing, kinds, placed, look, output, metres, context);
    }
    returnFreedMemory();
    report.extractedTriangles = triangles.extracted;
    report.finalTriangles = triangles.final;
    {
        const StageTimer timer(context, "write");
        writeText(out.place("seeds.json"), seedsJson(seeds, kinds, scene.units));
        writeText(out.place("scene.json"), sceneJson(scene, folder));
        std::vector<std::string> faults, elementFaults;
        const VdbOptions vdb = vdbOptions(scene);
        Jobs jobs;
        for (const std::string& format : output.mesh)
            if (merged) jobs.add([&, format] { writeFused(out, format, fused, output, metres); });
        if (output.vdb && output.separate) {
            std::vector<std::string> names;
            for (const PlacedElement& p : placed) names.push_back(kinds[size_t(p.kind)].name);
            jobs.add([&, names] { elementFaults = writeElementsVdb(out.place("elements.vdb"), packing, names, vdb); });
        }
        if (output.vdb) {
            jobs.add([&] { faults = writeDecorationVdb(out.place("decoration.vdb"), packing, vdb); });
            jobs.add([&] { writeElementIdVdb(out.place("element_id.vdb"), packing, vdb); });
        }
        if (output.preview && !fused.empty()) jobs.add(picture);
        jobs.run();
        faults.insert(faults.end(), elementFaults.begin(), elementFaults.end());
        for (const std::string& f : faults) context.warn(f);
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
