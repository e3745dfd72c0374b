#include <cstdio>

#include "pavel/tools/bench.h"
#include "pavel/tools/progress.h"

namespace pavel {

void commandBench(const std::vector<std::string>& names, const std::string& folder, const std::string& bunny,
                  const CommonOptions& options) {
    CommandContext context(options);
    BenchOptions bench_;
    bench_.names = names;
    bench_.folder = folder;
    bench_.bunny = bunny;
    bench_.threads = options.threads;
    bench_.force = options.force;
    const std::string tables = bench(bench_, context);
    context.finish();
    if (!options.quiet) std::printf("%sfiles: %s\n", tables.c_str(), folder.c_str());
}

}  // namespace pavel
