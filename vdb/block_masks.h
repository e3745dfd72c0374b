#pragma once
// Where something is, without distances: yes or no for each voxel.
#include <vector>

#include "pavel/vdb/block_numbers.h"
#include "pavel/vdb/voxel_mask.h"

namespace pavel {

/// Masks of the blocks of a box, others being all outside or all inside.
class BlockMasks {
  public:
    /// Nothing.
    BlockMasks() = default;
    /// With what lies inside told already. @param blocks room for so many
    BlockMasks(const BlockNumbers& numbers, size_t blocks) : numbers_(numbers) {
        origins_.reserve(blocks), masks_.reserve(blocks);
    }
    /// A block that may be empty or full.
    void add(const Coord& origin, const VoxelMask& mask) {
        numbers_.set(origin, int(masks_.size()));
        origins_.push_back(origin), masks_.push_back(mask);
    }
    /// As BlockNumbers.
    int at(const Coord& origin) const { return numbers_.at(origin); }
    /// Of any block.
    const VoxelMask& mask(const Coord& origin) const {
        static const VoxelMask none, all(true);
        const int n = at(origin);
        return n >= 0 ? masks_[size_t(n)] : n == BlockNumbers::kInside ? all : none;
    }
    bool isOn(const Coord& c) const { return mask(leafOrigin(c)).isOn(WorkLeaf::coordToOffset(c)); }
    /// Of the blocks with masks, in the order in which they were added.
    const std::vector<Coord>& origins() const { return origins_; }
    const BlockNumbers& numbers() const { return numbers_; }

  private:
    BlockNumbers numbers_;
    std::vector<Coord> origins_;
    std::vector<VoxelMask> masks_;
};

}  // namespace pavel
