#include "pavel/vdb/claims.h"

namespace pavel {

ClaimBlock::~ClaimBlock() {
    for (auto& cell : cells_) delete cell.load(std::memory_order_relaxed);
}

void ClaimBlock::enter(int v, Claim mine) {
    std::atomic<Cell*>& there = cells_[cellOf(v)];
    Cell* cell = there.load(std::memory_order_acquire);
    if (!cell) {
        auto made = std::make_unique<Cell>();
        for (auto& claim : made->claims) claim.store(kFree, std::memory_order_relaxed);
        if (there.compare_exchange_strong(cell, made.get(), std::memory_order_acq_rel)) cell = made.release();
    }
    std::atomic<Claim>& claim = cell->claims[inCell(v)];
    Claim held = claim.load(std::memory_order_relaxed);
    while (mine < held && !claim.compare_exchange_weak(held, mine, std::memory_order_relaxed)) {
    }
}

ClaimMap::ClaimMap(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base)
    : elements_(elements), base_(base), index_(boxesOf(elements)) {}

ClaimMap::~ClaimMap() {
    clear();
}

void ClaimMap::clear() {
    for (auto& entry : blocks_) delete entry.second;
    blocks_.clear();
}

ClaimBlock* ClaimMap::block(const Coord& origin) {
    const auto found = blocks_.find(origin);
    if (found != blocks_.end()) return found->second;
    std::unique_ptr<ClaimBlock> made = make(origin);
    const auto [it, isNew] = blocks_.insert({origin, made.get()});
    if (isNew) made.release();
    return it->second;
}

std::unique_ptr<ClaimBlock> ClaimMap::make(const Coord& origin) const {
    VoxelMask bodies;
    for (int i : index_.meeting(CoordBBox(origin, origin.offsetBy(7))))
        bodies |= elements_[size_t(i)].body.mask(origin);
    if (base_) {
        if (const auto* leaf = base_->probeConstLeaf(origin))
            bodies |= nodeMask(negativeMask(leaf->buffer().data()));
        else if (base_->getValue(origin) < 0)
            bodies.setOn();
    }
    return std::make_unique<ClaimBlock>(bodies);
}

}  // namespace pavel
