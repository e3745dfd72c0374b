#pragma once
// Closest points, normals and random points on a triangle surface.
#include <functional>
#include <memory>
#include <vector>

#include "pavel/core/mesh.h"
#include "pavel/core/rng.h"

namespace pavel {

struct SurfacePoint {
    Vec3 position;
    int triangle = -1;
    Vec3 normal{0, 0, 1};  ///< interpolated vertex normal
    double distance = 0;   ///< from the query point
};

class Surface {
  public:
    explicit Surface(TriangleMesh mesh);
    ~Surface();
    Surface(Surface&&) noexcept;

    const TriangleMesh& mesh() const { return mesh_; }
    const std::vector<std::array<int, 3>>& neighbours() const { return neighbours_; }
    double area() const { return area_; }
    const Vec3& faceNormal(int triangle) const { return faceNormals_[size_t(triangle)]; }
    double faceArea(int triangle) const { return faceAreas_[size_t(triangle)]; }

    /// Closest point of the surface; where `facing` is given, among triangles whose normal has a positive component
    /// along it (so that the other side of a thin wall is not taken), unless there is none. O(log triangles).
    SurfacePoint closest(const Vec3& p, const Vec3* facing = nullptr) const;
    /// A point of a triangle, with its interpolated normal.
    SurfacePoint pointOn(int triangle, const Vec3& position) const;
    /// The point reached by walking straight ahead, over edges as if both triangles were unfolded (K. Polthier and M.
    /// Schmies, Straightest geodesics on polyhedral surfaces, 1998), and along boundaries. O(triangles crossed).
    /// @param step its part along the surface counts
    SurfacePoint walked(const SurfacePoint& from, const Vec3& step) const;
    /// Points spread by area, or by density * area, each in a stratum of its own.
    /// @param density one value for each triangle, or empty
    std::vector<SurfacePoint> sample(size_t count, Rng& rng, const std::vector<double>& density = {}) const;

  private:
    Vec3 normalAt(int triangle, const Vec3& weights) const;
    struct Index;
    void makeIndex() const;
    TriangleMesh mesh_;
    std::vector<Vec3> vertexNormals_, faceNormals_;
    std::vector<std::array<int, 3>> neighbours_;
    std::vector<double> faceAreas_;
    double area_ = 0;
    std::unique_ptr<Index> index_;
};

/// Splits edges at their middles until `isLong` holds for none (of either direction); same surface.
void subdivideEdges(TriangleMesh& mesh, const std::function<bool(const Vec3& a, const Vec3& b)>& isLong);
/// The same for edges longer than a length.
void subdivideLongEdges(TriangleMesh& mesh, double longest);

}  // namespace pavel
