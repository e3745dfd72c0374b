#pragma once
// What a front holds on a grid finer than its own.
#include <memory>
#include <vector>

#include "pavel/vdb/front_nodes.h"

namespace pavel {

/// A front in one block, as the region of its element sees it.
struct GrownBlock {
    float way[512];    ///< distance-like: scale * (arrival - stop time); negative where the front came in time
    float scale[512];  ///< voxels per unit of time; 0 where the front does not go and `way` means nothing
};

/// A stopped front on a grid `factor` times (2 to 8) finer. Arrival times are smooth away from the rims, so they are
/// interpolated; near the rims they are found anew (Front::wedgeArrival).
class GrownField {
  public:
    /// The front must outlive it unchanged.
    GrownField(const Front& front, int factor);
    /// The front in a leaf of the fine grid; false where it does not come near. `placed`: the element's
    /// shape there.
    bool read(const Coord& origin, const float* placed, GrownBlock& out) const;

  private:
    const Front& front_;
    int factor_;
    std::vector<FineSpan> spans_;                     // of the fine blocks along a coarse one
    std::vector<std::unique_ptr<FrontNodes>> nodes_;  // by the front's blocks; null where none is near the band
};

}  // namespace pavel
