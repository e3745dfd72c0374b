#include "pavel/vdb/foot_block.h"

#include <algorithm>
#include <cstring>

#include "pavel/core/wide.h"

namespace pavel {
namespace {

/// What a row of voxels holds.
struct ConstRows {
    const float *x, *y, *z;
    const int32_t* foot;
    ConstRows at(int i) const { return {x + i, y + i, z + i, foot + i}; }
};
struct Rows {
    float *x, *y, *z;
    int32_t* foot;
    Rows at(int i) const { return {x + i, y + i, z + i, foot + i}; }
    operator ConstRows() const { return {x, y, z, foot}; }
};

Rows rowsOf(FootBlock& b) {
    return {b.x, b.y, b.z, b.foot};
}
ConstRows rowsIn(const FootBlock& b) {
    return {b.x, b.y, b.z, b.foot};
}

/// Voxels take the feet of others, a step away, where these are nearer.
template <int N>
[[gnu::always_inline]] inline void offer(const ConstRows& from, float dx, float dy, const Rows& to) {
    const float* __restrict fx = from.x, * __restrict fy = from.y, * __restrict fz = from.z;
    const int32_t* __restrict ff = from.foot;
    float* __restrict x = to.x, * __restrict y = to.y, * __restrict z = to.z;
    int32_t* __restrict foot = to.foot;
    PAVEL_ROLLED
    for (int i = 0; i < N; ++i) {
        const float ax = fx[i] + dx, ay = fy[i] + dy, az = fz[i], x0 = x[i], y0 = y[i], z0 = z[i];
        const bool better = ax * ax + ay * ay + az * az < x0 * x0 + y0 * y0 + z0 * z0;
        const int32_t theirs = ff[i], mine = foot[i];
        const float nx = better ? ax : x0, ny = better ? ay : y0, nz = better ? az : z0;
        const int32_t nf = better ? theirs : mine;
        x[i] = nx, y[i] = ny, z[i] = nz, foot[i] = nf;
    }
}

/// What a voxel at the end of its row pays for a neighbour that is none: the flat loops below do not stop at rows'
/// ends.
constexpr float kPay = 3e38f, kAtFirst[16] = {kPay, 0, 0, 0, 0, 0, 0, 0, kPay},
                kAtLast[16] = {0, 0, 0, 0, 0, 0, 0, kPay, 0, 0, 0, 0, 0, 0, 0, kPay};

/// Each voxel of a plane of 64 takes the foot of the one before or after it in its row, if nearer.
[[gnu::always_inline]] inline void offerAlong(const ConstRows& from, const Rows& to) {
    const float* __restrict fx = from.x, * __restrict fy = from.y, * __restrict fz = from.z;
    const int32_t* __restrict ff = from.foot;
    float* __restrict x = to.x, * __restrict y = to.y, * __restrict z = to.z;
    int32_t* __restrict foot = to.foot;
    for (int k = 0; k < 64; k += 16) {
        PAVEL_ROLLED
        for (int j = 0; j < 16; ++j) {
            const int i = k + j;
            const float x0 = fx[i], y0 = fy[i], z0 = fz[i], xb = fx[i - 1], yb = fy[i - 1], zb = fz[i - 1] + 1,
                        xa = fx[i + 1], ya = fy[i + 1], za = fz[i + 1] - 1;
            const float own = x0 * x0 + y0 * y0 + z0 * z0, before = xb * xb + yb * yb + zb * zb + kAtFirst[j],
                        after = xa * xa + ya * ya + za * za + kAtLast[j];
            const bool useBefore = before < own;
            const float least = useBefore ? before : own;
            const bool useAfter = after < least;
            const float nx = useBefore ? xb : x0, ny = useBefore ? yb : y0, nz = useBefore ? zb : z0;
            const int32_t nf = useBefore ? ff[i - 1] : ff[i];
            x[i] = useAfter ? xa : nx, y[i] = useAfter ? ya : ny, z[i] = useAfter ? za : nz;
            foot[i] = useAfter ? ff[i + 1] : nf;
        }
    }
}

PAVEL_WIDE void spreadX(FootBlock& block, const FootBlock* before, const FootBlock* after) {
    const Rows own = rowsOf(block);
    const ConstRows kept = rowsIn(block);
    if (before) offer<64>(rowsIn(*before).at(448), 1, 0, own);
    for (int x = 64; x < 512; x += 64) offer<64>(kept.at(x - 64), 1, 0, own.at(x));
    if (after) offer<64>(rowsIn(*after), -1, 0, own.at(448));
    for (int x = 384; x >= 0; x -= 64) offer<64>(kept.at(x + 64), -1, 0, own.at(x));
}

PAVEL_WIDE void spreadY(FootBlock& block, const FootBlock* before, const FootBlock* after) {
    const Rows own = rowsOf(block);
    const ConstRows kept = rowsIn(block);
    // Rows that do not wait for each other, one after another.
    if (before)
        for (int x = 0; x < 512; x += 64) offer<8>(rowsIn(*before).at(x + 56), 0, 1, own.at(x));
    for (int y = 8; y < 64; y += 8)
        for (int x = 0; x < 512; x += 64) offer<8>(kept.at(x + y - 8), 0, 1, own.at(x + y));
    if (after)
        for (int x = 0; x < 512; x += 64) offer<8>(rowsIn(*after).at(x), 0, -1, own.at(x + 56));
    for (int y = 48; y >= 0; y -= 8)
        for (int x = 0; x < 512; x += 64) offer<8>(kept.at(x + y + 8), 0, -1, own.at(x + y));
}

/// What the block beside offers to the first or last voxels of the rows.
void enterZ(FootBlock& block, const FootBlock& beside, int first, int from, float step) {
    for (int row = 0; row < 512; row += 8) {
        const int v = row + first, n = row + from;
        if (beside.foot[n] < 0) continue;
        const float x = beside.x[n], y = beside.y[n], z = beside.z[n] + step;
        if (x * x + y * y + z * z < block.x[v] * block.x[v] + block.y[v] * block.y[v] + block.z[v] * block.z[v])
            block.x[v] = x, block.y[v] = y, block.z[v] = z, block.foot[v] = beside.foot[n];
    }
}

/// By two voxels along the rows.
PAVEL_WIDE void spreadZ(FootBlock& block) {
    constexpr int kBefore = 16, kCount = kBefore + 64 + 16;
    alignas(64) float x[kCount] = {}, y[kCount] = {}, z[kCount] = {};
    alignas(64) int32_t foot[kCount] = {};
    const Rows between = Rows{x, y, z, foot}.at(kBefore);
    for (int plane = 0; plane < 512; plane += 64) {
        const Rows own = rowsOf(block).at(plane);
        offerAlong(own, between);
        offerAlong(between, own);
    }
}

}  // namespace

void FootBlock::clear() {
    std::fill(x, x + 512, kNowhere);
    std::fill(foot, foot + 512, -1);
}

bool FootBlock::spread(const FootBlock* const beside[6], int twosAlong) {
    int32_t known[512];
    std::memcpy(known, foot, sizeof known);
    spreadX(*this, beside[0], beside[1]);
    spreadY(*this, beside[2], beside[3]);
    if (beside[4]) enterZ(*this, *beside[4], 0, 7, 1);
    if (beside[5]) enterZ(*this, *beside[5], 7, 0, -1);
    for (int k = 0; k < twosAlong; ++k) spreadZ(*this);
    return std::memcmp(known, foot, sizeof known) != 0;
}

bool FootBlock::reaches(int side, float distance2) const {
    constexpr int kStep[3] = {64, 8, 1};
    const int axis = side / 2, u = kStep[axis == 0 ? 1 : 0], w = kStep[axis == 2 ? 1 : 2];
    const int first = side % 2 ? 7 * kStep[axis] : 0;
    const float step = side % 2 ? 1.f : -1.f;
    const float* along = axis == 0 ? x : axis == 1 ? y : z;
    for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k) {
            const int v = first + j * u + k * w;
            const float moved = along[v] + step, here2 = x[v] * x[v] + y[v] * y[v] + z[v] * z[v];
            if (here2 - along[v] * along[v] + moved * moved < distance2) return true;
        }
    return false;
}

}  // namespace pavel
