#include "pavel/vdb/extract.h"

#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/parallel_for.h>

#include "pavel/core/error.h"
#include "pavel/vdb/level_set_mesh.h"
#include "pavel/vdb/packed_grids.h"

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

}  // namespace

TriangleMesh levelSetMesh(const openvdb::FloatGrid& grid, double scale, double adaptivity) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, adaptivity, true);
    TriangleMesh mesh;
    mesh.points.resize(points.size());
    for (size_t i = 0; i < points.size(); ++i) mesh.points[i] = scale * Vec3(points[i][0], points[i][1], points[i][2]);
    mesh.triangles.reserve(triangles.size() + 2 * quads.size());
    for (const auto& t : triangles) mesh.triangles.push_back({int(t[0]), int(t[1]), int(t[2])});
    for (const auto& q : quads) {
        const auto gap = [&](int a, int b) { return length(mesh.points[q[a]] - mesh.points[q[b]]); };
        if (gap(0, 2) <= gap(1, 3)) {
            mesh.triangles.push_back({int(q[0]), int(q[1]), int(q[2])});
            mesh.triangles.push_back({int(q[0]), int(q[2]), int(q[3])});
        } else {
            mesh.triangles.push_back({int(q[0]), int(q[1]), int(q[3])});
            mesh.triangles.push_back({int(q[1]), int(q[2]), int(q[3])});
        }
    }
    // OpenVDB winds the polygons of level sets inward, and those of other grids outward.
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

TriangleMesh extractElement(const Packing& packing, int id, double adaptivity) {
    const WorkTree::Ptr& tree = packing.grids->elements[size_t(id) - 1];
    return tree ? levelSetMesh(*toFloatGrid(*tree), packing.voxelSize, adaptivity) : TriangleMesh{};
}

TriangleMesh extractBase(const Packing& packing, double adaptivity) {
    return levelSetMesh(*openvdb::FloatGrid::create(packing.grids->base), packing.voxelSize, adaptivity);
}

LabelledMesh extractFused(const Packing& packing, bool withBase, double adaptivity) {
    const PackedGrids& grids = *packing.grids;
    if (withBase && !grids.solid) throw RunError("the solid with the base was not asked for when packing");
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
    return out;
}

}  // namespace pavel
