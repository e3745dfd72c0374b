#pragma once
// The scene file: JSON with // comments; unknown keys are errors.
#include <string>
#include <vector>

#include "pavel/core/placement.h"
#include "pavel/core/scene.h"

namespace pavel {

/// Reads and validates a scene. `overrides` are key.path=value pairs that win over the file.
/// @throws InputError naming the file, the line or key, and the mend
Scene readScene(const std::string& path, const std::vector<std::string>& overrides = {});
Scene parseScene(const std::string& text, const std::string& name, const std::string& folder,
                 const std::vector<std::string>& overrides = {});

/// The scene with every default filled in, ready to be run from `folder` (paths of inputs made relative to it).
std::string sceneJson(const Scene& scene, const std::string& folder);

/// 32 hex digits that name a scene: equal scenes, equal digests.
std::string sceneDigest(const Scene& scene);

/// seeds.json, which manual placement reads back.
std::string seedsJson(const SeedSet& set, const std::vector<ElementKind>& kinds, const std::string& units);
std::vector<PlacementOptions> readSeeds(const std::string& path, const std::string& units);

}  // namespace pavel
