#pragma once
// From meshes to level sets: one canonical distance field per distinct element mesh, sampled under every placement.
#include "pavel/core/frame.h"
#include "pavel/core/mesh.h"
#include "pavel/vdb/block_level_set.h"

namespace pavel {

/// Signed distance of an element's mesh in its own frame, on a grid of its own, laid out for fast sampling: blocks of
/// 8^3 cells with all their corners.
struct CanonicalField {
    static constexpr int kCorners = 9 * 9 * 9;
    double voxelSize = 1;        ///< of the canonical grid, in scene units
    Vec3 centroid{0, 0, 0};      ///< of the solid, element frame
    double volume = 0;           ///< of the solid, element frame
    Bounds bounds;               ///< element frame
    Coord lower;                 ///< canonical index of the first block's first voxel
    int count[3] = {0, 0, 0};    ///< blocks
    std::vector<int> block;      ///< number of the values' block; 0: outside, 1: inside
    std::vector<float> values;   ///< kCorners for each block, in canonical voxels, x slowest
    std::vector<Coord> origins;  ///< of the blocks that a placement's band may cross, canonical index
};

/// @param voxelSize h of the scene; scaleMin, scaleMax: over the placements of this mesh
/// @param deep distances all through the inside, not only near the surface
CanonicalField makeCanonicalField(const TriangleMesh& mesh, double voxelSize, double scaleMin, double scaleMax,
                                  bool deep = false);

/// Distance in voxels of a placement at a point in index space, cut where the field's band ends.
double placedDistance(const CanonicalField& field, const Frame& indexFromElement, const Vec3& p);

/// A field under one placement; indexFromElement carries the placement's scale / h.
class Placement {
  public:
    enum Side { kOutside, kInside, kNear };
    /// The field must outlive it.
    Placement(const CanonicalField& field, const Frame& indexFromElement);
    /// Distances of a leaf's voxels in half width kBand, or the side on which all of it lies.
    Side sample(const Coord& origin, float* values) const;
    /// Distances of one of a leaf's eight corners of 4^3 voxels as far as the field tells them, into the leaf's values.
    void sampleDeep(const Coord& origin, int part, float* values) const;
    /// The k-th voxel of such a corner in its leaf; both x slowest.
    static constexpr int voxelOf(int part, int k) { return firstOf(part) + 64 * (k >> 4) + 8 * (k >> 2 & 3) + (k & 3); }

  private:
    static constexpr int firstOf(int part) { return 64 * (part & 4) + 8 * (part << 1 & 4) + (part << 2 & 4); }
    Vec3f startOf(const Coord& origin) const;
    void samplePart(const Vec3f& start, int part, float* values) const;

    const CanonicalField& field_;
    Frame frame_;
    Vec3f dx_, dy_, dz_;  // a voxel's way along each axis, in canonical voxels
    float scale_;         // canonical voxels -> voxels
};

/// Level set of one placement, as Placement tells it, of band kBand.
BlockLevelSet voxelizePlacement(const CanonicalField& field, const Frame& indexFromElement);

/// Half width of the base's band in work, where no gap is left: only its surface matters.
constexpr float kBaseBand = 2;
/// Narrow band of a solid, in voxels.
openvdb::FloatGrid::Ptr narrowBand(const TriangleMesh& mesh, double voxelSize, float halfWidth = kBaseBand);

}  // namespace pavel
