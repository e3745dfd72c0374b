#include "pavel/seeding/restricted_voronoi.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

/// Convex polygon inside a triangle; side[i]: what the edge from corner i to i+1 lies on: a side of the triangle (0, 1
/// or 2), or the bisector with seed s (-1 - s).
struct Polygon {
    static constexpr int kMost = 64;
    Vec3 p[kMost];
    int side[kMost];
    int n = 0;
};

/// Keeps the part of `in` that is nearer to a than to b, the position of seed `other`.
void clipByBisector(const Polygon& in, const Vec3& a, const Vec3& b, int other, Polygon& out) {
    const Vec3 normal = b - a, middle = 0.5 * (a + b);
    out.n = 0;
    double h0 = dot(in.p[0] - middle, normal);
    for (int i = 0; i < in.n; ++i) {
        const int j = i + 1 < in.n ? i + 1 : 0;
        const double h1 = dot(in.p[j] - middle, normal);
        if (h0 <= 0) {
            out.p[out.n] = in.p[i];
            out.side[out.n++] = in.side[i];
        }
        if ((h0 <= 0) != (h1 <= 0) && out.n < Polygon::kMost - 1) {
            out.p[out.n] = in.p[i] + (h0 / (h0 - h1)) * (in.p[j] - in.p[i]);
            out.side[out.n++] = h0 <= 0 ? -1 - other : in.side[i];
        }
        h0 = h1;
    }
    if (out.n < 3) out.n = 0;
}

/// The part of one triangle that one seed owns.
struct Piece {
    int triangle = -1, seed = -1;
    unsigned sides = 0;  ///< bit k: touches the triangle's side k
    VoronoiCell sums;
};

void integrate(const Polygon& poly, const Vec3& seed, double density, Piece& piece) {
    for (int i = 1; i + 1 < poly.n; ++i) {
        const Vec3 a = poly.p[0] - seed, b = poly.p[i] - seed, c = poly.p[i + 1] - seed;
        const double area = 0.5 * length(cross(b - a, c - a)), mass = density * area;
        piece.sums.area += area;
        piece.sums.mass += mass;
        piece.sums.moment += mass * ((poly.p[0] + poly.p[i] + poly.p[i + 1]) / 3.0);
        piece.sums.energy += mass / 6 * (dot(a, a) + dot(b, b) + dot(c, c) + dot(a, b) + dot(b, c) + dot(c, a));
    }
    for (int i = 0; i < poly.n; ++i)
        if (poly.side[i] >= 0) piece.sides |= 1u << poly.side[i];
}

Polygon wholeTriangle(const TriangleMesh& mesh, size_t t) {
    Polygon p;
    p.n = 3;
    for (int k = 0; k < 3; ++k) p.p[k] = mesh.corner(t, k), p.side[k] = k;
    return p;
}

/// Clips `start` among the candidates (nearest to the triangle's centre first) and appends the pieces.
void partition(const Polygon& start, int triangle, double density, const std::vector<int>& candidates,
               const std::vector<SurfacePoint>& seeds, std::vector<Piece>& out,
               std::vector<Polygon>* polygons = nullptr) {
    Polygon buffers[2];
    for (int s : candidates) {
        const Polygon* polygon = &start;
        const Vec3& own = seeds[size_t(s)].position;
        for (int other : candidates) {
            if (other == s) continue;
            Polygon& next = buffers[polygon == &buffers[0]];
            clipByBisector(*polygon, own, seeds[size_t(other)].position, other, next);
            polygon = &next;
            if (next.n == 0) break;
        }
        if (polygon->n == 0) continue;
        out.emplace_back();
        out.back().triangle = triangle;
        out.back().seed = s;
        integrate(*polygon, own, density, out.back());
        if (polygons) polygons->push_back(*polygon);
    }
}

/// The piece that a triangle is as a whole.
void appendWhole(const TriangleMesh& mesh, size_t t, const Vec3& centre, double area, double density, int seed,
                 const Vec3& position, std::vector<Piece>& out) {
    out.emplace_back();
    Piece& p = out.back();
    p.triangle = int(t);
    p.seed = seed;
    p.sides = 7;
    double edges2 = 0;
    for (int k = 0; k < 3; ++k) edges2 += (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).sqrnorm();
    p.sums.area = area;
    p.sums.mass = density * area;
    p.sums.moment = p.sums.mass * centre;
    p.sums.energy = p.sums.mass * ((centre - position).sqrnorm() + edges2 / 36);
}

/// Triangles that are worked on together.
constexpr size_t kChunk = 1024;

void add(VoronoiCell& to, const VoronoiCell& c, double sign = 1) {
    to.area += sign * c.area;
    to.mass += sign * c.mass;
    to.moment += sign * c.moment;
    to.energy += sign * c.energy;
}

/// All pieces by triangle: those of triangle t are begin[t] to end[t].
struct Pieces {
    struct Link {  // what a walk over them reads, close together
        int triangle, seed;
        unsigned sides;
    };
    const std::vector<std::array<int, 3>>& neighbours;  // of the triangles
    std::vector<int> begin, end;
    std::vector<Link> links;
    std::vector<VoronoiCell> sums;
    std::vector<char> joined;  // by a walk inside the cell to its seed

    Pieces(const Surface& surface, const std::vector<std::vector<Piece>>& chunks) : neighbours(surface.neighbours()) {
        const size_t triangles = neighbours.size();
        begin.resize(triangles);
        end.resize(triangles);
        std::vector<size_t> start(chunks.size() + 1, 0);
        for (size_t c = 0; c < chunks.size(); ++c) start[c + 1] = start[c] + chunks[c].size();
        links.resize(start.back());
        sums.resize(start.back());
        joined.assign(start.back(), 0);
        tbb::parallel_for(size_t(0), chunks.size(), [&](size_t c) {
            size_t at = start[c], t = c * kChunk;
            for (const Piece& p : chunks[c]) {
                for (; t <= size_t(p.triangle); ++t) begin[t] = int(at);
                links[at] = {p.triangle, p.seed, p.sides};
                sums[at++] = p.sums;
                end[size_t(p.triangle)] = int(at);
            }
        });
    }
    /// Puts new pieces in the place of a triangle's.
    void replace(int triangle, const std::vector<Piece>& pieces, const std::vector<char>& areJoined) {
        begin[size_t(triangle)] = int(links.size());
        for (const Piece& p : pieces) {
            links.push_back({p.triangle, p.seed, p.sides});
            sums.push_back(p.sums);
        }
        joined.insert(joined.end(), areJoined.begin(), areJoined.end());
        end[size_t(triangle)] = int(links.size());
    }
    /// Calls f for the pieces of the same cell in a triangle that is entered across the side towards `from`, or
    /// anyhow where that is -1.
    template <class F>
    void forEachOf(int seed, int triangle, int from, F f) const {
        for (int j = begin[size_t(triangle)]; j < end[size_t(triangle)]; ++j) {
            const Link& p = links[size_t(j)];
            if (p.seed != seed) continue;
            if (from >= 0) {
                int side = 0;
                while (neighbours[size_t(triangle)][size_t(side)] != from) ++side;
                if (!(p.sides >> side & 1)) continue;
            }
            f(j);
        }
    }
    /// Calls f for the pieces of the same cell that touch piece j.
    template <class F>
    void forEachTouching(int j, F f) const {
        const Link p = links[size_t(j)];
        forEachOf(p.seed, p.triangle, -1, f);  // a cell may have been handed a second part of a triangle
        for (int k = 0; k < 3; ++k)
            if (const int n = neighbours[size_t(p.triangle)][size_t(k)]; n >= 0 && (p.sides >> k & 1))
                forEachOf(p.seed, n, p.triangle, f);
    }
    /// Marks what is joined to the pieces on the stack and adds it to the cell.
    void join(std::vector<int>& stack, VoronoiCell& cell) {
        while (!stack.empty()) {
            const int j = stack.back();
            stack.pop_back();
            if (joined[size_t(j)]) continue;
            joined[size_t(j)] = 1;
            add(cell, sums[size_t(j)]);
            forEachTouching(j, [&](int k) {
                if (!joined[size_t(k)]) stack.push_back(k);
            });
        }
    }
};

/// Sums every cell's pieces that are joined to its seed.
std::vector<VoronoiCell> sumJoined(const std::vector<SurfacePoint>& seeds, Pieces& pieces) {
    std::vector<VoronoiCell> cells(seeds.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, seeds.size(), 64), [&](const auto& range) {
        std::vector<int> stack;
        for (size_t s = range.begin(); s < range.end(); ++s) {
            const auto push = [&](int j) { stack.push_back(j); };
            pieces.forEachOf(int(s), seeds[s].triangle, -1, push);
            if (stack.empty())  // a seed on an edge may own nothing of its own triangle by rounding
                for (int n : pieces.neighbours[size_t(seeds[s].triangle)])
                    if (n >= 0 && stack.empty()) pieces.forEachOf(int(s), n, seeds[s].triangle, push);
            pieces.join(stack, cells[s]);
        }
    });
    return cells;
}

/// Connected sets of triangles with orphaned pieces, and the seeds that own the ground in each and around it.
struct OrphanRegions {
    std::vector<std::vector<int>> owners;
    std::vector<int> of;  // by triangle, -1 where nothing is orphaned

    OrphanRegions(const Pieces& pieces, const std::vector<int>& affected) : of(pieces.begin.size(), -1) {
        constexpr int kUnassigned = -2;
        for (int t : affected) of[size_t(t)] = kUnassigned;
        for (int start : affected) {
            if (of[size_t(start)] != kUnassigned) continue;
            const int r = int(owners.size());
            std::vector<int> stack{start}, seeds;
            of[size_t(start)] = r;
            const auto collect = [&](int t) {
                for (int j = pieces.begin[size_t(t)]; j < pieces.end[size_t(t)]; ++j)
                    if (pieces.joined[size_t(j)]) seeds.push_back(pieces.links[size_t(j)].seed);
            };
            for (size_t i = 0; i < stack.size(); ++i) {
                const int t = stack[i];
                collect(t);
                for (int n : pieces.neighbours[size_t(t)]) {
                    if (n < 0) continue;
                    if (of[size_t(n)] == -1) collect(n);
                    if (of[size_t(n)] == kUnassigned) of[size_t(n)] = r, stack.push_back(n);
                }
            }
            std::sort(seeds.begin(), seeds.end());
            seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
            owners.push_back(std::move(seeds));
        }
    }
};

/// A triangle's pieces, the orphaned ones handed to those of `owners` that are nearest. Returns whether any was.
bool handOver(const TriangleMesh& mesh, int triangle, double density, const std::vector<SurfacePoint>& seeds,
              const Pieces& pieces, const std::vector<int>& owners, std::vector<Piece>& out,
              std::vector<char>& joined) {
    const size_t t = size_t(triangle);
    // The polygons are made again: most triangles never need theirs a second time.
    std::vector<int> before;
    for (int j = pieces.begin[t]; j < pieces.end[t]; ++j) before.push_back(pieces.links[size_t(j)].seed);
    std::sort(before.begin(), before.end());
    before.erase(std::unique(before.begin(), before.end()), before.end());
    std::vector<Piece> rebuilt;
    std::vector<Polygon> polygons;
    partition(wholeTriangle(mesh, t), triangle, density, before, seeds, rebuilt, &polygons);
    bool handed = false;
    for (size_t k = 0; k < rebuilt.size(); ++k) {
        bool orphan = false;
        pieces.forEachOf(rebuilt[k].seed, triangle, -1, [&](int j) { orphan |= !pieces.joined[size_t(j)]; });
        std::vector<int> heirs;
        if (orphan) {
            const Polygon& poly = polygons[k];
            double nearest = 1e300, radius = 0;
            for (int i = 1; i < poly.n; ++i) radius = std::max(radius, length(poly.p[i] - poly.p[0]));
            const auto distance = [&](int s) { return length(seeds[size_t(s)].position - poly.p[0]); };
            for (int s : owners)
                if (s != rebuilt[k].seed) nearest = std::min(nearest, distance(s));
            for (int s : owners)
                if (s != rebuilt[k].seed && distance(s) <= nearest + 2 * radius) heirs.push_back(s);
        }
        if (heirs.empty())
            out.push_back(rebuilt[k]);
        else
            partition(polygons[k], triangle, density, heirs, seeds, out);
        joined.resize(out.size(), !orphan);
        handed |= !heirs.empty();
    }
    return handed;
}

/// Hands orphaned pieces to the seeds that are connected to them, ring by ring.
void adoptOrphans(const Surface& surface, const std::vector<double>& density, const std::vector<SurfacePoint>& seeds,
                  Pieces& pieces, std::vector<VoronoiCell>& cells) {
    const auto hasOrphan = [&](int t) {
        for (int j = pieces.begin[size_t(t)]; j < pieces.end[size_t(t)]; ++j)
            if (!pieces.joined[size_t(j)]) return true;
        return false;
    };
    std::vector<int> affected;
    for (int t = 0; t < int(pieces.begin.size()); ++t)
        if (hasOrphan(t)) affected.push_back(t);
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds && !affected.empty(); ++round) {
        const OrphanRegions regions(pieces, affected);
        std::vector<std::vector<Piece>> parts(affected.size());
        std::vector<std::vector<char>> joined(affected.size());
        std::vector<char> handed(affected.size());
        tbb::parallel_for(size_t(0), affected.size(), [&](size_t i) {
            const size_t t = size_t(affected[i]);
            handed[i] = handOver(surface.mesh(), affected[i], density[t], seeds, pieces,
                                 regions.owners[size_t(regions.of[t])], parts[i], joined[i]);
        });
        if (std::find(handed.begin(), handed.end(), 1) == handed.end()) return;
        for (size_t i = 0; i < affected.size(); ++i) {
            // What stays joined may have been clipped anew, too.
            const size_t t = size_t(affected[i]);
            for (int j = pieces.begin[t]; j < pieces.end[t]; ++j)
                if (pieces.joined[size_t(j)])
                    add(cells[size_t(pieces.links[size_t(j)].seed)], pieces.sums[size_t(j)], -1);
            pieces.replace(affected[i], parts[i], joined[i]);
            for (int j = pieces.begin[t]; j < pieces.end[t]; ++j)
                if (pieces.joined[size_t(j)]) add(cells[size_t(pieces.links[size_t(j)].seed)], pieces.sums[size_t(j)]);
        }
        std::vector<int> stack;
        for (int t : affected)
            for (int j = pieces.begin[size_t(t)]; j < pieces.end[size_t(t)]; ++j) {
                if (pieces.joined[size_t(j)]) continue;
                bool touches = false;
                pieces.forEachTouching(j, [&](int k) { touches |= pieces.joined[size_t(k)] != 0; });
                if (!touches) continue;
                stack.assign(1, j);
                pieces.join(stack, cells[size_t(pieces.links[size_t(j)].seed)]);
            }
        std::vector<int> still;
        for (int t : affected)
            if (hasOrphan(t)) still.push_back(t);
        affected = std::move(still);
    }
}

/// Cells that share an edge. The owners of a triangle's pieces are enough to find its edges again.
std::vector<std::vector<int>> neighboursOf(const Surface& surface, const std::vector<SurfacePoint>& seeds,
                                           const Pieces& pieces) {
    std::vector<std::vector<int>> neighbours(seeds.size());
    std::vector<int> owners;
    std::vector<Piece> parts;
    std::vector<Polygon> polygons;
    for (size_t t = 0; t < pieces.begin.size(); ++t) {
        owners.clear(), parts.clear(), polygons.clear();
        for (int j = pieces.begin[t]; j < pieces.end[t]; ++j) owners.push_back(pieces.links[size_t(j)].seed);
        if (owners.size() < 2) continue;
        partition(wholeTriangle(surface.mesh(), t), int(t), 1, owners, seeds, parts, &polygons);
        for (size_t k = 0; k < parts.size(); ++k)
            for (int i = 0; i < polygons[k].n; ++i) {
                const int s = parts[k].seed, other = -1 - polygons[k].side[i];
                if (other < 0) continue;
                neighbours[size_t(s)].push_back(other);
                neighbours[size_t(other)].push_back(s);
            }
    }
    for (auto& n : neighbours) {
        std::sort(n.begin(), n.end());
        n.erase(std::unique(n.begin(), n.end()), n.end());
    }
    return neighbours;
}

}  // namespace

RestrictedVoronoi::RestrictedVoronoi(const Surface& surface, std::vector<double> density)
    : surface_(surface), density_(std::move(density)) {
    const TriangleMesh& mesh = surface.mesh();
    const size_t n = mesh.triangles.size();
    if (density_.empty()) density_.assign(n, 1);
    owner_.assign(n, -1);
    centre_.resize(n);
    radius_.assign(n, 0);
    area_.resize(n);
    for (size_t t = 0; t < n; ++t) {
        centre_[t] = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0;
        for (int k = 0; k < 3; ++k) radius_[t] = std::max(radius_[t], length(mesh.corner(t, k) - centre_[t]));
        area_[t] = triangleArea(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
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
                appendWhole(mesh, t, centre_[t], area_[t], density_[t], guess, seeds[size_t(guess)].position, out);
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
