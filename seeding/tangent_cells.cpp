#include "pavel/seeding/tangent_cells.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "pavel/seeding/kd_tree.h"

namespace pavel {
namespace {

struct Point {
    double x, y;
};

/// Convex polygon around the origin; other[i]: the seed behind the edge from corner i to i + 1.
struct Cell {
    static constexpr int kMost = 40;
    Point p[kMost];
    int other[kMost];
    int n;
    double radius2;  // of the farthest corner, squared
};

/// Keeps what is nearer to the origin than to b.
bool clip(const Cell& in, const Point& b, int other, Cell& out) {
    const double half = 0.5 * (b.x * b.x + b.y * b.y);
    double h[Cell::kMost];
    bool cuts = false;
    for (int i = 0; i < in.n; ++i) {
        h[i] = in.p[i].x * b.x + in.p[i].y * b.y - half;
        cuts |= h[i] > 0;
    }
    if (!cuts) return false;
    out.n = 0;
    out.radius2 = 0;
    const auto append = [&](const Point& p, int behind) {
        out.radius2 = std::max(out.radius2, p.x * p.x + p.y * p.y);
        out.p[out.n] = p;
        out.other[out.n++] = behind;
    };
    for (int i = 0; i < in.n; ++i) {
        const int j = i + 1 < in.n ? i + 1 : 0;
        if (h[i] <= 0) append(in.p[i], in.other[i]);
        if ((h[i] <= 0) != (h[j] <= 0)) {
            const double f = h[i] / (h[i] - h[j]);
            append({in.p[i].x + f * (in.p[j].x - in.p[i].x), in.p[i].y + f * (in.p[j].y - in.p[i].y)},
                   h[i] <= 0 ? other : in.other[i]);
        }
    }
    return true;
}

}  // namespace

TangentCells::TangentCells(const std::vector<SurfacePoint>& seeds, const std::vector<VoronoiCell>& exact) {
    constexpr double kMostDifference = 0.05;  // of the cell's area
    double area = 0;
    for (const VoronoiCell& c : exact) area += c.area;
    spacing_ = std::sqrt(area / double(seeds.size()));
    resting_.assign(seeds.size(), 0);
    const auto flat = cells(seeds);
    fit_.resize(seeds.size());
    for (size_t i = 0; i < seeds.size(); ++i)
        fit_[i] = std::abs(flat[i].area - exact[i].area) < kMostDifference * exact[i].area;
    moveAll();
}

void TangentCells::moveAll() {
    for (size_t i = 0; i < fit_.size(); ++i) resting_[i] = !fit_[i];
    reference_.clear();
}

void TangentCells::moveOnly(const std::vector<char>& moving) {
    for (size_t i = 0; i < fit_.size(); ++i) resting_[i] = !fit_[i] || !moving[i];
}

void TangentCells::updateNear(const std::vector<SurfacePoint>& seeds) {
    constexpr double kWorn = 0.9;  // spacings
    if (reference_.size() == seeds.size()) {
        double moved2 = 0;
        for (size_t i = 0; i < seeds.size(); ++i)
            moved2 = std::max(moved2, (seeds[i].position - reference_[i]).sqrnorm());
        if (moved2 < kWorn * kWorn * spacing_ * spacing_) return;
    }
    const PointCloud cloud{seeds};
    const KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(8));
    reference_.resize(seeds.size());
    near_.assign(seeds.size() * kNear, -1);
    tbb::parallel_for(tbb::blocked_range<size_t>(0, seeds.size(), 64), [&](const auto& range) {
        size_t index[kNear + 1];
        double distance2[kNear + 1];
        for (size_t s = range.begin(); s < range.end(); ++s) {
            reference_[s] = seeds[s].position;
            if (resting_[s]) continue;
            const size_t got = tree.knnSearch(reference_[s].data(), kNear + 1, index, distance2);
            size_t n = 0;
            for (size_t i = 0; i < got && n < kNear; ++i)
                if (index[i] != s) near_[s * kNear + n++] = int(index[i]);
        }
    });
}

std::vector<VoronoiCell> TangentCells::cells(const std::vector<SurfacePoint>& seeds,
                                             std::vector<std::vector<int>>* neighbours) {
    updateNear(seeds);
    std::vector<VoronoiCell> result(seeds.size());
    if (neighbours) neighbours->assign(seeds.size(), {});
    tbb::parallel_for(tbb::blocked_range<size_t>(0, seeds.size(), 32), [&](const auto& range) {
        Cell buffers[2];
        for (size_t i = range.begin(); i < range.end(); ++i) {
            if (resting_[i]) continue;
            const SurfacePoint& seed = seeds[i];
            const Vec3 u = anyPerpendicular(seed.normal), v = cross(seed.normal, u);
            const double reach = 1.5 * spacing_;
            Cell* cell = &buffers[0];
            cell->n = 4;
            cell->radius2 = 2 * reach * reach;
            const Point corners[4] = {{-reach, -reach}, {reach, -reach}, {reach, reach}, {-reach, reach}};
            for (int k = 0; k < 4; ++k) cell->p[k] = corners[k], cell->other[k] = -1;
            for (size_t k = 0; k < kNear; ++k) {
                const int j = near_[i * kNear + k];
                if (j < 0) break;
                const Vec3 d = seeds[size_t(j)].position - seed.position;
                if (d.sqrnorm() > 4 * cell->radius2) continue;
                if (dot(seed.normal, seeds[size_t(j)].normal) < 0) continue;  // across a wall
                const double x = dot(d, u), y = dot(d, v), flat2 = x * x + y * y;
                if (!(flat2 > 0)) continue;
                // As far away as it is on the surface, nearly.
                const double stretch = std::sqrt(d.sqrnorm() / flat2);
                Cell* next = &buffers[cell == &buffers[0]];
                if (cell->n < Cell::kMost - 1 && clip(*cell, {stretch * x, stretch * y}, j, *next)) cell = next;
            }
            VoronoiCell& c = result[i];
            double mx = 0, my = 0;
            for (int k = 0; k < cell->n; ++k) {
                const Point &a = cell->p[k], &b = cell->p[k + 1 < cell->n ? k + 1 : 0];
                const double area = 0.5 * (a.x * b.y - a.y * b.x);
                c.area += area;
                mx += area / 3 * (a.x + b.x);
                my += area / 3 * (a.y + b.y);
                c.energy += area / 6 * (a.x * a.x + a.y * a.y + b.x * b.x + b.y * b.y + a.x * b.x + a.y * b.y);
                if (neighbours && cell->other[k] >= 0) (*neighbours)[i].push_back(cell->other[k]);
            }
            c.mass = c.area;
            c.moment = c.mass * seed.position + mx * u + my * v;
        }
    });
    return result;
}

}  // namespace pavel
