#pragma once
// The contact curves of an element, and the distance to them that drives its growth.
#include <memory>
#include <vector>

#include "pavel/vdb/element.h"

namespace pavel {

/// The rim of the surface that an element shares with each neighbour (or, touching none, with the base), as points to a
/// fraction of a voxel, and a smooth distance to it.
///
/// d = (sum_j d_j^-p)^(-1/p) over the distances d_j to each neighbour's rim, p = 4. The plain minimum over j has ridges
/// where two contacts are equally far, and growth copies them into the crown as a star of creases; this one is zero on
/// the same curves and smooth elsewhere.
struct ContactDistance {
    ContactDistance();
    ~ContactDistance();
    void addRim(std::vector<Vec3f> points);
    bool empty() const { return rims_.empty(); }
    /// Distance in voxels; 1e9 where there is no contact. O(rims log points).
    double operator()(const Vec3& p) const;
    /// The nearest rim point; p itself where there is no contact.
    Vec3 nearest(const Vec3& p) const;
    /// All the points, rim by rim.
    const std::vector<Vec3f>& rimPoints(size_t rim) const;
    size_t rimCount() const { return rims_.size(); }

  private:
    struct Rim;
    std::vector<std::unique_ptr<Rim>> rims_;
};

/// Finds the contact curves of one element: where its placed surface meets the region taken by a neighbour, or by the
/// base when it touches no other. Fills `contacts` and `contact`.
void findContacts(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base);

}  // namespace pavel
