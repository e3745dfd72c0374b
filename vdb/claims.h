#pragma once
// The clock that all fronts share: who reached a voxel first, and when.
#include <tbb/concurrent_unordered_map.h>

#include <atomic>
#include <cstring>
#include <limits>

#include "pavel/vdb/element_index.h"
#include "pavel/vdb/leaf_tables.h"
#include "pavel/vdb/voxel_mask.h"

namespace pavel {

/// A claim orders by arrival time, ties by element id. Time 0 marks the body of an element or the base.
using Claim = uint64_t;
constexpr Claim kFree = std::numeric_limits<Claim>::max();
inline Claim makeClaim(float time, int id) {
    uint32_t bits;
    std::memcpy(&bits, &time, 4);  // positive floats order like their bits
    return Claim(bits) << 32 | uint32_t(id);
}
inline int claimOwner(Claim c) {
    return int(uint32_t(c));
}
inline float claimTime(Claim c) {
    const uint32_t bits = uint32_t(c >> 32);
    float t;
    std::memcpy(&t, &bits, 4);
    return t;
}

/// The claims of a leaf-sized block. Most of its voxels are never claimed: room is made by cells of 4^3 voxels.
class ClaimBlock {
  public:
    /// @param bodies voxels that elements keep of their placed shapes, and the base's: nobody claims these
    explicit ClaimBlock(const VoxelMask& bodies) : bodies_(bodies) {}
    ~ClaimBlock();
    Claim at(int v) const {
        if (bodies_.isOn(openvdb::Index(v))) return makeClaim(0, 0);
        const Cell* cell = cells_[cellOf(v)].load(std::memory_order_acquire);
        return cell ? cell->claims[inCell(v)].load(std::memory_order_relaxed) : kFree;
    }
    /// Enters a claim unless there is an earlier one. The outcome of many does not depend on their order.
    void enter(int v, Claim mine);
    /// Gives back what somebody holds: a voxel that was entered.
    void free(int v) {
        cells_[cellOf(v)].load(std::memory_order_relaxed)->claims[inCell(v)].store(kFree, std::memory_order_relaxed);
    }

  private:
    struct Cell {
        std::atomic<Claim> claims[64];
    };
    VoxelMask bodies_;
    std::atomic<Cell*> cells_[8] = {};  // null until a voxel there is claimed
};

/// Sparse map of claims, made where a front asks for it: the bodies and the base are entered then.
class ClaimMap {
  public:
    ClaimMap(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base);
    ~ClaimMap();
    /// Block at a leaf origin. Safe to call from many threads: the content depends on the place alone.
    ClaimBlock* block(const Coord& origin);
    /// Frees all blocks; pointers to them are void.
    void clear();

  private:
    std::unique_ptr<ClaimBlock> make(const Coord& origin) const;
    const std::vector<WorkElement>& elements_;
    const openvdb::FloatTree* base_;
    ElementIndex index_;
    tbb::concurrent_unordered_map<Coord, ClaimBlock*, CoordHash> blocks_;
};

}  // namespace pavel
