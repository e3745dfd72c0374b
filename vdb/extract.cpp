#include "pavel/vdb/extract.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <array>
#include <cstring>
#include <map>
#include <numeric>

#include "pavel/core/error.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/packed_grids.h"
#include "pavel/vdb/seam_vertices.h"

namespace pavel {
namespace {

using IdReader = openvdb::tree::ValueAccessor<const openvdb::Int32Tree, false>;

Coord nearestVoxel(const Vec3& p) {
    return {int(std::lround(p[0])), int(std::lround(p[1])), int(std::lround(p[2]))};
}

/// Id of the nearest decorated voxel within two voxels; 0 where there is none (in a filled slit, say).
int nearestId(const IdReader& ids, const Coord& c) {
    int best = 0, least = 13;
    for (int x = -2; x <= 2; ++x)
        for (int y = -2; y <= 2; ++y)
            for (int z = -2; z <= 2; ++z) {
                const int d = x * x + y * y + z * z, id = ids.getValue(c.offsetBy(x, y, z));
                if (id && d < least) least = d, best = id;
            }
    return best;
}

/// Vertices that fall on one point would be joined by programs that weld, into edges of four triangles: each goes a
/// thousandth of the way to its neighbours.
void separateTwins(TriangleMesh& mesh) {
    // Those with equal keys come to stand together; keys are at hand where places would have to be fetched.
    struct Vertex {
        uint64_t key;
        int number;
        bool operator<(const Vertex& o) const { return key != o.key ? key < o.key : number < o.number; }
    };
    using Place = std::array<float, 3>;
    const auto at = [&](const Vertex& v) {
        const Vec3& p = mesh.points[size_t(v.number)];
        return Place{float(p[0]) + 0.f, float(p[1]) + 0.f, float(p[2]) + 0.f};  // no negative zeros
    };
    std::vector<Vertex> order(mesh.points.size());
    tbb::parallel_for(size_t(0), order.size(), [&](size_t i) {
        order[i].number = int(i);
        order[i].key = 0;
        for (const float x : at(order[i])) {
            uint32_t bits;
            std::memcpy(&bits, &x, sizeof bits);
            order[i].key = (order[i].key ^ bits) * 0x9E3779B97F4A7C15ull;
        }
    });
    tbb::parallel_sort(order.begin(), order.end());
    std::map<int, std::pair<Vec3, double>> twins;  // sum and number of neighbours
    for (size_t i = 0; i < order.size(); ++i)
        for (size_t j = i + 1; j < order.size() && order[j].key == order[i].key; ++j)
            if (at(order[i]) == at(order[j]))
                for (size_t k : {i, j}) twins.emplace(order[k].number, std::make_pair(Vec3(0, 0, 0), 0.0));
    if (twins.empty()) return;
    for (const Triangle& t : mesh.triangles)
        for (size_t k = 0; k < 3; ++k)
            if (const auto twin = twins.find(t[k]); twin != twins.end()) {
                twin->second.first += mesh.points[size_t(t[(k + 1) % 3])] + mesh.points[size_t(t[(k + 2) % 3])];
                twin->second.second += 2;
            }
    for (const auto& [v, sum] : twins)
        if (sum.second > 0) mesh.points[size_t(v)] += 1e-3 * (sum.first / sum.second - mesh.points[size_t(v)]);
}

}  // namespace

TriangleMesh levelSetMesh(const openvdb::FloatGrid& grid, double scale, double adaptivity) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, adaptivity, true);
    constexpr size_t kChunk = 1 << 16;
    const auto inChunks = [](size_t n, const auto& f) {
        tbb::parallel_for(tbb::blocked_range<size_t>(0, n, kChunk), [&](const tbb::blocked_range<size_t>& r) {
            for (size_t i = r.begin(); i < r.end(); ++i) f(i);
        });
    };
    TriangleMesh mesh;
    mesh.points.resize(points.size());
    inChunks(points.size(), [&](size_t i) { mesh.points[i] = scale * Vec3(points[i][0], points[i][1], points[i][2]); });
    points = {};
    mesh.triangles.resize(triangles.size() + 2 * quads.size());
    for (size_t i = 0; i < triangles.size(); ++i)
        mesh.triangles[i] = {int(triangles[i][0]), int(triangles[i][1]), int(triangles[i][2])};
    inChunks(quads.size(), [&](size_t i) {
        const auto& q = quads[i];
        const auto gap = [&](int a, int b) { return length(mesh.points[q[a]] - mesh.points[q[b]]); };
        const bool alongFirst = gap(0, 2) <= gap(1, 3);
        Triangle* two = &mesh.triangles[triangles.size() + 2 * i];
        two[0] = {int(q[0]), int(q[1]), int(q[alongFirst ? 2 : 3])};
        two[1] = {int(q[alongFirst ? 0 : 1]), int(q[2]), int(q[3])};
    });
    // OpenVDB winds the polygons of level sets inward, and those of other grids outward.
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET)
        inChunks(mesh.triangles.size(), [&](size_t t) { std::swap(mesh.triangles[t][1], mesh.triangles[t][2]); });
    quads = {};
    separateTwins(mesh);
    return mesh;
}

TriangleMesh extractElement(const Packing& packing, int id, double adaptivity) {
    const WorkTree::Ptr tree = packing.grids->elements[size_t(id) - 1].tree();
    return tree ? levelSetMesh(*toFloatGrid(*tree), packing.voxelSize, adaptivity) : TriangleMesh{};
}

TriangleMesh extractBase(const Packing& packing, double adaptivity) {
    return levelSetMesh(*openvdb::FloatGrid::create(packing.grids->base), packing.voxelSize, adaptivity);
}

uint64_t surfaceVoxels(const Packing& packing, int id) {
    if (id == 0) return packing.grids->base->activeVoxelCount();
    return packing.grids->elements[size_t(id) - 1].activeVoxels();
}

namespace {

void requireElements(const Packing& packing) {
    if (packing.grids->elements.size() != packing.elements.size())
        throw RunError("the elements were dropped: they tell whose the fused mesh is at its seams");
}

}  // namespace

LabelledMesh extractFused(const Packing& packing, bool withBase, double adaptivity) {
    const PackedGrids& grids = *packing.grids;
    if (withBase && !grids.solid) throw RunError("the solid with the base was not asked for when packing");
    requireElements(packing);
    LabelledMesh out;
    out.mesh = levelSetMesh(*openvdb::FloatGrid::create(withBase ? grids.solid : grids.surface), packing.voxelSize,
                            adaptivity);
    out.ids.resize(out.mesh.triangles.size());
    tbb::parallel_for(size_t(0), (out.ids.size() + 4095) / 4096, [&](size_t chunk) {
        const IdReader ids(*grids.ids);
        const BaseReader base(*grids.base);
        for (size_t t = chunk * 4096; t < std::min(out.ids.size(), (chunk + 1) * 4096); ++t) {
            const Vec3 centre =
                (out.mesh.corner(t, 0) + out.mesh.corner(t, 1) + out.mesh.corner(t, 2)) / (3 * packing.voxelSize);
            const Vec3 inward = -triangleNormal(out.mesh, t);
            for (double depth : {0.6, 1.2, 0.0, 1.8}) {
                const Vec3 p = centre + depth * inward;
                out.ids[t] = ids.getValue(nearestVoxel(p));
                if (out.ids[t]) break;
            }
            if (!out.ids[t] && base.getValue(nearestVoxel(centre)) > 1)
                out.ids[t] = nearestId(ids, nearestVoxel(centre));
        }
    });
    out.seams = seamVertices(grids, packing.voxelSize, withBase, out.mesh, out.ids);
    return out;
}

std::vector<SeamVertex> vertexOwners(const Packing& packing, bool withBase, const TriangleMesh& mesh) {
    requireElements(packing);
    std::vector<int> all(mesh.points.size());
    std::iota(all.begin(), all.end(), 0);
    return ownersOf(*packing.grids, packing.voxelSize, withBase, mesh, all);
}

void dropSolid(Packing& packing) {
    packing.grids->solid.reset();
}

void dropElements(Packing& packing) {
    packing.grids->elements.clear();
}

}  // namespace pavel
