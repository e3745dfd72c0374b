#pragma once
// What a front holds on a grid finer than its own.
#include <memory>
#include <unordered_map>

#include "pavel/vdb/front.h"

namespace pavel {

/// A front in one block, as the region of its element sees it.
struct GrownBlock {
    float way[512];    ///< distance-like: scale * (arrival - stop time); negative where the front came in time
    float scale[512];  ///< voxels per unit of time; 0 where the front does not go and `way` means nothing
};

/// A stopped front on a grid `factor` times (2 to 8) finer, in the blocks where it comes near the band. Arrival
/// times are smooth away from the rims, so they are interpolated; near the rims they are found anew
/// (Front::wedgeArrival).
class GrownField {
  public:
    GrownField() = default;
    /// @param placed the element's shape on the fine grid
    GrownField(const Front& front, const WorkTree& placed, int factor);
    const GrownBlock* probe(const Coord& origin) const {
        const auto found = blocks_.find(origin);
        return found == blocks_.end() ? nullptr : found->second.get();
    }

  private:
    std::unordered_map<Coord, std::unique_ptr<GrownBlock>, CoordHash> blocks_;
};

}  // namespace pavel
