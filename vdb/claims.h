#pragma once
// The clock that all fronts share: who reached a voxel first, and when.
#include <tbb/concurrent_unordered_map.h>

#include <atomic>
#include <cstring>
#include <limits>

#include "pavel/vdb/element_index.h"

namespace pavel {

/// A claim orders by arrival time, ties by element id. Time 0 marks a body; id 0 the base.
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

struct ClaimBlock {
    std::atomic<Claim> claims[512];
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
