#pragma once
// The contact curves of an element, and the distance to them that drives its growth.
#include <memory>
#include <vector>

#include "pavel/vdb/element.h"

namespace pavel {

/// The rim of the surface that an element shares with each neighbour (or, touching none, with the base), as short
/// straight pieces, and a smooth distance to it.
///
/// d = (sum_j d_j^-p)^(-1/p) over the distances d_j to each neighbour's rim, p = 4. The plain minimum over j has ridges
/// where two contacts are equally far, and growth copies them into the crown as a star of creases; this one is zero on
/// the same curves and smooth elsewhere.
class ContactDistance {
  public:
    /// Points on the rim to a fraction of a voxel, dense, in any order: joined into pieces one to two voxels long.
    void addRim(const std::vector<Vec3f>& points);
    bool empty() const { return rims_.empty(); }
    /// Distance in voxels; 1e9 where there is no contact. O(pieces), eight at a time: a search tree is slower.
    double operator()(const Vec3& p) const;
    /// The nearest point on a rim; p itself where there is no contact.
    Vec3 nearest(const Vec3& p) const;
    /// Middles of the pieces of one rim.
    std::vector<Vec3f> rimPoints(size_t rim) const;
    size_t rimCount() const { return rims_.size(); }

    struct Piece {
        Vec3f middle, along;  ///< unit direction, zero where the piece is a point
        Vec3f nearest(const Vec3f& p) const;
    };
    /// Pieces that may be nearer than `distance` to a point of the ball.
    std::vector<Piece> piecesNear(const Vec3& centre, double radius, double distance) const;

  private:
    static constexpr int kLanes = 8;
    struct Lanes {
        float x[kLanes], y[kLanes], z[kLanes], tx[kLanes], ty[kLanes], tz[kLanes];
        Piece piece(int k) const { return {{x[k], y[k], z[k]}, {tx[k], ty[k], tz[k]}}; }
    };
    struct Rim {
        std::vector<Lanes> lanes;
        size_t count = 0;
    };
    static void distances2(const Lanes& lanes, const float p[3], float d2[kLanes]);
    std::vector<Rim> rims_;
};

/// Finds the contact curves of one element: where its placed surface meets the region taken by a neighbour, or by the
/// base when it touches no other. Fills `contacts` and `contact`.
void findContacts(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base);

}  // namespace pavel
