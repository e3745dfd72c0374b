#include "pavel/seeding/surface_map.h"

#include <algorithm>
#include <cmath>

#include "pavel/seeding/curvature.h"

namespace pavel {

double SurfaceMap::at(const Vec3& p, const Vec3& normal) const {
    const SurfacePoint q = surface_.closest(p, &normal);
    const TriangleMesh& m = surface_.mesh();
    const size_t t = size_t(q.triangle);
    Vec3 w;
    closestPointOnTriangle(q.position, m.corner(t, 0), m.corner(t, 1), m.corner(t, 2), &w);
    double value = 0;
    for (int k = 0; k < 3; ++k) value += w[k] * values_[size_t(m.triangles[t][size_t(k)])];
    return value;
}

SurfaceMap curvatureMap(const TriangleMesh& mesh) {
    std::vector<double> bend;
    for (const Curvature& c : principalCurvatures(mesh)) bend.push_back(std::abs(c.greatest));
    std::vector<double> sorted = bend;
    const auto most = sorted.begin() + long(0.99 * double(sorted.size() - 1));
    std::nth_element(sorted.begin(), most, sorted.end());
    for (double& b : bend) b = *most > 0 ? std::min(1.0, b / *most) : 0;
    return SurfaceMap(mesh, std::move(bend));
}

}  // namespace pavel
