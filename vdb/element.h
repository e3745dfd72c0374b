#pragma once
// An element in work, from its placement to its trimmed body. Index space, voxels.
#include <memory>
#include <vector>

#include "pavel/core/placement.h"
#include "pavel/vdb/pieces.h"

namespace pavel {

class ContactDistance;  // contact.h
struct CanonicalField;  // voxelize.h

struct WorkElement {
    int id = 0;  ///< 1..n; elements lie in a vector at id - 1
    int kind = 0;
    Frame indexFromElement;
    Vec3 centre{0, 0, 0};                  ///< centroid of the placed volume
    double stiffness = 1;                  ///< infinity: rigid
    const CanonicalField* deep = nullptr;  ///< distances all through its inside, where depth tells who keeps a point
    double size = 0;                  ///< diagonal of the bounding box in the element's own frame: the unit of a and b
    CoordBBox box;                    ///< of the placed level set, its band included
    WorkTree::Ptr placed;             ///< level set as placed
    BodyTree::Ptr body;               ///< voxels left after neighbours and base took their share
    std::vector<int> neighbours;      ///< indices of elements whose boxes meet, ascending
    std::vector<int> contacts;        ///< indices of those that it shares a contact surface with
    std::vector<MaskedBlock> strays;  ///< pieces that the trim cut off, erased from `placed`
    double placedVolume = 0, bodyVolume = 0;
    double targetVolume = 0;  ///< placed, less what the base cuts off for good
    uint64_t placedVoxels = 0, bodyVoxels = 0;
    std::shared_ptr<ContactDistance> contact;

    /// Volume to win back by growing.
    double lost() const { return targetVolume - bodyVolume; }
};

/// The boxes of all, in order.
inline std::vector<CoordBBox> boxesOf(const std::vector<WorkElement>& elements) {
    std::vector<CoordBBox> boxes;
    for (const WorkElement& e : elements) boxes.push_back(e.box);
    return boxes;
}

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
    /// Does depth decide? Then the distances to both placed surfaces, where they are known, tell the same.
    bool byDepth() const { return rule_ == kDepth; }
    double fromDistances(double own, double other) const { return shareOfOwn() * own - shareOfOther() * other; }
    double shareOfOwn() const {
        return (sign_ > 0 ? lowStiffness_ : highStiffness_) / (lowStiffness_ + highStiffness_);
    }
    double shareOfOther() const {
        return (sign_ > 0 ? highStiffness_ : lowStiffness_) / (lowStiffness_ + highStiffness_);
    }

  private:
    enum Rule { kPlane, kWeighted, kDepth };
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
