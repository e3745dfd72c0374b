#include "pavel/seeding/voronoi_pieces.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace pavel {
namespace {

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

}  // namespace

Polygon wholeTriangle(const TriangleMesh& mesh, size_t t) {
    Polygon p;
    p.n = 3;
    for (int k = 0; k < 3; ++k) p.p[k] = mesh.corner(t, k), p.side[k] = k;
    return p;
}

void partition(const Polygon& start, int triangle, double density, const std::vector<int>& candidates,
               const std::vector<SurfacePoint>& seeds, std::vector<Piece>& out, std::vector<Polygon>* polygons) {
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

}  // namespace pavel
