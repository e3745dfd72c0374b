#include "pavel/core/mesh.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>

#include "pavel/core/error.h"
#include "pavel/core/union_find.h"

namespace pavel {

Bounds meshBounds(const TriangleMesh& mesh) {
    Bounds b;
    for (const Vec3& p : mesh.points) b.add(p);
    return b;
}

double triangleArea(const Vec3& a, const Vec3& b, const Vec3& c) {
    return 0.5 * length(cross(b - a, c - a));
}

double meshArea(const TriangleMesh& mesh) {
    double sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += triangleArea(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
    return sum;
}

double meshVolume(const TriangleMesh& mesh) {
    if (mesh.points.empty()) return 0;
    const Vec3 o = mesh.points[0];  // near origin: less cancellation
    double sum = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        sum += dot(mesh.corner(t, 0) - o, cross(mesh.corner(t, 1) - o, mesh.corner(t, 2) - o));
    return sum / 6;
}

Vec3 triangleNormal(const TriangleMesh& mesh, size_t t) {
    return normalized(cross(mesh.corner(t, 1) - mesh.corner(t, 0), mesh.corner(t, 2) - mesh.corner(t, 0)));
}

std::array<Vec3, 3> cornerNormals(const TriangleMesh& mesh, size_t t) {
    const std::array<Vec3, 3> p{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
    const Vec3 across = cross(p[1] - p[0], p[2] - p[0]), n = normalized(across, Vec3(0, 0, 0));
    const double twice = length(across);  // the area, and what each corner's sides cross to
    std::array<Vec3, 3> weighted;
    for (size_t k = 0; k < 3; ++k)
        weighted[k] = std::atan2(twice, dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k])) * n;
    return weighted;
}

std::vector<Vec3> vertexNormals(const TriangleMesh& mesh) {
    constexpr size_t kChunk = 1 << 15;
    std::vector<Vec3> normals(mesh.points.size(), Vec3(0, 0, 0));
    std::vector<std::array<Vec3, 3>> weighted(std::min(kChunk, mesh.triangles.size()));
    for (size_t first = 0; first < mesh.triangles.size(); first += kChunk) {
        const size_t count = std::min(kChunk, mesh.triangles.size() - first);
        tbb::parallel_for(size_t(0), count, [&](size_t i) { weighted[i] = cornerNormals(mesh, first + i); });
        for (size_t i = 0; i < count; ++i)
            for (size_t k = 0; k < 3; ++k) normals[size_t(mesh.triangles[first + i][k])] += weighted[i][k];
    }
    for (Vec3& n : normals) n = normalized(n);
    return normals;
}

std::vector<std::array<int, 3>> triangleNeighbours(const TriangleMesh& mesh) {
    // Half-edges in buckets by their lower vertex: a handful in each.
    struct HalfEdge {
        int hi, number;  // 3 * triangle + side
        bool operator<(const HalfEdge& o) const { return hi != o.hi ? hi < o.hi : number < o.number; }
    };
    const size_t count = 3 * mesh.triangles.size();
    const auto ends = [&](size_t e) {
        const Triangle& t = mesh.triangles[e / 3];
        return std::minmax(t[e % 3], t[(e + 1) % 3]);
    };
    std::vector<size_t> end(mesh.points.size() + 1, 0);
    for (size_t e = 0; e < count; ++e) ++end[size_t(ends(e).first) + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<HalfEdge> edges(count);
    for (size_t e = 0; e < count; ++e) {
        const auto [lo, hi] = ends(e);
        edges[end[size_t(lo)]++] = {hi, int(e)};  // the bucket's begin becomes its end
    }
    std::vector<std::array<int, 3>> result(mesh.triangles.size(), {-1, -1, -1});
    size_t begin = 0;
    for (size_t v = 0; v < mesh.points.size(); begin = end[v++]) {
        std::sort(edges.begin() + long(begin), edges.begin() + long(end[v]));
        for (size_t i = begin; i < end[v];) {
            size_t j = i + 1;
            while (j < end[v] && edges[j].hi == edges[i].hi) ++j;
            if (j - i == 2) {
                const int one = edges[i].number, other = edges[i + 1].number;
                result[size_t(one / 3)][size_t(one % 3)] = other / 3;
                result[size_t(other / 3)][size_t(other % 3)] = one / 3;
            }
            i = j;
        }
    }
    return result;
}

void append(TriangleMesh& a, const TriangleMesh& b) {
    const int shift = int(a.points.size());
    const bool keepGroups = a.triangles.empty() || (!a.groups.empty() && a.groupNames == b.groupNames);
    if (keepGroups) {
        a.groupNames = b.groupNames;
        a.groups.insert(a.groups.end(), b.groups.begin(), b.groups.end());
    } else {
        a.groups.clear();
        a.groupNames.clear();
    }
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    a.triangles.reserve(a.triangles.size() + b.triangles.size());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
}

double sectionArea(const TriangleMesh& mesh, double z) {
    double twice = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        Vec3 cut[2] = {Vec3(0, 0, 0), Vec3(0, 0, 0)};
        int up = -1, down = -1;  // edges that cross upwards and downwards
        for (int k = 0; k < 3; ++k) {
            const Vec3 a = mesh.corner(t, k), b = mesh.corner(t, (k + 1) % 3);
            if ((a[2] < z) == (b[2] < z)) continue;
            const Vec3 p = a + (z - a[2]) / (b[2] - a[2]) * (b - a);
            if (a[2] < z)
                cut[0] = p, up = k;
            else
                cut[1] = p, down = k;
        }
        if (up < 0 || down < 0) continue;
        // Seen from above the solid lies to the left of the way from where an edge rises to where one falls.
        twice += cut[0][0] * cut[1][1] - cut[0][1] * cut[1][0];
    }
    return std::abs(twice) / 2;
}

double widestHeight(const TriangleMesh& mesh) {
    constexpr int kCuts = 64;
    const Bounds b = meshBounds(mesh);
    double best = 0, height = 0;
    for (int i = 0; i < kCuts; ++i) {
        const double z = b.min[2] + (i + 0.5) / kCuts * (b.max[2] - b.min[2]), area = sectionArea(mesh, z);
        if (area > best * (1 + 1e-9)) best = area, height = z;
    }
    return height;
}

void scaleMesh(TriangleMesh& mesh, double factor) {
    for (Vec3& p : mesh.points) p *= factor;
}

TriangleMesh splitAtCreases(const TriangleMesh& mesh, double degrees, std::vector<int>& source) {
    const double least = std::cos(degreesToRadians(degrees));
    const auto neighbours = triangleNeighbours(mesh);
    UnionFind corners(3 * mesh.triangles.size());
    const auto cornerOf = [&](size_t t, int v) {
        return int(3 * t) + (mesh.triangles[t][0] == v ? 0 : mesh.triangles[t][1] == v ? 1 : 2);
    };
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (size_t k = 0; k < 3; ++k) {
            const int n = neighbours[t][k];
            if (n < int(t)) continue;
            if (degrees < 180 && dot(triangleNormal(mesh, t), triangleNormal(mesh, size_t(n))) < least) continue;
            for (int v : {mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]})
                corners.join(cornerOf(t, v), cornerOf(size_t(n), v));
        }
    TriangleMesh out = mesh;
    source.resize(mesh.points.size());
    std::iota(source.begin(), source.end(), 0);
    std::vector<int> fanOf(mesh.points.size(), -1);  // that keeps the vertex
    std::map<int, int> numberOf;                     // of the other fans
    for (size_t c = 0; c < 3 * mesh.triangles.size(); ++c) {
        int& v = out.triangles[c / 3][c % 3];
        const int fan = corners.find(int(c));
        int& kept = fanOf[size_t(v)];
        if (kept < 0) kept = fan;
        if (kept == fan) continue;
        const auto [it, isNew] = numberOf.emplace(fan, int(out.points.size()));
        if (isNew) {
            out.points.push_back(mesh.points[size_t(v)]);
            source.push_back(v);
        }
        v = it->second;
    }
    return out;
}

size_t removeUnusedVertices(TriangleMesh& mesh) {
    std::vector<int> next(mesh.points.size(), -1);
    for (const Triangle& t : mesh.triangles)
        for (int v : t) next[size_t(v)] = 0;
    std::vector<Vec3> points;
    for (size_t i = 0; i < next.size(); ++i) {
        if (next[i] < 0) continue;
        next[i] = int(points.size());
        points.push_back(mesh.points[i]);
    }
    const size_t removed = mesh.points.size() - points.size();
    mesh.points = std::move(points);
    for (Triangle& t : mesh.triangles)
        for (int& v : t) v = next[size_t(v)];
    return removed;
}

TriangleMesh groupSubmesh(const TriangleMesh& mesh, const std::string& group) {
    const auto found = std::find(mesh.groupNames.begin(), mesh.groupNames.end(), group);
    if (found == mesh.groupNames.end()) {
        std::string names;
        for (const std::string& n : mesh.groupNames) names += (names.empty() ? "" : ", ") + n;
        throw InputError("the base has no part named \"" + group + "\"" +
                         (names.empty() ? "; use \"all\"" : "; its parts are: all, " + names));
    }
    const int index = int(found - mesh.groupNames.begin());
    TriangleMesh part;
    part.points = mesh.points;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        if (mesh.groups[t] == index) part.triangles.push_back(mesh.triangles[t]);
    removeUnusedVertices(part);
    return part;
}

Vec3 closestPointOnTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, Vec3* weights) {
    const auto answer = [&](double wa, double wb, double wc) {
        if (weights) *weights = Vec3(wa, wb, wc);
        return wa * a + wb * b + wc * c;
    };
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return answer(1, 0, 0);
    const Vec3 bp = p - b;
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return answer(0, 1, 0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return answer(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0);
    const Vec3 cp = p - c;
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return answer(0, 0, 1);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return answer(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return answer(0, 1 - w, w);
    }
    const double sum = va + vb + vc;
    return answer(va / sum, vb / sum, vc / sum);
}

}  // namespace pavel
