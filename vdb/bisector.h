#pragma once
// Who keeps a point that two elements were both placed on.
#include "pavel/vdb/element.h"

namespace pavel {

/// Distance to the bisector of two elements, positive on the other's side: who keeps a contested point.
/// By centre (paper): the nearest centre. Distances are weighed by stiffness, |x - c| / k: equal ones give a plane,
/// others a sphere of Apollonius. By depth, where both elements have `deep`: the one in which the point lies deeper,
/// k phi; this one is never more than the distance. A rigid element keeps everything. Exactly antisymmetric; coincident
/// centres, and two rigid ones, go to the lower id.
class Bisector {
  public:
    Bisector(const WorkElement& own, const WorkElement& other);
    double operator()(const Vec3& p) const {
        return sign_ * (rule_ == kPlane      ? dot(p, normal_) - offset_
                        : rule_ == kWeighted ? weightedDistance(p)
                                             : depthAt(p));
    }
    /// At a leaf's voxels, on a grid `factor` times finer: all in its voxels. `own`, `other`: distances to the two
    /// placed surfaces there, within kBand. No value is wrong within kSure of zero, none is there wrongly, and farther
    /// out they are only said to be so; where either distance is kBand, they need not make sense.
    void over(const Coord& origin, int factor, const float* own, const float* other, float* out) const;
    static constexpr float kSure = 2;

    /// Does depth decide? Then the two share a point of both surfaces.
    bool byDepth() const { return rule_ == kDepth; }

  private:
    enum Rule { kPlane, kWeighted, kDepth };
    double shareOfOwn() const {
        return (sign_ > 0 ? lowStiffness_ : highStiffness_) / (lowStiffness_ + highStiffness_);
    }
    double shareOfOther() const {
        return (sign_ > 0 ? highStiffness_ : lowStiffness_) / (lowStiffness_ + highStiffness_);
    }
    double weightedDistance(const Vec3& p) const;
    double depthAt(const Vec3& p) const;
    Vec3 normal_{0, 0, 0};
    double offset_ = 0, sign_ = 1;
    Rule rule_ = kPlane;
    const WorkElement *lo_ = nullptr, *hi_ = nullptr;
    Vec3 low_{0, 0, 0}, high_{0, 0, 0};  // centres, and what they are divided by
    double lowStiffness_ = 1, highStiffness_ = 1;
};

}  // namespace pavel
