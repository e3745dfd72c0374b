// Time and quality of isotropic seeding on whole surfaces.
//   pavel_seeding_benchmark [--threads N] [--iterations N] [SHAPE|MESH:SEEDS...]      for instance vase:2000
//   bunny.obj:10000
// Prints tables, then JSON; without arguments also how refinement evens out elements that are not round. G: second
// moment of the Voronoi cells over that of regular hexagons of the mean area; six: share of cells with six neighbours;
// nearest: smallest over mean distance to the nearest other seed. Reading a mesh is not counted; preparing it for the
// tessellation is.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pavel/core/error.h"
#include "pavel/core/footprint.h"
#include "pavel/core/run_context.h"
#include "pavel/core/shapes.h"
#include "pavel/io/mesh_read.h"
#include "pavel/seeding/cvt.h"
#include "pavel/seeding/nearest.h"
#include "pavel/seeding/refine.h"
#include "pavel/seeding/restricted_voronoi.h"
#include "pavel/seeding/seed.h"

namespace {

using json = nlohmann::ordered_json;
using namespace pavel;

json run(const std::string& name, size_t count, int iterations) {
    const std::string shape = name.substr(0, name.find('.'));
    TriangleMesh mesh = findShape(shape) ? makeShape(shape) : readMesh(name);
    if (findShape(shape) && shape != name) mesh = groupSubmesh(mesh, name.substr(shape.size() + 1));
    RunContext context;
    const double area = meshArea(mesh);
    const size_t triangles = mesh.triangles.size();
    std::unique_ptr<Surface> surface;
    std::vector<SurfacePoint> seeds;
    {
        const StageTimer timer(context, "seeding");
        subdivideLongEdges(mesh, kLongestEdge * std::sqrt(area / double(count)));
        surface = std::make_unique<Surface>(std::move(mesh));
        CvtOptions options;
        options.iterations = iterations;
        seeds = centroidalSeeds(*surface, count, options);
    }
    std::vector<std::vector<int>> around;
    const auto cells = RestrictedVoronoi(*surface).cells(seeds, &around);
    double energy = 0, sum = 0, squares = 0, nearest = 1e300, distances = 0;
    size_t six = 0, empty = 0;
    for (size_t i = 0; i < count; ++i) {
        energy += cells[i].energy;
        sum += cells[i].area;
        squares += cells[i].area * cells[i].area;
        six += around[i].size() == 6;
        empty += !(cells[i].area > 0);
    }
    const auto closest = nearestOf(seeds, 1);
    for (size_t i = 0; i < count; ++i) {
        const double d = length(seeds[i].position - seeds[closest[i][0]].position);
        nearest = std::min(nearest, d);
        distances += d;
    }
    const double n = double(count), mean = area / n;
    json r;
    r["surface"] = name;
    r["triangles"] = triangles;
    r["seeds"] = count;
    r["seconds"] = context.stages[0].seconds;
    r["cpu_seconds"] = context.stages[0].cpuSeconds;
    r["G"] = energy / n / (5 * mean * mean / (18 * std::sqrt(3.0)));
    r["six_neighbour_share"] = double(six) / n;
    r["area_cv"] = std::sqrt(std::max(0.0, squares / n - mean * mean)) / mean;
    r["nearest_over_mean"] = nearest / (distances / n);
    r["empty_cells"] = empty;
    r["area_error"] = std::abs(sum - area) / area;
    return r;
}

/// Refinement of one kind of element on the vase, coverage 1.4, turned at random.
json refinement(const std::string& shape, int iterations) {
    Scene scene;
    scene.seedings[0].coverage = 1.4;
    scene.refineIterations = iterations;
    ElementKind kind;
    kind.name = shape;
    kind.mesh = makeShape(shape);
    kind.footprint = footprintArea(kind.mesh);
    const TriangleMesh base = makeShape("vase");
    RunContext context;
    const SeedSet set = makeSeeds(base, {kind}, scene, {}, context);
    const Surface surface(decoratedSurface(base, scene.seedings[0], 1));
    const CoverMeasure m = measureCover(surface, set.seeds, {kind});
    json r;
    r["element"] = shape;
    r["seeds"] = set.seeds.size();
    r["iterations"] = iterations;
    r["cpu_seconds"] = context.stages[0].cpuSeconds;
    r["uncovered"] = m.uncovered;
    r["deviation"] = m.deviation;
    return r;
}

}  // namespace

int main(int argc, char** argv) {
    int threads = 0, iterations = CvtOptions().iterations;
    std::vector<std::pair<std::string, size_t>> runs;
    for (int i = 1; i < argc; ++i) {
        const std::string arg = argv[i];
        const size_t colon = arg.rfind(':');
        const long count = colon == std::string::npos ? 0 : std::atol(arg.c_str() + colon + 1);
        if (arg == "--threads" && i + 1 < argc) {
            threads = std::atoi(argv[++i]);
        } else if (arg == "--iterations" && i + 1 < argc) {
            iterations = std::atoi(argv[++i]);
        } else if (count > 1) {
            runs.emplace_back(arg.substr(0, colon), size_t(count));
        } else {
            std::fprintf(
                stderr,
                "usage: pavel_seeding_benchmark [--threads N] [--iterations N] [SHAPE|SHAPE.PART|MESH:SEEDS...]\n");
            return 2;
        }
    }
    std::unique_ptr<tbb::global_control> limit;
    if (threads > 0)
        limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads);
    const bool everything = runs.empty();
    if (runs.empty()) runs = {{"vase", 400}, {"vase", 2000}, {"vase.outer", 2000}, {"vase", 10000}};
    json all = json::array();
    std::printf("%-24s %8s %8s %8s %7s %6s %8s %8s %6s %10s\n", "surface", "seeds", "seconds", "CPU", "G", "six",
                "area CV", "nearest", "empty", "area err");
    bool failed = false;
    for (const auto& [name, count] : runs) {
        try {
            const json r = run(name, count, iterations);
            all.push_back(r);
            const auto number = [&, &row = r](const char* key) { return row[key].get<double>(); };
            std::printf("%-24s %8zu %8.2f %8.2f %7.4f %6.3f %8.4f %8.3f %6.0f %10.1e\n",
                        name.substr(name.rfind('/') + 1).c_str(), count, number("seconds"), number("cpu_seconds"),
                        number("G"), number("six_neighbour_share"), number("area_cv"), number("nearest_over_mean"),
                        number("empty_cells"), number("area_error"));
            std::fflush(stdout);
        } catch (const Error& e) {
            failed = true;
            std::fprintf(stderr, "%s: %s\n", name.c_str(), e.what());
        }
    }
    if (everything) {
        std::printf("\n%-24s %8s %10s %8s %10s %10s\n", "element on the vase", "seeds", "iterations", "CPU",
                    "uncovered", "deviation");
        for (const char* shape : {"bean", "leaf", "petal"})
            for (int steps : {0, 30}) {
                const json r = refinement(shape, steps);
                all.push_back(r);
                std::printf("%-24s %8zu %10d %8.2f %10.4f %10.4f\n", shape, r["seeds"].get<size_t>(), steps,
                            r["cpu_seconds"].get<double>(), r["uncovered"].get<double>(), r["deviation"].get<double>());
            }
    }
    std::printf("%s\n", all.dump(1).c_str());
    return failed ? 1 : 0;
}
