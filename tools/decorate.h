#pragma once
// The main job as a library call: scene in, files out.
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"

namespace pavel {

struct DecorateResult {
    std::string folder;
    size_t elements = 0;
    double coverage = 0, maxRelativeError = 0;
    uint64_t decorationVoxels = 0;
};

/// Runs a scene and leaves its result in `folder`, whole or not at all.
/// @throws InputError, RunError, Interrupted
DecorateResult decorate(const Scene& scene, const std::string& folder, bool force, int threads, RunContext& context);

}  // namespace pavel
