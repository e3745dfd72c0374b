#include "pavel/seeding/surface.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <map>
#include <mutex>

namespace pavel {
namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
using Point = bg::model::point<double, 3, bg::cs::cartesian>;
using Box = bg::model::box<Point>;

/// Made by the first search: walking needs none.
struct Surface::Index {
    std::once_flag once;
    bgi::rtree<std::pair<Box, int>, bgi::linear<8>> tree;
};

Surface::~Surface() = default;
Surface::Surface(Surface&&) noexcept = default;

Surface::Surface(TriangleMesh mesh) : mesh_(std::move(mesh)), index_(std::make_unique<Index>()) {
    vertexNormals_ = vertexNormals(mesh_);
    neighbours_ = triangleNeighbours(mesh_);
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
        faceAreas_.push_back(triangleArea(mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2)));
        area_ += faceAreas_.back();
        faceNormals_.push_back(triangleNormal(mesh_, t));
    }
}

void Surface::makeIndex() const {
    std::vector<std::pair<Box, int>> boxes;
    boxes.reserve(mesh_.triangles.size());
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
        Bounds b;
        for (int k = 0; k < 3; ++k) b.add(mesh_.corner(t, k));
        boxes.emplace_back(Box({b.min[0], b.min[1], b.min[2]}, {b.max[0], b.max[1], b.max[2]}), int(t));
    }
    index_->tree = decltype(index_->tree)(boxes);
}

Vec3 Surface::normalAt(int triangle, const Vec3& w) const {
    const Triangle& t = mesh_.triangles[size_t(triangle)];
    const Vec3 n =
        w[0] * vertexNormals_[size_t(t[0])] + w[1] * vertexNormals_[size_t(t[1])] + w[2] * vertexNormals_[size_t(t[2])];
    return normalized(n, faceNormals_[size_t(triangle)]);
}

SurfacePoint Surface::closest(const Vec3& p, const Vec3* facing) const {
    std::call_once(index_->once, [this] { makeIndex(); });
    SurfacePoint best;
    best.distance = 1e300;
    Vec3 bestWeights(1, 0, 0);
    const auto consider = [&](const std::pair<Box, int>& entry) {
        const size_t t = size_t(entry.second);
        if (facing && dot(faceNormals_[t], *facing) <= 0) return;
        Vec3 weights;
        const Vec3 c = closestPointOnTriangle(p, mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2), &weights);
        const double d = length(c - p);
        if (d > best.distance || (d == best.distance && entry.second > best.triangle)) return;
        best.position = c;
        best.distance = d;
        best.triangle = entry.second;
        bestWeights = weights;
    };
    // A few near boxes bound the distance (the library's incremental nearest query sorts far too much), then one box
    // query.
    const Point q(p[0], p[1], p[2]);
    std::vector<std::pair<Box, int>> found;
    for (unsigned k = 4; best.triangle < 0; k *= 8) {
        found.clear();
        index_->tree.query(bgi::nearest(q, k), std::back_inserter(found));
        for (const auto& e : found) consider(e);
        if (k >= mesh_.triangles.size()) break;
    }
    if (best.triangle < 0) return closest(p);
    const double d = best.distance;
    found.clear();
    index_->tree.query(bgi::intersects(Box({p[0] - d, p[1] - d, p[2] - d}, {p[0] + d, p[1] + d, p[2] + d})),
                       std::back_inserter(found));
    for (const auto& e : found) consider(e);
    best.normal = normalAt(best.triangle, bestWeights);
    return best;
}

SurfacePoint Surface::walked(const SurfacePoint& from, const Vec3& step) const {
    constexpr int kMost = 10000;  // crossings: more than any step of a seeding takes
    SurfacePoint at = from;
    Vec3 d = step;
    int entered = -1;  // the side just crossed, which rounding must not cross back
    for (int crossing = 0; crossing < kMost; ++crossing) {
        const size_t t = size_t(at.triangle);
        const Vec3& n = faceNormals_[t];
        d -= dot(d, n) * n;
        double share = 1;
        int side = -1;
        for (int k = 0; k < 3; ++k) {
            if (k == entered) continue;
            const Vec3 a = mesh_.corner(t, k), m = cross(mesh_.corner(t, (k + 1) % 3) - a, n);
            const double speed = dot(d, m);
            if (!(speed > 0)) continue;
            const double s = std::max(0.0, dot(a - at.position, m) / speed);
            if (s < share) share = s, side = k;
        }
        at.position += share * d;
        if (side < 0) break;
        d *= 1 - share;
        const Vec3 edge = normalized(mesh_.corner(t, (side + 1) % 3) - mesh_.corner(t, side));
        const double ahead = dot(d, edge), across = dot(d, cross(edge, n));
        const int next = neighbours_[t][size_t(side)];
        if (next < 0) {  // slide along the boundary
            d = ahead * edge;
            entered = side;
            continue;
        }
        d = ahead * edge + across * cross(edge, faceNormals_[size_t(next)]);
        for (entered = 0; entered < 2 && neighbours_[size_t(next)][size_t(entered)] != at.triangle;) ++entered;
        at.triangle = next;
    }
    return pointOn(at.triangle, at.position);
}

SurfacePoint Surface::pointOn(int triangle, const Vec3& position) const {
    const size_t t = size_t(triangle);
    SurfacePoint p;
    Vec3 weights;
    p.triangle = triangle;
    p.position = closestPointOnTriangle(position, mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2), &weights);
    p.normal = normalAt(triangle, weights);
    return p;
}

std::vector<SurfacePoint> Surface::sample(size_t count, Rng& rng, const std::vector<double>& density) const {
    std::vector<double> cumulative;
    double sum = 0;
    for (size_t t = 0; t < mesh_.triangles.size(); ++t) {
        const double area = faceAreas_[t];
        cumulative.push_back(sum += density.empty() ? area : density[t] * area);
    }
    std::vector<SurfacePoint> points;
    for (size_t i = 0; i < count; ++i) {
        const double a = sum * (double(i) + rng.uniform()) / double(count);
        const size_t t =
            std::min(size_t(std::lower_bound(cumulative.begin(), cumulative.end(), a) - cumulative.begin()),
                     mesh_.triangles.size() - 1);
        const double r = std::sqrt(rng.uniform()), s = rng.uniform();
        const Vec3 w(1 - r, r * (1 - s), r * s);
        SurfacePoint p;
        p.position = w[0] * mesh_.corner(t, 0) + w[1] * mesh_.corner(t, 1) + w[2] * mesh_.corner(t, 2);
        p.triangle = int(t);
        p.normal = normalAt(p.triangle, w);
        points.push_back(p);
    }
    return points;
}

void subdivideLongEdges(TriangleMesh& mesh, double longest) {
    const auto isShort = [&](const Triangle& t) {
        const Vec3 &a = mesh.points[size_t(t[0])], &b = mesh.points[size_t(t[1])], &c = mesh.points[size_t(t[2])];
        const double longest2 = longest * longest;
        return dot(b - a, b - a) <= longest2 && dot(c - b, c - b) <= longest2 && dot(a - c, a - c) <= longest2;
    };
    if (std::all_of(mesh.triangles.begin(), mesh.triangles.end(), isShort)) return;
    subdivideEdges(mesh, [=](const Vec3& a, const Vec3& b) { return length(a - b) > longest; });
}

void subdivideEdges(TriangleMesh& mesh, const std::function<bool(const Vec3& a, const Vec3& b)>& isLong) {
    // All three edges of a triangle are tested against the same rule, so both sides of an edge agree where to split it.
    for (bool changed = true; changed;) {
        changed = false;
        std::map<std::pair<int, int>, int> middle;
        const auto split = [&](int a, int b) {
            if (!isLong(mesh.points[size_t(a)], mesh.points[size_t(b)])) return -1;
            const auto [it, isNew] = middle.emplace(std::minmax(a, b), int(mesh.points.size()));
            if (isNew) mesh.points.push_back(0.5 * (mesh.points[size_t(a)] + mesh.points[size_t(b)]));
            return it->second;
        };
        std::vector<Triangle> next;
        std::vector<int> groups;
        for (size_t i = 0; i < mesh.triangles.size(); ++i) {
            const Triangle t = mesh.triangles[i];
            const int m[3] = {split(t[0], t[1]), split(t[1], t[2]), split(t[2], t[0])};
            const size_t before = next.size();
            const int cuts = (m[0] >= 0) + (m[1] >= 0) + (m[2] >= 0);
            if (cuts == 0) {
                next.push_back(t);
            } else if (cuts == 3) {
                next.insert(next.end(),
                            {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
            } else {
                int k = 0;  // turn the triangle so that its first edge is cut, and with two cuts the third is not
                while (m[k] < 0 || (cuts == 2 && m[(k + 2) % 3] >= 0)) ++k;
                const int a = t[size_t(k)], b = t[size_t((k + 1) % 3)], c = t[size_t((k + 2) % 3)], ab = m[k],
                          bc = m[(k + 1) % 3];
                if (cuts == 1)
                    next.insert(next.end(), {{a, ab, c}, {ab, b, c}});
                else
                    next.insert(next.end(), {{a, ab, c}, {ab, b, bc}, {ab, bc, c}});
            }
            changed |= cuts > 0;
            if (!mesh.groups.empty()) groups.insert(groups.end(), next.size() - before, mesh.groups[i]);
        }
        mesh.triangles = std::move(next);
        mesh.groups = std::move(groups);
    }
}

}  // namespace pavel
