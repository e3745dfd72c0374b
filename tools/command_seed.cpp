#include <cstdio>
#include <nlohmann/json.hpp>

#include "pavel/io/scene_json.h"
#include "pavel/tools/progress.h"
#include "pavel/tools/seed_only.h"

namespace pavel {

void commandSeed(const std::string& path, const std::string& folder, const CommonOptions& options) {
    const Scene scene = readScene(path, options.overrides);
    CommandContext context(options);
    const SeedSet set = seedOnly(scene, folder, options.force, context);
    context.finish();
    if (options.json) {
        std::printf("%s\n", nlohmann::ordered_json{{"result", folder},
                                                   {"elements", set.seeds.size()},
                                                   {"coverage", set.coverage},
                                                   {"decorated_area", set.decoratedArea},
                                                   {"warnings", context.warnings}}
                                .dump()
                                .c_str());
        return;
    }
    if (options.quiet) return;
    context.printWarnings();
    std::printf("%zu elements, coverage %.3f\npicture: %s/preview.png\nfiles:   %s\n", set.seeds.size(), set.coverage,
                folder.c_str(), folder.c_str());
}

}  // namespace pavel
