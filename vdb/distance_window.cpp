#include "pavel/vdb/distance_window.h"

#include <algorithm>

namespace pavel {
namespace {

/// Does the layer of a block at a place on an axis hold a voxel that is not `inside`?
bool facesOther(const BlockValues& f, int axis, int place, bool inside) {
    constexpr int step[3] = {64, 8, 1};
    const int u = step[axis == 0 ? 1 : 0], w = step[axis == 2 ? 1 : 2];
    for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
            if (f.inside(place * step[axis] + i * u + j * w) != inside) return true;
    return false;
}

/// Signed distances of a block's voxels, the first at `origin`, from their feet; +-band where they have none.
PAVEL_WIDE void distances(const BandVoxel* voxels, const Foot* feet, const Vec3f& origin, float band,
                          const BlockValues& source, float* out, BlockMask& near) {
    // Feet sample surface and crease a voxel apart, or less: half of that may be taken off the way along them.
    constexpr float kApart = 0.5f;
    for (int row = 0; row < 64; ++row) {
        const BandVoxel* at = voxels + 8 * row;
        float* d = out + 8 * row;
        int any = 0;
        for (int z = 0; z < 8; ++z) any |= ~at[z].foot;
        if (any >= 0) {
            std::fill(d, d + 8, band);
            continue;
        }
        float px[8], py[8], pz[8], ax[8], ay[8], az[8];
        int feetOf[8], crease[8];
        for (int z = 0; z < 8; ++z) {
            const int i = at[z].foot;
            const Foot& foot = feet[i < 0 ? 0 : i];
            px[z] = foot.point[0], py[z] = foot.point[1], pz[z] = foot.point[2];
            ax[z] = foot.along[0], ay[z] = foot.along[1], az[z] = foot.along[2];
            feetOf[z] = i, crease[z] = foot.onCrease;
        }
        const float x = origin[0] + float(row >> 3), y = origin[1] + float(row & 7);
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float u = x - px[z], v = y - py[z], w = origin[2] + float(z) - pz[z];
            const float along = u * ax[z] + v * ay[z] + w * az[z], along2 = along * along;
            const float rest2 = u * u + v * v + w * w - along2, aside2 = rest2 > 0 ? rest2 : 0;
            const float beside2 = crease[z] ? along2 : aside2, across2 = crease[z] ? aside2 : along2;
            const float far = std::sqrt(beside2) - kApart, beyond = far > 0 ? far : 0;
            const float distance = std::sqrt(across2 + beyond * beyond), least = distance < band ? distance : band;
            const float kept = least > 1e-6f ? least : 1e-6f;  // zero would be no side at all
            d[z] = feetOf[z] < 0 ? band : kept;
        }
    }
    for (int row = 0; row < 64; ++row) {
        unsigned within = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) within |= unsigned(out[8 * row + z] < band) << z;
        near[size_t(row)] = uint8_t(within);
    }
    if (!source.own) {
        for (int v = 0; v < 512; ++v) out[v] = source.tile < 0 ? -out[v] : out[v];
    } else if (!source.clip) {
        for (int v = 0; v < 512; ++v) out[v] = source.own[v] < 0 ? -out[v] : out[v];
    } else {
        for (int v = 0; v < 512; ++v) out[v] = (source.own[v] < 0) & (source.clip[v] < 0) ? -out[v] : out[v];
    }
}

PAVEL_WIDE int countInside(const float* own, const float* clip) {
    int negative = 0;
    if (clip) {
        PAVEL_ROLLED
        for (int v = 0; v < 512; ++v) negative += int((own[v] < 0) & (clip[v] < 0));
    } else {
        PAVEL_ROLLED
        for (int v = 0; v < 512; ++v) negative += int(own[v] < 0);
    }
    return negative;
}

}  // namespace

void DistanceWindow::solve() {
    unknown_.assign(512, {std::max(limit_[0], limit_[1]), -1});
    feet_.clear(), points_.clear();
    layer_.clear();
    for (int x = 1; x + 1 < count_[0]; ++x)
        for (int y = 1; y + 1 < count_[1]; ++y)
            for (int z = 1; z + 1 < count_[2]; ++z)
                if (crosses(block(x, y, z))) findFeet(x, y, z);
    while (!layer_.empty()) spread();
}

bool DistanceWindow::read(int bx, int by, int bz, float* out, BlockMask& near) const {
    const size_t b = size_t(block(bx + 1, by + 1, bz + 1));
    const int slot = slot_[b];
    if (slot < 0) return false;
    distances(&voxels_[size_t(slot) * 512], feet_.data(), Vec3f(float(8 * bx), float(8 * by), float(8 * bz)), band_,
              source_[b], out, near);
    return std::any_of(near.begin(), near.end(), [](uint8_t row) { return row != 0; });
}

signed char DistanceWindow::signOf(const BlockValues& f) {
    if (!f.own) return f.tile < 0 ? -1 : 1;
    const int negative = countInside(f.own, f.clip);
    return static_cast<signed char>(negative == 0 ? 1 : negative == 512 ? -1 : 0);
}

bool DistanceWindow::crosses(int b) const {
    const int own = sign_[size_t(b)];
    if (own == 0) return true;
    for (int side = 0; side < 6; ++side) {
        const int axis = side / 2, n = side % 2 ? b + step_[axis] : b - step_[axis];
        const int other = sign_[size_t(n)];
        if (other == -own || (other == 0 && facesOther(source_[size_t(n)], axis, side % 2 ? 0 : 7, own < 0)))
            return true;
    }
    return false;
}

int DistanceWindow::slotAt(int b) {
    int& slot = slot_[size_t(b)];
    if (slot != kNone) return slot;
    slot = int(slots_.size());
    const int x = b / step_[0], y = b / step_[1] % count_[1], z = b % count_[2];
    slots_.push_back({b, Vec3f(float(8 * x - 8), float(8 * y - 8), float(8 * z - 8))});
    const size_t first = size_t(slot) * 512;
    if (voxels_.size() < first + 512) voxels_.resize(std::max(first + 512, 2 * voxels_.size()));
    std::copy(unknown_.begin(), unknown_.end(), &voxels_[first]);
    return slot;
}

void DistanceWindow::findFeet(int bx, int by, int bz) {
    const int b = block(bx, by, bz);
    const BlockValues* around[27];
    for (int part = 0; part < 27; ++part)
        around[part] = &source_[size_t(b + block(part / 9 - 1, part / 3 % 3 - 1, part % 3 - 1))];
    patch_.load(around);
    const Vec3f shift(float(8 * bx - 8 - Patch::kHalo), float(8 * by - 8 - Patch::kHalo),
                      float(8 * bz - 8 - Patch::kHalo));
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            const unsigned row = patch_.crossing(x, y);
            if (!row) continue;
            const int first = slotAt(b) * 512 + x * 64 + y * 8;
            for (int z = 0; z < 8; ++z) {
                if (!(row >> z & 1)) continue;
                Foot foot = patch_.findFoot(x + Patch::kHalo, y + Patch::kHalo, z + Patch::kHalo);
                const Vec3f at(float(x + Patch::kHalo), float(y + Patch::kHalo), float(z + Patch::kHalo));
                voxels_[size_t(first + z)] = {(at - foot.point).sqrnorm(), int(feet_.size())};
                foot.point += shift;
                feet_.push_back(foot);
                points_.push_back(foot.point);
                layer_.push_back(first + z);
            }
        }
}

void DistanceWindow::spread() {
    next_.resize(6 * layer_.size());
    int* next = next_.data();
    const bool oneLimit = limit_[0] == limit_[1];
    for (const int i : layer_) {
        const int foot = voxels_[size_t(i)].foot & ~kQueued;
        voxels_[size_t(i)].foot = foot;
        const Slot& own = slots_[size_t(i >> 9)];
        const int v = i & 511, x = v >> 6, y = v >> 3 & 7, z = v & 7, b = own.block;
        const Vec3f e = own.origin + Vec3f(float(x), float(y), float(z)) - points_[size_t(foot)];
        const float ex = e[0], ey = e[1], ez = e[2];
        const float xx = ex * ex, yy = ey * ey, zz = ez * ez;
        const float limit = oneLimit ? limit_[0] : limit_[source_[size_t(b)].inside(v)];
        float d2[6];
        int at[6];
        unsigned better = 0;
        // Voxels between this one and its foot have nearer ones of their own.
        const auto look = [&](int side, float along, float aside2, int place, int stride)
            __attribute__((always_inline)) {
            const bool up = side & 1;
            const float away = up ? along + 1 : along - 1;
            const bool asked = up ? along >= -kBetween : along <= kBetween;
            d2[side] = away * away + aside2;
            at[side] = up ? i + stride : i - stride;
            if (up ? place < 7 : place > 0) {
                better |= unsigned(asked & (d2[side] < limit) & (d2[side] < voxels_[size_t(at[side])].distance2))
                          << side;
                return;
            }
            if (!asked || d2[side] >= limit) return;
            const int slot = slotAt(up ? b + step_[side / 2] : b - step_[side / 2]);
            if (slot < 0) return;
            at[side] = slot * 512 + (up ? v - 7 * stride : v + 7 * stride);
            better |= unsigned(d2[side] < voxels_[size_t(at[side])].distance2) << side;
        };
        look(0, ex, yy + zz, x, 64), look(1, ex, yy + zz, x, 64);
        look(2, ey, xx + zz, y, 8), look(3, ey, xx + zz, y, 8);
        look(4, ez, xx + yy, z, 1), look(5, ez, xx + yy, z, 1);
        for (; better; better &= better - 1) {
            const int side = __builtin_ctz(better);
            BandVoxel& taker = voxels_[size_t(at[side])];
            *next = at[side];
            next += taker.foot < kQueued;
            taker = {d2[side], foot | kQueued};
        }
    }
    next_.resize(size_t(next - next_.data()));
    layer_.swap(next_);
}

}  // namespace pavel
