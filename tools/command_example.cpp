#include <cstdio>

#include "pavel/io/atomic_output.h"
#include "pavel/tools/commands.h"
#include "pavel/tools/examples.h"

namespace pavel {

void commandExample(const std::string& name, const std::string& folder, const CommonOptions& options) {
    if (name.empty()) {
        for (const Example& e : examples()) std::printf("%-15s %s\n", e.name.c_str(), e.help.c_str());
        return;
    }
    const Example& example = findExample(name);
    AtomicOutput out(folder, true, options.force);
    writeText(out.place("scene.json"), example.scene);
    out.commit();
    if (!options.quiet) std::printf("%s/scene.json\n", folder.c_str());
}

}  // namespace pavel
