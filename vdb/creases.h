#pragma once
// Creases between packed elements that touch, in their union.
#include <vector>

#include "pavel/vdb/element_index.h"

namespace pavel {

/// Minima of two distances with a fillet in the crease between them, a voxel deep: slits thinner than a voxel, which
/// no grid or printer can show, are filled instead of leaving a row of beads, and both sides of a contact face are well
/// inside. Fades out where the farther surface's narrow band ends. For a block's 512; `out` is neither of the two.
void blendMin(const float* a, const float* b, float* out);

/// How surfaces meet along the seams of a block, by its cells of 4^3 voxels: sums over voxels above the seams of the
/// cosine between both surfaces' normals, and their number.
struct Seams {
    float cosines[8] = {}, count[8] = {};
    /// Do they run on flush anywhere, as if there were but one surface?
    bool flush() const;
};

/// The union of some packed elements.
class ElementUnion {
  public:
    /// The elements must outlive it.
    explicit ElementUnion(const std::vector<const CompactLevelSet*>& elements);
    /// In a block: the least distance, and the second one.
    void read(const Coord& origin, float* least, float* second) const;
    Seams seams(const Coord& origin) const;
    /// Turns a tree of the least distances into one with fillets in its creases. Where seams are flush there is none,
    /// as it would be a weal: there slits are closed up to the surface (morphological closing by a ball of a voxel).
    void fillCreases(openvdb::FloatTree& tree) const;

  private:
    const std::vector<const CompactLevelSet*>& elements_;
    ElementIndex index_;
};

}  // namespace pavel
