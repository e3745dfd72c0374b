#include "pavel/tools/bench_run.h"

#include <spawn.h>
#include <sys/wait.h>
#include <tbb/info.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "pavel/core/error.h"
#include "pavel/io/atomic_output.h"
#include "pavel/tools/examples.h"

extern char** environ;

namespace pavel {
namespace {

namespace fs = std::filesystem;

void runProgram(const std::vector<std::string>& arguments, const std::string& what, const RunContext& context) {
    std::vector<char*> argv;
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    pid_t child = 0;
    if (posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, argv.data(), environ) != 0)
        throw RunError(what + ": the program cannot be started");
    int status = 0;
    for (bool told = false;;) {
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) break;
        if (ended < 0 && errno != EINTR) throw RunError(what + ": lost sight of the run");
        if (context.cancelled && !told) told = kill(child, SIGINT) == 0;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if ((WIFSIGNALED(status) && WTERMSIG(status) == SIGINT) || (WIFEXITED(status) && WEXITSTATUS(status) == 130))
        throw Interrupted();
    if (WIFEXITED(status) && WEXITSTATUS(status) == 2) throw InputError(what + " was refused, see above");
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw RunError(what + " failed, see above");
}

}  // namespace

BenchRunner::BenchRunner(std::string folder, std::string bunny, int threads, const RunContext& context)
    : context_(context),
      folder_(std::move(folder)),
      bunny_(std::move(bunny)),
      threads_(threads > 0 ? threads : int(tbb::info::default_concurrency())) {}

void BenchRunner::run(const std::string& verb, const std::string& scene, const std::string& name,
                      const std::vector<std::string>& overrides) {
    const fs::path folder = fs::path(folder_) / name;
    fs::create_directories(folder_);
    const std::string file = (fs::path(folder_) / (name + ".json")).string();
    writeText(file, findExample(scene).scene);
    std::vector<std::string> arguments{
        "pavel", verb, file, "-o", folder, "--quiet", "--force", "--threads", std::to_string(threads_)};
    std::vector<std::string> sets = overrides;
    if (scene == "bunny" && !bunny_.empty())
        sets.push_back("base=" + nlohmann::json{{"mesh", fs::absolute(bunny_).string()}, {"scale_to", 150}}.dump());
    for (const std::string& s : sets) arguments.insert(arguments.end(), {"--set", s});
    runProgram(arguments, verb + " " + scene, context_);
}

void BenchRunner::seed(const std::string& scene, const std::string& name, const std::vector<std::string>& overrides) {
    run("seed", scene, name, overrides);
}

BenchRun BenchRunner::decorate(const std::string& scene, const std::string& name,
                               const std::vector<std::string>& overrides) {
    run("decorate", scene, name, overrides);
    std::ifstream file(fs::path(folder_) / name / "report.json");
    const nlohmann::json r = nlohmann::json::parse(file);
    const auto& seconds = r["seconds"];
    const auto& cpu = r["cpu_seconds"];
    const auto& counts = r["counts"];
    BenchRun b;
    b.scene = scene;
    b.elements = counts["elements"];
    b.coverage = r["coverage"];
    b.seeding = seconds["seeding"];
    for (const char* stage : {"voxelize", "overlap", "growth"}) {
        b.deformation += seconds[stage].get<double>();
        b.deformationCpu += cpu[stage].get<double>();
    }
    b.extract = seconds["extract"];
    b.remesh = seconds["remesh"];
    b.decorationVoxels = counts["decoration_voxels"];
    b.overlapPercent = counts["overlap_percent"];
    b.baseVoxels = counts["base_voxels"];
    b.extractedTriangles = counts["extracted_triangles"];
    b.finalTriangles = counts["final_triangles"];
    b.peakBytes = r["memory"]["peak_rss_bytes"];
    b.worstError = r["volume"]["max_relative_error"];
    b.unrecoveredPercent = 100 * r["volume"]["unrecovered"].get<double>() / r["volume"]["initial"].get<double>();
    for (const auto& e : r["elements"])
        b.shortElements += e["unrecovered_volume"].get<double>() > 1e-3 * e["target_volume"].get<double>();
    return b;
}

}  // namespace pavel
