#pragma once
// Who holds what after growth, at any resolution.
#include "pavel/vdb/front.h"
#include "pavel/vdb/region.h"

namespace pavel {

/// What one element would hold in one block if it were alone there. Voxels of the builder's grid.
struct OwnField {
    float phi[512];      ///< distance to the placed surface
    float way[512];      ///< distance-like: scale * (arrival - stop time); negative where the front came in time
    float scale[512];    ///< voxels per unit of time; 0 where the front does not go and `way` means nothing
    bool grown = false;  ///< false: no front here, `way` and `scale` are not set
    float own(int v) const { return grown && scale[v] > 0 ? std::min(phi[v], way[v]) : phi[v]; }
};

/// Evaluates regions on a grid that is `factor` times (1, 2, 4 or 8) finer than the one the fronts marched on: arrival
/// times are smooth away from the rims, so they are interpolated, while placed shapes, bisectors and base are taken at
/// full resolution. Near the rims the arrival is evaluated anew (Front::wedgeArrival).
///
/// The region of i is, with T an arrival time, T* a stop time, and times running backwards inside the bodies,
///   max( min(phi_i, T_i - T_i*), -phi_B, taken_j )
///   taken_j = min(-phi_j, g_ij)                 where both were placed
///           = min(T_j* - T_j, T_i - T_j)        elsewhere
/// each term divided by the length of its gradient.
class RegionBuilder {
  public:
    /// The arguments must outlive the builder. `elements` and `fronts` (null where one does not grow) are coarse,
    /// `base` and `placed` fine; a placed shape need only be there while a region is made that may meet it: rivalsOf.
    RegionBuilder(const std::vector<WorkElement>& elements, const std::vector<WorkTree::Ptr>& placed,
                  const openvdb::FloatTree* base, const std::vector<std::unique_ptr<Front>>& fronts, int factor);

    /// The region of an element on the fronts' own grid. Needs factor 1.
    Region build(int i) const;
    /// The same on the finer grid, around the surface of the coarse one.
    Region refine(int i, const Region& coarse) const;
    /// The elements whose shapes or fronts may meet those of i, ascending, without i.
    std::vector<int> rivalsOf(int i) const;

  private:
    /// False where the element has nothing in the block.
    bool load(int i, const Coord& origin, OwnField& field) const;
    void interpolate(const Front& front, const Coord& origin, OwnField& field) const;
    void mendNearRim(const Front& front, const Coord& origin, OwnField& field) const;
    void clipBy(int i, int j, const Coord& origin, const OwnField& own, float* clip) const;
    bool evaluate(int i, const std::vector<int>& rivals, const Coord& origin, float* own, float* clip,
                  float* slope) const;
    void addBlock(int i, const std::vector<int>& rivals, const Coord& origin, Region& region) const;

    const std::vector<WorkElement>& elements_;
    const std::vector<WorkTree::Ptr>& placed_;
    const openvdb::FloatTree* base_;
    const std::vector<std::unique_ptr<Front>>& fronts_;
    int factor_, shift_;
    std::vector<CoordBBox> reach_;
    ElementIndex index_;
};

}  // namespace pavel
