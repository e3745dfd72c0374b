#pragma once
// The rims of an element's contacts as curves, and the distance to them. Index space, voxels.
#include <functional>
#include <vector>

#include "pavel/core/vec.h"

namespace pavel {

/// A point of a rim, and the way from there along the element's own free surface: a unit vector, or zero where the two
/// surfaces run the same way. Where the rim is the other's, too: that along its surface.
struct RimPoint {
    Vec3f place, away{0, 0, 0}, othersAway{0, 0, 0};
};

/// Eight straight pieces of rim, so that one instruction works on several: middle and unit direction, zero where a
/// piece is a point.
struct RimLanes {
    static constexpr int kCount = 8;
    float x[kCount], y[kCount], z[kCount], tx[kCount], ty[kCount], tz[kCount];
    void set(int k, const Vec3f& middle, const Vec3f& along);
};

/// How a piece of rim bends: its curvature vector, and for how far on each side that holds.
struct RimBend {
    Vec3f curvature;
    float half;
};

/// The rim of the surface that an element shares with each neighbour (or, touching none, with the base), as short
/// straight pieces, and a smooth distance to it.
///
/// d = (sum_j d_j^-p)^(-1/p) over the distances d_j to each neighbour's rim, p = 4. The plain minimum over j has ridges
/// where two contacts are equally far, and growth copies them into the crown as a star of creases; this one is zero on
/// the same curves and smooth elsewhere.
class ContactDistance {
  public:
    /// One rim, in pieces.
    struct Rim {
        std::vector<RimLanes> lanes;
        std::vector<Vec3f> away;  ///< of each piece
        std::vector<RimBend> bend;
        struct Piece {
            Vec3f middle, along;
        };
        Piece piece(size_t i) const;
    };
    /// The same as the two elements that meet there see it; `others` where the rim is that of both.
    struct RimOfTwo {
        Rim own, others;
    };
    /// Joins points on the rim to a fraction of a voxel, dense, in any order, into pieces one to two voxels long.
    /// `settle`: moves the middle of a piece onto the rim with more care.
    static RimOfTwo join(const std::vector<RimPoint>& points, const std::function<Vec3f(const Vec3f&)>& settle = {});
    void add(Rim rim) { rims_.push_back(std::move(rim)); }
    bool empty() const { return rims_.empty(); }
    /// Distance in voxels; 1e9 where there is no contact. O(pieces), eight at a time: a search tree is slower.
    double operator()(const Vec3& p) const { return measure(p).distance; }
    /// The point on a rim that is nearest to p, and how far from it p lies along the element's free surface: negative
    /// on the side of the shared one. p itself where there is no contact.
    struct Foot {
        Vec3 rim;
        double away = 0;
    };
    Foot nearest(const Vec3& p) const { return footOn(measure(p).rim, p); }
    /// The distance, and which rim is nearest (negative where there is none, or p lies on one), whose foot may be asked
    /// for afterwards.
    struct Measure {
        double distance;
        int rim;
    };
    Measure measure(const Vec3& p) const;
    Foot footOn(int rim, const Vec3& p) const;
    /// Middles of the pieces of one rim.
    std::vector<Vec3f> rimPoints(size_t rim) const;
    size_t rimCount() const { return rims_.size(); }
    /// Of all rims together, in voxels. O(pieces of a rim squared).
    double length() const;

    /// The pieces around a block, for many queries there: bent, where that is known.
    class Near {
      public:
        bool empty() const { return pieces_.empty(); }
        /// Points of a block, in any number up to kMost, and what is asked of them.
        struct Queries {
            static constexpr int kMost = 512;
            int count = 0;
            float x[kMost], y[kMost], z[kMost];
            float distance2[kMost];  ///< to the nearest piece
            float away[kMost];       ///< as in Foot
            int piece[kMost];        ///< which that is
        };
        void nearest(Queries& queries) const;
        Vec3f nearestOn(int piece, const Vec3f& p) const;
        struct Box {
            Vec3f lower{1e9f, 1e9f, 1e9f}, upper{-1e9f, -1e9f, -1e9f};
        };
        /// Around all pieces, for a first look.
        const Box& box() const { return box_; }

      private:
        friend class ContactDistance;
        struct Piece {
            Vec3f middle, along, away;
            RimBend bend;
        };
        std::vector<Piece> pieces_;
        Box box_;
    };
    /// Pieces that may be nearer than `distance` to a point of the ball.
    Near near(const Vec3& centre, double radius, double distance) const;

  private:
    std::vector<Rim> rims_;
};

}  // namespace pavel
