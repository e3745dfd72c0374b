#include "pavel/io/raster.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace pavel {
namespace {

/// Draws rows [y0, y1) of a triangle. `beyond`: the corners' distances past the cut.
void drawTriangle(Raster& raster, const Vec3 (&p)[3], const double* beyond, double bias, int64_t id, int y0, int y1) {
    const double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if (area == 0 || !(p[0][2] > 0 && p[1][2] > 0 && p[2][2] > 0)) return;
    const double farther = area < 0 ? bias : 0;  // rows run down, so fronts have areas below 0
    const int top = std::max(y0, int(std::ceil(std::min({p[0][1], p[1][1], p[2][1]}) - 0.5)));
    const int bottom = std::min(y1 - 1, int(std::floor(std::max({p[0][1], p[1][1], p[2][1]}) - 0.5)));
    const int left = std::max(0, int(std::ceil(std::min({p[0][0], p[1][0], p[2][0]}) - 0.5)));
    const int right = std::min(raster.width - 1, int(std::floor(std::max({p[0][0], p[1][0], p[2][0]}) - 0.5)));
    for (int y = top; y <= bottom; ++y)
        for (int x = left; x <= right; ++x) {
            double w[3];
            Raster::weights(p, x + 0.5, y + 0.5, w);
            if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
            if (beyond && w[0] * beyond[0] + w[1] * beyond[1] + w[2] * beyond[2] > 0) continue;
            const float z = float(w[0] * p[0][2] + w[1] * p[1][2] + w[2] * p[2][2] + farther);
            const size_t at = raster.at(x, y);
            if (z >= raster.depth[at]) continue;
            raster.depth[at] = z;
            raster.item[at] = id;
        }
}

}  // namespace

Camera orthonormalCamera(const Vec3& back) {
    Camera c;
    c.back = normalized(back);
    c.right = normalized(cross(std::abs(c.back[2]) < 0.99 ? Vec3(0, 0, 1) : Vec3(0, 1, 0), c.back));
    c.up = cross(c.back, c.right);
    return c;
}

void Raster::weights(const Vec3 (&p)[3], double x, double y, double (&w)[3]) {
    const double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    w[1] = ((x - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (y - p[0][1])) / area;
    w[2] = ((p[1][0] - p[0][0]) * (y - p[0][1]) - (x - p[0][0]) * (p[1][1] - p[0][1])) / area;
    w[0] = 1 - w[1] - w[2];
}

Stage::Stage(const std::vector<MeshObject>& o) : objects(o) {
    int64_t n = 0;
    for (const MeshObject& m : o) first_.push_back(n), n += int64_t(m.mesh.triangles.size());
}

std::pair<size_t, size_t> Stage::locate(int64_t id) const {
    const size_t object = size_t(std::upper_bound(first_.begin(), first_.end(), id) - first_.begin()) - 1;
    return {object, size_t(id - first_[object])};
}

void Stage::makeNormals(const Raster& raster) {
    places_.resize(objects.size());
    normals_.resize(objects.size());
    for (size_t o = 0; o < objects.size(); ++o) places_[o].assign(objects[o].mesh.points.size(), kUnseen);
    std::vector<uint32_t> counts(objects.size(), 0);
    int64_t last = -1;
    for (const int64_t id : raster.item) {
        if (id < 0 || id == last) continue;
        last = id;
        const auto [o, t] = locate(id);
        for (int v : objects[o].mesh.triangles[t])
            if (uint32_t& place = places_[o][size_t(v)]; place == kUnseen) place = counts[o]++;
    }
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t o) {
        if (counts[o] == 0) return;
        const TriangleMesh& m = objects[o].mesh;
        std::vector<Vec3>& normals = normals_[o];
        normals.assign(counts[o], Vec3(0, 0, 0));
        for (size_t t = 0; t < m.triangles.size(); ++t) {
            uint32_t at[3];
            for (size_t k = 0; k < 3; ++k) at[k] = places_[o][size_t(m.triangles[t][k])];
            if (at[0] == kUnseen && at[1] == kUnseen && at[2] == kUnseen) continue;
            const std::array<Vec3, 3> weighted = cornerNormals(m, t);
            for (size_t k = 0; k < 3; ++k)
                if (at[k] != kUnseen) normals[at[k]] += weighted[k];
        }
        for (Vec3& n : normals) n = normalized(n);
    });
}

void Stage::draw(const Camera& camera, Raster& raster, const std::optional<CutPlane>& cut) const {
    // The lowest and highest row of each run.
    std::vector<std::vector<std::pair<double, double>>> rows(objects.size());
    tbb::parallel_for(size_t(0), objects.size(), [&](size_t o) {
        const TriangleMesh& m = objects[o].mesh;
        rows[o].assign((m.triangles.size() + kRun - 1) / kRun, {1e30, -1e30});
        tbb::parallel_for(size_t(0), rows[o].size(), [&](size_t run) {
            auto& [lo, hi] = rows[o][run];
            for (size_t t = run * kRun; t < std::min(m.triangles.size(), (run + 1) * kRun); ++t)
                for (int v : m.triangles[t]) {
                    const double y = camera.project(m.points[size_t(v)])[1];
                    lo = std::min(lo, y), hi = std::max(hi, y);
                }
        });
    });
    // Bands of rows, so that threads write apart; within a band triangles come in order: equal pictures on any number.
    constexpr int kBand = 64;
    tbb::parallel_for(0, (raster.height + kBand - 1) / kBand, [&](int band) {
        const int y0 = band * kBand, y1 = std::min(raster.height, y0 + kBand);
        for (size_t o = 0; o < objects.size(); ++o) {
            const TriangleMesh& m = objects[o].mesh;
            for (size_t run = 0; run < rows[o].size(); ++run) {
                if (rows[o][run].second < y0 || rows[o][run].first > y1) continue;
                for (size_t t = run * kRun; t < std::min(m.triangles.size(), (run + 1) * kRun); ++t) {
                    const Triangle& c = m.triangles[t];
                    const Vec3 p[3] = {camera.project(m.points[size_t(c[0])]), camera.project(m.points[size_t(c[1])]),
                                       camera.project(m.points[size_t(c[2])])};
                    if (std::max({p[0][1], p[1][1], p[2][1]}) < y0 || std::min({p[0][1], p[1][1], p[2][1]}) > y1)
                        continue;
                    double beyond[3];
                    if (cut)
                        for (int k = 0; k < 3; ++k) beyond[k] = cut->beyond(m.corner(t, k));
                    drawTriangle(raster, p, cut ? beyond : nullptr, cut ? cut->bias : 0, first_[o] + int64_t(t), y0,
                                 y1);
                }
            }
        }
    });
}

}  // namespace pavel
