#include "pavel/vdb/voxelize.h"

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>

#include "pavel/core/error.h"
#include "pavel/vdb/mesh_band.h"
#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

openvdb::FloatGrid::Ptr meshToLevelSet(const TriangleMesh& mesh, double voxelSize, float outside, float inside) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    points.reserve(mesh.points.size());
    for (const Vec3& p : mesh.points) points.emplace_back(toVdb(p / voxelSize));
    triangles.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
    auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        adapter, *openvdb::math::Transform::createLinearTransform(1.0), outside, inside);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

Vec3 solidCentroid(const TriangleMesh& mesh, double& volume) {
    Vec3 sum(0, 0, 0);
    volume = 0;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 a = mesh.corner(t, 0), b = mesh.corner(t, 1), c = mesh.corner(t, 2);
        const double v = dot(a, cross(b, c));
        volume += v;
        sum += v * (a + b + c) / 4.0;
    }
    const Vec3 centroid = sum / volume;
    volume /= 6;
    return centroid;
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

/// No voxel of an eighth of a block is farther from its middle: 1.5 sqrt(3).
constexpr double kPartRadius = 2.6;

/// Copies a level set's leaves, each with the first layer of the leaves after it.
/// @param near values that a placement may need; a block without any of them, and of one sign, has none between either
void layOut(const openvdb::FloatTree& tree, float outside, float inside, float near, CanonicalField& f) {
    CoordBBox box;
    tree.evalLeafBoundingBox(box);
    f.lower = leafOrigin(box.min()).offsetBy(-8);
    const Coord upper = leafOrigin(box.max());
    for (int k = 0; k < 3; ++k) f.count[k] = (upper[k] - f.lower[k]) / 8 + 1;
    f.block.assign(size_t(f.count[0]) * size_t(f.count[1]) * size_t(f.count[2]), 0);
    f.values.assign(2 * CanonicalField::kCorners, outside);
    std::fill(f.values.begin() + CanonicalField::kCorners, f.values.end(), -inside);
    const BaseReader reader(tree);
    size_t cell = 0;
    for (int x = 0; x < f.count[0]; ++x)
        for (int y = 0; y < f.count[1]; ++y)
            for (int z = 0; z < f.count[2]; ++z, ++cell) {
                const Coord origin = f.lower.offsetBy(8 * x, 8 * y, 8 * z);
                bool any = false;
                for (int n = 0; n < 8 && !any; ++n)
                    any = reader.probeConstLeaf(origin.offsetBy(n & 4 ? 8 : 0, n & 2 ? 8 : 0, n & 1 ? 8 : 0));
                if (!any) {
                    f.block[cell] = reader.getValue(origin) < 0 ? 1 : 0;
                    continue;
                }
                f.block[cell] = int(f.values.size() / CanonicalField::kCorners);
                for (int i = 0; i < 9; ++i)
                    for (int j = 0; j < 9; ++j)
                        for (int k = 0; k < 9; ++k) f.values.push_back(reader.getValue(origin.offsetBy(i, j, k)));
                const auto ends = std::minmax_element(f.values.end() - CanonicalField::kCorners, f.values.end());
                const float least = *ends.first, most = *ends.second;
                if (least < near && most > -near) f.origins.push_back(origin);
            }
}

Vec3f toFloat(const Vec3& v) {
    return {float(v[0]), float(v[1]), float(v[2])};
}

/// Trilinear samples on 8 x 8 places start + y dy + z dz, in canonical voxels from `lower`.
PAVEL_WIDE void sampleSlab(const CanonicalField& f, const float start[3], const float dy[3], const float dz[3],
                           float* out) {
    constexpr int kCorner[8] = {0, 1, 9, 10, 81, 82, 90, 91};
    float u[64], v[64], w[64], c[8][64];
    int ix[64], iy[64], iz[64];
    for (int y = 0, n = 0; y < 8; ++y) {
        const float fromX = start[0] + float(y) * dy[0], fromY = start[1] + float(y) * dy[1],
                    fromZ = start[2] + float(y) * dy[2];
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z, ++n) {
            const float px = fromX + float(z) * dz[0], py = fromY + float(z) * dz[1], pz = fromZ + float(z) * dz[2];
            ix[n] = int(px), iy[n] = int(py), iz[n] = int(pz);
            u[n] = px - float(ix[n]), v[n] = py - float(iy[n]), w[n] = pz - float(iz[n]);
        }
    }
    bool within = true;
    for (int k = 0; k < 3; ++k)
        for (int corner = 0; corner < 4; ++corner) {
            const float x = start[k] + float(corner & 2 ? 7 : 0) * dy[k] + float(corner & 1 ? 7 : 0) * dz[k];
            within &= x >= 0 && x < 8.f * float(f.count[k]);
        }
    for (int n = 0; n < 64; ++n) {
        const int bx = ix[n] >> 3, by = iy[n] >> 3, bz = iz[n] >> 3;
        size_t block = 0;
        if (within || (ix[n] >= 0 && iy[n] >= 0 && iz[n] >= 0 && bx < f.count[0] && by < f.count[1] && bz < f.count[2]))
            block = size_t(f.block[size_t((bx * f.count[1] + by) * f.count[2] + bz)]);
        const float* at =
            f.values.data() + block * CanonicalField::kCorners + (ix[n] & 7) * 81 + (iy[n] & 7) * 9 + (iz[n] & 7);
        for (int k = 0; k < 8; ++k) c[k][n] = at[kCorner[k]];
    }
    for (int n = 0; n < 64; ++n) {
        const float a = c[0][n] + (c[1][n] - c[0][n]) * w[n], b = c[2][n] + (c[3][n] - c[2][n]) * w[n],
                    d = c[4][n] + (c[5][n] - c[4][n]) * w[n], e = c[6][n] + (c[7][n] - c[6][n]) * w[n];
        const float g = a + (b - a) * v[n], h = d + (e - d) * v[n];
        out[n] = g + (h - g) * u[n];
    }
}

/// To voxels, within the band. Does any value lie inside it?
PAVEL_WIDE bool scaledToBand(float scale, float* values) {
    int near = 0;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float scaled = values[v] * scale, above = scaled > -kBand ? scaled : -kBand;
        near += int((above > -kBand) & (above < kBand));
        values[v] = above < kBand ? above : kBand;
    }
    return near > 0;
}

}  // namespace

openvdb::FloatGrid::Ptr narrowBand(const TriangleMesh& mesh, double voxelSize, float halfWidth) {
    // In wide bands a triangle would meet too many voxels.
    constexpr float kNarrow = 6;
    if (halfWidth <= kNarrow) {
        TriangleMesh inVoxels;
        inVoxels.triangles = mesh.triangles;
        for (const Vec3& p : mesh.points) inVoxels.points.push_back(p / voxelSize);
        if (const auto tree = meshBand(inVoxels, halfWidth)) {
            auto grid = openvdb::FloatGrid::create(tree);
            grid->setGridClass(openvdb::GRID_LEVEL_SET);
            return grid;
        }
    }
    return meshToLevelSet(mesh, voxelSize, halfWidth, halfWidth);
}

CanonicalField makeCanonicalField(const TriangleMesh& mesh, double voxelSize, double scaleMin, double scaleMax,
                                  bool deep) {
    CanonicalField f;
    f.voxelSize = 0.8 * voxelSize / scaleMax;
    // Under the smallest scale, too, the band must reach as far as a block's parts are told to be away from it.
    const double perVoxel = voxelSize / scaleMin / f.voxelSize;
    const float band = float(std::ceil((kBand + kPartRadius) * perVoxel + 0.01));
    const Vec3 size = meshBounds(mesh).size();
    const float inside = deep ? std::max(band, float(std::ceil(0.5 * size.min() / f.voxelSize)) + 2) : band;
    const openvdb::FloatTree::Ptr tree = widened(narrowBand(mesh, f.voxelSize, kResultBand)->tree(), band, inside);
    if (tree->leafCount() == 0) throw RunError("an element's mesh left no voxels");
    f.centroid = solidCentroid(mesh, f.volume);
    f.bounds = meshBounds(mesh);
    layOut(*tree, band, inside, float(kBand * perVoxel + 0.01), f);
    return f;
}

double placedDistance(const CanonicalField& f, const Frame& indexFromElement, const Vec3& p) {
    const Vec3 q = indexFromElement.applyInverse(p) / f.voxelSize - centreOf(f.lower);
    int i[3];
    double t[3];
    for (int k = 0; k < 3; ++k) {
        const double x = std::clamp(q[k], 0.0, 8.0 * f.count[k] - 1e-6);
        i[k] = int(x), t[k] = x - i[k];
    }
    const size_t block = size_t(f.block[size_t(((i[0] >> 3) * f.count[1] + (i[1] >> 3)) * f.count[2] + (i[2] >> 3))]);
    const float* c = f.values.data() + block * CanonicalField::kCorners + (i[0] & 7) * 81 + (i[1] & 7) * 9 + (i[2] & 7);
    const auto alongZ = [&](int at) { return c[at] + (c[at + 1] - c[at]) * t[2]; };
    const auto alongY = [&](int at) { return alongZ(at) + (alongZ(at + 9) - alongZ(at)) * t[1]; };
    return (alongY(0) + (alongY(81) - alongY(0)) * t[0]) * f.voxelSize * indexFromElement.scale;
}

namespace {

/// Eight samples tell of most blocks that the band does not come near them.
bool mayHoldBand(const CanonicalField& field, const Frame& indexFromElement, const Coord& origin) {
    for (int part = 0; part < 8; ++part) {
        const Vec3 middle(part & 4 ? 5.5 : 1.5, part & 2 ? 5.5 : 1.5, part & 1 ? 5.5 : 1.5);
        if (std::abs(placedDistance(field, indexFromElement, centreOf(origin) + middle)) < kBand + kPartRadius)
            return true;
    }
    return false;
}

}  // namespace

WorkTree::Ptr voxelizePlacement(const CanonicalField& field, const Frame& indexFromElement) {
    const double toIndex = field.voxelSize * indexFromElement.scale;  // canonical voxels -> voxels
    std::vector<Coord> blocks;
    for (const Coord& origin : field.origins) {
        const Vec3 centre = (centreOf(origin) + Vec3(4, 4, 4)) * field.voxelSize;
        markBlocks(indexFromElement.apply(centre), 4 * std::sqrt(3.0) * toIndex, blocks);
    }
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());

    auto tree = std::make_shared<WorkTree>(kBand);
    // canonical = origin + step * (i, j, k): the inverse placement is linear
    const double inv = 1 / toIndex;
    const auto step = [&](size_t k) {
        return Vec3(indexFromElement.x[k], indexFromElement.y[k], indexFromElement.z[k]) * inv;
    };
    const Vec3 dx = step(0);
    const Vec3f dy = toFloat(step(1)), dz = toFloat(step(2));
    const float scale = float(toIndex);
    float values[WorkLeaf::SIZE];
    for (const Coord& origin : blocks) {
        if (!mayHoldBand(field, indexFromElement, origin)) continue;
        const Vec3 start = indexFromElement.applyInverse(centreOf(origin)) / field.voxelSize - centreOf(field.lower);
        for (int i = 0; i < 8; ++i)
            sampleSlab(field, toFloat(start + double(i) * dx).data(), dy.data(), dz.data(), values + 64 * i);
        if (!scaledToBand(scale, values)) continue;
        WorkLeaf* leaf = tree->touchLeaf(origin);
        std::copy(values, values + WorkLeaf::SIZE, leaf->buffer().data());
        leaf->setValuesOn();
    }
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, kBand, -kBand, true, 1, kAboveLeaves);
    return tree;
}

}  // namespace pavel
