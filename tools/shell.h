#pragma once
// Printable parts of a scene's decoration: scene in, files out.
#include "pavel/core/run_context.h"
#include "pavel/core/scene.h"

namespace pavel {

struct ShellResult {
    size_t parts = 0, elements = 0, bonds = 0, locked = 0;
    double volume = 0;  ///< of all parts, units^3
};

/// Packs the scene and leaves part_01.stl ..., assembly.png, shell.json and scene.json in `folder`, whole or not at
/// all.
/// @throws InputError, RunError, Interrupted
ShellResult makeShell(const Scene& scene, const std::string& folder, bool force, RunContext& context);

}  // namespace pavel
