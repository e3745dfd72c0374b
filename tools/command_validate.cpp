#include <tbb/info.h>

#include <algorithm>
#include <cstdio>

#include "pavel/core/mesh_check.h"
#include "pavel/io/scene_json.h"
#include "pavel/seeding/seed.h"
#include "pavel/tools/commands.h"
#include "pavel/tools/load.h"
#include "pavel/tools/machine_speed.h"
#include "pavel/tools/paged_heap.h"
#include "pavel/vdb/pack.h"

namespace pavel {

void commandValidate(const std::string& path, const CommonOptions& options) {
    if (options.memoryLimit > 0) checkMemoryLimit(options.memoryLimit);
    const Scene scene = readScene(path, options.overrides);
    RunContext context;
    const TriangleMesh base = loadBase(scene, context);
    const std::vector<ElementKind> kinds = loadKinds(scene, context);
    const double h = sceneVoxelSize(scene, kinds);
    checkVoxelSize(base, kinds, h, scene.material.gap, context);
    std::vector<double> volumes, areas;  // of the kinds
    double weights = 0, volume = 0, area = 0, thinnest = 1e300, rise = 1e300;
    for (size_t i = 0; i < kinds.size(); ++i) {
        const ElementKind& k = kinds[i];
        weights += k.weight;
        volumes.push_back(meshVolume(k.mesh));
        areas.push_back(meshArea(k.mesh));
        volume += k.weight * volumes.back();
        area += k.weight * areas.back();
        thinnest = std::min(thinnest, meshBounds(k.mesh).size().min());
        rise = std::min(rise, scene.elements[i].a.value_or(scene.material.a) * meshBounds(k.mesh).diagonal());
    }
    double n = 0, leastScale = 1 - scene.sizeVariation;
    double placed = 0, placedVolume = 0, placedArea = 0;  // by hand: each as it is
    const auto manual = loadPlacements(scene);
    for (size_t i = 0; i < scene.seedings.size(); ++i) {
        const SeedingOptions& d = scene.seedings[i];
        const double v = scene.sizeVariation;
        for (const PlacementOptions& p : manual[i]) {
            const auto named = [&](const ElementKind& k) { return k.name == p.element; };
            const auto kind = std::find_if(kinds.begin(), kinds.end(), named);
            const size_t k = kind == kinds.end() ? 0 : size_t(kind - kinds.begin());
            placedVolume += volumes[k] * p.scale * p.scale * p.scale;
            placedArea += areas[k] * p.scale * p.scale;
            leastScale = std::min(leastScale, p.scale);
        }
        placed += double(manual[i].size());
        if (d.count) n += double(*d.count);
        if (!d.coverage && !d.spacing) continue;
        const double decorated =
            meshArea(decoratedSurface(base, d, meanSpacing(base, kinds, d, v), loadMask(scene, d).get()));
        n += d.coverage ? *d.coverage * decorated / meanFootprint(kinds, d, v)
                        : decorated / (d.spacing->first * d.spacing->second);
    }
    const double voxels = (n * volume / weights + placedVolume) / (h * h * h);
    const double surface = (n * area / weights + placedArea) / (h * h), baseSurface = meshArea(base) / (h * h);
    n += placed;
    // Growth costs by the surface on the grid that fronts march on.
    const double factor = marchingFactor(thinnest * leastScale / h, rise * leastScale / h);
    const double marched = surface / (factor * factor);
    // Measured on the built-in scenes and on 10,000 pearls, whole runs with their files: memory within a quarter, time
    // within a third or so.
    const double bytes = 180e6 + 515 * baseSurface + 51 * surface;
    const auto& formats = scene.output.mesh;
    const bool packed = std::find(formats.begin(), formats.end(), "3mf") != formats.end();  // its library is slow
    const double work = 4.6 + 0.0017 * n + (packed ? 9.6e-6 : 6.3e-6) * (surface + baseSurface) + 1.4e-6 * marched;
    const double cpu = work / machineSpeed();
    const int threads = options.threads > 0 ? options.threads : int(tbb::info::default_concurrency());
    std::printf(
        "%s: valid\n  elements           about %.0f\n  voxel size         %.6g %s\n  decoration voxels  about %.1f "
        "million\n  base voxels        about %.1f million\n  memory             about %.2f GB\n  time               "
        "about "
        "%.0f s of CPU, %.0f s on %d thread%s\n",
        path.c_str(), n, h, scene.units.c_str(), voxels / 1e6, meshVolume(base) / (h * h * h) / 1e6, bytes / 1e9, cpu,
        cpu / threads, threads, threads > 1 ? "s" : "");
    if (options.memoryLimit > 0 && bytes > double(options.memoryLimit))
        std::printf("  memory limit       %.2f GB: the run will page about %.2f GB to disk\n",
                    double(options.memoryLimit) / 1e9, (bytes - double(options.memoryLimit)) / 1e9);
    for (const std::string& w : context.warnings) std::printf("  warning: %s\n", w.c_str());
}

}  // namespace pavel
