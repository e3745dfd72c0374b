#pragma once
// The pieces into which seeds cut a surface's triangles. Internal to the restricted Voronoi diagram.
#include <tbb/parallel_for.h>

#include <array>

#include "pavel/seeding/restricted_voronoi.h"

namespace pavel {

/// Convex polygon inside a triangle; side[i]: what the edge from corner i to i+1 lies on: a side of the triangle (0, 1
/// or 2), or the bisector with seed s (-1 - s).
struct Polygon {
    static constexpr int kMost = 64;
    Vec3 p[kMost];
    int side[kMost];
    int n = 0;
};

/// The part of one triangle that one seed owns.
struct Piece {
    int triangle = -1, seed = -1;
    unsigned sides = 0;  ///< bit k: touches the triangle's side k
    VoronoiCell sums;
};

/// Triangles that are worked on together.
constexpr size_t kChunk = 256;

inline void add(VoronoiCell& to, const VoronoiCell& c, double sign = 1) {
    to.area += sign * c.area;
    to.mass += sign * c.mass;
    to.moment += sign * c.moment;
    to.energy += sign * c.energy;
}

Polygon wholeTriangle(const TriangleMesh& mesh, size_t t);
/// Clips `start` among the candidates (nearest to the triangle's centre first) and appends the pieces.
void partition(const Polygon& start, int triangle, double density, const std::vector<int>& candidates,
               const std::vector<SurfacePoint>& seeds, std::vector<Piece>& out,
               std::vector<Polygon>* polygons = nullptr);
/// The piece that a triangle is as a whole.
void appendWhole(const TriangleMesh& mesh, size_t t, const Vec3& centre, double area, double density, int seed,
                 const Vec3& position, std::vector<Piece>& out);

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
std::vector<VoronoiCell> sumJoined(const std::vector<SurfacePoint>& seeds, Pieces& pieces);
/// Hands orphaned pieces to the seeds that are connected to them, ring by ring.
void adoptOrphans(const Surface& surface, const std::vector<double>& density, const std::vector<SurfacePoint>& seeds,
                  Pieces& pieces, std::vector<VoronoiCell>& cells);
/// Cells that share an edge. The owners of a triangle's pieces are enough to find its edges again.
std::vector<std::vector<int>> neighboursOf(const Surface& surface, const std::vector<SurfacePoint>& seeds,
                                           const Pieces& pieces);

}  // namespace pavel
