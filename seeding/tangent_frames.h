#pragma once
// Polar coordinates around the vertices of a surface, and how directions turn from one vertex to the next (F. Knöppel,
// K. Crane, U. Pinkall, P. Schröder, Globally optimal direction fields, 2013, section 6.1).
#include <array>
#include <cmath>
#include <vector>

#include "pavel/core/mesh.h"

namespace pavel {

/// Built on a copy of the mesh whose vertices are split where their triangles form more than one fan, so that every
/// vertex has one tangent plane, and numbered so that sparse equations over them fill in little (nested dissection, G.
/// Karypis and V. Kumar, METIS). Triangles keep their order and corners.
class TangentFrames {
  public:
    explicit TangentFrames(const TriangleMesh& mesh);

    const TriangleMesh& mesh() const { return mesh_; }
    const std::vector<std::array<int, 3>>& neighbours() const { return neighbours_; }
    int vertex(size_t t, int k) const { return mesh_.triangles[t][size_t(k)]; }
    const Vec3& normal(int v) const { return normal_[size_t(v)]; }
    /// Angle, in the polar coordinates of corner k's vertex, of the side from corner k to corner k + 1.
    double sideAngle(size_t t, int k) const { return angle_[3 * t + size_t(k)]; }
    /// The same at corner k + 1, of the same side back to corner k.
    double backAngle(size_t t, int k) const {
        const size_t c = 3 * t + size_t((k + 1) % 3);
        return angle_[c] + opening_[c];
    }
    /// What a direction's angle grows by when it is carried along the side from corner k to corner k + 1.
    double transport(size_t t, int k) const { return backAngle(t, k) + kPi - sideAngle(t, k); }
    /// Half the cotangent opposite the side; not below 0.001, so that matrices stay positive.
    double weight(size_t t, int k) const;
    /// Third of the area of the triangles around each vertex.
    std::vector<double> vertexAreas() const;
    /// The tangent at a polar angle. Sides of triangles keep their angles, though the tangent plane foreshortens them.
    Vec3 direction(int v, double angle) const;
    double angle(int v, const Vec3& direction) const;

  private:
    TriangleMesh mesh_;
    std::vector<std::array<int, 3>> neighbours_;
    std::vector<Vec3> normal_, x_, y_;
    std::vector<double> angle_, opening_;  // by corner: angle of its first side, and to its second one
    struct Spoke {
        double angle, seen;  // polar angle, and that in the tangent plane
    };
    std::vector<Spoke> spokes_;  // of each vertex in ascending order, from 0 to a whole turn
    std::vector<int> firstSpoke_, endSpoke_;
    void renumber();
};

}  // namespace pavel
