#pragma once
// All fronts on one clock, and the stop times that give every element its volume back.
#include "pavel/core/run_context.h"
#include "pavel/vdb/front.h"

namespace pavel {

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

    void march(const RunContext& context);
    /// Solves the stop times on the sub-voxel volume of the regions; targets by index, in voxels.
    void solveStopTimes(const std::vector<double>& targets, const RunContext& context);

    /// Level set of element i after growth, raw: right where it changes sign, not a distance farther out.
    WorkTree::Ptr region(int i) const;
    /// Null where the element did not grow.
    const Front* front(int i) const { return fronts_[size_t(i)].get(); }
    size_t grownVoxels() const;
    /// Value of the region of i at a voxel of one of its blocks, unclipped by other elements.
    float ownValue(int i, const GrowthBlock& block, int v) const;

  private:
    WorkTree::Ptr rawRegion(int i) const;
    void registerBlocks();
    void displaceBodies(int i);
    void fillRegion(int i, const GrowthBlock& block, float* values) const;
    struct Evaluation {
        double volume = 0;  ///< of the region, sub-voxel
        double slope = 0;   ///< dV/dT: the integral of the speed over the free front
        double area = 0;    ///< of the free front
    };
    Evaluation evaluate(int i) const;
    void measureFixedPart(int i);

    const std::vector<WorkElement>& elements_;
    const openvdb::FloatTree* base_;
    ClaimMap claims_;
    std::vector<std::unique_ptr<Front>> fronts_;
    std::map<Coord, std::vector<int>> here_;  // fronts with a block at an origin
    std::vector<double> fixedVolume_;         // of the leaves that growth does not touch
    std::vector<std::vector<Coord>> touched_;
    std::vector<size_t> measuredBlocks_;
};

}  // namespace pavel
