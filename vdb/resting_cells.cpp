#include "pavel/vdb/resting_cells.h"

#include <algorithm>
#include <cmath>

#include "pavel/core/wide.h"

namespace pavel {
namespace {

/// The voxels of a cell that the front knows anything of.
PAVEL_WIDE uint64_t knownOf(const GrowthCell& cell) {
    uint8_t known[GrowthCell::kCount];
    PAVEL_ROLLED
    for (int i = 0; i < GrowthCell::kCount; ++i) {
        const bool left = (cell.state[i] == kFar) | (cell.state[i] == kBody);
        known[i] = uint8_t(!left | (cell.time[i] < GrowthBlock::kNever) | (cell.contact[i] >= 0));
    }
    uint64_t bits = 0;
    for (int i = 0; i < GrowthCell::kCount; ++i) bits |= uint64_t(known[i]) << i;
    return bits;
}

}  // namespace

RestingCells::RestingCells(const std::deque<GrowthBlock>& blocks, float farthest)
    : blocks_(blocks.size()), perSquare_(farthest / (float(kFarthest) * float(kFarthest))) {
    size_t voxels = 0;
    for (const GrowthBlock& block : blocks) {
        Block& b = blocks_[size_t(block.number)];
        b.first = uint32_t(cells_.size());
        for (int c = 0; c < 8; ++c) {
            if (!block.cells[c]) continue;
            b.cells = uint8_t(b.cells | 1 << c);
            cells_.push_back({knownOf(*block.cells[c]), uint32_t(voxels)});
            voxels += size_t(__builtin_popcountll(cells_.back().known));
        }
    }
    cells_.shrink_to_fit();
    time_.reserve(voxels), contact_.reserve(voxels), state_.reserve(voxels);
    const auto number = [](float contact, float perSquare) {
        return contact < 0 ? kUnknown : uint16_t(std::min(std::sqrt(contact / perSquare) + 0.5f, float(kFarthest)));
    };
    size_t k = 0;
    for (const GrowthBlock& block : blocks)
        for (const GrowthCell* cell : block.cells) {
            if (!cell) continue;
            for (uint64_t bits = cells_[k++].known; bits; bits &= bits - 1) {
                const int i = __builtin_ctzll(bits);
                time_.push_back(cell->time[i]), state_.push_back(cell->state[i]);
                contact_.push_back(number(cell->contact[i], cell->state[i] == kInner ? kPerScale : perSquare_));
            }
        }
}

void RestingCells::read(int block, int c, GrowthCell& out) const {
    const Cell& cell = cellOf(blocks_[size_t(block)], c);
    std::fill_n(out.time, GrowthCell::kCount, GrowthBlock::kNever);
    std::fill_n(out.contact, GrowthCell::kCount, -1.f);
    std::fill_n(out.state, GrowthCell::kCount, uint8_t(kFar));
    uint32_t from = cell.first;
    for (uint64_t bits = cell.known; bits; bits &= bits - 1, ++from) {
        const int i = __builtin_ctzll(bits);
        const float number = float(contact_[from]);
        out.time[i] = time_[from], out.state[i] = state_[from] & uint8_t(~kHeld);
        out.contact[i] =
            contact_[from] == kUnknown ? -1 : (out.state[i] == kInner ? kPerScale : perSquare_) * number * number;
    }
}

void RestingCells::setState(int block, int v, VoxelState state) {
    const Cell& cell = cellOf(blocks_[size_t(block)], pavel::cellOf(v));
    const uint64_t before = cell.known & ((uint64_t(1) << inCell(v)) - 1);
    state_[cell.first + unsigned(__builtin_popcountll(before))] = state;
}

}  // namespace pavel
