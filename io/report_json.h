#pragma once
#include "pavel/core/placement.h"
#include "pavel/core/scene.h"
#include "pavel/vdb/pack.h"

namespace pavel {

struct OutputFile {
    std::string file;
    uint64_t bytes = 0;
};

struct Report {
    double voxelSize = 0;
    int threads = 0;
    uint64_t extractedTriangles = 0, finalTriangles = 0;
    std::vector<OutputFile> outputs;
};

/// report.json: what a run did and how well.
std::string reportJson(const Scene& scene, const SeedSet& seeds, const std::vector<ElementKind>& kinds,
                       const Packing& packing, const Report& report, const RunContext& context);

}  // namespace pavel
