#pragma once
// The text of a bench's pages.
#include <string>
#include <vector>

#include "pavel/tools/bench_run.h"

namespace pavel {

struct BenchTables {
    std::vector<BenchRun> paper;  ///< at the paper's resolution
    std::vector<BenchRun> large;  ///< at half its voxel size: eight times the voxels
    int threads = 0;
};

/// Processor and number of threads.
std::string machineName(int threads);
/// Markdown.
std::string tablesPage(const BenchTables& tables);
std::string tablesJson(const BenchTables& tables);
/// Deformation time and peak memory against decoration voxels, as SVG.
std::string tablesPlot(const BenchTables& tables);

}  // namespace pavel
