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

/// Signed distances of a block's voxels from their feet; +-band where they have none.
PAVEL_WIDE void distances(const FootBlock& voxels, const Foot* feet, float band, const BlockValues& source, float* out,
                          BlockMask& near) {
    // Feet sample surface and crease a voxel apart, or less: half of that may be taken off the way along them.
    constexpr float kApart = 0.5f;
    const float farthest2 = (band + kApart) * (band + kApart);
    for (int row = 0; row < 64; ++row) {
        const int* footOf = voxels.foot + 8 * row;
        const float *x = voxels.x + 8 * row, *y = voxels.y + 8 * row, *z = voxels.z + 8 * row;
        float* d = out + 8 * row;
        int any = 0;
        PAVEL_ROLLED
        for (int k = 0; k < 8; ++k) any |= int(x[k] * x[k] + y[k] * y[k] + z[k] * z[k] < farthest2);
        if (!any) {
            std::fill(d, d + 8, band);
            continue;
        }
        float ax[8], ay[8], az[8];
        int crease[8];
        for (int k = 0; k < 8; ++k) {
            const Foot& foot = feet[footOf[k] < 0 ? 0 : footOf[k]];
            ax[k] = foot.along[0], ay[k] = foot.along[1], az[k] = foot.along[2];
            crease[k] = foot.onCrease;
        }
        PAVEL_ROLLED
        for (int k = 0; k < 8; ++k) {
            const float u = x[k], v = y[k], w = z[k];
            const float along = u * ax[k] + v * ay[k] + w * az[k], along2 = along * along;
            const float rest2 = u * u + v * v + w * w - along2, aside2 = rest2 > 0 ? rest2 : 0;
            const float beside2 = crease[k] ? along2 : aside2, across2 = crease[k] ? aside2 : along2;
            const float far = std::sqrt(beside2) - kApart, beyond = far > 0 ? far : 0;
            const float distance = std::sqrt(across2 + beyond * beyond), least = distance < band ? distance : band;
            const float kept = least > 1e-6f ? least : 1e-6f;  // zero would be no side at all
            d[k] = footOf[k] < 0 ? band : kept;
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
    feet_.clear();
    for (int x = 1; x + 1 < count_[0]; ++x)
        for (int y = 1; y + 1 < count_[1]; ++y)
            for (int z = 1; z + 1 < count_[2]; ++z)
                if (crosses(block(x, y, z))) findFeet(x, y, z);
    // In a narrow band feet go no farther than into the next blocks: once up and down is enough.
    constexpr float kNarrow = 4;
    if (band_ <= kNarrow)
        sweepOnce();
    else
        while (sweep()) {
        }
}

void DistanceWindow::sweepOnce() {
    // Layer by layer up, and down again just behind, while they are at hand.
    for (int x = 1; x < count_[0]; ++x) {
        if (x + 1 < count_[0]) spreadLayer(x, true, 1);
        if (x > 1) spreadLayer(x - 1, false, 1);
    }
}

bool DistanceWindow::sweep() {
    bool changed = false;
    for (int x = 1; x + 1 < count_[0]; ++x) changed |= spreadLayer(x, true, 4);
    for (int x = count_[0] - 2; x > 0; --x) changed |= spreadLayer(x, false, 4);
    return changed;
}

bool DistanceWindow::spreadLayer(int x, bool up, int twosAlong) {
    const int first = block(x, 1, 1), last = block(x, count_[1] - 2, count_[2] - 2);
    bool changed = false;
    for (int b = up ? first : last; up ? b <= last : b >= first; b += up ? 1 : -1)
        if (slot_[size_t(b)] >= 0) changed |= spread(b, twosAlong);
    return changed;
}

bool DistanceWindow::spread(int b, int twosAlong) {
    const int slot = slot_[size_t(b)];
    const auto blockBeside = [&](int side) { return side % 2 ? b + step_[side / 2] : b - step_[side / 2]; };
    const FootBlock* beside[6];
    for (int side = 0; side < 6; ++side) {
        const int n = slot_[size_t(blockBeside(side))];
        beside[side] = n < 0 ? nullptr : &voxels_[size_t(n)];
    }
    const bool changed = voxels_[size_t(slot)].spread(beside, twosAlong);
    for (int side = 0; side < 6; ++side) {
        const int n = blockBeside(side), sign = sign_[size_t(n)];
        if (slot_[size_t(n)] != kNone) continue;
        const float limit = sign ? limit_[sign < 0] : std::max(limit_[0], limit_[1]);
        if (voxels_[size_t(slot)].reaches(side, limit)) slotAt(n);
    }
    return changed;
}

bool DistanceWindow::read(int bx, int by, int bz, float* out, BlockMask& near) const {
    const size_t b = size_t(block(bx + 1, by + 1, bz + 1));
    const int slot = slot_[b];
    if (slot < 0) return false;
    distances(voxels_[size_t(slot)], feet_.data(), band_, source_[b], out, near);
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
    slot = slots_++;
    if (voxels_.size() < size_t(slots_)) voxels_.resize(std::max(size_t(slots_), 2 * voxels_.size()));
    voxels_[size_t(slot)].clear();
    return slot;
}

void DistanceWindow::findFeet(int bx, int by, int bz) {
    const int b = block(bx, by, bz);
    const BlockValues* around[27];
    for (int part = 0; part < 27; ++part)
        around[part] = &source_[size_t(b + block(part / 9 - 1, part / 3 % 3 - 1, part % 3 - 1))];
    patch_.load(around);
    const int slot = slotAt(b);
    FootBlock& voxels = voxels_[size_t(slot)];
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            for (unsigned row = patch_.crossing(x, y); row; row &= row - 1) {
                const int z = __builtin_ctz(row), v = x * 64 + y * 8 + z;
                const int at[3] = {x + Patch::kHalo, y + Patch::kHalo, z + Patch::kHalo};
                const FootPoint found = patch_.findFoot(at[0], at[1], at[2]);
                voxels.x[v] = float(at[0]) - found.point[0], voxels.y[v] = float(at[1]) - found.point[1];
                voxels.z[v] = float(at[2]) - found.point[2], voxels.foot[v] = int(feet_.size());
                feet_.push_back(found);
            }
}

}  // namespace pavel
