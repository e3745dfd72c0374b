#include "pavel/vdb/voxelize.h"

#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cstring>

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

/// The origins of all blocks that hold voxels within the radius of one of the centres, sorted.
std::vector<Coord> blocksAround(const std::vector<Vec3>& centres, double radius) {
    std::vector<Coord> blocks;
    if (centres.empty()) return blocks;
    const auto lo = [&](double x) { return int(std::floor(x - radius)) >> 3; };
    const auto hi = [&](double x) { return int(std::ceil(x + radius)) >> 3; };
    Bounds all;
    for (const Vec3& c : centres) all.add(c);
    int first[3], count[3];
    for (int k = 0; k < 3; ++k) first[k] = lo(all.min[k]), count[k] = hi(all.max[k]) - first[k] + 1;
    std::vector<char> marks(size_t(count[0]) * size_t(count[1]) * size_t(count[2]), 0);
    const auto markAt = [&](int x, int y, int z) -> char& {
        return marks[size_t(((x - first[0]) * count[1] + y - first[1]) * count[2] + z - first[2])];
    };
    for (const Vec3& c : centres) {
        const auto away = [&](int k, int block) { return std::max({8.0 * block - c[k], c[k] - (8 * block + 7), 0.0}); };
        for (int x = lo(c[0]); x <= hi(c[0]); ++x)
            for (int y = lo(c[1]); y <= hi(c[1]); ++y)
                for (int z = lo(c[2]); z <= hi(c[2]); ++z)
                    if (length(Vec3(away(0, x), away(1, y), away(2, z))) <= radius) markAt(x, y, z) = 1;
    }
    for (int x = first[0]; x < first[0] + count[0]; ++x)
        for (int y = first[1]; y < first[1] + count[1]; ++y)
            for (int z = first[2]; z < first[2] + count[2]; ++z)
                if (markAt(x, y, z)) blocks.emplace_back(8 * x, 8 * y, 8 * z);
    return blocks;
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

/// Places in canonical voxels from `lower`.
template <int kCount>
struct Places {
    float x[kCount], y[kCount], z[kCount];
};

/// Trilinear samples. `within`: are all places in the field's box?
template <int kCount>
[[gnu::always_inline]] inline void sample(const CanonicalField& f, const Places<kCount>& p, bool within, float* out) {
    constexpr int kPair[4] = {0, 9, 81, 90};  // of corners that follow each other along z
    float u[kCount], v[kCount], w[kCount], c[4][2 * kCount];
    int cell[kCount], place[kCount], inField[kCount];
    const int countX = f.count[0], countY = f.count[1], countZ = f.count[2];
    for (int n = 0; n < kCount; ++n) {
        const float x = p.x[n], y = p.y[n], z = p.z[n];
        const int ix = int(x), iy = int(y), iz = int(z), bx = ix >> 3, by = iy >> 3, bz = iz >> 3;
        u[n] = x - float(ix), v[n] = y - float(iy), w[n] = z - float(iz);
        cell[n] = (bx * countY + by) * countZ + bz;
        place[n] = (ix & 7) * 81 + (iy & 7) * 9 + (iz & 7);
        inField[n] = int(x >= 0) & int(y >= 0) & int(z >= 0) & int(bx < countX) & int(by < countY) & int(bz < countZ);
    }
    for (int n = 0; n < kCount; ++n) {
        const size_t block = within || inField[n] ? size_t(f.block[size_t(cell[n])]) : 0;
        const float* at = f.values.data() + block * CanonicalField::kCorners + place[n];
        for (int k = 0; k < 4; ++k) std::memcpy(&c[k][2 * n], at + kPair[k], 2 * sizeof(float));
    }
    for (int n = 0; n < kCount; ++n) {
        const int m = 2 * n;
        const float a = c[0][m] + (c[0][m + 1] - c[0][m]) * w[n], b = c[1][m] + (c[1][m + 1] - c[1][m]) * w[n],
                    d = c[2][m] + (c[2][m + 1] - c[2][m]) * w[n], e = c[3][m] + (c[3][m + 1] - c[3][m]) * w[n];
        const float g = a + (b - a) * v[n], h = d + (e - d) * v[n];
        out[n] = g + (h - g) * u[n];
    }
}

/// Samples at 4^3 places start + x dx + y dy + z dz, into a corner of a leaf.
PAVEL_WIDE void samplePart(const CanonicalField& f, const Vec3f& start, const Vec3f& dx, const Vec3f& dy,
                           const Vec3f& dz, float* corner) {
    Places<64> p;
    for (int row = 0, n = 0; row < 16; ++row) {
        const Vec3f at = start + dx * float(row >> 2) + dy * float(row & 3);
        const float x0 = at[0], y0 = at[1], z0 = at[2];
        PAVEL_ROLLED
        for (int z = 0; z < 4; ++z, ++n)
            p.x[n] = x0 + float(z) * dz[0], p.y[n] = y0 + float(z) * dz[1], p.z[n] = z0 + float(z) * dz[2];
    }
    bool within = true;
    for (int end : {0, 3, 12, 15, 48, 51, 60, 63}) {
        const float at[3] = {p.x[end], p.y[end], p.z[end]};
        for (int k = 0; k < 3; ++k) within &= at[k] >= 0 && at[k] < 8.f * float(f.count[k]);
    }
    float d[64];
    sample(f, p, within, d);
    for (int row = 0; row < 16; ++row) std::copy_n(d + 4 * row, 4, corner + 64 * (row >> 2) + 8 * (row & 3));
}

/// Distances at the middles of a leaf's eight corners of 4^3 voxels, in canonical voxels.
PAVEL_WIDE void sampleMiddles(const CanonicalField& f, const Vec3f& start, const Vec3f& dx, const Vec3f& dy,
                              const Vec3f& dz, float* d) {
    Places<8> p;
    for (int part = 0; part < 8; ++part) {
        const Vec3f at =
            start + dx * (part & 4 ? 5.5f : 1.5f) + dy * (part & 2 ? 5.5f : 1.5f) + dz * (part & 1 ? 5.5f : 1.5f);
        p.x[part] = at[0], p.y[part] = at[1], p.z[part] = at[2];
    }
    sample(f, p, false, d);
}

/// To voxels, within the band. Does any value lie inside it?
PAVEL_WIDE bool scaledToBand(float scale, float* values) {
    int near = 0;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float scaled = values[v] * scale, above = scaled > -kBand ? scaled : -kBand,
                    kept = above < kBand ? above : kBand;
        near += int(std::abs(kept) < kBand);  // two conditions would not be vectorised
        values[v] = kept;
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

Placement::Placement(const CanonicalField& field, const Frame& indexFromElement)
    : field_(field), frame_(indexFromElement), scale_(float(field.voxelSize * indexFromElement.scale)) {
    // canonical = origin + step * (i, j, k): the inverse placement is linear
    const double inv = 1 / (field.voxelSize * frame_.scale);
    const auto step = [&](size_t k) { return Vec3(frame_.x[k], frame_.y[k], frame_.z[k]) * inv; };
    dx_ = toFloat(step(0)), dy_ = toFloat(step(1)), dz_ = toFloat(step(2));
}

Vec3f Placement::startOf(const Coord& origin) const {
    return toFloat(frame_.applyInverse(centreOf(origin)) / field_.voxelSize - centreOf(field_.lower));
}

void Placement::samplePart(const Vec3f& start, int part, float* values) const {
    const Vec3f at = start + dx_ * float(part & 4) + dy_ * float(part << 1 & 4) + dz_ * float(part << 2 & 4);
    pavel::samplePart(field_, at, dx_, dy_, dz_, values + firstOf(part));
}

Placement::Side Placement::sample(const Coord& origin, float* values) const {
    const Vec3f start = startOf(origin);
    float middles[8];
    sampleMiddles(field_, start, dx_, dy_, dz_, middles);
    // One value tells of most corners that the band does not come near them.
    const auto isFar = [&](float d) { return std::abs(d * scale_) >= float(kBand + kPartRadius); };
    if (std::all_of(middles, middles + 8, isFar)) return middles[0] < 0 ? kInside : kOutside;
    for (int part = 0; part < 8; ++part) {
        if (isFar(middles[part]))
            for (int row = 0; row < 16; ++row) std::fill_n(values + voxelOf(part, 4 * row), 4, middles[part]);
        else
            samplePart(start, part, values);
    }
    return scaledToBand(scale_, values) ? kNear : values[0] < 0 ? kInside : kOutside;
}

void Placement::sampleDeep(const Coord& origin, int part, float* values) const {
    samplePart(startOf(origin), part, values);
    for (int k = 0; k < 64; ++k) values[voxelOf(part, k)] *= scale_;
}

BlockLevelSet voxelizePlacement(const CanonicalField& field, const Frame& indexFromElement) {
    std::vector<Vec3> centres;
    for (const Coord& origin : field.origins)
        centres.push_back(indexFromElement.apply((centreOf(origin) + Vec3(4, 4, 4)) * field.voxelSize));
    const std::vector<Coord> candidates =
        blocksAround(centres, 4 * std::sqrt(3.0) * field.voxelSize * indexFromElement.scale);

    const Placement placement(field, indexFromElement);
    CoordBBox box;
    BlockLevelSet::Blocks near;
    std::vector<Coord> filled;
    float values[512];
    BlockMask mask;
    for (const Coord& origin : candidates) {
        if (placement.sample(origin, values) != Placement::kNear) continue;
        nearMask(values, kBand, mask);
        if (!near.origins.empty()) {
            // Blocks without values between two in a row are as the end of the first.
            const Coord& last = near.origins.back();
            constexpr size_t kEndOfRow = 7;
            if (last[0] == origin[0] && last[1] == origin[1] &&
                (*near.values)[near.values->size() - 512 + kEndOfRow] < 0)
                for (int z = last[2] + 8; z < origin[2]; z += 8) filled.emplace_back(origin[0], origin[1], z);
        }
        near.add(origin, values, mask);
        box.expand(CoordBBox(origin, origin.offsetBy(7)));
    }
    BlockLevelSet shape(box, kBand);
    shape.add(std::move(near));
    for (const Coord& origin : filled) shape.fill(origin);
    return shape;
}

}  // namespace pavel
