#pragma once
// An element at full resolution, made block by block where somebody asks.
#include <atomic>
#include <map>
#include <memory>
#include <vector>

#include "pavel/vdb/block_numbers.h"
#include "pavel/vdb/grown_field.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {

/// The voxels of the fine grid that an element, or its front (may be null), may reach. Boxes of whole leaves.
CoordBBox reachOf(const WorkElement& element, const Front* front, int factor);

/// The element in one leaf.
struct FineBlock {
    float phi[512];                     ///< distance to the placed surface, within kBand
    std::unique_ptr<GrownBlock> grown;  ///< null where its front does not come near
};

/// What an element, settled on a grid `factor` times coarser, is there by itself: as placed, less the pieces that were
/// cut off, and what its front holds. Only what is asked for is computed, once. Safe to use from many threads.
class FineShape {
  public:
    /// The arguments must outlive it. `front`: null where the element does not grow.
    FineShape(const WorkElement& coarse, const Front* front, const CanonicalField& field, const Frame& indexFromElement,
              int factor);
    ~FineShape();
    /// At a leaf's origin.
    const FineBlock& at(const Coord& origin) const;
    /// The block that stands for all in which an element has nothing.
    static const FineBlock& nothing();

  private:
    FineBlock* make(const Coord& origin) const;
    bool eraseStrays(const Coord& origin, float* phi) const;

    const WorkElement& coarse_;
    Placement placement_;
    std::unique_ptr<GrownField> grown_;
    int factor_;
    std::map<Coord, BlockMask> strays_;  // on the coarse grid
    std::vector<CoordBBox> strayBoxes_;  // of what they reach
    BlockBox box_;
    std::unique_ptr<std::atomic<FineBlock*>[]> blocks_;  // null until asked for
};

}  // namespace pavel
