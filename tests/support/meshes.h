#pragma once
// Meshes and helpers that several tests share.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "pavel/core/mesh.h"
#include "pavel/core/shape_kit.h"

namespace pavel::test {

/// Path of a mesh from the development set, or empty where the set is missing (the test then skips).
inline std::string developmentMesh(const std::string& name) {
    const std::string path = std::string(PAVEL_TEST_MESHES) + "/" + name;
    return std::filesystem::exists(path) ? path : "";
}

#define PAVEL_NEED_MESH(variable, name)                              \
    const std::string variable = pavel::test::developmentMesh(name); \
    if (variable.empty()) GTEST_SKIP() << name << " is not at hand (" PAVEL_TEST_MESHES ")"

inline TriangleMesh sphere(double radius, const Vec3& centre = Vec3(0, 0, 0), int rows = 96) {
    return sweepPoles(rows, 2 * rows, [&](double u, double v) {
        const double t = kPi * u, f = 2 * kPi * v;
        return centre + radius * Vec3(std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t));
    });
}

/// A flat square [0, side]^2 of n x n cells, facing +z.
inline TriangleMesh square(double side, int n) {
    TriangleMesh m;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) m.points.emplace_back(side * i / n, side * j / n, 0);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const int a = i * (n + 1) + j, b = a + n + 1;
            m.triangles.push_back({a, b, b + 1});
            m.triangles.push_back({a, b + 1, a + 1});
        }
    return m;
}

/// Around the z axis; `around` quads along the ring.
inline TriangleMesh torus(double major, double minor, int around = 96) {
    TriangleMesh m;
    const int n = around, k = std::max(12, int(around * minor / major));
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < k; ++j) {
            const double u = 2 * kPi * i / n, v = 2 * kPi * j / k, r = major + minor * std::cos(v);
            m.points.emplace_back(r * std::cos(u), r * std::sin(u), minor * std::sin(v));
            const int a = i * k + j, b = (i + 1) % n * k + j, c = (i + 1) % n * k + (j + 1) % k,
                      d = i * k + (j + 1) % k;
            m.triangles.push_back({a, b, c});
            m.triangles.push_back({a, c, d});
        }
    return m;
}

inline TriangleMesh box(const Vec3& lo, const Vec3& hi) {
    TriangleMesh m;
    for (int i = 0; i < 8; ++i)
        m.points.emplace_back(i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]);
    m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return m;
}

/// A folder of its own that is removed at the end.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "pavel-test-XXXXXX").string();
        path_ = mkdtemp(name.data());
    }
    ~TemporaryFolder() { std::filesystem::remove_all(path_); }
    std::string operator/(const std::string& file) const { return (path_ / file).string(); }

  private:
    std::filesystem::path path_;
};

}  // namespace pavel::test
