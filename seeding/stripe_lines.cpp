#include "pavel/seeding/stripe_lines.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

/// A point with both phases.
struct Node {
    Vec3 position;
    double phase[2];
};

/// A triangle in which phases are linear: a whole one of the mesh, or a part of a singular one.
struct Cell {
    Node node[3];
    int triangle;
    uint64_t edge[3];       ///< name of the edge from node k to node k + 1: the same on both of its sides
    double from[3], to[3];  ///< where that edge begins and ends along the named one
};

uint64_t sideName(int a, int b) {
    return uint64_t(std::min(a, b)) << 31 | uint64_t(std::max(a, b));
}

/// Parts of a singular triangle: rings around its middle.
constexpr int kRays = 24, kRings = 5;  // rays: a multiple of three

/// Phase on the ray `u` (0 to 3, whole at the corners) at a share `r` of the way from the middle to the border.
double phaseAt(const TrianglePhases& p, double u, double r) {
    const int k = std::min(2, int(u));
    const double border = p.corner[size_t(k)] + (u - k) * (p.corner[size_t(k) + 1] - p.corner[size_t(k)]);
    double middle;
    if (p.flipped) {
        constexpr double kClear = 1e-7;  // the middle is its own mirror image: a multiple of half a turn
        middle = 0.5 * (p.corner[0] + p.corner[3]) + kClear;
    } else {
        const double turn = p.corner[3] - p.corner[0];
        middle = (p.corner[0] + p.corner[1] + p.corner[2]) / 3 - turn / 3 + turn * u / 3;
    }
    return r * border + (1 - r) * middle;
}

void appendCells(const TangentFrames& f, size_t t, const TrianglePhases (&phases)[2], std::vector<Cell>& cells) {
    const TriangleMesh& m = f.mesh();
    if (!phases[0].flipped && !phases[0].turns() && !phases[1].turns()) {
        Cell c;
        c.triangle = int(t);
        for (int k = 0; k < 3; ++k) {
            const int i = f.vertex(t, k), j = f.vertex(t, (k + 1) % 3);
            c.node[k] = {m.corner(t, k), {phases[0].corner[size_t(k)], phases[1].corner[size_t(k)]}};
            c.edge[k] = sideName(i, j);
            c.from[k] = i < j ? 0 : 1;
            c.to[k] = 1 - c.from[k];
        }
        cells.push_back(c);
        return;
    }
    const Vec3 middle = (m.corner(t, 0) + m.corner(t, 1) + m.corner(t, 2)) / 3.0;
    const auto node = [&](int ray, int ring) {
        const double u = 3.0 * ray / kRays, r = std::pow(0.5, ring);
        const int k = std::min(2, int(u));
        const Vec3 border = m.corner(t, k) + (u - k) * (m.corner(t, (k + 1) % 3) - m.corner(t, k));
        return Node{middle + r * (border - middle), {phaseAt(phases[0], u, r), phaseAt(phases[1], u, r)}};
    };
    const auto name = [&](int rayA, int ringA, int rayB, int ringB) {
        const uint64_t a = uint64_t(ringA * kRays + rayA % kRays), b = uint64_t(ringB * kRays + rayB % kRays);
        return uint64_t(1) << 63 | uint64_t(t) << 16 | std::min(a, b) << 8 | std::max(a, b);
    };
    const auto add = [&](const int(&ray)[3], const int(&ring)[3]) {
        Cell c;
        c.triangle = int(t);
        for (int k = 0; k < 3; ++k) {
            const int next = (k + 1) % 3;
            c.node[k] = node(ray[k], ring[k]);
            c.edge[k] = name(ray[k], ring[k], ray[next], ring[next]);
            const int a = ring[k] * kRays + ray[k] % kRays, b = ring[next] * kRays + ray[next] % kRays;
            c.from[k] = a < b ? 0 : 1;
            c.to[k] = 1 - c.from[k];
            if (ring[k] == 0 && ring[next] == 0) {  // on a side of the triangle
                const int side = std::min(ray[k], ray[next]) * 3 / kRays;
                const int i = f.vertex(t, side), j = f.vertex(t, (side + 1) % 3);
                const auto along = [&](int r) {
                    const double s = 3.0 * r / kRays - side;
                    return i < j ? s : 1 - s;
                };
                c.edge[k] = sideName(i, j);
                c.from[k] = along(ray[k]);
                c.to[k] = along(ray[next]);
            }
        }
        cells.push_back(c);
    };
    for (int ring = 0; ring < kRings; ++ring)
        for (int ray = 0; ray < kRays; ++ray) {
            add({ray, ray + 1, ray + 1}, {ring, ring, ring + 1});
            add({ray, ray + 1, ray}, {ring, ring + 1, ring + 1});
        }
}

/// A stripe's way through a cell.
struct Segment {
    size_t cell;
    Vec3 end[2];
    double other[2];           ///< the other pattern's phase at the ends
    int joined[2] = {-1, -1};  ///< 2 * segment + end
};

struct End {
    uint64_t edge;
    size_t cell;
    double at;
    int segmentEnd;
};

std::vector<Segment> segmentsOf(const std::vector<Cell>& cells, int pattern) {
    std::vector<Segment> segments;
    std::vector<End> ends;
    for (size_t c = 0; c < cells.size(); ++c) {
        const Cell& cell = cells[c];
        const double p[3] = {cell.node[0].phase[pattern], cell.node[1].phase[pattern], cell.node[2].phase[pattern]};
        const int first = int(std::floor(std::min({p[0], p[1], p[2]}) / (2 * kPi))),
                  last = int(std::ceil(std::max({p[0], p[1], p[2]}) / (2 * kPi)));
        for (int turn = first; turn <= last; ++turn) {
            const double level = 2 * kPi * turn;
            Segment s;
            s.cell = c;
            int n = 0;
            for (int k = 0; k < 3 && n < 2; ++k) {
                const int next = (k + 1) % 3;
                if ((p[k] < level) == (p[next] < level)) continue;
                const double share = (level - p[k]) / (p[next] - p[k]);
                s.end[n] = cell.node[k].position + share * (cell.node[next].position - cell.node[k].position);
                s.other[n] = cell.node[k].phase[1 - pattern] +
                             share * (cell.node[next].phase[1 - pattern] - cell.node[k].phase[1 - pattern]);
                ends.push_back({cell.edge[k], c, cell.from[k] + share * (cell.to[k] - cell.from[k]),
                                int(2 * segments.size()) + n});
                ++n;
            }
            if (n == 2) segments.push_back(s);
        }
    }
    // On every edge the first end of one side meets the first of the other.
    std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
        return std::tie(a.edge, a.at, a.cell) < std::tie(b.edge, b.at, b.cell);
    });
    std::vector<int> sides[2];
    for (size_t i = 0; i < ends.size();) {
        size_t j = i;
        sides[0].clear(), sides[1].clear();
        const int triangle = cells[ends[i].cell].triangle;
        const bool inside = ends[i].edge >> 63;  // within one triangle: cells tell the sides apart
        for (; j < ends.size() && ends[j].edge == ends[i].edge; ++j)
            sides[inside ? ends[j].cell != ends[i].cell : cells[ends[j].cell].triangle != triangle].push_back(
                ends[j].segmentEnd);
        for (size_t k = 0; k < std::min(sides[0].size(), sides[1].size()); ++k) {
            const int a = sides[0][k], b = sides[1][k];
            segments[size_t(a / 2)].joined[a % 2] = b;
            segments[size_t(b / 2)].joined[b % 2] = a;
        }
        i = j;
    }
    return segments;
}

/// Segments in order along each line; `ends`: with which end each begins.
struct Chain {
    std::vector<std::pair<int, int>> segments;  // segment, first end
    bool closed = false;
};

std::vector<Chain> chainsOf(const std::vector<Segment>& segments) {
    std::vector<Chain> chains;
    std::vector<char> done(segments.size(), 0);
    const auto follow = [&](int segment, int end) {
        Chain chain;
        const int start = segment;
        while (!done[size_t(segment)]) {
            done[size_t(segment)] = 1;
            chain.segments.emplace_back(segment, end);
            const int next = segments[size_t(segment)].joined[1 - end];
            if (next < 0) break;
            segment = next / 2;
            end = next % 2;
            chain.closed = segment == start;
        }
        chains.push_back(std::move(chain));
    };
    for (size_t s = 0; s < segments.size(); ++s)  // open ones from their ends
        for (int end : {0, 1})
            if (!done[s] && segments[s].joined[end] < 0) follow(int(s), end);
    for (size_t s = 0; s < segments.size(); ++s)
        if (!done[s]) follow(int(s), 0);
    return chains;
}

struct Found {
    Vec3 position, direction;
    int triangle;
};

/// Where a chain crosses the other pattern's stripes, in order.
std::vector<Found> crossingsOf(const Chain& chain, const std::vector<Segment>& segments, const std::vector<Cell>& cells,
                               double tolerance) {
    std::vector<Found> found;
    double along = 0, last = -1e300, first = 0;
    for (const auto& [index, end] : chain.segments) {
        const Segment& s = segments[size_t(index)];
        const Vec3 a = s.end[end], d = s.end[1 - end] - a;
        const double l = length(d), p = s.other[end], q = s.other[1 - end];
        // Ends count to both of their segments, so that rounding loses none; doubles are merged.
        constexpr double kSlack = 1e-9;
        const double lo = std::min(p, q) - kSlack, hi = std::max(p, q) + kSlack;
        std::vector<double> shares;
        for (int turn = int(std::ceil(lo / (2 * kPi))); 2 * kPi * turn <= hi; ++turn)
            shares.push_back(p == q ? 0 : std::clamp((2 * kPi * turn - p) / (q - p), 0.0, 1.0));
        std::sort(shares.begin(), shares.end());
        for (double share : shares) {
            const double at = along + share * l;
            if (at - last < tolerance) continue;
            if (found.empty()) first = at;
            last = at;
            found.push_back({a + share * d, normalized(d), cells[s.cell].triangle});
        }
        along += l;
    }
    if (chain.closed && found.size() > 1 && first + along - last < tolerance) found.pop_back();
    return found;
}

}  // namespace

StripeLines traceStripes(const TangentFrames& frames, const std::vector<TrianglePhases>& first,
                         const std::vector<TrianglePhases>& second, double tolerance) {
    std::vector<Cell> cells;
    cells.reserve(first.size());
    for (size_t t = 0; t < first.size(); ++t) appendCells(frames, t, {first[t], second[t]}, cells);
    StripeLines result;
    std::vector<SurfacePoint> places;  // of the crossings, for the search
    std::unique_ptr<PointCloud> cloud;
    std::unique_ptr<KdTree> tree;
    for (int pattern : {0, 1}) {
        const std::vector<Segment> segments = segmentsOf(cells, pattern);
        for (const Chain& chain : chainsOf(segments)) {
            const int line = int(result.lines[pattern].size());
            result.lines[pattern].emplace_back();
            StripeLine& l = result.lines[pattern].back();
            l.closed = chain.closed;
            for (const auto& [s, end] : chain.segments) l.points.push_back(segments[size_t(s)].end[end]);
            if (!chain.closed) {
                const auto& [s, end] = chain.segments.back();
                l.points.push_back(segments[size_t(s)].end[1 - end]);
            }
            for (const Found& f : crossingsOf(chain, segments, cells, tolerance)) {
                int c = int(result.crossings.size());
                if (pattern == 0) {
                    Crossing x;
                    x.position = f.position;
                    x.triangle = f.triangle;
                    x.along = f.direction;
                    result.crossings.push_back(x);
                } else {  // it was found from the first pattern, too
                    size_t nearest = 0;
                    double distance2 = 0;
                    if (!tree || !tree->knnSearch(f.position.data(), 1, &nearest, &distance2) ||
                        distance2 > 4 * tolerance * tolerance || result.crossings[nearest].line[1] >= 0)
                        continue;
                    c = int(nearest);
                    result.crossings[nearest].across = f.direction;
                }
                result.crossings[size_t(c)].line[pattern] = line;
                l.crossings.push_back(c);
            }
        }
        if (pattern == 0) {
            for (const Crossing& c : result.crossings) {
                places.emplace_back();
                places.back().position = c.position;
            }
            cloud = std::make_unique<PointCloud>(PointCloud{places});
            if (!places.empty())
                tree = std::make_unique<KdTree>(3, *cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
        }
        for (const StripeLine& l : result.lines[pattern])
            for (size_t i = 0; i < l.crossings.size(); ++i) {
                const bool last = i + 1 == l.crossings.size();
                if (last && (!l.closed || l.crossings.size() < 2)) continue;
                const int a = l.crossings[i], b = l.crossings[last ? 0 : i + 1];
                result.crossings[size_t(a)].next[pattern] = b;
                result.crossings[size_t(b)].previous[pattern] = a;
            }
    }
    return result;
}

}  // namespace pavel
