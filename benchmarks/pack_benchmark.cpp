// Time and memory of packing against voxels: a sphere with 400 pearls at rising resolution.
//   pavel_benchmark [ELEMENTS [RESOLUTION...]]    prints a table, then JSON. One process for each size keeps peaks
//   apart.
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "pavel/core/error.h"
#include "pavel/io/scene_json.h"
#include "pavel/seeding/seed.h"
#include "pavel/tools/load.h"
#include "pavel/vdb/pack.h"

int main(int argc, char** argv) {
    using namespace pavel;
    const int elements = argc > 1 ? std::atoi(argv[1]) : 400;
    std::vector<double> resolutions;
    for (int i = 2; i < argc; ++i) resolutions.push_back(std::atof(argv[i]));
    if (resolutions.empty()) resolutions = {20, 30, 40};
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    std::printf("%10s %10s %10s %10s %12s %12s %10s %10s\n", "elements", "across", "Mvoxels", "Mgrown", "CPU ns/voxel",
                "wall s", "GB", "error %");
    try {
        for (double r : resolutions) {
            Scene scene;
            scene.resolution = r;
            scene.base.shape = "sphere";
            ElementOptions pearl;
            pearl.name = pearl.shape = "pearl";
            pearl.parameters["radius"] = 40 * std::sqrt(4 * 1.43 / elements);
            scene.elements = {pearl};
            scene.seeding.count = size_t(elements);
            validate(scene);
            RunContext context;
            const TriangleMesh base = loadBase(scene, context);
            const auto kinds = loadKinds(scene, context);
            const SeedSet seeds = makeSeeds(base, kinds, scene, {}, context);
            PackOptions options;
            options.surface = false;  // the packed elements alone are compared
            options.voxelSize = sceneVoxelSize(scene, kinds);
            const Packing p = pack(base, kinds, placeElements(seeds.seeds, kinds), options, context);
            double wall = 0, cpu = 0, worst = 0;
            for (const StageTime& s : context.stages)
                if (s.name != "seeding" && s.name != "extract") wall += s.seconds, cpu += s.cpuSeconds;
            for (const StageTime& s : context.stages)
                std::fprintf(stderr, "  %s: %.2f s, CPU %.2f s\n", s.name.c_str(), s.seconds, s.cpuSeconds);
            for (const ElementResult& e : p.elements)
                worst =
                    std::max(worst, std::abs(e.finalVolume + e.unrecoveredVolume - e.targetVolume) / e.targetVolume);
            const double voxels = double(p.counts.decorationVoxels), memory = double(peakResidentBytes());
            std::printf("%10d %10.0f %10.2f %10.2f %12.0f %12.2f %10.2f %10.4f\n", elements, r, voxels / 1e6,
                        double(p.counts.grownVoxels) / 1e6, cpu / voxels * 1e9, wall, memory / 1e9, 100 * worst);
            std::fflush(stdout);
            all.push_back({{"elements", elements},
                           {"resolution", r},
                           {"decoration_voxels", voxels},
                           {"grown_voxels", p.counts.grownVoxels},
                           {"seconds", wall},
                           {"cpu_seconds", cpu},
                           {"peak_rss_bytes", memory},
                           {"max_relative_error", worst}});
        }
    } catch (const Error& e) {
        std::fprintf(stderr, "pavel_benchmark: %s\n", e.what());
        return e.exitStatus();
    }
    std::printf("%s\n", all.dump(1).c_str());
}
