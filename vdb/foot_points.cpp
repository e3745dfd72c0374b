#include "pavel/vdb/foot_points.h"

#include <algorithm>
#include <cstring>

namespace pavel {
namespace {

/// Nearer to both fields than this, a voxel may have its foot on the crease between them.
constexpr float kCrease = 1.8f;
/// Farther from a voxel than this, no foot point is looked for.
constexpr float kFarthest = 1.75f;

/// A field with less of a slope tells no direction. Where two fronts run side by side, that between them is flat.
constexpr float kFlattest = 0.03f;

constexpr int placeOf(int x, int y, int z) {
    return x * Patch::kSlab + y * Patch::kRow + z;
}

/// Nearest point of the line in which two planes meet: p - a n - b m.
bool crease(const Vec3f& p, float dn, const Vec3f& n, float dm, const Vec3f& m, FootPoint& foot) {
    const float c = dotf(n, m), det = 1 - c * c;
    if (det < 0.05f) return false;
    const float a = (dn - c * dm) / det, b = (dm - c * dn) / det;
    foot.point = p - n * a - m * b;
    if ((foot.point - p).sqrnorm() > 4) return false;
    foot.along = Vec3f(n[1] * m[2] - n[2] * m[1], n[2] * m[0] - n[0] * m[2], n[0] * m[1] - n[1] * m[0]);
    foot.along /= foot.along.norm();
    foot.onCrease = 1;
    return true;
}

/// Where both fields are negative, for rows of 16: bit z.
PAVEL_WIDE void markInside(const float* own, const float* clip, int rows, unsigned* inside) {
    for (int row = 0; row < rows; ++row, own += 16, clip += 16) {
        unsigned bits = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 16; ++z) bits |= unsigned((own[z] < 0) & (clip[z] < 0)) << z;
        inside[row] = bits;
    }
}

float trilinear(const float* field, const Vec3f& p) {
    const int x = int(p[0]), y = int(p[1]), z = int(p[2]);
    const float u = p[0] - float(x), v = p[1] - float(y), w = p[2] - float(z);
    const float* f = field + placeOf(x, y, z);
    const float *g = f + Patch::kRow, *h = f + Patch::kSlab, *k = h + Patch::kRow;
    const float a = (f[0] * (1 - w) + f[1] * w) * (1 - v) + (g[0] * (1 - w) + g[1] * w) * v;
    const float b = (h[0] * (1 - w) + h[1] * w) * (1 - v) + (k[0] * (1 - w) + k[1] * w) * v;
    return a * (1 - u) + b * u;
}

/// Point of the field's zero set along its gradient. Normal: unit gradient.
bool dropOnto(const float* field, int i, const Vec3f& p, Vec3f& point, Vec3f& normal) {
    const float* f = field + i;
    const float f0 = *f;
    normal = {0.5f * (f[Patch::kSlab] - f[-Patch::kSlab]), 0.5f * (f[Patch::kRow] - f[-Patch::kRow]),
              0.5f * (f[1] - f[-1])};
    const float l = normal.norm();
    if (l < kFlattest) return false;
    normal /= l;
    const Vec3f toward = f0 < 0 ? normal : -normal;
    // The step that the slope asks for; what is left then is mostly so little that the slope tells the rest, too.
    constexpr float kLittle = 0.01f, kDone = 1e-3f;  // a way, and a value
    float lo = 0, fLo = f0, hi = std::min(std::abs(f0) / l, kFarthest), fHi = trilinear(field, p + toward * hi), s = 0;
    const float rest = f0 < 0 ? -fHi / l : fHi / l;
    if (std::abs(rest) < kLittle) {
        s = std::max(hi + rest, 0.f);
    } else {
        // Else the secant between two sides.
        bool found = (fHi < 0) != (f0 < 0);
        for (int it = 0; it < 3 && !found; ++it) {
            if (hi >= kFarthest) return false;
            lo = hi, fLo = fHi, hi = std::min(hi + 1.5f * std::abs(rest) + 0.2f * float(1 + it), kFarthest);
            fHi = trilinear(field, p + toward * hi);
            found = (fHi < 0) != (f0 < 0);
        }
        if (!found) return false;
        for (int it = 0; it < 3; ++it) {
            s = lo + (hi - lo) * fLo / (fLo - fHi);
            const float value = trilinear(field, p + toward * s);
            if (std::abs(value) < kDone) break;
            if ((value < 0) == (f0 < 0))
                lo = s, fLo = value;
            else
                hi = s, fHi = value;
        }
    }
    point = p + toward * s;
    return true;
}

}  // namespace

void Patch::load(const BlockValues* const around[27]) {
    forEachRowAround<kHalo, kHalo, kRow>([&](int part, int row, int at, auto n) {
        const BlockValues& f = *around[part];
        constexpr size_t kBytes = decltype(n)::value * sizeof(float);
        const auto put = [&](const float* from, float tile, float* to) {
            if (from)
                std::memcpy(to + at, from + row, kBytes);
            else
                std::fill_n(to + at, int(n), tile);
        };
        put(f.own, f.tile, own_), put(f.clip, -kBand, clip_);
    });
    markInside(own_, clip_, kSide * kSide, inside_);
}

FootPoint Patch::findFoot(int x, int y, int z) const {
    FootPoint foot;
    const int i = placeOf(x, y, z);
    const Vec3f p{float(x), float(y), float(z)};
    const float own = own_[i], clip = clip_[i];
    foot.onCrease = 0;
    const bool ownFirst = own >= clip;
    const float *first = ownFirst ? own_ : clip_, *second = ownFirst ? clip_ : own_;
    const bool landed = dropOnto(first, i, p, foot.point, foot.along);
    if (std::min(own, clip) < -kCrease) {  // one field alone decides here
        if (!landed) stepAcross(i, p, foot);
        return foot;
    }
    // No slope is steeper than that: the other surface, whose field may be much flatter, may still be nearer.
    constexpr float kSteepest = 1.3f;
    const float value = ownFirst ? clip : own, away2 = landed ? (foot.point - p).sqrnorm() : 0;
    const bool stands = landed && trilinear(second, foot.point) <= 0;
    if (stands && value * value > kSteepest * kSteepest * away2) return foot;
    Vec3f point, normal;
    if (!dropOnto(second, i, p, point, normal)) {
        if (!stands) stepAcross(i, p, foot);
        return foot;
    }
    if (trilinear(first, point) <= 0) {
        if (!stands || (point - p).sqrnorm() < away2) foot.point = point, foot.along = normal;
        return foot;
    }
    // Each foot is cut away by the other field.
    if (!stands &&
        (!landed || !crease(p, dotf(p - foot.point, foot.along), foot.along, dotf(p - point, normal), normal, foot)))
        stepAcross(i, p, foot);
    return foot;
}

/// Where the gradient helps nothing: the crossing of an axis that comes soonest.
void Patch::stepAcross(int i, const Vec3f& p, FootPoint& foot) const {
    const auto phi = [&](int at) { return std::max(own_[at], clip_[at]); };
    const float f0 = phi(i);
    constexpr int step[3] = {kSlab, kRow, 1};
    float best = 2;
    foot.onCrease = 0;
    for (int k = 0; k < 3; ++k)
        for (int sign = -1; sign <= 1; sign += 2) {
            const float f1 = phi(i + sign * step[k]);
            if ((f1 < 0) == (f0 < 0)) continue;
            const float t = f0 / (f0 - f1);
            if (t >= best) continue;
            best = t;
            foot.point = p;
            foot.point[k] += float(sign) * t;
            foot.along = Vec3f(0, 0, 0);
            foot.along[k] = f0 < 0 ? float(sign) : -float(sign);
        }
}

}  // namespace pavel
