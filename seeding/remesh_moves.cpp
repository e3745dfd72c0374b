// Flips and moves of vertices.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <tuple>

#include "pavel/core/wide.h"
#include "pavel/seeding/remesher.h"

namespace pavel {
namespace {

/// Triangles whose mean normal is shorter than this surround their vertex.
constexpr double kAround = 0.4;
/// Cosine of the dihedral angle from which on a pair of triangles is bent.
constexpr double kBent = 0.85;

/// Do two triangles with these normals make an edge?
bool bent(const Vec3& n, const Vec3& m) {
    const double d = dot(n, m);
    return d <= 0 || d * d < kBent * kBent * dot(n, n) * dot(m, m);
}

/// Cosine of a triangle's least angle.
double sharpest(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 pa = normalized(a - p), ab = normalized(b - a), bp = normalized(p - b);
    return std::min(1.0, std::max({-dot(pa, bp), -dot(pa, ab), -dot(ab, bp)}));
}

/// M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 4.4.45, to 7e-5; for x in [0, 1].
[[gnu::always_inline]] inline double arccosine(double x) {
    return std::sqrt(1 - x) * (1.5707288 + x * (-0.2121144 + x * (0.0742610 - x * 0.0187293)));
}

/// The neighbours of an inner vertex, in order.
struct Ring {
    static constexpr int kMost = 24;
    int count = 0;
    Vec3 at[kMost], along[kMost];  ///< unit, to the next

    Ring(const Triangulation& tri, Triangulation::Vertex v) {
        for (auto n = tri.mesh.cvv_ccwbegin(v); n.is_valid(); ++n, ++count)
            if (count < kMost) at[count] = tri.at(*n);
        for (int k = 0; k < count && fits(); ++k) along[k] = normalized(at[k + 1 < count ? k + 1 : 0] - at[k]);
    }
    bool fits() const { return count <= kMost; }
};

/// Places that a vertex may move to, side by side.
struct Places {
    static constexpr int kMost = 8;
    double x[kMost] = {}, y[kMost] = {}, z[kMost] = {};
    void set(int i, const Vec3& p) { x[i] = p[0], y[i] = p[1], z[i] = p[2]; }
    Vec3 operator[](int i) const { return {x[i], y[i], z[i]}; }
};

/// Sums of the least angles of the triangles around a vertex if it stood at each of these places.
PAVEL_WIDE void leastAngles(const Ring& ring, const Places& p, double* sum) {
    constexpr int kLanes = Places::kMost;
    double x[Ring::kMost + 1][kLanes], y[Ring::kMost + 1][kLanes], z[Ring::kMost + 1][kLanes];  // unit, to the ring
    const int count = ring.count;
    for (int k = 0; k <= count; ++k) {
        const Vec3& at = ring.at[k < count ? k : 0];
        const double atX = at[0], atY = at[1], atZ = at[2];
        PAVEL_ROLLED
        for (int i = 0; i < kLanes; ++i) {
            const double dx = atX - p.x[i], dy = atY - p.y[i], dz = atZ - p.z[i],
                         l = std::sqrt(dx * dx + dy * dy + dz * dz), scale = 1 / (l > 0 ? l : 1);
            x[k][i] = dx * scale, y[k][i] = dy * scale, z[k][i] = dz * scale;
        }
    }
    for (int i = 0; i < kLanes; ++i) sum[i] = 0;
    for (int k = 0; k < count; ++k) {
        const double sideX = ring.along[k][0], sideY = ring.along[k][1], sideZ = ring.along[k][2];
        const double *ax = x[k], *ay = y[k], *az = z[k], *bx = x[k + 1], *by = y[k + 1], *bz = z[k + 1];
        PAVEL_ROLLED
        for (int i = 0; i < kLanes; ++i) {
            const double here = ax[i] * bx[i] + ay[i] * by[i] + az[i] * bz[i],
                         first = -(ax[i] * sideX + ay[i] * sideY + az[i] * sideZ),
                         second = bx[i] * sideX + by[i] * sideY + bz[i] * sideZ,
                         outer = first > second ? first : second, most = here > outer ? here : outer;
            sum[i] += arccosine(most < 1 ? most : 1);
        }
    }
}

}  // namespace

/// Directions in a tangent plane, all around.
struct Turns {
    int count;
    double cosine[Places::kMost], sine[Places::kMost];
    explicit Turns(int n) : count(n) {
        for (int k = 0; k < n; ++k) cosine[k] = std::cos(2 * kPi * k / n), sine[k] = std::sin(2 * kPi * k / n);
    }
};

/// Delaunay, or six neighbours, where it is flat; along the crease where it is bent.
bool Remesher::wantsFlip(Edge e, bool byValence) const {
    const Connectivity& m = tri_.mesh;
    if (m.is_boundary(e)) return false;
    const Halfedge h = m.halfedge_handle(e, 0), o = m.opposite_halfedge_handle(h);
    const Vertex a = m.from_vertex_handle(h), b = m.to_vertex_handle(h),
                 c = m.to_vertex_handle(m.next_halfedge_handle(h)), d = m.to_vertex_handle(m.next_halfedge_handle(o));
    const Vec3 n1 = normal(a, b, c), n2 = normal(b, a, d);
    const auto kindOf = [&](Vertex v) { return kind_[size_t(v.idx())]; };
    if (kindOf(c) != Kind::smooth || kindOf(d) != Kind::smooth) {
        // A sliver of three vertices of a crease goes to the side that the crease's edge then bounds.
        constexpr double kFlat = -0.8;
        for (const auto& [tip, far, side] : {std::make_tuple(c, d, n2), std::make_tuple(d, c, n1)})
            if (kindOf(tip) != Kind::smooth && cosineAt(tip, a, b) < kFlat && cosineAt(far, a, b) > kFlat)
                return dot(normal(c, d, b), side) > 0 && dot(normal(d, c, a), side) > 0;
    }
    const bool bentNow = bent(n1, n2);
    if (!bentNow && !(byValence ? evensValence(a, b, c, d) : cosineAt(c, a, b) + cosineAt(d, a, b) < -1e-6))
        return false;
    const Vec3 m1 = normal(c, d, b), m2 = normal(d, c, a), mean = n1 + n2;
    if (dot(m1, mean) <= 0 || dot(m2, mean) <= 0) return false;
    if (bentNow || bent(m1, m2)) {
        const double before = dot(normalized(n1), normalized(n2)), after = dot(normalized(m1), normalized(m2));
        return !follows(a, b) && (follows(c, d) || after > before + 0.1);
    }
    if (!fits(c, d, b) || !fits(d, c, a)) return !(fits(a, b, c) && fits(b, a, d));
    if (!byValence) return true;
    constexpr double kSharp = 0.9;  // cosine of the least angle that a gain in order may cost
    for (const auto& [p, q, r] : {std::array<Vertex, 3>{c, d, b}, std::array<Vertex, 3>{d, c, a}})
        if (cosineAt(p, q, r) > kSharp || cosineAt(q, r, p) > kSharp || cosineAt(r, p, q) > kSharp) return false;
    return true;
}

/// Would the other diagonal, from c to d, bring the numbers of neighbours nearer to six?
bool Remesher::evensValence(Vertex a, Vertex b, Vertex c, Vertex d) const {
    int change = 0;
    for (const auto& [v, by] :
         {std::make_pair(a, -1), std::make_pair(b, -1), std::make_pair(c, 1), std::make_pair(d, 1)})
        change += 2 * by * (valence_[size_t(v.idx())] - (kind_[size_t(v.idx())] == Kind::boundary ? 4 : 6)) + 1;
    return change < 0;
}

void Remesher::flipEdges(bool byValence) {
    const Connectivity& m = tri_.mesh;
    valence_.assign(on_.size(), 0);
    for (size_t i = 0; i < m.n_edges(); ++i)
        for (int side = 0; side < 2 && alive(Edge(int(i))); ++side)
            ++valence_[size_t(m.to_vertex_handle(m.halfedge_handle(Edge(int(i)), side)).idx())];
    std::vector<char> wanted(m.n_edges(), 0), open(m.n_edges(), 1);
    const auto openAround = [&](Vertex v) {
        for (auto h = m.cvoh_ccwbegin(v); h.is_valid(); ++h) {
            open[size_t(m.edge_handle(*h).idx())] = 1;
            if (!m.is_boundary(*h)) open[size_t(m.edge_handle(m.next_halfedge_handle(*h)).idx())] = 1;
        }
    };
    for (int pass = 0; pass < 4; ++pass) {
        size_t flips = 0;
        // Few flip: which may is found in parallel, and asked again when its turn comes.
        tbb::parallel_for(size_t(0), wanted.size(), [&](size_t i) {
            const Edge e{int(i)};
            if (open[i]) wanted[i] = alive(e) && wantsFlip(e, byValence);
            open[i] = 0;
        });
        for (size_t i = 0; i < wanted.size(); ++i) {
            const Edge e{int(i)};
            if (!wanted[i] || !wantsFlip(e, byValence)) continue;
            const Halfedge h = m.halfedge_handle(e, 0);
            const Vertex ends[2] = {m.from_vertex_handle(h), m.to_vertex_handle(h)};
            if (!tri_.flip(e)) continue;
            for (Vertex v : ends) --valence_[size_t(v.idx())];
            const Vertex now[2] = {m.from_vertex_handle(h), m.to_vertex_handle(h)};
            for (Vertex v : now) ++valence_[size_t(v.idx())];
            for (Vertex v : {ends[0], ends[1], now[0], now[1]}) openAround(v);
            ++flips;
        }
        if (flips < count_ / 1000) break;
    }
}

/// The least angle of the triangles around a vertex if it stood at p, as a cosine.
double Remesher::sharpestAround(Vertex v, const Vec3& p) const {
    double most = -1;
    for (auto it = tri_.mesh.cvoh_ccwbegin(v); it.is_valid(); ++it)
        if (!tri_.mesh.is_boundary(*it))
            most = std::max(most, sharpest(p, tri_.at(tri_.mesh.to_vertex_handle(*it)),
                                           tri_.at(tri_.mesh.to_vertex_handle(tri_.mesh.next_halfedge_handle(*it)))));
    return most;
}

/// Would all triangles around a vertex face outward if it stood at p?
bool Remesher::facesOut(Vertex v, const Vec3& p) const {
    for (auto it = tri_.mesh.cvoh_ccwbegin(v); it.is_valid(); ++it) {
        if (tri_.mesh.is_boundary(*it)) continue;
        const Vec3 &a = tri_.at(tri_.mesh.to_vertex_handle(*it)),
                   &b = tri_.at(tri_.mesh.to_vertex_handle(tri_.mesh.next_halfedge_handle(*it)));
        if (dot(cross(a - p, b - p), on_[size_t(v.idx())].normal) <= 0) return false;
    }
    return true;
}

/// Looks around a vertex, on a crease along it, for where its score is higher.
template <class Scores>
bool Remesher::improvePlace(Vertex v, std::initializer_list<double> reaches, const Turns& around, Scores scores) {
    static const Turns kAlong(2);
    const size_t i = size_t(v.idx());
    const Turns& turns = kind_[i] == Kind::crease ? kAlong : around;
    const SurfacePoint from = on_[i];
    const Vec3 u = kind_[i] == Kind::crease ? along_[i] : anyPerpendicular(from.normal), w = cross(from.normal, u);
    Places places;
    double score[Places::kMost];
    const auto scoreAt = [&](const Vec3& p) {
        double one[Places::kMost];
        Places single;
        single.set(0, p);
        scores(single, 1, one);
        return one[0];
    };
    double best = scoreAt(tri_.place[i]);
    bool moved = false;
    for (double reach : reaches) {
        for (int k = 0; k < turns.count; ++k)
            places.set(k, from.position + reach * spacing_ * (turns.cosine[k] * u + turns.sine[k] * w));
        scores(places, turns.count, score);
        for (int k = 0; k < turns.count; ++k) {
            if (score[k] <= best) continue;  // walking costs more than looking
            const SurfacePoint to = surface_.walked(from, places[k] - from.position);
            const double now = scoreAt(to.position);
            if (!(now > best && facesOut(v, to.position))) continue;
            best = now, on_[i] = to, tri_.place[i] = to.position;
            moved = true;
        }
    }
    return moved;
}

/// Relaxation evens out areas; this then sees to the angles themselves.
void Remesher::improveAngles() {
    constexpr int kSweeps = 3;
    const Turns turns(6);
    // Vertices of one colour are not neighbours: they move at the same time.
    std::vector<int> colour(on_.size(), -1);
    std::vector<std::vector<int>> classes;
    for (size_t i = 0; i < on_.size(); ++i) {
        const Vertex v{int(i)};
        if (kind_[i] > Kind::crease || tri_.mesh.status(v).deleted()) continue;
        uint64_t taken = 0;
        for (auto n = tri_.mesh.cvv_ccwbegin(v); n.is_valid(); ++n)
            if (const int c = colour[size_t(n->idx())]; c >= 0) taken |= uint64_t(1) << c;
        do ++colour[i];
        while (colour[i] < 63 && (taken >> colour[i] & 1));
        if (size_t(colour[i]) >= classes.size()) classes.emplace_back();
        classes[size_t(colour[i])].push_back(int(i));
    }
    std::vector<char> moved(on_.size()), active(on_.size(), 1);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        moved.assign(on_.size(), 0);
        for (const std::vector<int>& c : classes)
            tbb::parallel_for(size_t(0), c.size(), [&](size_t k) {
                const Vertex v(c[k]);
                if (!active[size_t(c[k])]) return;
                const Ring ring(tri_, v);
                moved[size_t(c[k])] =
                    ring.fits() && improvePlace(v, {0.2, 0.07, 0.025}, turns, [&](const Places& p, int, double* score) {
                        leastAngles(ring, p, score);
                    });
            });
        active = moved;
        for (size_t i = 0; i < on_.size(); ++i)
            if (moved[i])
                for (auto n = tri_.mesh.cvv_ccwbegin(Vertex(int(i))); n.is_valid(); ++n) active[size_t(n->idx())] = 1;
    }
}

/// Last, the few triangles that are still sharp: their vertices look for a better place nearby.
void Remesher::improveWorst() {
    constexpr double kSharp = 0.8;  // cosine
    const Turns turns(8);
    std::vector<char> tried(on_.size(), 0);  // in vain, and nothing has moved since
    for (int sweep = 0; sweep < 12; ++sweep)
        for (size_t i = 0; i < on_.size(); ++i) {
            const Vertex v{int(i)};
            if (tried[i] || kind_[i] != Kind::smooth || tri_.mesh.status(v).deleted()) continue;
            tried[i] = 1;
            if (sharpestAround(v, tri_.place[i]) < kSharp) continue;
            const auto scores = [&](const Places& p, int n, double* score) {
                for (int k = 0; k < n; ++k) score[k] = -sharpestAround(v, p[k]);
            };
            if (!improvePlace(v, {0.3, 0.12, 0.04}, turns, scores)) continue;
            tried[i] = 0;
            for (auto n = tri_.mesh.cvv_ccwbegin(v); n.is_valid(); ++n) tried[size_t(n->idx())] = 0;
        }
}

/// To the centroid of the triangles around it, heavier where edges are to be short: what an optimal Delaunay
/// triangulation asks for (L. Chen and M. Holst, Efficient mesh optimization schemes based on optimal Delaunay
/// triangulations, 2011, section 3).
Vec3 Remesher::centroidStep(Vertex v) const {
    const Vec3& p = tri_.at(v);
    Vec3 sum(0, 0, 0), normals(0, 0, 0);
    double areas = 0, weights = 0;
    for (auto it = tri_.mesh.cvoh_ccwbegin(v); it.is_valid(); ++it) {
        const Vertex next = tri_.mesh.to_vertex_handle(*it),
                     last = tri_.mesh.to_vertex_handle(tri_.mesh.next_halfedge_handle(*it));
        const Vec3 a = tri_.at(next) - p, b = tri_.at(last) - p, n = cross(a, b);
        const double area = length(n), grade = (gradeAt(v) + gradeAt(next) + gradeAt(last)) / 3,
                     weight = area / (grade * grade * grade);
        normals += n;
        sum += weight / 3 * (a + b);
        weights += weight;
        areas += area;
    }
    // The few vertices of a tiny part would all meet.
    const bool around = length(normals) < kAround * areas && tri_.mesh.valence(v) <= 4;
    return areas > 0 && !around ? sum / weights : Vec3(0, 0, 0);
}

/// Onto the crease, and along it to the middle between its neighbours there.
Vec3 Remesher::creaseStep(Vertex v) const {
    const size_t i = size_t(v.idx());
    const Vec3& p = tri_.at(v);
    Vec3 ahead(0, 0, 0), behind(0, 0, 0);
    double bestAhead = 0.6, bestBehind = 0.6;
    for (auto it = tri_.mesh.cvv_ccwbegin(v); it.is_valid(); ++it) {
        if (kind_[size_t(it->idx())] == Kind::smooth) continue;
        const Vec3 d = tri_.at(*it) - p;
        const double c = dot(normalized(d), along_[i]);
        if (c > bestAhead) bestAhead = c, ahead = d;
        if (-c > bestBehind) bestBehind = -c, behind = d;
    }
    const bool between = bestAhead > 0.6 && bestBehind > 0.6;
    const Vec3 onto = optimum_[i] - p;
    return onto - dot(onto, along_[i]) * along_[i] +
           (between ? 0.5 * dot(ahead + behind, along_[i]) * along_[i] : Vec3(0, 0, 0));
}

void Remesher::relax() {
    std::vector<SurfacePoint> next(on_.size());
    tbb::parallel_for(size_t(0), on_.size(), [&](size_t i) {
        const Vertex v{int(i)};
        next[i] = on_[i];
        if (tri_.mesh.status(v).deleted() || kind_[i] == Kind::boundary) return;
        Vec3 step = kind_[i] == Kind::smooth   ? centroidStep(v)
                    : kind_[i] == Kind::crease ? creaseStep(v)
                                               : optimum_[i] - tri_.at(v);
        const double l = length(step);
        if (l > 0.5 * spacing_) step *= 0.5 * spacing_ / l;
        next[i] = surface_.walked(on_[i], step);
    });
    on_ = std::move(next);
    for (size_t i = 0; i < on_.size(); ++i) tri_.place[i] = on_[i].position;
}

}  // namespace pavel
