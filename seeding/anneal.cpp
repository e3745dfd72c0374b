#include "pavel/seeding/anneal.h"

#include <algorithm>
#include <cmath>

#include "pavel/seeding/descent.h"
#include "pavel/seeding/tangent_cells.h"

namespace pavel {
namespace {

constexpr int kFarApart = 5;  // cells between the middles of places
constexpr int kShaken = 2;    // rings of cells around a middle
constexpr int kMoving = 5;    // rings that settle, their surroundings resting

/// Where the seeds are shaken: the nearest place of every seed, and how many cells away its middle is.
struct Places {
    std::vector<int> nearest, steps;
    size_t count = 0;

    Places(const std::vector<std::vector<int>>& around, const TangentCells& flat, Rng& rng)
        : nearest(around.size(), -1), steps(around.size(), 1 << 20) {
        std::vector<int> defects, queue;
        for (size_t i = 0; i < around.size(); ++i)
            if (around[i].size() != 6 && flat.fits(i)) defects.push_back(int(i));
        for (size_t i = defects.size(); i > 1; --i)
            std::swap(defects[i - 1], defects[size_t(rng.uniform() * double(i))]);
        for (int middle : defects) {
            if (steps[size_t(middle)] < kFarApart) continue;
            steps[size_t(middle)] = 0;
            nearest[size_t(middle)] = int(count);
            queue.assign(1, middle);
            for (size_t k = 0; k < queue.size(); ++k) {
                const int next = steps[size_t(queue[k])] + 1;
                if (next > kMoving) break;
                for (int j : around[size_t(queue[k])])
                    if (steps[size_t(j)] > next)
                        steps[size_t(j)] = next, nearest[size_t(j)] = int(count), queue.push_back(j);
            }
            ++count;
        }
    }
};

}  // namespace

std::vector<SurfacePoint> annealed(const Surface& surface, RestrictedVoronoi& voronoi, std::vector<SurfacePoint> seeds,
                                   Rng& rng) {
    constexpr int kRounds = 12;
    constexpr double kFarthest = 0.5;  // shaken along each axis, in seed spacings
    constexpr Descent kSettling{1, 20, 2e-3};
    const size_t n = seeds.size();
    TangentCells flat(seeds, voronoi.cells(seeds));
    const auto flatCells = [&](const std::vector<SurfacePoint>& s) { return flat.cells(s); };
    seeds = descended(surface, flatCells, std::move(seeds), kSettling);
    // What a cell's energy grows by with its area: seeds beside a place gain or lose area by what happens in it.
    const double energyPerArea = 2 * 5 / (18 * std::sqrt(3.0)) * surface.area() / double(n);
    for (int round = 0; round < kRounds; ++round) {
        flat.moveAll();
        std::vector<std::vector<int>> around;
        flat.cells(seeds, &around);
        const Places places(around, flat, rng);
        if (places.count == 0) break;
        std::vector<char> moving(n);
        for (size_t i = 0; i < n; ++i) moving[i] = places.nearest[i] >= 0;
        flat.moveOnly(moving);
        std::vector<SurfacePoint> trial = seeds;
        for (size_t i = 0; i < n; ++i) {
            if (places.steps[i] > kShaken || !flat.fits(i)) continue;
            const Vec3 shake(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.5);
            trial[i] = surface.walked(seeds[i], 2 * kFarthest * flat.spacing() * shake);
        }
        const auto before = flat.cells(seeds);
        trial = descended(surface, flatCells, std::move(trial), kSettling);
        const auto after = flat.cells(trial);
        std::vector<double> growth(places.count, 0);
        for (size_t i = 0; i < n; ++i)
            if (const int p = places.nearest[i]; p >= 0)
                growth[size_t(p)] +=
                    after[i].energy - before[i].energy - energyPerArea * (after[i].area - before[i].area);
        for (size_t i = 0; i < n; ++i)
            if (const int p = places.nearest[i]; p >= 0 && growth[size_t(p)] < 0) seeds[i] = trial[i];
    }
    flat.moveAll();
    return descended(surface, flatCells, std::move(seeds), kSettling);
}

}  // namespace pavel
