#pragma once
// Triangle meshes of smoothly bounded sheets, and their thickening; for bases such as masks.
#include <array>
#include <functional>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

using Point2 = std::array<double, 2>;

/// A sheet over the part of the plane where `outside` is negative; the function is smooth near its zero set.
struct SheetShape {
    std::function<double(const Point2&)> outside;
    std::function<Vec3(const Point2&)> point;
    Point2 min, max;  ///< of the plane's part that the sheet lies over
};

/// Nearly even triangles of about the given edge in the plane, spread by their lengths in space; boundary vertices lie
/// on the zero set. Counter-clockwise in the plane.
TriangleMesh meshSheet(const SheetShape& shape, double edge);

/// Closes an open sheet to a solid by a second one, no point of which is nearer than `thickness` to the sheet's
/// vertices. Where the sheet bends more sharply than that, on the hollow side, plain offsets along normals would fold
/// over. Rims between them are flat, of rows about `edge` wide. Group 0: the sheet, 1: the rest.
TriangleMesh thickenSheet(const TriangleMesh& sheet, const std::vector<Vec3>& normals, double thickness, double edge);

}  // namespace pavel
