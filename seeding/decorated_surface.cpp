#include "pavel/seeding/decorated_surface.h"

#include <algorithm>
#include <map>

#include "pavel/core/error.h"

namespace pavel {
namespace {

using Function = std::function<double(const Vec3&, const Vec3&)>;

double distanceToLines(const Vec3& p, const std::vector<std::vector<Vec3>>& lines) {
    double least = 1e300;
    for (const auto& line : lines)
        for (size_t i = 0; i < line.size(); ++i) {
            const Vec3 a = line[i], d = line[std::min(i + 1, line.size() - 1)] - a;
            const double l2 = dot(d, d), s = l2 > 0 ? std::clamp(dot(p - a, d) / l2, 0.0, 1.0) : 0;
            least = std::min(least, length(p - a - s * d));
        }
    return least;
}

/// Splits the edges that the zero set of f may cross until none is longer than `longest`.
void refineBorder(TriangleMesh& mesh, const Function& f, double longest) {
    subdivideEdges(mesh, [&](const Vec3& a, const Vec3& b) {
        const double l = length(b - a);
        return l > longest && std::abs(f(0.5 * (a + b), Vec3(0, 0, 0))) < l;
    });
}

}  // namespace

void clipMesh(TriangleMesh& mesh, const Function& f) {
    const std::vector<Vec3> normals = vertexNormals(mesh);
    std::vector<double> value(mesh.points.size());
    for (size_t v = 0; v < value.size(); ++v) value[v] = f(mesh.points[v], normals[v]);
    std::map<std::pair<int, int>, int> crossings;
    const auto crossing = [&](int a, int b) {
        const auto [it, isNew] = crossings.emplace(std::minmax(a, b), int(mesh.points.size()));
        if (isNew) {
            const auto [lo, hi] = it->first;
            const double s = value[size_t(lo)] / (value[size_t(lo)] - value[size_t(hi)]);
            mesh.points.push_back(mesh.points[size_t(lo)] + s * (mesh.points[size_t(hi)] - mesh.points[size_t(lo)]));
        }
        return it->second;
    };
    std::vector<Triangle> kept;
    for (const Triangle& t : mesh.triangles) {
        int ring[4], n = 0;
        for (size_t k = 0; k < 3; ++k) {
            const int a = t[k], b = t[(k + 1) % 3];
            const bool in = value[size_t(a)] >= 0, next = value[size_t(b)] >= 0;
            if (in) ring[n++] = a;
            if (in != next && value[size_t(in ? a : b)] > 0) ring[n++] = crossing(a, b);
        }
        for (int k = 1; k + 1 < n; ++k) kept.push_back({ring[0], ring[k], ring[k + 1]});
    }
    mesh.triangles = std::move(kept);
    mesh.groups.clear();
    mesh.groupNames.clear();
    removeUnusedVertices(mesh);
}

TriangleMesh decoratedSurface(const TriangleMesh& base, const SeedingOptions& options, double spacing,
                              const SurfaceMap* mask) {
    const RegionOptions& region = options.region;
    std::string part = region.part;
    const bool hasOuter = std::find(base.groupNames.begin(), base.groupNames.end(), "outer") != base.groupNames.end();
    if (part.empty()) part = hasOuter && options.method != "manual" ? "outer" : "all";
    TriangleMesh mesh = part == "all" ? base : groupSubmesh(base, part);
    if (!region.cuts()) return mesh;
    const double fine = std::max(spacing, 4e-3 * meshBounds(mesh).diagonal()) / 8;
    const auto cut = [&](const Function& f) {
        if (!mesh.triangles.empty()) clipMesh(mesh, f);
    };
    const auto halfSpace = [&](int axis, double sign, double at) {
        cut([=](const Vec3& p, const Vec3&) { return sign * (p[axis] - at); });
    };
    if (region.box)
        for (int k = 0; k < 3; ++k) {
            halfSpace(k, 1, region.box->min[k]);
            halfSpace(k, -1, region.box->max[k]);
        }
    if (region.height) {
        halfSpace(2, 1, region.height->first);
        halfSpace(2, -1, region.height->second);
    }
    if (region.sphere) {
        const auto f = [&](const Vec3& p, const Vec3&) {
            return region.sphere->radius - length(p - region.sphere->center);
        };
        refineBorder(mesh, f, fine);
        cut(f);
    }
    if (region.curve) {
        const auto f = [&](const Vec3& p, const Vec3&) {
            return region.curve->distance - distanceToLines(p, region.curve->lines);
        };
        refineBorder(mesh, f, fine);
        cut(f);
    }
    if (!region.mask.empty()) {
        if (!mask) throw InputError("seeding.region.vertex_mask: has no values");
        cut([&](const Vec3& p, const Vec3& n) { return mask->at(p, n) - 0.5; });
    }
    if (mesh.triangles.empty()) throw InputError("seeding.region: nothing of the base lies in it");
    return mesh;
}

}  // namespace pavel
