#pragma once
// Who holds what after growth, at any resolution.
#include "pavel/vdb/fine_shapes.h"
#include "pavel/vdb/region.h"

namespace pavel {

/// What one element would hold in one block if it were alone there: 512 values each, in voxels of the builder's grid.
struct OwnField {
    const float* phi = nullptr;    ///< distance to the placed surface
    const float* way = nullptr;    ///< as GrownBlock's; phi where there is no front
    const float* scale = nullptr;  ///< as GrownBlock's
    float placed[512];             ///< holds these where nobody else does
    GrownBlock made;
};

/// Evaluates regions on a grid that is `factor` times (1 to 8) finer than the one the fronts marched on: arrival
/// times are interpolated (GrownField), while placed shapes, bisectors and base are taken at full resolution.
///
/// The region of i is, with T an arrival time, T* a stop time, and times running backwards inside the bodies,
///   max( min(phi_i, T_i - T_i*), -phi_B, taken_j )
///   taken_j = min(-phi_j, g_ij)                 where both were placed
///           = min(T_j* - T_j, T_i - T_j)        elsewhere
/// each term divided by the length of its gradient. What lies in the placed shape of one alone is never the other's.
class RegionBuilder {
  public:
    /// On the fronts' own grid. The arguments must outlive the builder; fronts are null where an element does not grow.
    /// What belongs to one element need only be there while a region is made that it may meet: rivalsOf.
    RegionBuilder(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
                  const std::vector<std::unique_ptr<Front>>& fronts)
        : RegionBuilder(elements, base, fronts, 1, nullptr) {}
    /// On a finer one: that of `base` and `fine`.
    RegionBuilder(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
                  const std::vector<std::unique_ptr<Front>>& fronts, int factor, const FineShapes* fine);

    /// The region of an element on the fronts' own grid. Needs factor 1.
    Region build(int i) const;
    /// The same on the finer grid, around the surface of the coarse one, and wherever it leads on from there.
    Region refine(int i, const Outline& coarse) const;
    /// The elements whose shapes or fronts may meet those of i, ascending, without i.
    std::vector<int> rivalsOf(int i) const;
    /// May any element's shape or front meet the box?
    bool reach(const CoordBBox& box) const { return !index_.meeting(box).empty(); }

  private:
    /// False where the element has nothing in the block.
    bool load(int i, const Coord& origin, OwnField& field) const;
    void clipBy(int i, int j, const Coord& origin, const OwnField& own, float* clip) const;
    bool evaluate(int i, const std::vector<int>& rivals, const Coord& origin, float* own, float* clip,
                  float* slope) const;
    /// Those of the rivals that may have something in a block of the fronts' grid.
    std::vector<int> meeting(const std::vector<int>& rivals, const Coord& coarseBlock) const;
    void addBlock(int i, const std::vector<int>& rivals, const Coord& origin, Region& region) const;
    void followSurface(int i, const std::vector<int>& rivals, Region& region) const;

    const std::vector<WorkElement>& elements_;
    const openvdb::FloatTree* base_;
    const std::vector<std::unique_ptr<Front>>& fronts_;
    int factor_;
    const FineShapes* fine_;
    std::vector<CoordBBox> reach_;
    ElementIndex index_;
    std::vector<std::vector<Coord>> blocks_;
};

}  // namespace pavel
