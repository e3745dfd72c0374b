#pragma once
// One run of a scene in a process of its own, so that its memory and its faults are its own.
#include <string>
#include <vector>

#include "pavel/core/run_context.h"

namespace pavel {

struct BenchRun {
    std::string scene;  ///< name of the built-in scene
    double elements = 0, coverage = 0;
    double seeding = 0, deformation = 0, extract = 0, remesh = 0;  ///< seconds
    double deformationCpu = 0;                                     ///< seconds of all cores
    double decorationVoxels = 0, overlapPercent = 0, baseVoxels = 0;
    double extractedTriangles = 0, finalTriangles = 0;
    double peakBytes = 0;
    double worstError = 0;          ///< of an element's volume, with what is reported unrecovered
    int shortElements = 0;          ///< with more than a thousandth of their volume unrecovered
    double unrecoveredPercent = 0;  ///< of the whole volume
    double total() const { return seeding + deformation + extract + remesh; }
};

/// What a bench asks of this program's other verbs: it runs the program that it is part of.
class BenchRunner {
  public:
    /// @param folder where runs leave their results, one after the other
    /// @param bunny a mesh for the scene `bunny`; empty: the built-in stand-in
    BenchRunner(std::string folder, std::string bunny, int threads, const RunContext& context);
    /// Decorates a built-in scene with these overrides, into `folder`/`name`.
    /// @throws InputError where it is refused, RunError where it fails; Interrupted
    BenchRun decorate(const std::string& scene, const std::string& name, const std::vector<std::string>& overrides);
    /// Places its elements only.
    void seed(const std::string& scene, const std::string& name, const std::vector<std::string>& overrides);
    int threads() const { return threads_; }

  private:
    void run(const std::string& verb, const std::string& scene, const std::string& name,
             const std::vector<std::string>& overrides);
    const RunContext& context_;
    std::string folder_, bunny_;
    int threads_;
};

}  // namespace pavel
