#include <cstdio>

#include "pavel/core/error.h"
#include "pavel/core/shapes.h"
#include "pavel/io/atomic_output.h"
#include "pavel/tools/commands.h"
#include "pavel/tools/examples.h"

namespace pavel {

void commandExample(const std::string& name, const std::string& folder, const CommonOptions& options) {
    if (name.empty()) {
        for (const Example& e : examples()) std::printf("%-10s %s\n", e.name.c_str(), e.help.c_str());
        return;
    }
    std::vector<std::string> names;
    for (const Example& e : examples()) {
        names.push_back(e.name);
        if (e.name != name) continue;
        AtomicOutput out(folder, true, options.force);
        writeText(out.place("scene.json"), e.scene);
        out.commit();
        if (!options.quiet) std::printf("%s/scene.json\n", folder.c_str());
        return;
    }
    throw InputError("there is no example \"" + name + "\"" + didYouMean(name, names) + "; pavel example lists them");
}

}  // namespace pavel
