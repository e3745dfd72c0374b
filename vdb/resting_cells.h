#pragma once
// The cells of a front that rests: about a quarter of their voxels were ever touched.
#include <cstdint>
#include <deque>
#include <vector>

#include "pavel/vdb/growth_block.h"

namespace pavel {

/// Keeps of a front's cells what the front touched, voxel by voxel. Times and states stay as they are, distances to the
/// contact are kept in 16 bits: finest near it, where a front turns, and to a 30,000th of the farthest anywhere.
class RestingCells {
  public:
    /// In a voxel's state: the front holds it against others.
    static constexpr uint8_t kHeld = 0x80;

    RestingCells() = default;
    /// @param blocks by number; they keep their cells
    /// @param farthest distances are told up to this
    RestingCells(const std::deque<GrowthBlock>& blocks, float farthest);
    bool empty() const { return blocks_.empty(); }
    /// Which cells a block has, a bit for each.
    unsigned cells(int block) const { return size_t(block) < blocks_.size() ? blocks_[size_t(block)].cells : 0; }
    /// A cell that is there. Voxels that the front left alone are kFar, those of the body, too.
    void read(int block, int cell, GrowthCell& out) const;
    /// Of a voxel that the front touched.
    void setState(int block, int v, VoxelState state);
    /// Calls f(block, voxel, time, state) for all voxels of a state, which may be marked or unmarked then.
    template <class F>
    void forEach(VoxelState state, F f) {
        for (int b = 0; b < int(blocks_.size()); ++b)
            for (int c = 0, k = int(blocks_[size_t(b)].first); c < 8; ++c) {
                if (!(blocks_[size_t(b)].cells >> c & 1)) continue;
                const Cell& cell = cells_[size_t(k++)];
                uint32_t from = cell.first;
                for (uint64_t bits = cell.known; bits; bits &= bits - 1, ++from)
                    if ((state_[from] & ~kHeld) == state)
                        f(b, GrowthBlock::voxelOf(c, __builtin_ctzll(bits)), time_[from], state_[from]);
            }
    }

  private:
    struct Block {
        uint32_t first = 0;  // of its cells
        uint8_t cells = 0;   // a bit for each
    };
    struct Cell {
        uint64_t known;  // voxels that are kept, in the cell's order
        uint32_t first;  // of their values
    };
    const Cell& cellOf(const Block& block, int cell) const {
        return cells_[block.first + unsigned(__builtin_popcount(block.cells & ((1u << cell) - 1)))];
    }
    std::vector<Block> blocks_;
    std::vector<Cell> cells_;
    static constexpr uint16_t kUnknown = 0xffff, kFarthest = 0xfffe;
    // Of contact_: distance over the number squared; and of inner voxels' scales, which are speeds, at most 1.
    float perSquare_ = 0;
    static constexpr float kPerScale = 4 / (float(kFarthest) * float(kFarthest));
    std::vector<float> time_;
    std::vector<uint16_t> contact_;
    std::vector<uint8_t> state_;
};

}  // namespace pavel
