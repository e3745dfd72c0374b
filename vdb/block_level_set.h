#pragma once
// An element's level set in work, while it is trimmed or its volume is settled: blocks without a tree around them.
#include <deque>

#include "pavel/vdb/block_masks.h"
#include "pavel/vdb/compact_level_set.h"
#include "pavel/vdb/measure.h"
#include "pavel/vdb/pieces.h"
#include "pavel/vdb/scratch.h"

namespace pavel {

/// Blocks with values within a band around the surface, and which others lie inside.
class BlockLevelSet {
  public:
    /// Nothing. @param box voxels that blocks may cover
    BlockLevelSet(const CoordBBox& box, float band) : band_(band), numbers_(box) {}
    /// Of a level set at rest, with its background as the band.
    explicit BlockLevelSet(const CompactLevelSet& at);
    /// Blocks that lie one behind the other, 512 values each, plus or minus the band outside their masks.
    struct Blocks {
        std::vector<Coord> origins;
        std::vector<BlockMask> near;
        Scratch values;
        void add(const Coord& origin, const float* values, const BlockMask& near);
    };
    void add(Blocks&& blocks);
    /// A block that lies inside.
    void fill(const Coord& origin);

    /// Those of the block at a leaf origin, to be changed; null where it lies outside or inside.
    float* values(const Coord& origin) {
        const int n = numbers_.at(origin);
        return n >= 0 ? values_[size_t(n)] : nullptr;
    }
    /// The same of a block that is not outside, with values now if it had none.
    float* open(const Coord& origin);
    /// A block, whatever it was, comes to lie outside.
    void clear(const Coord& origin);
    /// To be called after changes: blocks of one side with no value within the band come to lie there.
    void tidy();

    /// Moves the surface until its volume is the target, or no more than it where `growing` is false: what
    /// re-distancing changed, hundredths of a voxel. Outwards by .05 voxels at most, inwards by .75. Returns the
    /// volume.
    double settleVolume(double target, bool growing);
    InsideMeasure measure() const;
    CompactLevelSet compact() const;
    BlockMasks inside() const;
    const BlockNumbers& numbers() const { return numbers_; }

  private:
    /// Calls f(halo) for each block.
    template <class F>
    void forEachHalo(F f) const;
    float* grow(const Coord& origin, const BlockMask& near);
    float band_;
    BlockNumbers numbers_;
    std::vector<Coord> origins_;
    std::vector<BlockMask> near_;
    std::vector<float*> values_;  // by block
    std::deque<Scratch> storage_;
    uint64_t filled_ = 0;  // voxels
};

}  // namespace pavel
