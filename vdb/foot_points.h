#pragma once
// Foot points: for the voxels of a block beside a surface, the nearest point on it. Internal to re-distancing.
#include "pavel/vdb/grid.h"

namespace pavel {

inline float dotf(const Vec3f& a, const Vec3f& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// How a surface lies around a foot point.
struct Foot {
    Vec3f along;   ///< unit normal of the surface, or direction of the crease
    int onCrease;  ///< 0 or 1; a word, so that eight feet can be read at a time
};

struct FootPoint : Foot {
    Vec3f point;
};

/// Values of one block: own and, where a second field cuts it, clip; null where `tile` stands for all.
struct BlockValues {
    const float *own = nullptr, *clip = nullptr;
    float tile = kBand;

    bool inside(int v) const { return own ? (own[v] < 0) & (!clip || clip[v] < 0) : tile < 0; }
};

/// The fields of one block and three voxels around it. Places are those of this box: the block begins at kHalo.
class Patch {
  public:
    static constexpr int kHalo = 3, kSide = 8 + 2 * kHalo, kRow = 16, kSlab = kSide * kRow, kCount = kSide * kSlab;

    /// @param around the block, number 13, and its neighbours, x slowest
    void load(const BlockValues* const around[27]);
    /// Voxels of row (x, y) of the block that have a face neighbour on the other side: bit z.
    unsigned crossing(int x, int y) const {
        const int row = (x + kHalo) * kSide + y + kHalo;
        const unsigned m = inside_[row];
        return ((m ^ m << 1) | (m ^ m >> 1) | (m ^ inside_[row - kSide]) | (m ^ inside_[row + kSide]) |
                (m ^ inside_[row - 1]) | (m ^ inside_[row + 1])) >>
                   kHalo &
               0xff;
    }
    /// Along the gradient of the field that decides at a voxel; where it leads to what the other field cuts away, the
    /// nearest point of the crease in which the two meet.
    FootPoint findFoot(int x, int y, int z) const;

  private:
    void stepAcross(int i, const Vec3f& p, FootPoint& foot) const;

    float own_[kCount] = {}, clip_[kCount] = {};
    unsigned inside_[kSide * kSide];
};

}  // namespace pavel
