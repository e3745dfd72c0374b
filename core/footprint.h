#pragma once
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

/// The shadow that a mesh throws along z on z = 0: its projection, overlaps counted once, concave outlines too, as
/// spans of rows.
class Footprint {
  public:
    explicit Footprint(const TriangleMesh& mesh, int rows = 512);
    double area() const;
    bool covers(double x, double y) const;
    /// Largest distance from the origin.
    double radius() const { return radius_; }

  private:
    double y0_ = 0, dy_ = 0, radius_ = 0;
    std::vector<std::vector<std::pair<double, double>>> spans_;  // by row, in order, apart from each other
};

/// Area of a mesh's footprint; relative error below 1e-3.
double footprintArea(const TriangleMesh& mesh);

}  // namespace pavel
