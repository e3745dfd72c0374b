#pragma once
// The region of one element, raw, block by block: right where it changes sign, not a distance farther out.
//
//   region = max(own, clip)
// own:  the element as placed, joined with what its front grew: free surface
// clip: what others hold: bisectors, faces between fronts, foreign bodies, base
// The two are kept apart because each is smooth; the crease where they meet is known to a fraction of a voxel only as
// long as they are not mixed.
#include <vector>

#include "pavel/vdb/block_numbers.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/pieces.h"
#include "pavel/vdb/scratch.h"

namespace pavel {

class Region {
  public:
    static constexpr int kOutside = BlockNumbers::kOutside, kInside = BlockNumbers::kInside;
    /// Values this far from the surface, in voxels, need no block.
    static constexpr float kNear = 2;

    /// @param box voxels that blocks may cover
    explicit Region(const CoordBBox& box) : numbers_(box) {}
    /// Adds a block, or puts it in the place of a filled one. Returns its number.
    int add(const Coord& origin, const float* own, const float* clip, const float* slope);
    void reserve(size_t blocks);
    /// A block without surface that is filled, or one that is empty, in the place of what was told before.
    void fill(const Coord& origin);
    void clear(const Coord& origin);
    /// As BlockNumbers.
    int at(const Coord& origin) const { return numbers_.at(origin); }
    const BlockNumbers& numbers() const { return numbers_; }

    size_t size() const { return origins_.size(); }
    const Coord& origin(int block) const { return origins_[size_t(block)]; }
    const float* own(int block) const { return &(*own_)[size_t(block) * 512]; }
    const float* clip(int block) const { return &(*clip_)[size_t(block) * 512]; }

    /// Voxels that do not belong to the largest piece leave the region.
    void dropStrays();
    /// Blocks at the faces -x +x -y +y -z +z, or kOutside, kInside.
    std::array<int, 6> beside(int block) const { return numbers_.beside(origin(block)); }
    uint64_t filledVoxels() const { return filled_; }
    /// Moves own on to the later stop time; what is told of the front stays that of before.
    void advance(double later);
    /// Of the free front in a block.
    struct FrontArea {
        double voxels = 0, slopes = 0;  ///< how many, and the sum of their slopes: dV/dT
        bool moves = false;             ///< anywhere in the block, beside the surface or not
    };
    const FrontArea& front(int block) const { return front_[size_t(block)]; }
    /// The 512 values of a block, max(own, clip), for a front that stops later.
    void values(int block, double later, float* out) const;

  private:
    BlockNumbers numbers_;
    std::vector<Coord> origins_;
    Scratch own_, clip_, slope_;
    std::vector<FrontArea> front_;   // by block, as is
    std::vector<BlockMask> inside_;  // what is negative
    uint64_t filled_ = 0;
};

/// Where a region's surface passes on a grid `factor` times (2 to 8) finer, in blocks of that grid.
class Outline {
  public:
    enum Side : uint8_t { kOut, kIn, kSurface };

    Outline() = default;
    /// Of a region whose front stops later by something. On the finer grid the surface may lie a little elsewhere:
    /// kSurface is a good guess, not a promise.
    Outline(const Region& region, double later, int factor);
    bool empty() const { return sides_.empty(); }
    /// Of the coarse blocks; outside or inside ones lie there with all their voxels.
    const BlockNumbers& numbers() const { return numbers_; }
    size_t surfaceBlocks() const;
    /// Of the factor^3 fine blocks in a coarse one, x slowest.
    const uint8_t* sides(int block) const { return &sides_[size_t(block) * perBlock_]; }

  private:
    BlockNumbers numbers_;
    size_t perBlock_ = 0;
    std::vector<uint8_t> sides_;
};

/// Volume of a region for stop times that are later by something; `slope`, the speed, tells how own falls. Blocks that
/// the front does not move in or beside are measured once.
class RegionMeasure {
  public:
    /// The region must outlive it unchanged.
    explicit RegionMeasure(const Region& region);
    InsideMeasure operator()(double later);
    /// Of the whole region: as Region's.
    double frontVoxels() const { return frontVoxels_; }
    double frontSlopes() const { return frontSlopes_; }

  private:
    InsideMeasure measure(int block) const;

    const Region& region_;
    double later_ = 0;                  // that values_ are for
    std::vector<int> moving_, beside_;  // blocks with front in them; they and their face neighbours
    Scratch values_;
    InsideMeasure rest_;
    double frontVoxels_ = 0, frontSlopes_ = 0;
};

}  // namespace pavel
