#include "pavel/vdb/contact_distance.h"

#include <algorithm>

#include "pavel/core/wide.h"

namespace pavel {
namespace {

/// Half the length of a piece of rim; middles are about twice this apart, or less.
constexpr float kHalfPiece = 0.75f, kSpacing = 1.2f;
/// The same where the way on is known to bend with the rim: no gaps between them.
constexpr float kHalfArc = 1.2f;
constexpr double kExponent = 4;

/// Main direction of the points within two voxels, by power iteration on their covariance; zero for a lone point.
Vec3f directionAt(const std::vector<RimPoint>& points, const Vec3f& middle) {
    double c[6] = {};  // xx xy xz yy yz zz
    for (const RimPoint& p : points) {
        const Vec3f d = p.place - middle;
        if (d.sqrnorm() > 4) continue;
        c[0] += double(d[0]) * d[0], c[1] += double(d[0]) * d[1], c[2] += double(d[0]) * d[2];
        c[3] += double(d[1]) * d[1], c[4] += double(d[1]) * d[2], c[5] += double(d[2]) * d[2];
    }
    Vec3 t = c[0] >= c[3] && c[0] >= c[5] ? Vec3(c[0], c[1], c[2])
             : c[3] >= c[5]               ? Vec3(c[1], c[3], c[4])
                                          : Vec3(c[2], c[4], c[5]);
    for (int it = 0; it < 8; ++it) {
        const double l = length(t);
        if (l < 1e-9) return {0, 0, 0};
        t /= l;
        t = Vec3(c[0] * t[0] + c[1] * t[1] + c[2] * t[2], c[1] * t[0] + c[3] * t[1] + c[4] * t[2],
                 c[2] * t[0] + c[4] * t[1] + c[5] * t[2]);
    }
    t = normalized(t);
    return {float(t[0]), float(t[1]), float(t[2])};
}

const RimBend kStraight{{0, 0, 0}, kHalfPiece};

/// Fits an arc through the middle to the points within two voxels, and turns the direction along it; straight, and the
/// direction as it was, where they do not lie on one, as at a corner.
RimBend bendAt(const std::vector<RimPoint>& points, const Vec3f& middle, Vec3f& along) {
    constexpr float kOff = 0.1f;                // voxels, at most
    std::vector<std::pair<float, Vec3f>> near;  // way along, and off the line
    double s2 = 0, s3 = 0, s4 = 0;
    Vec3 off1(0, 0, 0), off2(0, 0, 0);
    for (const RimPoint& p : points) {
        const Vec3f d = p.place - middle;
        if (d.sqrnorm() > 4) continue;
        const float s = d | along;
        const Vec3f off = d - along * s;
        near.emplace_back(s, off);
        const double ss = double(s) * s;
        s2 += ss, s3 += ss * s, s4 += ss * ss;
        for (int k = 0; k < 3; ++k) off1[k] += double(s) * off[k], off2[k] += ss * off[k];
    }
    const double det = s2 * s4 - s3 * s3;
    if (det < 0.1 * s2 * s4) return kStraight;
    const Vec3 slope = (off1 * s4 - off2 * s3) / det, half = (off2 * s2 - off1 * s3) / det;
    const Vec3f tilt{float(slope[0]), float(slope[1]), float(slope[2])},
        curve{float(half[0]), float(half[1]), float(half[2])};
    for (const auto& [s, off] : near)
        if ((off - tilt * s - curve * (s * s)).sqrnorm() > kOff * kOff) return kStraight;
    along += tilt;
    along.normalize();
    return {curve * 2, kHalfArc};
}

}  // namespace

void RimLanes::set(int k, const Vec3f& m, const Vec3f& t) {
    x[k] = m[0], y[k] = m[1], z[k] = m[2];
    tx[k] = t[0], ty[k] = t[1], tz[k] = t[2];
}

namespace {

/// The point of a piece that is nearest.
[[gnu::always_inline]] inline Vec3f nearestOn(const RimLanes& l, int k, const Vec3f& p) {
    const Vec3f m{l.x[k], l.y[k], l.z[k]}, t{l.tx[k], l.ty[k], l.tz[k]}, v = p - m;
    return m + t * std::clamp(v[0] * t[0] + v[1] * t[1] + v[2] * t[2], -kHalfPiece, kHalfPiece);
}

/// Mean way along the free surface around a point, if all agree: where a rim bends round a corner, it tells no side.
Vec3f awayAt(const std::vector<RimPoint>& points, const RimPoint& at, Vec3f RimPoint::*away) {
    constexpr float kAround = 5, kMean = 1.5f, kAgree = 0.7f;
    Vec3f sum{0, 0, 0};
    for (const RimPoint& p : points) {
        const float d2 = (p.place - at.place).sqrnorm();
        if (d2 < kAround * kAround && (p.*away | at.*away) < kAgree) return {0, 0, 0};
        if (d2 < kMean * kMean) sum += p.*away;
    }
    return sum.normalized();
}

constexpr Vec3f::value_type kNowhere = 1e9f;

/// Groups pieces in lanes; the last is filled up with pieces that are far from everything.
std::vector<RimLanes> inLanes(const std::vector<std::pair<Vec3f, Vec3f>>& pieces) {
    std::vector<RimLanes> lanes((pieces.size() + RimLanes::kCount - 1) / RimLanes::kCount);
    for (size_t i = 0; i < lanes.size() * RimLanes::kCount; ++i)
        lanes[i / RimLanes::kCount].set(int(i % RimLanes::kCount),
                                        i < pieces.size() ? pieces[i].first : Vec3f{kNowhere, kNowhere, kNowhere},
                                        i < pieces.size() ? pieces[i].second : Vec3f{0, 0, 0});
    return lanes;
}

/// Squared distances to eight pieces. Inlined: each caller is compiled for wide registers itself.
[[gnu::always_inline]] inline void distances2(const RimLanes& l, const Vec3f& p, float d2[RimLanes::kCount]) {
    PAVEL_ROLLED
    for (int k = 0; k < RimLanes::kCount; ++k) {
        const float vx = p[0] - l.x[k], vy = p[1] - l.y[k], vz = p[2] - l.z[k];
        float s = vx * l.tx[k] + vy * l.ty[k] + vz * l.tz[k];
        s = s > kHalfPiece ? kHalfPiece : s;
        s = s < -kHalfPiece ? -kHalfPiece : s;
        const float wx = vx - s * l.tx[k], wy = vy - s * l.ty[k], wz = vz - s * l.tz[k];
        d2[k] = wx * wx + wy * wy + wz * wz;
    }
}

/// The nearest of the pieces.
[[gnu::always_inline]] inline int nearestIn(const std::vector<RimLanes>& lanes, const Vec3f& p) {
    float least[RimLanes::kCount], d2[RimLanes::kCount];
    int lane[RimLanes::kCount];
    std::fill(least, least + RimLanes::kCount, 1e30f);
    std::fill(lane, lane + RimLanes::kCount, 0);
    for (int i = 0; i < int(lanes.size()); ++i) {
        distances2(lanes[size_t(i)], p, d2);
        PAVEL_ROLLED
        for (int k = 0; k < RimLanes::kCount; ++k) {
            lane[k] = d2[k] < least[k] ? i : lane[k];
            least[k] = d2[k] < least[k] ? d2[k] : least[k];
        }
    }
    int nearest = 0;
    for (int k = 1; k < RimLanes::kCount; ++k)
        if (least[k] < least[nearest] || (least[k] == least[nearest] && lane[k] < lane[nearest])) nearest = k;
    return lane[nearest] * RimLanes::kCount + nearest;
}

}  // namespace

ContactDistance::RimOfTwo ContactDistance::join(const std::vector<RimPoint>& points,
                                                const std::function<Vec3f(const Vec3f&)>& settle) {
    RimOfTwo rim;
    std::vector<std::pair<Vec3f, Vec3f>> pieces;
    for (const RimPoint& p : points) {
        if (std::any_of(pieces.begin(), pieces.end(),
                        [&](const auto& m) { return (m.first - p.place).sqrnorm() < kSpacing * kSpacing; }))
            continue;
        pieces.emplace_back(p.place, directionAt(points, p.place));
        rim.own.away.push_back(awayAt(points, p, &RimPoint::away));
        rim.others.away.push_back(awayAt(points, p, &RimPoint::othersAway));
        rim.own.bend.push_back(settle ? bendAt(points, p.place, pieces.back().second) : kStraight);
        if (settle) pieces.back().first = settle(p.place);
    }
    rim.own.lanes = rim.others.lanes = inLanes(pieces);
    rim.others.bend = rim.own.bend;
    return rim;
}

ContactDistance::Rim::Piece ContactDistance::Rim::piece(size_t i) const {
    const RimLanes& l = lanes[i / RimLanes::kCount];
    const size_t k = i % RimLanes::kCount;
    return {{l.x[k], l.y[k], l.z[k]}, {l.tx[k], l.ty[k], l.tz[k]}};
}

std::vector<Vec3f> ContactDistance::rimPoints(size_t rim) const {
    std::vector<Vec3f> points;
    for (size_t i = 0; i < rims_[rim].away.size(); ++i) points.push_back(rims_[rim].piece(i).middle);
    return points;
}

double ContactDistance::length() const {
    // A piece stands for half the way to the next one on each side; where there is none near, the rim ends with it.
    constexpr float kFarthest = 3;
    double sum = 0;
    for (const Rim& rim : rims_)
        for (size_t i = 0; i < rim.away.size(); ++i) {
            const Rim::Piece at = rim.piece(i);
            float before2 = kFarthest * kFarthest, after2 = before2;
            for (size_t j = 0; j < rim.away.size(); ++j) {
                if (j == i) continue;
                const Vec3f d = rim.piece(j).middle - at.middle;
                const float d2 = d.sqrnorm(), along = d | at.along;
                if (4 * along * along < d2) continue;  // beside it
                float& nearest2 = along < 0 ? before2 : after2;
                nearest2 = std::min(nearest2, d2);
            }
            for (const float d2 : {before2, after2})
                sum += d2 < kFarthest * kFarthest ? 0.5 * std::sqrt(double(d2)) : double(kHalfPiece);
        }
    return sum;
}

PAVEL_WIDE ContactDistance::Near ContactDistance::near(const Vec3& centre, double radius, double distance) const {
    const float reach = float(radius + distance);
    Near near;
    float d2[RimLanes::kCount];
    for (const Rim& rim : rims_)
        for (size_t i = 0; i < rim.lanes.size(); ++i) {
            const RimLanes& l = rim.lanes[i];
            distances2(l, Vec3f(centre), d2);
            for (int k = 0; k < RimLanes::kCount; ++k)
                if (d2[k] < reach * reach)
                    near.pieces_.push_back({{l.x[k], l.y[k], l.z[k]},
                                            {l.tx[k], l.ty[k], l.tz[k]},
                                            rim.away[i * RimLanes::kCount + size_t(k)],
                                            rim.bend[i * RimLanes::kCount + size_t(k)]});
        }
    for (const Near::Piece& piece : near.pieces_)
        for (int k = 0; k < 3; ++k) {
            const RimBend& bend = piece.bend;
            const float half = bend.half * std::abs(piece.along[size_t(k)]), middle = piece.middle[size_t(k)],
                        aside = 0.5f * bend.half * bend.half * bend.curvature[size_t(k)];
            near.box_.lower[size_t(k)] = std::min(near.box_.lower[size_t(k)], middle - half + std::min(aside, 0.f));
            near.box_.upper[size_t(k)] = std::max(near.box_.upper[size_t(k)], middle + half + std::max(aside, 0.f));
        }
    return near;
}

PAVEL_WIDE void ContactDistance::Near::nearest(Queries& q) const {
    std::fill(q.distance2, q.distance2 + q.count, 1e30f);
    std::fill(q.piece, q.piece + q.count, -1);
    for (int k = 0; k < int(pieces_.size()); ++k) {
        const Vec3f m = pieces_[size_t(k)].middle, t = pieces_[size_t(k)].along, a = pieces_[size_t(k)].away;
        const Vec3f bend = pieces_[size_t(k)].bend.curvature * 0.5f;
        const float mx = m[0], my = m[1], mz = m[2], tx = t[0], ty = t[1], tz = t[2], ax = a[0], ay = a[1], az = a[2],
                    bx = bend[0], by = bend[1], bz = bend[2], half = pieces_[size_t(k)].bend.half;
        for (int i = 0; i < q.count; ++i) {
            const float vx = q.x[i] - mx, vy = q.y[i] - my, vz = q.z[i] - mz;
            float s = vx * tx + vy * ty + vz * tz;
            s = s > half ? half : s;
            s = s < -half ? -half : s;
            const float ss = s * s, wx = vx - s * tx - ss * bx, wy = vy - s * ty - ss * by, wz = vz - s * tz - ss * bz,
                        d2 = wx * wx + wy * wy + wz * wz;
            q.piece[i] = d2 < q.distance2[i] ? k : q.piece[i];
            q.away[i] = d2 < q.distance2[i] ? wx * ax + wy * ay + wz * az : q.away[i];
            q.distance2[i] = d2 < q.distance2[i] ? d2 : q.distance2[i];
        }
    }
}

Vec3f ContactDistance::Near::nearestOn(int piece, const Vec3f& p) const {
    const auto& [middle, along, away, bend] = pieces_[size_t(piece)];
    const float s = std::clamp((p - middle) | along, -bend.half, bend.half);
    return middle + along * s + bend.curvature * (0.5f * s * s);
}

PAVEL_WIDE ContactDistance::Measure ContactDistance::measure(const Vec3& p) const {
    const Vec3f q = Vec3f(p);
    double sum = 0;
    float closest = 1e30f;
    int nearest = -1;
    for (int r = 0; r < int(rims_.size()); ++r) {
        float best[RimLanes::kCount], d2[RimLanes::kCount];
        std::fill(best, best + RimLanes::kCount, 1e30f);
        for (const RimLanes& l : rims_[size_t(r)].lanes) {
            distances2(l, q, d2);
            PAVEL_ROLLED
            for (int k = 0; k < RimLanes::kCount; ++k) best[k] = d2[k] < best[k] ? d2[k] : best[k];
        }
        for (int n = RimLanes::kCount / 2; n > 0; n /= 2) {
            PAVEL_ROLLED
            for (int k = 0; k < n; ++k) best[k] = best[k + n] < best[k] ? best[k + n] : best[k];
        }
        nearest = best[0] < closest ? r : nearest;
        closest = best[0] < closest ? best[0] : closest;
        const double least = best[0];
        sum += 1 / (least * least);  // d^-4
    }
    static_assert(kExponent == 4, "the sum above spells the exponent out");
    if (nearest < 0) return {1e9, -1};
    if (closest < 1e-8f) return {0, -1};
    return {1 / std::sqrt(std::sqrt(sum)), nearest};
}

PAVEL_WIDE ContactDistance::Foot ContactDistance::footOn(int nearest, const Vec3& p) const {
    if (nearest < 0) return {p};
    const Rim& rim = rims_[size_t(nearest)];
    const Vec3f q = Vec3f(p);
    const int piece = nearestIn(rim.lanes, q);
    const Vec3f on = nearestOn(rim.lanes[size_t(piece / RimLanes::kCount)], piece % RimLanes::kCount, q);
    const Vec3f& away = rim.away[size_t(piece)];
    const Vec3 foot(on[0], on[1], on[2]);
    return {foot, dot(p - foot, Vec3(away[0], away[1], away[2]))};
}

}  // namespace pavel
