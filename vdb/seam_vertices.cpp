#include "pavel/vdb/seam_vertices.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "pavel/vdb/element_index.h"

namespace pavel {
namespace {

/// Vertices whose triangles have different labels, and some rings of vertices around them.
std::vector<int> verticesAtBorders(const TriangleMesh& mesh, const std::vector<int>& ids) {
    // Edges are about a voxel long, labels are off by up to two, and blends reach a voxel or two on from there.
    constexpr uint8_t kRings = 4;
    std::vector<int> label(mesh.points.size(), -1);
    std::vector<uint8_t> ring(mesh.points.size(), 0);  // 1: at a border; 0: not reached
    for (size_t t = 0; t < ids.size(); ++t)
        for (const int v : mesh.triangles[t]) {
            int& known = label[size_t(v)];
            if (known < 0) known = ids[t];
            if (known != ids[t]) ring[size_t(v)] = 1;
        }
    for (uint8_t r = 1; r <= kRings; ++r)
        for (const Triangle& t : mesh.triangles) {
            const auto at = [&](size_t k) -> uint8_t& { return ring[size_t(t[k])]; };
            if (at(0) != r && at(1) != r && at(2) != r) continue;
            for (size_t k = 0; k < 3; ++k)
                if (at(k) == 0) at(k) = uint8_t(r + 1);
        }
    std::vector<int> found;
    for (size_t v = 0; v < ring.size(); ++v)
        if (ring[v]) found.push_back(int(v));
    return found;
}

/// The two that are nearest to a point.
struct Nearest {
    int id[2] = {-1, -1};
    double distance[2] = {kResultBand, kResultBand};
    void add(int of, double d) {
        if (d >= distance[1]) return;
        const bool first = d < distance[0];
        if (first) id[1] = id[0], distance[1] = distance[0];
        id[first ? 0 : 1] = of, distance[first ? 0 : 1] = d;
    }
};

}  // namespace

std::vector<SeamVertex> seamVertices(const PackedGrids& grids, double h, bool withBase, const TriangleMesh& mesh,
                                     const std::vector<int>& ids) {
    return ownersOf(grids, h, withBase, mesh, verticesAtBorders(mesh, ids));
}

std::vector<SeamVertex> ownersOf(const PackedGrids& grids, double h, bool withBase, const TriangleMesh& mesh,
                                 const std::vector<int>& vertices) {
    // Differences grow by one to two a voxel, where surfaces meet at an angle: less would leave steps from vertex to
    // vertex.
    constexpr double kWide = 1;
    constexpr size_t kChunk = 4096;
    std::vector<const CompactLevelSet*> elements;
    for (const CompactLevelSet& e : grids.elements) elements.push_back(&e);
    const ElementIndex index(boxesOf(elements));
    std::vector<SeamVertex> seams(vertices.size());
    tbb::parallel_for(size_t(0), (vertices.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
        const BaseReader base(*grids.base);
        Coord block(Coord::max());
        std::vector<int> near;  // of the block
        for (size_t k = chunk * kChunk; k < std::min(vertices.size(), (chunk + 1) * kChunk); ++k) {
            const Vec3 p = mesh.points[size_t(vertices[k])] / h;
            const Coord voxel(int(std::lround(p[0])), int(std::lround(p[1])), int(std::lround(p[2])));
            if (leafOrigin(voxel) != block) {
                block = leafOrigin(voxel);
                near = index.meeting(CoordBBox(block, block.offsetBy(7)));
            }
            Nearest nearest;
            for (const int i : near)
                if (elements[size_t(i)]->getValue(voxel) < kResultBand)
                    nearest.add(i + 1, sampleAt(*elements[size_t(i)], p));
            if (withBase) nearest.add(0, sampleAt(base, p));
            const double apart = nearest.distance[1] - nearest.distance[0];
            seams[k] = {vertices[k], nearest.id[0], nearest.id[1], float(std::max(0.0, 0.5 - apart / (2 * kWide)))};
        }
    });
    const auto isFar = [](const SeamVertex& s) { return s.id < 0; };
    seams.erase(std::remove_if(seams.begin(), seams.end(), isFar), seams.end());
    for (SeamVertex& s : seams)
        if (s.other < 0) s.other = s.id, s.share = 0;
    return seams;
}

}  // namespace pavel
