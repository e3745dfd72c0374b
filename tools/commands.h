#pragma once
// The verbs of the command line, one file each. Each returns after printing its result; failures are exceptions.
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pavel/core/run_context.h"

namespace pavel {

/// What all verbs share.
struct CommonOptions {
    int threads = 0;  ///< 0: all
    std::vector<std::string> overrides;
    size_t memoryLimit = 0;  ///< bytes; 0: none
    bool quiet = false, verbose = false, json = false, force = false;
};

void commandDecorate(const std::string& scene, const std::string& folder, const CommonOptions& options);
void commandSeed(const std::string& scene, const std::string& folder, const CommonOptions& options);
void commandExample(const std::string& name, const std::string& folder, const CommonOptions& options);
void commandShape(const std::string& name, const std::vector<std::string>& parameters, const std::string& file,
                  const CommonOptions& options);
void commandRemesh(const std::string& input, const std::string& file, size_t vertices, const CommonOptions& options);
void commandShell(const std::string& path, const std::string& folder, const CommonOptions& options);
struct RenderOptions {
    std::string input, picture;
    int width = 1200, height = 1000;
    double azimuth = -60, zoom = 1;
    std::optional<double> elevation;
    std::string finish = "clay", color;
    bool back = false, cut = false, transparent = false;
    int frames = 1;  ///< of a full turn
};
void commandRender(const RenderOptions& render, const CommonOptions& options);
/// Rebuilds the paper's tables and gallery.
void commandBench(const std::vector<std::string>& names, const std::string& folder, const std::string& bunny,
                  const CommonOptions& options);
void commandInfo(const std::vector<std::string>& files, const CommonOptions& options);
void commandValidate(const std::string& scene, const CommonOptions& options);

/// The text of `pavel shape --help`'s list, or of one shape's parameters.
std::string shapeHelp(const std::string& name = "");

}  // namespace pavel
