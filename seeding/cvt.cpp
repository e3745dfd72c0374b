#include "pavel/seeding/cvt.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "pavel/seeding/anneal.h"
#include "pavel/seeding/descent.h"
#include "pavel/seeding/restricted_voronoi.h"
#include "pavel/seeding/simplify.h"

namespace pavel {
namespace {

/// Seeds at the middles of the lines between neighbours are added: four times as many in the same order. Their number
/// is brought to `count` at random places.
std::vector<SurfacePoint> refined(const Surface& surface, RestrictedVoronoi& voronoi,
                                  const std::vector<SurfacePoint>& coarse, size_t count,
                                  const std::vector<double>& density, Rng& rng) {
    std::vector<std::vector<int>> neighbours;
    voronoi.cells(coarse, &neighbours);
    std::vector<SurfacePoint> seeds = coarse;
    for (size_t i = 0; i < coarse.size(); ++i)
        for (int j : neighbours[i])
            if (size_t(j) > i)
                seeds.push_back(surface.walked(coarse[i], 0.5 * (coarse[size_t(j)].position - coarse[i].position)));
    for (; seeds.size() > count; seeds.pop_back())
        std::swap(seeds[size_t(rng.uniform() * double(seeds.size()))], seeds.back());
    if (seeds.size() < count)
        for (const SurfacePoint& p : surface.sample(count - seeds.size(), rng, density)) seeds.push_back(p);
    // Near in memory what is near on the surface.
    std::stable_sort(seeds.begin(), seeds.end(),
                     [](const SurfacePoint& a, const SurfacePoint& b) { return a.triangle < b.triangle; });
    return seeds;
}

/// Moves single seeds from where cells are too small, in the mean over some eighty of them, to where they are too
/// large: what a coarse tessellation could not get right by whole seeds, and what descent would take thousands of steps
/// for. O(n + moves).
std::vector<SurfacePoint> balanced(const Surface& surface, RestrictedVoronoi& voronoi, std::vector<SurfacePoint> seeds,
                                   const std::vector<double>& density) {
    constexpr int kPasses = 30;           // of averaging over neighbours
    constexpr double kTolerance = 0.015;  // share of a seed too many or too few
    const size_t n = seeds.size();
    std::vector<std::vector<int>> around;
    const std::vector<VoronoiCell> cells = voronoi.cells(seeds, &around);
    std::vector<double> wanted(n);  // seeds that a cell would have, by its area and density
    double sum = 0;
    for (size_t i = 0; i < n; ++i)
        sum += wanted[i] = cells[i].area * (density.empty() ? 1 : density[size_t(seeds[i].triangle)]);
    for (double& w : wanted) w *= double(n) / sum;
    // Averages over neighbours that keep the sum: both give the other the same share.
    const auto averaged = [&](std::vector<std::pair<int, double>> values) {
        std::vector<double> now(n, 0), next(n, 0);
        std::vector<int> active;
        std::vector<char> isActive(n, 0);
        const auto activate = [&](int i) {
            if (!isActive[size_t(i)]) isActive[size_t(i)] = 1, active.push_back(i);
        };
        for (const auto& [i, v] : values) now[size_t(i)] = v, activate(i);
        for (int pass = 0; pass < kPasses; ++pass) {
            const size_t known = active.size();
            for (size_t k = 0; k < known; ++k)
                for (int j : around[size_t(active[k])]) activate(j);
            for (int i : active) {
                next[size_t(i)] = now[size_t(i)];
                for (int j : around[size_t(i)]) next[size_t(i)] += (now[size_t(j)] - now[size_t(i)]) / 10;
            }
            for (int i : active) now[size_t(i)] = next[size_t(i)];
        }
        return now;
    };
    std::vector<std::pair<int, double>> all;
    for (size_t i = 0; i < n; ++i) all.emplace_back(int(i), wanted[i]);
    std::vector<double> mean = averaged(all);
    std::vector<char> used(n, 0);
    for (size_t moves = 0; moves < n / 20; ++moves) {
        int many = -1, few = -1;
        for (size_t i = 0; i < n; ++i) {
            if (used[i]) continue;
            if (few < 0 || mean[i] > mean[size_t(few)]) few = int(i);
            if (many < 0 || mean[i] < mean[size_t(many)]) many = int(i);
        }
        if (few < 0 || mean[size_t(few)] - mean[size_t(many)] < 2 * kTolerance) break;
        used[size_t(few)] = used[size_t(many)] = 1;
        // Into the gap beside the seed: towards the middle between two of its neighbours.
        const auto& ring = around[size_t(few)];
        Vec3 towards(1, 0, 0);
        double farthest = 0;
        for (int j : ring)
            if (const Vec3 d = seeds[size_t(j)].position - seeds[size_t(few)].position; dot(d, d) > farthest)
                farthest = dot(d, d), towards = d;
        seeds[size_t(many)] = surface.walked(seeds[size_t(few)], 0.35 * towards);
        const std::vector<double> taken = averaged({{few, 1.0}}), given = averaged({{many, 1.0}});
        for (size_t i = 0; i < n; ++i) mean[i] += given[i] - taken[i];
    }
    return seeds;
}

std::vector<SurfacePoint> mapped(const std::vector<SurfacePoint>& seeds, const Surface& from, const Surface& to) {
    std::vector<SurfacePoint> result(seeds.size());
    tbb::parallel_for(size_t(0), seeds.size(), [&](size_t i) {
        const Vec3 facing = from.faceNormal(seeds[i].triangle);
        result[i] = to.closest(seeds[i].position, &facing);
    });
    return result;
}

/// A surface to tessellate, with the wanted seeds per area on its triangles.
struct Ground {
    const Surface& surface;
    std::vector<double> density;
    RestrictedVoronoi voronoi;

    Ground(const Surface& s, std::vector<double> d) : surface(s), density(std::move(d)), voronoi(s, weights()) {}
    /// Cells of a tessellation are as many as the root of its weight (A. Gersho 1979).
    std::vector<double> weights() const {
        std::vector<double> w = density;
        for (double& x : w) x *= x;
        return w;
    }
};

std::vector<double> densityOn(const Surface& coarse, const Surface& fine, const std::vector<double>& density) {
    std::vector<double> result(density.empty() ? 0 : coarse.mesh().triangles.size());
    for (size_t t = 0; t < result.size(); ++t) {
        const Vec3 facing = coarse.faceNormal(int(t));
        const TriangleMesh& m = coarse.mesh();
        result[t] =
            density[size_t(fine.closest((m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3.0, &facing).triangle)];
    }
    return result;
}

}  // namespace

std::vector<SurfacePoint> centroidalSeeds(const Surface& surface, size_t count, const CvtOptions& options,
                                          const std::function<void(double)>& progress) {
    Rng rng(options.seed, 1);
    constexpr int kOrderly = 20;       // iterations from which the start is orderly, too
    constexpr size_t kCoarsest = 300;  // seeds
    constexpr int kLloyd = 5;
    constexpr size_t kFew = 6000;     // seeds up to which single ones make a difference
    constexpr double kRough = 1e-2;   // tolerance before annealing
    constexpr size_t kTriangles = 8;  // for each seed: enough to see the surface's shape
    const auto centred = [&](Ground& ground, std::vector<SurfacePoint> seeds, int lloydSteps, double tolerance,
                             const std::function<void(double)>& report = {}) {
        return descended(
            ground.surface, [&](const std::vector<SurfacePoint>& s) { return ground.voronoi.cells(s); },
            std::move(seeds), {lloydSteps, options.iterations, tolerance}, report);
    };
    Ground exact(surface, options.density);
    if (options.iterations < kOrderly || count < 2) {
        auto seeds = surface.sample(count, rng, options.density);
        if (options.iterations <= 0 || count < 2) return seeds;
        return centred(exact, std::move(seeds), kLloyd, options.tolerance, progress);
    }
    std::vector<size_t> levels{count};
    while (levels.back() > 4 * kCoarsest) levels.push_back((levels.back() + 6) / 4);
    std::vector<TriangleMesh> simple(levels.size());
    tbb::parallel_for(size_t(0), levels.size(), [&](size_t l) {
        if (surface.mesh().triangles.size() > 2 * kTriangles * levels[l])
            simple[l] = simplified(surface.mesh(), kTriangles * levels[l]);
    });
    std::unique_ptr<Surface> light, lighter;
    std::unique_ptr<Ground> coarse;
    std::vector<SurfacePoint> seeds;
    for (size_t l = levels.size(); l-- > 0;) {
        const size_t n = levels[l];
        const Surface* before = light ? light.get() : &surface;
        Ground* ground = &exact;
        if (TriangleMesh mesh = std::move(simple[l]); !mesh.triangles.empty()) {
            subdivideLongEdges(mesh, std::sqrt(surface.area() / double(n)));
            lighter = std::make_unique<Surface>(std::move(mesh));
            coarse = std::make_unique<Ground>(*lighter, densityOn(*lighter, surface, options.density));
            ground = coarse.get();
        }
        const bool first = seeds.empty();
        if (first)
            seeds = ground->surface.sample(n, rng, ground->density);
        else
            seeds = refined(ground->surface, ground->voronoi, mapped(seeds, *before, ground->surface), n,
                            ground->density, rng);
        if (!first && n <= kFew) seeds = balanced(ground->surface, ground->voronoi, std::move(seeds), ground->density);
        if (options.density.empty() && n <= kFew) {
            seeds = centred(*ground, std::move(seeds), first ? kLloyd : 1, kRough);
            seeds = annealed(ground->surface, ground->voronoi, std::move(seeds), rng);
            seeds = centred(*ground, std::move(seeds), 1, 0.5 * options.tolerance);
        } else {
            seeds = centred(*ground, std::move(seeds), first ? kLloyd : 1, options.tolerance);
        }
        light = ground == &exact ? nullptr : std::move(lighter);
        if (progress) progress(0.8 * double(levels.size() - l) / double(levels.size()));
    }
    if (!light) return seeds;
    return centred(exact, mapped(seeds, *light, surface), 1, options.tolerance);
}

}  // namespace pavel
