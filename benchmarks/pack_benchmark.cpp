// Time and memory of packing: pearls on a sphere, from placed elements to packed level sets.
//   pavel_benchmark [--threads N] [ELEMENTS:MEGAVOXELS...]     for instance 400:50 20000:50
// Prints a table, then JSON. Each size runs in a process of its own, so that peaks of memory stay apart. Seeding, the
// fused surface, meshes and files are not counted.
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pavel/core/error.h"
#include "pavel/seeding/seed.h"
#include "pavel/tools/load.h"
#include "pavel/vdb/pack.h"

namespace {

using json = nlohmann::ordered_json;

json run(int elements, double megavoxels) {
    using namespace pavel;
    Scene scene;
    scene.resolution = std::cbrt(6 * megavoxels * 1e6 / (3.14159265358979 * elements));
    scene.base.shape = "sphere";
    ElementOptions pearl;
    pearl.name = pearl.shape = "pearl";
    pearl.parameters["radius"] = 40 * std::sqrt(4 * 1.43 / elements);  // coverage 1.43
    scene.elements = {pearl};
    scene.seedings[0].count = size_t(elements);
    validate(scene);
    RunContext context;
    const TriangleMesh base = loadBase(scene, context);
    const auto kinds = loadKinds(scene, context);
    const SeedSet seeds = makeSeeds(base, kinds, scene, {}, context);
    context.stages.clear();
    PackOptions options;
    options.surface = false;
    options.voxelSize = sceneVoxelSize(scene, kinds);
    const Packing p = pack(base, kinds, placeElements(seeds.seeds, kinds), options, context);
    json stages;
    double wall = 0, cpu = 0, worst = 0, unrecovered = 0;
    for (const StageTime& s : context.stages) {
        stages[s.name] = {{"seconds", s.seconds}, {"cpu_seconds", s.cpuSeconds}};
        wall += s.seconds, cpu += s.cpuSeconds;
    }
    for (const ElementResult& e : p.elements) {
        worst = std::max(worst, std::abs(e.finalVolume + e.unrecoveredVolume - e.targetVolume) / e.targetVolume);
        unrecovered += e.unrecoveredVolume / e.targetVolume;
    }
    const double voxels = double(p.counts.decorationVoxels), grown = double(p.counts.grownVoxels);
    json r;
    r["elements"] = elements;
    r["voxels_across"] = *scene.resolution;
    r["decoration_voxels"] = voxels;
    r["grown_voxels"] = grown;
    r["overlap_percent"] = 100 * double(p.counts.overlapVoxels) / voxels;
    r["seconds"] = wall;
    r["cpu_seconds"] = cpu;
    r["cpu_ns_per_voxel"] = cpu / voxels * 1e9;
    r["cpu_ns_per_grown_voxel"] = cpu / std::max(grown, 1.0) * 1e9;
    r["peak_rss_bytes"] = double(peakResidentBytes());
    r["max_relative_volume_error"] = worst;
    r["elements_unrecovered"] = unrecovered;
    r["stages"] = stages;
    return r;
}

json failure(const std::string& what) {
    json r;
    r["error"] = what;
    return r;
}

/// The result of f() in a child process; an object with "error" where it failed.
template <class F>
json inChild(F f) {
    int ends[2];
    if (pipe(ends) != 0) return failure("no pipe");
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        json result;
        try {
            result = f();
        } catch (const std::exception& e) {
            result = failure(e.what());
        }
        const std::string text = result.dump();
        for (size_t at = 0; at < text.size();) {
            const ssize_t n = write(ends[1], text.data() + at, text.size() - at);
            if (n <= 0) break;
            at += size_t(n);
        }
        _exit(0);
    }
    close(ends[1]);
    std::string text;
    char buffer[4096];
    for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;) text.append(buffer, size_t(n));
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    const json result = json::parse(text, nullptr, false);
    return result.is_object() ? result : failure("the run ended with status " + std::to_string(status));
}

}  // namespace

int main(int argc, char** argv) {
    int threads = 0;
    std::vector<std::pair<int, double>> sizes;
    for (int i = 1; i < argc; ++i) {
        int elements = 0;
        double megavoxels = 0;
        if (!std::strcmp(argv[i], "--threads") && i + 1 < argc) {
            threads = std::atoi(argv[++i]);
        } else if (std::sscanf(argv[i], "%d:%lf", &elements, &megavoxels) == 2 && elements > 0 && megavoxels > 0) {
            sizes.emplace_back(elements, megavoxels);
        } else {
            std::fprintf(stderr, "usage: pavel_benchmark [--threads N] [ELEMENTS:MEGAVOXELS...]\n");
            return 2;
        }
    }
    if (sizes.empty()) sizes = {{400, 1}, {400, 4}, {400, 16}};
    json all = json::array();
    std::printf("%8s %7s %9s %8s %9s %9s %9s %11s %9s %7s %9s\n", "elements", "across", "Mvoxels", "seconds",
                "voxelize", "overlap", "growth", "CPU ns/vox", "ns/grown", "GB", "error %");
    bool failed = false;
    for (const auto& [elements, megavoxels] : sizes) {
        const json r = inChild([&, n = elements, m = megavoxels] {
            std::unique_ptr<tbb::global_control> limit;
            if (threads > 0)
                limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
            return run(n, m);
        });
        all.push_back(r);
        if (r.contains("error")) {
            failed = true;
            std::fprintf(stderr, "%d:%g: %s\n", elements, megavoxels, r["error"].get<std::string>().c_str());
            continue;
        }
        const auto number = [&](const char* key) { return r[key].get<double>(); };
        const auto stage = [&](const char* key) { return r["stages"][key]["seconds"].get<double>(); };
        std::printf("%8d %7.1f %9.2f %8.2f %9.2f %9.2f %9.2f %11.0f %9.0f %7.2f %9.4f\n", elements,
                    number("voxels_across"), number("decoration_voxels") / 1e6, number("seconds"), stage("voxelize"),
                    stage("overlap"), stage("growth"), number("cpu_ns_per_voxel"), number("cpu_ns_per_grown_voxel"),
                    number("peak_rss_bytes") / 1e9, 100 * number("max_relative_volume_error"));
        std::fflush(stdout);
    }
    std::printf("%s\n", all.dump(1).c_str());
    return failed ? 1 : 0;
}
