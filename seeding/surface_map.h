#pragma once
#include <vector>

#include "pavel/seeding/surface.h"

namespace pavel {

/// A number for every point of a surface, given at the vertices of a mesh that lies on it: a painted mask or density.
class SurfaceMap {
  public:
    /// @param values one for each of the mesh's points
    SurfaceMap(TriangleMesh mesh, std::vector<double> values) : surface_(std::move(mesh)), values_(std::move(values)) {}

    /// The value at the mesh's point nearest to p, of those that face like `normal`. O(log triangles).
    double at(const Vec3& p, const Vec3& normal) const;

  private:
    Surface surface_;
    std::vector<double> values_;
};

/// How much a surface bends: the greater principal curvature's magnitude, 1 where it is that of the most bent
/// hundredth of the surface.
SurfaceMap curvatureMap(const TriangleMesh& mesh);

}  // namespace pavel
