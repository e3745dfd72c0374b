#include "pavel/vdb/claims.h"

namespace pavel {

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
    Claim claims[512];
    std::fill(claims, claims + 512, kFree);
    for (int i : index_.meeting(CoordBBox(origin, origin.offsetBy(7)))) {
        const WorkElement& e = elements_[size_t(i)];
        const auto* leaf = e.body->probeConstLeaf(origin);
        if (!leaf && !e.body->getValue(origin)) continue;
        for (openvdb::Index v = 0; v < 512; ++v)
            if (!leaf || leaf->isValueOn(v)) claims[v] = std::min(claims[v], makeClaim(0, e.id));
    }
    if (base_) {
        const auto* leaf = base_->probeConstLeaf(origin);
        const float* values = leaf ? leaf->buffer().data() : nullptr;
        if (leaf || base_->getValue(origin) < 0)
            for (int v = 0; v < 512; ++v)
                if (!values || values[v] < 0) claims[v] = makeClaim(0, 0);
    }
    auto block = std::make_unique<ClaimBlock>();
    for (size_t v = 0; v < 512; ++v) block->claims[v].store(claims[v], std::memory_order_relaxed);
    return block;
}

}  // namespace pavel
