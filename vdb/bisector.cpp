#include "pavel/vdb/bisector.h"

#include <algorithm>
#include <cstring>

#include "pavel/vdb/voxelize.h"

namespace pavel {
namespace {

/// A linear function of the voxel.
PAVEL_WIDE void overPlane(float at, const Vec3f& slope, float* out) {
    const float sx = slope[0], sy = slope[1], sz = slope[2];
    for (int row = 0; row < 64; ++row) {
        const float start = at + sx * float(row >> 3) + sy * float(row & 7);
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) out[8 * row + z] = start + sz * float(z);
    }
}

/// From both distances. True where some are cut by the band and do not tell it: which, 1 for each.
PAVEL_WIDE bool overDepths(float shareOwn, float shareOther, const float* own, const float* other, float* out,
                           uint8_t* untold) {
    int any = 0;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float value = shareOwn * own[v] - shareOther * other[v];
        out[v] = value;
        const bool ownCut = own[v] <= -kBand, otherCut = other[v] <= -kBand;
        // Deeper in the own one only lessens the value, deeper in the other one adds to it.
        const bool told = (!ownCut | (value <= -Bisector::kSure)) & (!otherCut | (value >= Bisector::kSure));
        const int asked = int(!told & (own[v] < kBand) & (other[v] < kBand));
        untold[v] = uint8_t(asked);
        any += asked;
    }
    return any > 0;
}

}  // namespace

Bisector::Bisector(const WorkElement& own, const WorkElement& other) {
    const WorkElement &lo = own.id < other.id ? own : other, &hi = own.id < other.id ? other : own;
    sign_ = own.id < other.id ? 1 : -1;
    const Vec3 d = hi.centre - lo.centre;
    const double l = length(d);
    const bool loRigid = std::isinf(lo.stiffness), hiRigid = std::isinf(hi.stiffness);
    const auto same = [](const Vec3& a, const Vec3& b) { return length(a - b) < 1e-6; };
    const Frame &a = lo.indexFromElement, &b = hi.indexFromElement;
    const bool byDepth = lo.deep && hi.deep,
               tied = l < 1e-6 && (!byDepth || (lo.deep == hi.deep && same(a.x, b.x) && same(a.z, b.z)));
    if (tied || loRigid || hiRigid) {
        offset_ = hiRigid && !loRigid ? -1e6 : 1e6;  // everything lies on one side
        return;
    }
    rule_ = byDepth ? kDepth : lo.stiffness != hi.stiffness ? kWeighted : kPlane;
    lo_ = &lo, hi_ = &hi;
    low_ = lo.centre, high_ = hi.centre;
    lowStiffness_ = lo.stiffness, highStiffness_ = hi.stiffness;
    normal_ = d / std::max(l, 1e-9);
    offset_ = dot(0.5 * (lo.centre + hi.centre), normal_);
}

double Bisector::weightedDistance(const Vec3& p) const {
    const Vec3 a = p - low_, b = p - high_;
    const double la = std::max(length(a), 1e-9), lb = std::max(length(b), 1e-9);
    const Vec3 slope = a / (la * lowStiffness_) - b / (lb * highStiffness_);
    return (la / lowStiffness_ - lb / highStiffness_) / std::max(length(slope), 1e-9);
}

double Bisector::depthAt(const Vec3& p) const {
    return (lowStiffness_ * placedDistance(*lo_->deep, lo_->indexFromElement, p) -
            highStiffness_ * placedDistance(*hi_->deep, hi_->indexFromElement, p)) /
           (lowStiffness_ + highStiffness_);
}

void Bisector::over(const Coord& origin, int factor, const float* own, const float* other, float* out) const {
    const auto at = [&](int v) {
        return float(factor * (*this)(centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))) / factor));
    };
    if (rule_ == kPlane)
        return overPlane(at(0), Vec3f(float(sign_ * normal_[0]), float(sign_ * normal_[1]), float(sign_ * normal_[2])),
                         out);
    if (rule_ == kWeighted) {
        for (int v = 0; v < 512; ++v) out[v] = own[v] < kBand && other[v] < kBand ? at(v) : kBand;
        return;
    }
    uint8_t untold[512];
    if (!overDepths(float(shareOfOwn()), float(shareOfOther()), own, other, out, untold)) return;
    // Where the band cuts them, from the deep fields, 4^3 voxels at a time.
    const auto onThisGrid = [&](const WorkElement& e) {
        Frame frame = e.indexFromElement;
        frame.origin *= factor, frame.scale *= factor;
        return Placement(*e.deep, frame);
    };
    const bool ownIsLow = sign_ > 0;
    const Placement ownDeep = onThisGrid(ownIsLow ? *lo_ : *hi_), otherDeep = onThisGrid(ownIsLow ? *hi_ : *lo_);
    const float ownShare = float(shareOfOwn()), otherShare = float(shareOfOther());
    float owns[512], others[512];
    for (int part = 0; part < 8; ++part) {
        bool asked = false;
        for (int k = 0; k < 64; k += 4) {
            const int row = Placement::voxelOf(part, k);  // four voxels follow each other
            uint32_t four;
            std::memcpy(&four, untold + row, 4);
            if (!four) continue;
            if (!asked) ownDeep.sampleDeep(origin, part, owns), otherDeep.sampleDeep(origin, part, others);
            asked = true;
            for (int v = row; v < row + 4; ++v)
                if (untold[v]) out[v] = ownShare * owns[v] - otherShare * others[v];
        }
    }
}

}  // namespace pavel
