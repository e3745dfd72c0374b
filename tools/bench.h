#pragma once
// The paper's gallery and tables, rebuilt: pages, pictures and JSON.
#include <string>
#include <vector>

#include "pavel/core/run_context.h"

namespace pavel {

struct BenchOptions {
    std::vector<std::string> names;  ///< paper, large, gallery, or built-in scenes; empty: all of the first three
    std::string folder, bunny;
    int threads = 0;
    bool force = false;
};

/// Writes into the folder, whole or not at all: README.md (the gallery, where it was asked for), tables.md,
/// tables.json, time-and-memory.svg and the pictures. Returns the tables as text.
/// @throws InputError for a name that there is not; RunError where a run fails
std::string bench(const BenchOptions& options, RunContext& context);

}  // namespace pavel
