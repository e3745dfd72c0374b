// Time and quality of remeshing.
//   pavel_remesh_benchmark MESH[:VERTICES]...      for instance decoration.ply:100000; default: a tenth of the input's
// Prints a table, then JSON. Smooth: triangles at whose corners the output bends by less than 25 degrees; six: share of
// vertices with six neighbours; distance: from 20,000 of the input's vertices to the output, in the input's mean edges.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pavel/core/error.h"
#include "pavel/core/mesh_check.h"
#include "pavel/core/run_context.h"
#include "pavel/io/mesh_read.h"
#include "pavel/seeding/remesh.h"
#include "pavel/seeding/surface.h"

namespace {

using json = nlohmann::ordered_json;
using namespace pavel;

double leastAngle(const TriangleMesh& mesh, size_t t) {
    double most = -1;
    for (int k = 0; k < 3; ++k) {
        const Vec3 p = mesh.corner(t, k);
        most = std::max(most,
                        dot(normalized(mesh.corner(t, (k + 1) % 3) - p), normalized(mesh.corner(t, (k + 2) % 3) - p)));
    }
    return std::acos(std::min(most, 1.0)) * 180 / kPi;
}

/// Cosine of the largest angle between a vertex's normal and its triangles'.
std::vector<double> bends(const TriangleMesh& mesh) {
    const std::vector<Vec3> normals = vertexNormals(mesh);
    std::vector<double> bend(mesh.points.size(), 1);
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int v : mesh.triangles[t])
            bend[size_t(v)] = std::min(bend[size_t(v)], dot(normals[size_t(v)], triangleNormal(mesh, t)));
    return bend;
}

json run(const std::string& path, size_t vertices) {
    const TriangleMesh mesh = readMesh(path);
    if (!vertices) vertices = mesh.points.size() / 10;
    RunContext context;
    TriangleMesh out;
    {
        const StageTimer timer(context, "remesh");
        out = remeshed(mesh, vertices).mesh;
    }
    const std::vector<double> bend = bends(out);
    std::vector<int> valence(out.points.size());
    double angles = 0, worst = 180;
    for (size_t t = 0; t < out.triangles.size(); ++t) {
        const double angle = leastAngle(out, t);
        angles += angle;
        bool smooth = true;
        for (int v : out.triangles[t]) ++valence[size_t(v)], smooth &= bend[size_t(v)] > std::cos(degreesToRadians(25));
        if (smooth) worst = std::min(worst, angle);
    }
    const Surface surface(out);
    const double edge = std::sqrt(meshArea(mesh) / double(mesh.points.size()) * 2 / std::sqrt(3.0));
    double sum = 0, farthest = 0;
    const size_t step = mesh.points.size() / 20000 + 1;
    size_t count = 0;
    for (size_t v = 0; v < mesh.points.size(); v += step, ++count) {
        const double d = surface.closest(mesh.points[v]).distance;
        sum += d, farthest = std::max(farthest, d);
    }
    const MeshFacts before = meshFacts(mesh), after = meshFacts(out);
    return {{"mesh", path},
            {"triangles_before", mesh.triangles.size()},
            {"triangles", out.triangles.size()},
            {"seconds", context.stages[0].seconds},
            {"cpu_seconds", context.stages[0].cpuSeconds},
            {"peak_rss_bytes", peakResidentBytes()},
            {"mean_least_angle", angles / double(out.triangles.size())},
            {"least_angle_smooth", worst},
            {"six", double(std::count(valence.begin(), valence.end(), 6)) / double(valence.size())},
            {"mean_distance", sum / double(count) / edge},
            {"largest_distance", farthest / edge},
            {"topology_kept", before.euler == after.euler && before.components == after.components},
            {"open_or_non_manifold_edges", after.boundaryEdges + after.nonManifoldEdges}};
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: pavel_remesh_benchmark MESH[:VERTICES]...\n");
        return 2;
    }
    try {
        json all = json::array();
        std::printf("%-32s %10s %9s %7s %7s %6s %6s %5s %9s %8s\n", "mesh", "triangles", "to", "seconds", "CPU",
                    "angle", "worst", "six", "distance", "largest");
        for (int i = 1; i < argc; ++i) {
            std::string path = argv[i];
            size_t vertices = 0;
            if (const size_t colon = path.rfind(':'); colon != std::string::npos) {
                vertices = size_t(std::atoll(path.c_str() + colon + 1));
                path.resize(colon);
            }
            const json r = run(path, vertices);
            std::printf("%-32s %10zu %9zu %7.1f %7.1f %6.1f %6.1f %5.2f %9.4f %8.2f\n",
                        path.size() > 32 ? path.c_str() + path.size() - 32 : path.c_str(),
                        size_t(r["triangles_before"]), size_t(r["triangles"]), double(r["seconds"]),
                        double(r["cpu_seconds"]), double(r["mean_least_angle"]), double(r["least_angle_smooth"]),
                        double(r["six"]), double(r["mean_distance"]), double(r["largest_distance"]));
            all.push_back(r);
        }
        std::printf("%s\n", all.dump(1).c_str());
    } catch (const Error& e) {
        std::fprintf(stderr, "pavel_remesh_benchmark: %s\n", e.what());
        return e.exitStatus();
    }
    return 0;
}
