#include "pavel/core/sheet_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "pavel/core/mesh_check.h"

namespace pavel {
namespace {

Point2 between(const Point2& a, const Point2& b, double s) {
    return {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])};
}

/// A triangular lattice cut along the zero set: vertices near it are moved onto it first, so that no cut leaves a
/// sliver (F. Labelle and J. Shewchuk 2007, in the plane).
class CutLattice {
  public:
    CutLattice(const SheetShape& shape, double edge) : shape_(shape) {
        const double rowHeight = std::sqrt(0.75) * edge;
        // mirror symmetric about the middle of the bounds, and a margin wider than they are
        const int columns = 2 * (int((shape.max[0] - shape.min[0]) / edge / 2) + 2);
        const int rows = 2 * (int((shape.max[1] - shape.min[1]) / rowHeight / 2) + 2);
        for (int j = 0; j <= rows; ++j)
            for (int i = 0; i <= columns; ++i)
                points_.push_back({(shape.min[0] + shape.max[0]) / 2 + (i - columns / 2 + (j % 2 ? 0.5 : 0)) * edge,
                                   (shape.min[1] + shape.max[1]) / 2 + (j - rows / 2) * rowHeight});
        for (int j = 0; j < rows; ++j) {
            for (int i = 0; i < columns; ++i) {
                const int a = j * (columns + 1) + i, b = a + 1, c = a + columns + 1, d = c + 1;
                triangles_.push_back(j % 2 ? Triangle{a, b, d} : Triangle{a, b, c});
                triangles_.push_back(j % 2 ? Triangle{a, d, c} : Triangle{b, d, c});
            }
        }
        for (const Point2& p : points_) value_.push_back(shape.outside(p));
        snap();
    }

    /// What lies inside, as a mesh with z = 0.
    TriangleMesh inside() {
        TriangleMesh m;
        for (const Triangle& t : triangles_) cut(t, m.triangles);
        for (const Point2& p : points_) m.points.emplace_back(p[0], p[1], 0);
        removeUnusedVertices(m);
        return m;
    }

  private:
    bool crosses(int a, int b) const { return value_[size_t(a)] * value_[size_t(b)] < 0; }

    Point2 crossing(int a, int b) const {
        double lo = 0, hi = 1;
        const bool below = value_[size_t(a)] < 0;
        for (int i = 0; i < 50; ++i) {
            const double s = (lo + hi) / 2;
            ((shape_.outside(between(points_[size_t(a)], points_[size_t(b)], s)) < 0) == below ? lo : hi) = s;
        }
        return between(points_[size_t(a)], points_[size_t(b)], (lo + hi) / 2);
    }

    void snap() {
        const double reach = 0.35;  // of an edge
        std::vector<double> nearest(points_.size(), reach);
        std::vector<Point2> target(points_.size());
        for (const Triangle& t : triangles_) {
            for (int k = 0; k < 3; ++k) {
                const int a = t[size_t(k)], b = t[size_t((k + 1) % 3)];
                if (!crosses(a, b)) continue;
                const Point2 x = crossing(a, b);
                const auto distance = [&](int from, int to) {
                    const Point2 &p = points_[size_t(from)], &q = points_[size_t(to)];
                    return std::hypot(x[0] - p[0], x[1] - p[1]) / std::hypot(q[0] - p[0], q[1] - p[1]);
                };
                for (const auto& [v, other] : {std::pair(a, b), std::pair(b, a)}) {
                    const double d = distance(v, other);
                    if (d < nearest[size_t(v)]) nearest[size_t(v)] = d, target[size_t(v)] = x;
                }
            }
        }
        for (size_t v = 0; v < points_.size(); ++v)
            if (nearest[v] < reach) points_[v] = target[v], value_[v] = 0;
    }

    int cutVertex(int a, int b) {
        const auto [it, isNew] = cuts_.emplace(std::minmax(a, b), int(points_.size()));
        if (isNew) points_.push_back(crossing(std::min(a, b), std::max(a, b)));
        return it->second;
    }

    void cut(const Triangle& t, std::vector<Triangle>& kept) {
        std::vector<int> polygon;
        bool any = false;
        for (size_t k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            any |= value_[size_t(a)] < 0;
            if (value_[size_t(a)] <= 0) polygon.push_back(a);
            if (crosses(a, b)) polygon.push_back(cutVertex(a, b));
        }
        if (polygon.size() < 3) return;
        if (!any) {  // three corners on the zero set, on either side of it
            Point2 middle{0, 0};
            for (int v : t)
                for (size_t k = 0; k < 2; ++k) middle[k] += points_[size_t(v)][k] / 3;
            if (shape_.outside(middle) >= 0) return;
        }
        const auto length = [&](size_t i, size_t k) {
            const Point2 &p = points_[size_t(polygon[i])], &q = points_[size_t(polygon[k])];
            return std::hypot(q[0] - p[0], q[1] - p[1]);
        };
        if (polygon.size() == 4 && length(1, 3) < length(0, 2))
            std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
        for (size_t i = 1; i + 1 < polygon.size(); ++i) kept.push_back({polygon[0], polygon[i], polygon[i + 1]});
    }

    const SheetShape& shape_;
    std::vector<Point2> points_;
    std::vector<double> value_;
    std::vector<Triangle> triangles_;
    std::map<std::pair<int, int>, int> cuts_;
};

/// Newton's steps along the gradient onto the zero set.
Point2 ontoBoundary(const SheetShape& shape, Point2 p, double edge) {
    for (int i = 0; i < 3; ++i) {
        const double h = 1e-5 * edge, f = shape.outside(p);
        const Point2 g{(shape.outside({p[0] + h, p[1]}) - shape.outside({p[0] - h, p[1]})) / (2 * h),
                       (shape.outside({p[0], p[1] + h}) - shape.outside({p[0], p[1] - h})) / (2 * h)};
        const double s = f / (g[0] * g[0] + g[1] * g[1]);
        p = {p[0] - s * g[0], p[1] - s * g[1]};
    }
    return p;
}

struct Neighbourhood {
    std::vector<std::vector<int>> of;
    std::vector<bool> onBoundary;
};

/// Vertices around each; those of a boundary vertex are its two neighbours along the boundary.
Neighbourhood neighbourhood(const TriangleMesh& m) {
    Neighbourhood n{std::vector<std::vector<int>>(m.points.size()), std::vector<bool>(m.points.size())};
    for (const std::vector<int>& loop : boundaryLoops(m)) {
        for (size_t i = 0; i < loop.size(); ++i) {
            const size_t v = size_t(loop[i]);
            n.onBoundary[v] = true;
            n.of[v] = {loop[(i + loop.size() - 1) % loop.size()], loop[(i + 1) % loop.size()]};
        }
    }
    for (const Triangle& t : m.triangles)
        for (size_t k = 0; k < 3; ++k)
            if (!n.onBoundary[size_t(t[k])]) n.of[size_t(t[k])].push_back(t[(k + 1) % 3]);
    return n;
}

/// Distance along a line from p to where it last leaves a ball around c, or -1 where it does not meet it.
double exitFromBall(const Vec3& p, const Vec3& direction, const Vec3& c, double radius) {
    const Vec3 d = c - p;
    const double along = dot(d, direction), square = radius * radius - dot(d, d) + along * along;
    return square < 0 ? -1 : along + std::sqrt(square);
}

/// Directions into the wall, evened so that they don't meet within its thickness. Those of boundaries stay, so that
/// rims stand square.
std::vector<Vec3> wallDirections(const TriangleMesh& sheet, const std::vector<Vec3>& normals, int rounds) {
    const Neighbourhood near = neighbourhood(sheet);
    std::vector<Vec3> inward;
    for (const Vec3& n : normals) inward.push_back(-n);
    for (int round = 0; round < rounds; ++round) {
        const std::vector<Vec3> before = inward;
        for (size_t v = 0; v < before.size(); ++v) {
            if (near.onBoundary[v]) continue;
            Vec3 sum = before[v];
            for (int k : near.of[v]) sum += before[size_t(k)];
            inward[v] = normalized(sum);
        }
    }
    return inward;
}

/// How far to go along each direction until no vertex of the sheet is nearer than the thickness.
std::vector<double> wallDepths(const TriangleMesh& sheet, const std::vector<Vec3>& inward, double thickness) {
    const double reach = 2.5 * thickness;
    std::map<std::array<int, 3>, std::vector<int>> cells;
    for (size_t v = 0; v < sheet.points.size(); ++v) {
        std::array<int, 3> cell;
        for (int k = 0; k < 3; ++k) cell[size_t(k)] = int(std::floor(sheet.points[v][k] / reach));
        cells[cell].push_back(int(v));
    }
    std::vector<double> depth(sheet.points.size(), thickness);
    for (const auto& [cell, vertices] : cells) {
        std::vector<int> around;
        for (int i = 0; i < 27; ++i) {
            const auto c = cells.find({cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1});
            if (c != cells.end()) around.insert(around.end(), c->second.begin(), c->second.end());
        }
        for (int v : vertices) {
            const Vec3 &p = sheet.points[size_t(v)], &direction = inward[size_t(v)];
            double& d = depth[size_t(v)];
            for (int k : around) d = std::max(d, exitFromBall(p, direction, sheet.points[size_t(k)], thickness));
        }
    }
    return depth;
}

/// One step that evens out a sheet's triangles as they lie in space, by moving its vertices in the plane.
void evenOut(const SheetShape& shape, double edge, const TriangleMesh& m, const Neighbourhood& near,
             std::vector<Point2>& places) {
    std::vector<Point2> sum(places.size(), {0, 0});
    std::vector<double> weight(places.size(), 0.0);
    const auto pull = [&](int v, const Point2& to, double w) {
        for (size_t i = 0; i < 2; ++i) sum[size_t(v)][i] += w * to[i];
        weight[size_t(v)] += w;
    };
    for (const Triangle& t : m.triangles) {  // to the middle of the triangles around, by their areas
        Point2 middle{0, 0};
        for (int v : t)
            for (size_t i = 0; i < 2; ++i) middle[i] += places[size_t(v)][i] / 3;
        const double area = triangleArea(m.points[size_t(t[0])], m.points[size_t(t[1])], m.points[size_t(t[2])]);
        for (int v : t)
            if (!near.onBoundary[size_t(v)]) pull(v, middle, area);
    }
    for (size_t v = 0; v < places.size(); ++v)  // along the boundary, to the longer side
        if (near.onBoundary[v])
            for (int k : near.of[v]) pull(int(v), places[size_t(k)], length(m.points[size_t(k)] - m.points[v]));
    for (size_t v = 0; v < places.size(); ++v) {
        const Point2 target{sum[v][0] / weight[v], sum[v][1] / weight[v]};
        places[v] = between(places[v], target, near.onBoundary[v] ? 0.4 : 0.9);
        if (near.onBoundary[v]) places[v] = ontoBoundary(shape, places[v], edge);
    }
}

}  // namespace

TriangleMesh meshSheet(const SheetShape& shape, double edge) {
    TriangleMesh m = CutLattice(shape, edge).inside();
    std::vector<Point2> places;
    for (const Vec3& p : m.points) places.push_back({p[0], p[1]});
    const auto lift = [&] {
        for (size_t v = 0; v < places.size(); ++v) m.points[v] = shape.point(places[v]);
    };
    lift();
    const Neighbourhood near = neighbourhood(m);
    for (int round = 0; round < 25; ++round) {
        evenOut(shape, edge, m, near, places);
        lift();
    }
    return m;
}

TriangleMesh thickenSheet(const TriangleMesh& sheet, const std::vector<Vec3>& normals, double thickness, double edge) {
    // Evening spreads over about sqrt(rounds) edges.
    const int n = int(sheet.points.size()), rounds = int(std::ceil(6 * std::pow(thickness / edge, 2)));
    std::vector<Vec3> wall = wallDirections(sheet, normals, rounds);
    const std::vector<double> depth = wallDepths(sheet, wall, thickness);
    for (size_t v = 0; v < wall.size(); ++v) wall[v] *= depth[v];
    TriangleMesh m = sheet;
    for (size_t v = 0; v < wall.size(); ++v) m.points.push_back(sheet.points[v] + wall[v]);
    for (const Triangle& t : sheet.triangles) m.triangles.push_back({t[0] + n, t[2] + n, t[1] + n});
    const int rows = std::max(1, int(std::lround(thickness / edge)));
    for (const std::vector<int>& loop : boundaryLoops(sheet)) {
        std::vector<int> row = loop;
        for (int r = 1; r <= rows; ++r) {
            std::vector<int> next;
            for (int v : loop) {
                next.push_back(r == rows ? v + n : int(m.points.size()));
                if (r < rows) m.points.push_back(sheet.points[size_t(v)] + double(r) / rows * wall[size_t(v)]);
            }
            for (size_t i = 0; i < loop.size(); ++i) {
                const size_t k = (i + 1) % loop.size();
                m.triangles.push_back({row[i], row[k], next[k]});
                m.triangles.push_back({row[i], next[k], next[i]});
            }
            row = next;
        }
    }
    m.groups.assign(m.triangles.size(), 1);
    std::fill_n(m.groups.begin(), sheet.triangles.size(), 0);
    return m;
}

}  // namespace pavel
