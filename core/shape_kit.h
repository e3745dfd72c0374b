#pragma once
// Ways to sweep closed meshes and to join them, shared by the built-in shapes.
#include <functional>
#include <utility>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

/// Point of the cubic Bezier with control points c.
template <class T>
T bezier(const T (&c)[4], double s) {
    const double q = 1 - s;
    return q * q * q * c[0] + 3 * q * q * s * c[1] + 3 * q * s * s * c[2] + s * s * s * c[3];
}
/// Its derivative.
template <class T>
T bezierTangent(const T (&c)[4], double s) {
    const double q = 1 - s;
    return 3 * q * q * (c[1] - c[0]) + 6 * q * s * (c[2] - c[1]) + 3 * s * s * (c[3] - c[2]);
}

/// A closed surface with two poles: at(u, v), u in [0,1] from pole to pole, v in [0,1) around. Counter-clockwise seen
/// from outside when v turns counter-clockwise about the direction from the u=1 pole to the u=0 pole.
TriangleMesh sweepPoles(int rows, int columns, const std::function<Vec3(double u, double v)>& at);

/// A closed surface of torus type: at(u, v), both periodic in [0,1).
TriangleMesh sweepPeriodic(int rows, int columns, const std::function<Vec3(double u, double v)>& at);

/// A stretch of a sweep, up to u = end, and the group of its triangles.
struct SweepBand {
    double end;
    int group;
    int least = 1;  ///< number of strips between rings
};
/// As sweepPoles, of nearly equilateral triangles: rings lie evenly within each band, and each has as many points as
/// its length asks. Bands begin and end on rings, so that creases and the borders of groups are met; the last one ends
/// at 1. Turned outward.
TriangleMesh sweepEvenly(double edge, const std::vector<SweepBand>& bands,
                         const std::function<Vec3(double u, double v)>& at, std::vector<std::string> groupNames);

struct ProfilePoint {
    double r, z;
    int group;
};
/// Revolves a profile about z. It starts and ends on the axis (r = 0) and runs so that the solid lies to its left
/// (from the bottom, outside, up, and back inside). A segment belongs to the group of its first point.
TriangleMesh revolve(const std::vector<ProfilePoint>& profile, int steps, std::vector<std::string> groupNames);

/// Tells whether points lie inside a closed mesh, by the crossings of a vertical ray, which a grid of columns finds.
class InsideTest {
  public:
    explicit InsideTest(const TriangleMesh& mesh);
    bool operator()(const Vec3& p) const;

  private:
    size_t column(double v, int axis) const;

    TriangleMesh mesh_;
    Bounds bounds_;
    size_t n_;
    std::vector<std::vector<int>> columns_;  // triangles over each cell of an n x n grid
};

/// Faces of the mesh whose middles lie inside the cover are no surface of the union: puts them into the group `hidden`.
void hideCovered(TriangleMesh& mesh, const InsideTest& cover, int hidden);

/// Overlapping closed parts, with the same group names, as one mesh; faces inside another part get the group `hidden`.
TriangleMesh joinParts(std::vector<TriangleMesh> parts, int hidden);

}  // namespace pavel
