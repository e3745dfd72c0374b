#include "pavel/vdb/voxelize.h"

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>

#include "pavel/core/error.h"

namespace pavel {
namespace {

Vec3 solidCentroid(const TriangleMesh& mesh) {
    Vec3 sum(0, 0, 0);
    double volume = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 a = mesh.corner(t, 0), b = mesh.corner(t, 1), c = mesh.corner(t, 2);
        const double v = dot(a, cross(b, c));
        volume += v;
        sum += v * (a + b + c) / 4.0;
    }
    return sum / volume;
}

void markBlocks(const Vec3& centre, double radius, std::vector<Coord>& blocks) {
    const auto lo = [&](int k) { return int(std::floor(centre[k] - radius)) & ~7; };
    const auto hi = [&](int k) { return int(std::ceil(centre[k] + radius)); };
    for (int x = lo(0); x <= hi(0); x += 8)
        for (int y = lo(1); y <= hi(1); y += 8)
            for (int z = lo(2); z <= hi(2); z += 8) {
                const Vec3 nearest(std::clamp(centre[0], double(x), x + 7.0), std::clamp(centre[1], double(y), y + 7.0),
                                   std::clamp(centre[2], double(z), z + 7.0));
                if (length(nearest - centre) <= radius) blocks.emplace_back(x, y, z);
            }
}

}  // namespace

openvdb::FloatGrid::Ptr meshToLevelSet(const TriangleMesh& mesh, double voxelSize, float halfWidth) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    points.reserve(mesh.points.size());
    for (const Vec3& p : mesh.points) points.emplace_back(toVdb(p / voxelSize));
    triangles.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
    auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        adapter, *openvdb::math::Transform::createLinearTransform(1.0), halfWidth, halfWidth);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

CanonicalField makeCanonicalField(const TriangleMesh& mesh, double voxelSize, double scaleMin, double scaleMax) {
    CanonicalField f;
    f.voxelSize = 0.8 * voxelSize / scaleMax;
    // The band must still reach kBand voxels of the scene under the smallest scale, a cell's diagonal included.
    const float band = float(std::ceil((kBand + 0.5) * voxelSize / scaleMin / f.voxelSize)) + 2;
    f.grid = meshToLevelSet(mesh, f.voxelSize, band);
    if (f.grid->activeVoxelCount() == 0) throw RunError("an element's mesh left no voxels");
    f.centroid = solidCentroid(mesh);
    f.bounds = meshBounds(mesh);
    return f;
}

WorkTree::Ptr voxelizePlacement(const CanonicalField& field, const Frame& indexFromElement) {
    const double toIndex = field.voxelSize * indexFromElement.scale;  // canonical voxels -> voxels
    std::vector<Coord> blocks;
    for (auto leaf = field.grid->tree().cbeginLeaf(); leaf; ++leaf) {
        const Vec3 centre = (centreOf(leaf->origin()) + Vec3(3.5, 3.5, 3.5)) * field.voxelSize;
        markBlocks(indexFromElement.apply(centre), 3.5 * std::sqrt(3.0) * toIndex, blocks);
    }
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());

    auto tree = std::make_shared<WorkTree>(kBand);
    const BaseReader reader(field.grid->tree());
    // canonical = origin + step * (i, j, k): the inverse placement is linear
    const double inv = 1 / toIndex;
    const Vec3 dx = Vec3(indexFromElement.x[0], indexFromElement.y[0], indexFromElement.z[0]) * inv,
               dy = Vec3(indexFromElement.x[1], indexFromElement.y[1], indexFromElement.z[1]) * inv,
               dz = Vec3(indexFromElement.x[2], indexFromElement.y[2], indexFromElement.z[2]) * inv;
    float values[WorkLeaf::SIZE];
    for (const Coord& origin : blocks) {
        const Vec3 start = indexFromElement.applyInverse(centreOf(origin)) / field.voxelSize;
        bool near = false;
        int n = 0;
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j) {
                Vec3 p = start + double(i) * dx + double(j) * dy;
                for (int k = 0; k < 8; ++k, p += dz) {
                    const float v = std::clamp(float(sampleAt(reader, p) * toIndex), -kBand, kBand);
                    near |= std::abs(v) < kBand;
                    values[n++] = v;
                }
            }
        if (!near) continue;
        WorkLeaf* leaf = tree->touchLeaf(origin);
        for (openvdb::Index v = 0; v < WorkLeaf::SIZE; ++v) leaf->setValueOnly(v, values[v]);
        leaf->setValuesOn();  // the flood fill below must not touch a sign
    }
    openvdb::tools::signedFloodFillWithValues(*tree, kBand, -kBand);
    return tree;
}

openvdb::FloatGrid::Ptr voxelizeBase(const TriangleMesh& mesh, double voxelSize) {
    return meshToLevelSet(mesh, voxelSize, kBand);
}

}  // namespace pavel
