#include <tbb/info.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "pavel/io/scene_json.h"
#include "pavel/tools/decorate.h"
#include "pavel/tools/progress.h"

namespace pavel {

void commandDecorate(const std::string& path, const std::string& folder, const CommonOptions& options) {
    const Scene scene = readScene(path, options.overrides);
    CommandContext context(options);
    const int threads = options.threads > 0 ? options.threads : int(tbb::info::default_concurrency());
    const DecorateResult r = decorate(scene, folder, options.force, threads, context);
    context.finish();
    if (options.json) {
        std::printf("%s\n", nlohmann::ordered_json{{"result", r.folder},
                                                   {"elements", r.elements},
                                                   {"coverage", r.coverage},
                                                   {"decoration_voxels", r.decorationVoxels},
                                                   {"max_relative_error", r.maxRelativeError},
                                                   {"warnings", context.warnings}}
                                .dump()
                                .c_str());
        return;
    }
    if (!options.quiet) context.printWarnings();
    if (options.verbose)
        for (const StageTime& s : context.stages)
            std::fprintf(stderr, "%-9s %8.2f s  %8.2f s CPU\n", s.name.c_str(), s.seconds, s.cpuSeconds);
    if (!options.quiet) {
        std::printf("%zu elements, coverage %.3f, %.1f million decoration voxels, volumes kept to %.4f %%\n",
                    r.elements, r.coverage, double(r.decorationVoxels) / 1e6, 100 * r.maxRelativeError);
        std::printf("picture: %s/preview.png\nfiles:   %s\n", folder.c_str(), folder.c_str());
    }
}

}  // namespace pavel
