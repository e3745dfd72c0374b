#include "pavel/vdb/fine_shape.h"

#include <algorithm>

#include "pavel/vdb/scratch.h"

namespace pavel {
namespace {

FineBlock& uniform(float value) {
    const auto filled = [](float v) {
        auto* block = new FineBlock;
        std::fill(block->phi, block->phi + 512, v);
        return block;
    };
    static const std::unique_ptr<FineBlock> in(filled(-kBand)), out(filled(kBand));
    return value < 0 ? *in : *out;
}

/// Leaves a block's memory to the next.
void putAway(FineBlock* block) {
    if (!block || block == &uniform(-1) || block == &uniform(1)) return;
    Spares<GrownBlock>::keep(std::move(block->grown));
    Spares<FineBlock>::keep(std::unique_ptr<FineBlock>(block));
}

}  // namespace

CoordBBox reachOf(const WorkElement& element, const Front* front, int factor) {
    CoordBBox box = element.box;
    if (front)
        for (const GrowthBlock& b : front->blocks) box.expand(b.origin), box.expand(b.origin.offsetBy(7));
    if (box.empty()) return box;
    const Coord lo = box.min(), hi = box.max().offsetBy(1);
    return CoordBBox(lo[0] * factor, lo[1] * factor, lo[2] * factor, hi[0] * factor - 1, hi[1] * factor - 1,
                     hi[2] * factor - 1);
}

FineShape::FineShape(const WorkElement& coarse, const Front* front, const CanonicalField& field,
                     const Frame& indexFromElement, int factor)
    : coarse_(coarse),
      placement_(field, indexFromElement),
      grown_(front ? std::make_unique<GrownField>(*front, factor) : nullptr),
      factor_(factor),
      box_(reachOf(coarse, front, factor)),
      blocks_(std::make_unique<std::atomic<FineBlock*>[]>(box_.size())) {
    for (const MaskedBlock& m : coarse.strays) {
        for (size_t row = 0; row < 64; ++row) strays_[m.origin][row] |= m.mask[row];
        CoordBBox nodes;
        for (int v = 0; v < 512; ++v)
            if (testMask(m.mask, v)) nodes.expand(m.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
        CoordBBox around;  // fine voxels that have one of them at a corner
        for (int k = 0; k < 3; ++k) {
            around.min()[k] = (nodes.min()[k] - 1) * factor + 1;
            around.max()[k] = (nodes.max()[k] + 1) * factor - 1;
        }
        strayBoxes_.push_back(around);
    }
}

FineShape::~FineShape() {
    for (size_t i = 0; i < box_.size(); ++i) putAway(blocks_[i].load(std::memory_order_relaxed));
}

const FineBlock& FineShape::nothing() {
    return uniform(1);
}

const FineBlock& FineShape::at(const Coord& origin) const {
    const int i = box_.index(origin);
    if (i < 0) return nothing();
    std::atomic<FineBlock*>& slot = blocks_[size_t(i)];
    FineBlock* known = slot.load(std::memory_order_acquire);
    if (known) return *known;
    FineBlock* made = make(origin);
    if (slot.compare_exchange_strong(known, made, std::memory_order_acq_rel)) return *made;
    // Another thread was here first, with the same.
    putAway(made);
    return *known;
}

FineBlock* FineShape::make(const Coord& origin) const {
    // Half of what is asked for turns out to be nothing.
    struct Kept {
        std::unique_ptr<FineBlock> block = Spares<FineBlock>::take();
        ~Kept() { putAway(block.release()); }
    } kept;
    FineBlock* const block = kept.block.get();
    Placement::Side side = placement_.sample(origin, block->phi);
    if (side != Placement::kNear) std::fill(block->phi, block->phi + 512, side == Placement::kInside ? -kBand : kBand);
    if (eraseStrays(origin, block->phi)) side = Placement::kNear;
    // Times run backwards all through the inside, but nobody else can come there.
    if (side == Placement::kInside) return &uniform(-1);
    if (grown_) {
        auto grown = Spares<GrownBlock>::take();
        if (grown_->read(origin, block->phi, *grown))
            block->grown = std::move(grown);
        else
            Spares<GrownBlock>::keep(std::move(grown));
    }
    if (!block->grown && side == Placement::kOutside) return &uniform(1);
    return kept.block.release();
}

/// Turns the voxels outside that the trim cut off: those with a stray node around them and none of the main body.
bool FineShape::eraseStrays(const Coord& origin, float* phi) const {
    const CoordBBox block(origin, origin.offsetBy(7));
    if (std::none_of(strayBoxes_.begin(), strayBoxes_.end(), [&](const CoordBBox& b) { return b.hasOverlap(block); }))
        return false;
    const auto isStray = [&](const Coord& c) {
        const auto found = strays_.find(leafOrigin(c));
        return found != strays_.end() && testMask(found->second, int(WorkLeaf::coordToOffset(c)));
    };
    bool any = false;
    for (int v = 0; v < 512; ++v) {
        if (phi[v] >= kBand) continue;
        const Coord c = origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
        bool near = false, main = false;
        for (int corner = 0; corner < 8; ++corner) {
            Coord node;
            for (int k = 0; k < 3; ++k) {
                const int down = floorDivide(c[k], factor_);
                node[k] = down + (corner >> k & 1 && down * factor_ != c[k]);
            }
            near |= isStray(node);
            main |= coarse_.body.isOn(node);
        }
        if (!near || main) continue;
        phi[v] = std::max(0.5f, std::abs(phi[v]));
        any = true;
    }
    return any;
}

}  // namespace pavel
