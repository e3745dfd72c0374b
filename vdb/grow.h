#pragma once
// All fronts on one clock, and the stop times that give every element its volume back.
#include <functional>

#include "pavel/core/run_context.h"
#include "pavel/vdb/front.h"
#include "pavel/vdb/region.h"

namespace pavel {

class RegionBuilder;  // region_builder.h

struct Material {
    double a = 0.1, b = 0.3;  ///< shares of the element's size
};

/// The competition of all fronts and what came of it.
///
/// Rounds of a common time window: every front marches alone, enters its claims by an atomic minimum of (arrival, id),
/// and loses what another reached first. Nothing depends on which thread did what when: equal bytes on any number.
class Growth {
  public:
    /// `materials` by kind. Elements without loss or contact get no front.
    Growth(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
           const std::vector<Material>& materials);

    /// @param window voxels that the fastest front covers in one round: how old another's claim may be before it is
    /// seen. Short ones march like a single queue, but in many rounds.
    void march(const RunContext& context, double window = 1.5);
    /// Takes an element's region and how much later its front is to stop: the last call for an element stands. Comes
    /// from many threads, for one element from one at a time.
    using UseRegion = std::function<void(int element, Region& region, double later)>;
    /// Solves the stop times on the sub-voxel volume of the regions; targets by index, in voxels. Goes on until no
    /// front moves by more than `still` voxels, or its neighbours hinder it. `close`: as solveShift's. Fronts that no
    /// element left to solve sees are not marched on to their last stop times: see catchUp. `done`: takes elements
    /// whose fronts and shapes no region will ask for any more, as early as that is known; also from many threads.
    void solveStopTimes(const std::vector<double>& targets, double still, double close, const RunContext& context,
                        const UseRegion& use = {}, const std::function<void(int element)>& done = {});

    /// Null where the element did not grow.
    const Front* front(int i) const { return fronts_[size_t(i)].get(); }
    const std::vector<std::unique_ptr<Front>>& fronts() const { return fronts_; }
    size_t grownVoxels() const;
    /// Marches all fronts on to their last stop times; for who builds regions after solveStopTimes.
    void catchUp();
    /// The same, and Front::lookBeyond for all; call before the clock is freed.
    void lookBeyond();
    /// Frees the shared clock: no more marching after this.
    void dropClaims() { claims_.clear(), hasClaims_ = false; }
    /// Frees what one front knows of its voxels.
    void drop(int i) {
        if (fronts_[size_t(i)]) fronts_[size_t(i)]->forget();
    }

  private:
    /// Elements, and those whose fronts their regions ask for.
    std::vector<int> seenBy(const std::vector<int>& elements, const RegionBuilder& builder) const;
    void catchUp(const std::vector<int>& elements);
    /// Frees the clock until somebody is to march; what the fronts hold of it they keep.
    void leaveClaims();
    void restoreClaims();

    const std::vector<WorkElement>& elements_;
    const openvdb::FloatTree* base_;
    ClaimMap claims_;
    bool hasClaims_ = true;
    std::vector<std::unique_ptr<Front>> fronts_;
    std::vector<float> stopTimes_;  // by id
    std::vector<double> horizons_;  // how far a front is to go on; infinite where it has
};

/// How much later the front of a region must stop for a volume (voxels); negative: earlier. At most the time in which
/// it moves by `most` voxels. `close`: share of the volume that may be left over.
struct StopShift {
    double later = 0;    ///< solves, or comes as near as `most` allows
    double missing = 0;  ///< volume that was missing before
    double reach = 0;    ///< time in which the front moves by a voxel; 0 where nothing moves
};
StopShift solveShift(const Region& region, double target, double most, double close);

}  // namespace pavel
