// What a front keeps while others march, and what it gives up until it goes on.
#include <algorithm>

#include "pavel/vdb/front.h"

namespace pavel {

void Front::rest() {
    if (!resting_.empty()) return;
    resting_ = RestingCells(blocks, float(std::max(b, kWidest) * element.size));  // nothing moves farther off
    for (GrowthBlock& block : blocks) std::fill(block.cells, block.cells + 8, nullptr);
    cells_.clear(), cells_.shrink_to_fit();
    usedOfLast_ = kChunk;
    Queue().swap(heap_), std::vector<uint32_t>().swap(leftOut_);
    queuesGone_ = true;
    waits_ = std::numeric_limits<float>::infinity();
    resting_.forEach(kTrial, [&](int, int, float time, uint8_t) { waits_ = std::min(waits_, time); });
    claimed_.shrink_to_fit();
}

void Front::wake() {
    if (resting_.empty()) return;
    for (GrowthBlock& block : blocks) {
        const unsigned there = resting_.cells(block.number);
        for (int c = 0; c < 8; ++c) {
            if (!(there >> c & 1)) continue;
            GrowthCell& cell = add(block, c);
            resting_.read(block.number, c, cell);
            for (int i = 0; i < GrowthCell::kCount; i += 4) {  // four follow each other in a mask's word
                const int v = GrowthBlock::voxelOf(c, i);
                unsigned body = unsigned(block.body->getWord<uint64_t>(openvdb::Index(v >> 6)) >> (v & 63)) & 15;
                for (; body; body &= body - 1) {
                    uint8_t& state = cell.state[i + __builtin_ctz(body)];
                    if (state == kFar) state = kBody;
                }
            }
        }
    }
    if (queuesGone_)
        resting_.forEach(kTrial, [&](int block, int v, float time, uint8_t) {
            heap_.push({time, keyOf(blocks[size_t(block)], v)});
        });
    resting_ = {};
}

void Front::forget() {
    resting_ = {};
    cells_.clear(), cells_.shrink_to_fit();
    std::deque<GrowthBlock>().swap(blocks);
    decltype(map_)().swap(map_);
    Queue().swap(heap_), std::vector<Arrival>().swap(claimed_), std::vector<uint32_t>().swap(leftOut_);
}

/// What was accepted beside voxels that wait, or that nothing was asked of.
void Front::findQueues() {
    if (!queuesGone_) return;
    queuesGone_ = false;
    if (!pastEnd_) return;
    for (GrowthBlock& block : blocks)
        block.forEachVoxel([&](int v, const GrowthCell& cell, int i) {
            if (cell.state[i] != kReal && (cell.state[i] != kGhost || claimTime(block.claims->at(v)) == 0)) return;
            for (int side = 0, n; side < 6; ++side) {
                const GrowthBlock* other = step(&block, v, side, n);
                // What was asked and does not wait is out of reach.
                if (other && other->state(n) != kTrial && (other->state(n) != kFar || other->contact(n) >= 0)) continue;
                leftOut_.push_back(keyOf(block, v));
                break;
            }
        });
}

void Front::leaveClaims() {
    resting_.forEach(kReal, [&](int block, int v, float time, uint8_t& state) {
        if (blocks[size_t(block)].claims->at(v) == makeClaim(time, element.id)) state |= RestingCells::kHeld;
    });
    for (GrowthBlock& block : blocks) block.claims = nullptr;
}

void Front::returnToClaims() {
    for (GrowthBlock& block : blocks) block.claims = claims_.block(block.origin);
    resting_.forEach(kReal, [&](int block, int v, float time, uint8_t& state) {
        if (!(state & RestingCells::kHeld)) return;
        blocks[size_t(block)].claims->enter(v, makeClaim(time, element.id));
        state &= uint8_t(~RestingCells::kHeld);
    });
}

}  // namespace pavel
