#pragma once
// Drawing triangles into depth buffers.
#include <cstdint>
#include <optional>
#include <vector>

#include "pavel/io/mesh_write.h"

namespace pavel {

struct Camera {
    Vec3 right, up, back;  // orthonormal; the camera looks along -back
    Vec3 eye;
    double focal = 0;  // pixels; 0: orthographic with `scale` pixels per unit
    double scale = 1, cx = 0, cy = 0;

    /// Pixel coordinates and depth (larger is farther).
    Vec3 project(const Vec3& p) const {
        const Vec3 d = p - eye;
        const double depth = -dot(d, back), s = focal > 0 ? focal / depth : scale;
        return {cx + s * dot(d, right), cy - s * dot(d, up), depth};
    }
    /// Of a perspective camera: where the line of sight through a pixel is at depth 1, from the eye.
    Vec3 ray(double x, double y) const { return ((x - cx) / focal) * right - ((y - cy) / focal) * up - back; }
};

/// Looking against `back`, z up where that can be.
Camera orthonormalCamera(const Vec3& back);

/// Everything with dot(p, normal) > offset is taken away.
struct CutPlane {
    Vec3 normal{0, 0, 1};
    double offset = 0;
    /// Fronts are drawn by so much farther away: where things touch, the back of what is cut open shows, not the
    /// other's front.
    double bias = 0;
    double beyond(const Vec3& p) const { return dot(p, normal) - offset; }
};

/// For each pixel the depth and the running number of the triangle that is seen; -1: none.
struct Raster {
    Raster(int w, int h) : width(w), height(h), depth(size_t(w) * size_t(h), 1e30f), item(depth.size(), -1) {}
    int width, height;
    std::vector<float> depth;
    std::vector<int64_t> item;
    size_t at(int x, int y) const { return size_t(y) * size_t(width) + size_t(x); }
    /// Barycentric weights of a pixel in a projected triangle.
    static void weights(const Vec3 (&p)[3], double x, double y, double (&w)[3]);
};

/// Objects to be drawn from several cameras. Projects corners as they are asked for: where there are millions, a list
/// of all would take as much memory as the meshes.
class Stage {
  public:
    explicit Stage(const std::vector<MeshObject>& objects);
    /// Object and triangle of a running number.
    std::pair<size_t, size_t> locate(int64_t id) const;
    void draw(const Camera& camera, Raster& raster, const std::optional<CutPlane>& cut) const;
    /// Makes the normals at the corners of all triangles that are seen.
    void makeNormals(const Raster& raster);
    const Vec3& normal(size_t object, size_t vertex) const { return normals_[object][places_[object][vertex]]; }

    const std::vector<MeshObject>& objects;

  private:
    /// Triangles whose rows are kept together: meshes come in order of place, so most bands skip most runs.
    static constexpr size_t kRun = 1024;
    static constexpr uint32_t kUnseen = ~uint32_t(0);
    std::vector<int64_t> first_;                 // running number of each object's first triangle
    std::vector<std::vector<uint32_t>> places_;  // of a vertex among the normals
    std::vector<std::vector<Vec3>> normals_;
};

}  // namespace pavel
