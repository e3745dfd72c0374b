#include "pavel/seeding/restricted_voronoi.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "pavel/core/union_find.h"
#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

/// Convex polygon inside a triangle; side[i]: the triangle's side that the edge from corner i to i+1 lies on, or -1.
struct Polygon {
    static constexpr int kMost = 64;
    Vec3 p[kMost];
    int side[kMost];
    int n = 0;
};

/// Keeps the part of `in` that is nearer to a than to b.
void clipByBisector(const Polygon& in, const Vec3& a, const Vec3& b, Polygon& out) {
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
            out.side[out.n++] = h0 <= 0 ? -1 : in.side[i];
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

void integrate(const Polygon& poly, const Vec3& seed, Piece& piece) {
    for (int i = 1; i + 1 < poly.n; ++i) {
        const Vec3 a = poly.p[0] - seed, b = poly.p[i] - seed, c = poly.p[i + 1] - seed;
        const double area = 0.5 * length(cross(b - a, c - a));
        piece.sums.area += area;
        piece.sums.moment += area * ((poly.p[0] + poly.p[i] + poly.p[i + 1]) / 3.0);
        piece.sums.energy += area / 6 * (dot(a, a) + dot(b, b) + dot(c, c) + dot(a, b) + dot(b, c) + dot(c, a));
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

/// Clips `start` among the candidates (sorted by distance from the triangle's centre) and appends the pieces.
void partition(const Polygon& start, int triangle, const std::vector<int>& candidates,
               const std::vector<SurfacePoint>& seeds, std::vector<Piece>& out,
               std::vector<Polygon>* polygons = nullptr) {
    Polygon a, b;
    for (int s : candidates) {
        a = start;
        const Vec3& own = seeds[size_t(s)].position;
        for (int other : candidates) {
            if (other == s) continue;
            clipByBisector(a, own, seeds[size_t(other)].position, b);
            std::swap(a, b);
            if (a.n == 0) break;
        }
        if (a.n == 0) continue;
        Piece piece;
        piece.triangle = triangle;
        piece.seed = s;
        integrate(a, own, piece);
        out.push_back(piece);
        if (polygons) polygons->push_back(a);
    }
}

/// first[t]..first[t+1]: the pieces of triangle t (pieces sorted by triangle).
std::vector<int> pieceOffsets(const std::vector<Piece>& pieces, size_t triangles) {
    std::vector<int> first(triangles + 1, 0);
    for (const Piece& p : pieces) ++first[size_t(p.triangle) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    return first;
}

/// Marks the pieces that no walk inside their own cell joins to the seed.
std::vector<char> findOrphans(const Surface& surface, const std::vector<SurfacePoint>& seeds,
                              const std::vector<Piece>& pieces, const std::vector<int>& first) {
    UnionFind sets(pieces.size());
    const auto& neighbours = surface.neighbours();
    for (size_t i = 0; i < pieces.size(); ++i) {
        const Piece& p = pieces[i];
        for (int k = 0; k < 3; ++k) {
            const int n = neighbours[size_t(p.triangle)][size_t(k)];
            if (n < p.triangle || !(p.sides >> k & 1)) continue;
            for (int j = first[size_t(n)]; j < first[size_t(n) + 1]; ++j) {
                const Piece& q = pieces[size_t(j)];
                if (q.seed != p.seed) continue;
                int side = 0;
                while (neighbours[size_t(n)][size_t(side)] != p.triangle) ++side;
                if (q.sides >> side & 1) sets.join(int(i), j);
            }
        }
        for (int j = first[size_t(p.triangle)]; j < int(i); ++j)
            if (pieces[size_t(j)].seed == p.seed) sets.join(int(i), j);
    }
    std::vector<int> home(seeds.size(), -1);
    for (size_t s = 0; s < seeds.size(); ++s) {
        const int t = seeds[s].triangle;
        for (int j = first[size_t(t)]; j < first[size_t(t) + 1]; ++j)
            if (pieces[size_t(j)].seed == int(s)) home[s] = sets.find(j);
    }
    // A seed on an edge may own nothing of its own triangle by rounding: its largest component is its home then.
    for (size_t s = 0; s < seeds.size(); ++s) {
        if (home[s] >= 0) continue;
        double best = -1;
        for (int k = 0; k < 3; ++k) {
            const int n = neighbours[size_t(seeds[s].triangle)][size_t(k)];
            if (n < 0) continue;
            for (int j = first[size_t(n)]; j < first[size_t(n) + 1]; ++j)
                if (pieces[size_t(j)].seed == int(s) && pieces[size_t(j)].sums.area > best)
                    best = pieces[size_t(j)].sums.area, home[s] = sets.find(j);
        }
    }
    std::vector<char> orphan(pieces.size());
    for (size_t i = 0; i < pieces.size(); ++i) {
        const int h = home[size_t(pieces[i].seed)];
        orphan[i] = h >= 0 && sets.find(int(i)) != h;
    }
    return orphan;
}

/// One round of handing orphaned pieces to the seeds that are connected to their region. Returns false where none
/// moved.
bool adoptOrphans(const Surface& surface, const std::vector<SurfacePoint>& seeds, std::vector<Piece>& pieces) {
    const size_t triangles = surface.mesh().triangles.size();
    const std::vector<int> first = pieceOffsets(pieces, triangles);
    const std::vector<char> orphan = findOrphans(surface, seeds, pieces, first);
    if (std::none_of(orphan.begin(), orphan.end(), [](char o) { return o; })) return false;
    std::vector<char> hasOrphan(triangles, 0);
    for (size_t i = 0; i < pieces.size(); ++i) hasOrphan[size_t(pieces[i].triangle)] |= orphan[i];

    std::vector<int> region(triangles, -1);
    std::vector<std::vector<int>> candidates;
    for (size_t start = 0; start < triangles; ++start) {
        if (!hasOrphan[start] || region[start] >= 0) continue;
        const int r = int(candidates.size());
        std::vector<int> stack{int(start)}, owners;
        region[start] = r;
        for (size_t i = 0; i < stack.size(); ++i) {
            const int t = stack[i];
            const auto collect = [&](int triangle) {
                for (int j = first[size_t(triangle)]; j < first[size_t(triangle) + 1]; ++j)
                    if (!orphan[size_t(j)]) owners.push_back(pieces[size_t(j)].seed);
            };
            collect(t);
            for (int n : surface.neighbours()[size_t(t)]) {
                if (n < 0) continue;
                collect(n);
                if (hasOrphan[size_t(n)] && region[size_t(n)] < 0) region[size_t(n)] = r, stack.push_back(n);
            }
        }
        std::sort(owners.begin(), owners.end());
        owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
        candidates.push_back(std::move(owners));
    }

    bool moved = false;
    std::vector<Piece> next;
    next.reserve(pieces.size());
    for (size_t t = 0; t < triangles; ++t) {
        const int begin = first[t], end = first[t + 1];
        if (!hasOrphan[t] || candidates[size_t(region[t])].empty()) {
            next.insert(next.end(), pieces.begin() + begin, pieces.begin() + end);
            continue;
        }
        // Rebuild this triangle's polygons to clip the orphaned ones again.
        std::vector<int> owners;
        for (int j = begin; j < end; ++j) owners.push_back(pieces[size_t(j)].seed);
        std::vector<Piece> rebuilt;
        std::vector<Polygon> polygons;
        partition(wholeTriangle(surface.mesh(), t), int(t), owners, seeds, rebuilt, &polygons);
        for (size_t k = 0; k < rebuilt.size(); ++k) {
            bool isOrphan = false;
            for (int j = begin; j < end; ++j)
                isOrphan |= pieces[size_t(j)].seed == rebuilt[k].seed && orphan[size_t(j)];
            std::vector<int> heirs;
            if (isOrphan) {
                const Polygon& poly = polygons[k];
                double nearest = 1e300, radius = 0;
                for (int i = 1; i < poly.n; ++i) radius = std::max(radius, length(poly.p[i] - poly.p[0]));
                for (int s : candidates[size_t(region[t])])
                    if (s != rebuilt[k].seed)
                        nearest = std::min(nearest, length(seeds[size_t(s)].position - poly.p[0]));
                for (int s : candidates[size_t(region[t])])
                    if (s != rebuilt[k].seed && length(seeds[size_t(s)].position - poly.p[0]) <= nearest + 2 * radius)
                        heirs.push_back(s);
            }
            if (heirs.empty()) {
                next.push_back(rebuilt[k]);
            } else {
                partition(polygons[k], int(t), heirs, seeds, next);
                moved = true;
            }
        }
    }
    pieces = std::move(next);
    return moved;
}

}  // namespace

std::vector<VoronoiCell> restrictedVoronoi(const Surface& surface, const std::vector<SurfacePoint>& seeds) {
    const PointCloud cloud{seeds};
    KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
    const TriangleMesh& mesh = surface.mesh();
    const size_t triangles = mesh.triangles.size();
    constexpr size_t kChunk = 1024;
    std::vector<std::vector<Piece>> chunks((triangles + kChunk - 1) / kChunk);
    tbb::parallel_for(size_t(0), chunks.size(), [&](size_t chunk) {
        std::vector<Piece>& out = chunks[chunk];
        std::vector<std::pair<size_t, double>> found;
        std::vector<int> candidates;
        for (size_t t = chunk * kChunk; t < std::min(triangles, (chunk + 1) * kChunk); ++t) {
            const Vec3 centre = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0;
            double radius = 0;
            for (int k = 0; k < 3; ++k) radius = std::max(radius, length(mesh.corner(t, k) - centre));
            constexpr size_t kFirst = 6;
            size_t index[kFirst];
            double distance2[kFirst];
            const size_t got = tree.knnSearch(centre.data(), kFirst, index, distance2);
            const double reach = (std::sqrt(distance2[0]) + 2 * radius) * (1 + 1e-12);
            candidates.clear();
            if (got < kFirst || distance2[got - 1] > reach * reach) {
                for (size_t i = 0; i < got && distance2[i] <= reach * reach; ++i) candidates.push_back(int(index[i]));
            } else {
                found.clear();
                tree.radiusSearch(centre.data(), reach * reach, found, nanoflann::SearchParams(0, 0, true));
                for (const auto& f : found) candidates.push_back(int(f.first));
            }
            partition(wholeTriangle(mesh, t), int(t), candidates, seeds, out);
        }
    });
    std::vector<Piece> pieces;
    for (const auto& c : chunks) pieces.insert(pieces.end(), c.begin(), c.end());
    for (int round = 0; round < 6 && adoptOrphans(surface, seeds, pieces); ++round) {
    }
    std::vector<VoronoiCell> cells(seeds.size());
    for (const Piece& p : pieces) {
        VoronoiCell& c = cells[size_t(p.seed)];
        c.area += p.sums.area;
        c.moment += p.sums.moment;
        c.energy += p.sums.energy;
    }
    return cells;
}

}  // namespace pavel
