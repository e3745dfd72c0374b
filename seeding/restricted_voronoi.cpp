#include "pavel/seeding/restricted_voronoi.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "pavel/seeding/kd_tree.h"
#include "pavel/seeding/voronoi_pieces.h"

namespace pavel {

RestrictedVoronoi::RestrictedVoronoi(const Surface& surface, std::vector<double> density)
    : surface_(surface), density_(std::move(density)) {
    const TriangleMesh& mesh = surface.mesh();
    const size_t n = mesh.triangles.size();
    if (density_.empty()) density_.assign(n, 1);
    owner_.assign(n, -1);
    centre_.resize(n);
    radius_.assign(n, 0);
    for (size_t t = 0; t < n; ++t) {
        centre_[t] = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0;
        for (int k = 0; k < 3; ++k) radius_[t] = std::max(radius_[t], length(mesh.corner(t, k) - centre_[t]));
    }
}

struct RestrictedVoronoi::Search {
    const std::vector<SurfacePoint>& seeds;
    PointCloud cloud{seeds};
    KdTree tree{3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8)};
    double moved = 0;  // the farthest that a seed has gone since the lists were made
};

/// Lists the seeds around every seed, unless those of an earlier call still serve.
void RestrictedVoronoi::updateNear(Search& search) {
    const std::vector<SurfacePoint>& seeds = search.seeds;
    constexpr double kWorn = 0.1;  // of the mean reach
    if (reference_.size() == seeds.size()) {
        double moved2 = 0, reach = 0;
        for (size_t s = 0; s < seeds.size(); ++s) {
            moved2 = std::max(moved2, (seeds[s].position - reference_[s]).sqrnorm());
            reach += reach_[s];
        }
        search.moved = std::sqrt(moved2);
        if (search.moved < kWorn * reach / double(seeds.size())) return;
    }
    search.moved = 0;
    reference_.resize(seeds.size());
    reach_.assign(seeds.size(), 1e300);
    near_.assign(seeds.size() * kNear, {});
    tbb::parallel_for(tbb::blocked_range<size_t>(0, seeds.size(), 64), [&](const auto& range) {
        size_t index[kNear + 1];
        double distance2[kNear + 1];
        for (size_t s = range.begin(); s < range.end(); ++s) {
            reference_[s] = seeds[s].position;
            const size_t got = search.tree.knnSearch(reference_[s].data(), kNear + 1, index, distance2);
            size_t n = 0;
            for (size_t i = 0; i < got && n < kNear; ++i)
                if (index[i] != s) near_[s * kNear + n++] = {int(index[i]), std::sqrt(distance2[i])};
            if (got > kNear) reach_[s] = std::sqrt(distance2[kNear]);
        }
    });
}

/// All seeds that can own a part of a triangle, nearest to its centre first, ties by index. The seeds around `guess` do
/// where they reach far enough: what is nearer than d to the centre is nearer than |guess - centre| + d to the guess.
void RestrictedVoronoi::findCandidates(size_t t, int guess, const Search& search, std::vector<Candidate>& found) const {
    const Vec3 centre = centre_[t], normal = surface_.faceNormal(int(t));
    const auto distance2 = [&](int s) { return (search.seeds[size_t(s)].position - centre).sqrnorm(); };
    const auto faces = [&](int s) {
        return dot(normal, surface_.faceNormal(search.seeds[size_t(s)].triangle)) > kFacing;
    };
    const auto most = [&](double nearest2) { return (std::sqrt(nearest2) + 2 * radius_[t]) * (1 + 1e-9); };
    const auto keepNear = [&] {
        std::sort(found.begin(), found.end());
        const double limit = most(found[0].first);
        while (found.back().first > limit * limit) found.pop_back();
    };
    constexpr int kSteps = 8;
    for (int step = 0; guess >= 0 && step < kSteps; ++step) {
        const double own2 = distance2(guess), own = std::sqrt(own2);
        const bool valid = faces(guess);
        double least = valid ? own2 : 1e300;
        int nearest = guess;
        found.clear();
        if (valid) found.emplace_back(own2, guess);
        const Near* around = &near_[size_t(guess) * kNear];
        for (size_t i = 0; i < kNear && around[i].seed >= 0; ++i) {
            if (valid && around[i].distance > own + most(own2) + 2 * search.moved) break;
            const double d = distance2(around[i].seed);
            if ((valid && std::sqrt(d) > most(own2)) || !faces(around[i].seed)) continue;
            found.emplace_back(d, around[i].seed);
            if (d < least) least = d, nearest = around[i].seed;
        }
        if (nearest != guess) {
            guess = nearest;
            continue;
        }
        if (!valid || reach_[size_t(guess)] < own + most(own2) + 2 * search.moved) break;
        return keepNear();
    }
    size_t index = 0;
    double nearest2 = 0;
    search.tree.knnSearch(centre.data(), 1, &index, &nearest2);
    std::vector<std::pair<size_t, double>> all;
    found.clear();
    for (double reach = most(nearest2);; reach *= 2) {
        search.tree.radiusSearch(centre.data(), reach * reach, all, nanoflann::SearchParams(0, 0, false));
        const bool everyone = all.size() == search.seeds.size();
        double least = 1e300;
        for (const auto& f : all)
            if (faces(int(f.first))) least = std::min(least, distance2(int(f.first)));
        if (least == 1e300 && !everyone) continue;
        if (least < 1e300 && most(least) > reach && !everyone) {
            reach = most(least) / 2;
            continue;
        }
        for (const auto& f : all)
            if (least == 1e300 || faces(int(f.first))) found.emplace_back(distance2(int(f.first)), int(f.first));
        return keepNear();
    }
}

std::vector<VoronoiCell> RestrictedVoronoi::cells(const std::vector<SurfacePoint>& seeds,
                                                  std::vector<std::vector<int>>* neighbours) {
    Search search{seeds};
    updateNear(search);
    const TriangleMesh& mesh = surface_.mesh();
    const size_t triangles = mesh.triangles.size();
    std::vector<std::vector<Piece>> chunks((triangles + kChunk - 1) / kChunk);
    tbb::parallel_for(size_t(0), chunks.size(), [&](size_t chunk) {
        std::vector<Piece>& out = chunks[chunk];
        out.reserve(2 * kChunk);
        std::vector<Candidate> found;
        std::vector<int> candidates;
        int guess = -1;
        for (size_t t = chunk * kChunk; t < std::min(triangles, (chunk + 1) * kChunk); ++t) {
            if (owner_[t] >= 0 && size_t(owner_[t]) < seeds.size()) guess = owner_[t];
            findCandidates(t, guess, search, found);
            owner_[t] = guess = found[0].second;
            if (found.size() == 1) {
                appendWhole(mesh, t, centre_[t], surface_.faceArea(int(t)), density_[t], guess,
                            seeds[size_t(guess)].position, out);
                continue;
            }
            candidates.clear();
            for (const auto& f : found) candidates.push_back(f.second);
            partition(wholeTriangle(mesh, t), int(t), density_[t], candidates, seeds, out);
        }
    });
    Pieces pieces(surface_, chunks);
    std::vector<VoronoiCell> cells = sumJoined(seeds, pieces);
    adoptOrphans(surface_, density_, seeds, pieces, cells);
    for (size_t t = 0; t < triangles; ++t)  // a component without a seed goes to the nearest one, though not connected
        for (int j = pieces.begin[t]; j < pieces.end[t]; ++j)
            if (!pieces.joined[size_t(j)]) add(cells[size_t(pieces.links[size_t(j)].seed)], pieces.sums[size_t(j)]);
    if (neighbours) *neighbours = neighboursOf(surface_, seeds, pieces);
    return cells;
}

}  // namespace pavel
