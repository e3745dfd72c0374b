#include <cstdio>

#include "pavel/core/mesh_check.h"
#include "pavel/io/mesh_read.h"
#include "pavel/io/scene_json.h"
#include "pavel/io/vdb_file.h"
#include "pavel/tools/commands.h"

namespace pavel {
namespace {

bool endsWith(const std::string& s, const std::string& e) {
    return s.size() >= e.size() && s.compare(s.size() - e.size(), e.size(), e) == 0;
}

void printBounds(const Bounds& b) {
    std::printf("  bounds     (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)\n", b.min[0], b.min[1], b.min[2], b.max[0],
                b.max[1], b.max[2]);
}

void meshInfo(const std::string& path) {
    const MeshFacts f = meshFacts(readMesh(path));
    std::printf("%s: mesh, %zu vertices, %zu triangles, %zu components, %s\n", path.c_str(), f.vertices, f.triangles,
                f.components,
                f.fit()      ? "a closed solid"
                : f.closed() ? "closed, but not consistently oriented outward"
                             : "not closed");
    printBounds(f.bounds);
    std::printf("  area       %.6g\n  volume     %.6g\n  Euler      %ld\n", f.area, f.volume, f.euler);
    std::printf(
        "  defects    %zu boundary edges, %zu non-manifold edges, %zu misoriented edges, %zu degenerate triangles, %zu "
        "unused and %zu doubled vertices\n",
        f.boundaryEdges, f.nonManifoldEdges, f.misorientedEdges, f.degenerateTriangles, f.unusedVertices,
        f.doubledVertices);
}

}  // namespace

void commandInfo(const std::vector<std::string>& files, const CommonOptions&) {
    for (const std::string& path : files) {
        if (endsWith(path, ".vdb")) {
            for (const VdbGridInfo& g : vdbInfo(path)) {
                std::printf("%s: %s, %s, %s, voxel %.6g, %llu active voxels, %.1f MB in memory\n", path.c_str(),
                            g.name.c_str(), g.type.c_str(), g.gridClass.c_str(), g.voxelSize,
                            (unsigned long long)g.activeVoxels, double(g.bytes) / 1e6);
                if (g.activeVoxels) printBounds(g.bounds);
            }
        } else if (endsWith(path, "seeds.json")) {
            Bounds b;
            const auto seeds = readSeeds(path, "mm");
            for (const PlacementOptions& p : seeds) b.add(p.position);
            std::printf("%s: %zu seeds (lengths in mm)\n", path.c_str(), seeds.size());
            if (!seeds.empty()) printBounds(b);
        } else if (endsWith(path, ".json")) {
            const Scene s = readScene(path);
            std::printf("%s: scene, base %s, %zu kinds of element, seeding by %s, units %s\n", path.c_str(),
                        s.base.shape.empty() ? s.base.mesh.c_str() : s.base.shape.c_str(), s.elements.size(),
                        s.seedings[0].method.c_str(), s.units.c_str());
        } else {
            meshInfo(path);
        }
    }
}

}  // namespace pavel
