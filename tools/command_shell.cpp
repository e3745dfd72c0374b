#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pavel/io/scene_json.h"
#include "pavel/tools/progress.h"
#include "pavel/tools/shell.h"

namespace pavel {

void commandShell(const std::string& path, const std::string& folder, const CommonOptions& options) {
    // The folder of a run holds its scene; packing it again gives the same elements.
    const bool isResult = std::filesystem::is_directory(path);
    const Scene scene = readScene(isResult ? path + "/scene.json" : path, options.overrides);
    CommandContext context(options);
    const ShellResult r = makeShell(scene, folder, options.force, context);
    context.finish();
    if (options.json) {
        std::printf("%s\n", nlohmann::ordered_json{{"result", folder},
                                                   {"parts", r.parts},
                                                   {"elements", r.elements},
                                                   {"volume", r.volume},
                                                   {"bonds_thickened", r.bonds},
                                                   {"undercut_parts", r.locked},
                                                   {"warnings", context.warnings}}
                                .dump()
                                .c_str());
        return;
    }
    if (options.quiet) return;
    context.printWarnings();
    std::printf("%zu parts of %zu elements, %zu bonds thickened\npicture: %s/assembly.png\nfiles:   %s\n", r.parts,
                r.elements, r.bonds, folder.c_str(), folder.c_str());
}

}  // namespace pavel
