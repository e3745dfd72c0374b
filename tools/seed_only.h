#pragma once
// Placement alone as a library call: scene in, seeds and a picture out.
#include "pavel/core/placement.h"
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"

namespace pavel {

/// Places the elements of a scene and leaves in `folder`, whole or not at all: seeds.json, seeds.ply, seeds.vdb,
/// placed.glb (the elements as placed, on the base) and preview.png.
/// @throws InputError, RunError, Interrupted
SeedSet seedOnly(const Scene& scene, const std::string& folder, bool force, RunContext& context);

}  // namespace pavel
