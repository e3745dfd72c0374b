#include "pavel/tools/machine_speed.h"

#include <tbb/task_arena.h>

#include <algorithm>

#include "pavel/io/scene_json.h"
#include "pavel/tools/examples.h"
#include "pavel/tools/load.h"

namespace pavel {

double machineSpeed() {
    constexpr double kThere = 0.165;  // seconds of CPU that make forecasts right, from whole runs
    const Scene scene = parseScene(findExample("pair").scene, "pair", ".", {"voxel_size=0.4"});
    double least = 1e300;
    tbb::task_arena alone(1);  // idle threads of a large machine would count, too
    const auto run = [&] {
        RunContext context;
        const TriangleMesh base = loadBase(scene, context);
        const std::vector<ElementKind> kinds = loadKinds(scene, context);
        const SeedSet seeds = loadSeeds(scene, base, kinds, context);
        PackOptions options = packOptions(scene, sceneVoxelSize(scene, kinds));
        options.surface = false;
        context.stages.clear();
        pack(base, kinds, placeElements(seeds.seeds, kinds), options, context);
        double seconds = 0;
        for (const StageTime& stage : context.stages) seconds += stage.cpuSeconds;
        least = std::min(least, seconds);
    };
    for (int i = 0; i < 2; ++i) alone.execute(run);  // the first finds nothing in caches
    return kThere / least;
}

}  // namespace pavel
