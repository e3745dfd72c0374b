#include "pavel/seeding/simplify.h"

#include <meshoptimizer.h>

namespace pavel {

TriangleMesh simplified(const TriangleMesh& mesh, size_t triangles) {
    TriangleMesh result;
    result.points = mesh.points;
    result.triangles = mesh.triangles;
    if (mesh.triangles.size() <= triangles) return result;
    std::vector<unsigned> indices;
    indices.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (int v : t) indices.push_back(unsigned(v));
    std::vector<float> points;
    points.reserve(3 * mesh.points.size());
    for (const Vec3& p : mesh.points) points.insert(points.end(), {float(p[0]), float(p[1]), float(p[2])});
    constexpr float kError = 0.02f;
    std::vector<unsigned> kept(indices.size());
    kept.resize(meshopt_simplify(kept.data(), indices.data(), indices.size(), points.data(), mesh.points.size(),
                                 3 * sizeof(float), 3 * triangles, kError));
    result.triangles.clear();
    for (size_t i = 0; i + 2 < kept.size(); i += 3)
        result.triangles.push_back({int(kept[i]), int(kept[i + 1]), int(kept[i + 2])});
    removeUnusedVertices(result);
    return result;
}

}  // namespace pavel
