#include "pavel/core/footprint.h"

#include <algorithm>
#include <cmath>

namespace pavel {

Footprint::Footprint(const TriangleMesh& mesh, int rows) : spans_(size_t(rows)) {
    const Bounds b = meshBounds(mesh);
    for (const Vec3& p : mesh.points) radius_ = std::max(radius_, std::hypot(p[0], p[1]));
    y0_ = b.min[1];
    dy_ = (b.max[1] - b.min[1]) / rows;
    if (!(dy_ > 0)) return;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 p[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
        const double lo = std::min({p[0][1], p[1][1], p[2][1]}), hi = std::max({p[0][1], p[1][1], p[2][1]});
        const int first = std::max(0, int(std::ceil((lo - y0_) / dy_ - 0.5)));
        for (int r = first; r < rows; ++r) {
            const double y = y0_ + (r + 0.5) * dy_;
            if (y > hi) break;
            double x0 = 1e300, x1 = -1e300;
            for (int k = 0; k < 3; ++k) {
                const Vec3 &a = p[k], &c = p[(k + 1) % 3];
                if ((a[1] <= y) == (c[1] <= y)) continue;
                const double x = a[0] + (y - a[1]) / (c[1] - a[1]) * (c[0] - a[0]);
                x0 = std::min(x0, x);
                x1 = std::max(x1, x);
            }
            if (x0 < x1) spans_[size_t(r)].emplace_back(x0, x1);
        }
    }
    for (auto& row : spans_) {
        std::sort(row.begin(), row.end());
        size_t n = 0;
        for (const auto& s : row) {
            if (n > 0 && s.first <= row[n - 1].second)
                row[n - 1].second = std::max(row[n - 1].second, s.second);
            else
                row[n++] = s;
        }
        row.resize(n);
    }
}

double Footprint::area() const {
    double area = 0;
    for (const auto& row : spans_)
        for (const auto& [x0, x1] : row) area += (x1 - x0) * dy_;
    return area;
}

bool Footprint::covers(double x, double y) const {
    const double r = (y - y0_) / dy_;
    if (!(r >= 0) || r >= double(spans_.size())) return false;
    for (const auto& [x0, x1] : spans_[size_t(r)])
        if (x >= x0) {
            if (x <= x1) return true;
        } else {
            return false;
        }
    return false;
}

double footprintArea(const TriangleMesh& mesh) {
    return Footprint(mesh, 2048).area();
}

}  // namespace pavel
