#include "pavel/vdb/grown_field.h"

#include <algorithm>

#include "pavel/vdb/recovery_function.h"

namespace pavel {
namespace {

/// Fine voxels: farther off, a front is not seen in a region, nor after its last small move.
constexpr float kReach = 3;

/// Values on the window's nodes to the block's 8^3 voxels.
PAVEL_WIDE void upsample(const float* nodes, const FrontNodes::Window& w, float* out) {
    constexpr int n = FineSpan::kMostNodes, kSlab = FrontNodes::kSlab;
    float alongX[n * 8], alongY[8 * n];
    for (int x = 0; x < 8; ++x) {
        const auto& cx = w.x->weights[x];
        const float* slab = nodes + w.x->before[x] * kSlab;
        for (int y = 0; y < w.y->nodes; ++y) {
            const float* f = slab + y * FrontNodes::kRow;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z)
                alongX[y * 8 + z] =
                    cx[0] * f[z] + cx[1] * f[kSlab + z] + cx[2] * f[2 * kSlab + z] + cx[3] * f[3 * kSlab + z];
        }
        for (int y = 0; y < 8; ++y) {
            const auto& cy = w.y->weights[y];
            const float* f = alongX + w.y->before[y] * 8;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z)
                alongY[z] = cy[0] * f[z] + cy[1] * f[8 + z] + cy[2] * f[16 + z] + cy[3] * f[24 + z];
            // As a matrix: the four nodes that a voxel asks for would have to be gathered.
            float* row = out + x * 64 + y * 8;
            PAVEL_ROLLED
            for (int z = 0; z < 8; ++z) {
                float sum = w.z->spread[0][z] * alongY[0];
                for (int m = 1; m < n; ++m) sum += w.z->spread[m][z] * alongY[m];
                row[z] = sum;
            }
        }
    }
}

/// Front::wedgeArrival, and the speed there, for many points at once.
struct Wedge {
    explicit Wedge(const Front& front)
        : weight(float(front.weight)),
          a(float(front.a * front.element.size)),
          b(float(front.b * front.element.size)),
          reach(float(front.wedgeReach())) {}
    float weight, a, b, reach;  ///< a and b in voxels of the front's grid

    [[gnu::always_inline]] float speed(float d) const { return weight * recoveryFunction(d, a, b); }
};

/// M. Abramowitz and I. Stegun, Handbook of Mathematical Functions, 4.4.46; for x in [0, 1].
[[gnu::always_inline]] inline float arcsine(float x) {
    const float p =
        1.5707963050f +
        x * (-0.2145988016f +
             x * (0.0889789874f +
                  x * (-0.0501743046f +
                       x * (0.0308918810f + x * (-0.0170881256f + x * (0.0066700901f - x * 0.0012624911f))))));
    return 1.57079633f - std::sqrt(1 - x) * p;
}

/// Points of a fine block near a rim, in coarse voxels.
struct NearRim : ContactDistance::Near::Queries {
    int voxel[kMost];
    float phi[kMost], distance[kMost], time[kMost], scale[kMost];
};

constexpr float kNever = 1e30f;

PAVEL_WIDE void wedgeTimes(const Wedge& wedge, float least, NearRim& q) {
    const Wedge w = wedge;
    const float *distance2 = q.distance2, *phi = q.phi, *away = q.away;
    float *distance = q.distance, *times = q.time, *scale = q.scale;
    for (int i = 0; i < q.count; ++i) {
        const float d = std::sqrt(distance2[i]), share = std::abs(phi[i]) / d, speed = w.speed(d),
                    rise = std::copysign(arcsine(share < 1 ? share : 1), phi[i]),
                    angle = rise + Front::behind(away[i] / d) * (float(kPi) - 2 * rise), time = angle * d / speed;
        // One condition at a time: the compiler would not vectorise their conjunction.
        const float moving = speed > 0 ? time : kNever, near = phi[i] <= 3 ? moving : kNever;
        distance[i] = d;
        times[i] = d <= w.reach ? near : kNever;
        scale[i] = w.speed(d < least ? least : d);
    }
}

/// Voxels in the placed surface, so deep that it still shows outside.
constexpr float kJustInside = 2;

/// Voxels outside the placed surface and near it, or just inside, where the front comes within the band and the box
/// around the rims is within reach.
PAVEL_WIDE void besideRim(const Coord& origin, float toCoarse, float none, const ContactDistance::Near::Box& rims,
                          const float* distance, const GrownBlock& grown, BlockMask& out) {
    // Close to the rim an interpolated time may be off by much.
    const float near = none / toCoarse, far2 = none * none, close2 = none < 1 ? far2 : 1;
    const auto outside = [](float p, float lower, float upper) {
        const float below = lower - p, above = p - upper, most = below > above ? below : above;
        return most > 0 ? most : 0;
    };
    const int x = origin[0], y = origin[1], z0 = origin[2];
    for (int row = 0; row < 64; ++row) {
        const float dx = outside(float(x + (row >> 3)) * toCoarse, rims.lower[0], rims.upper[0]),
                    dy = outside(float(y + (row & 7)) * toCoarse, rims.lower[1], rims.upper[1]);
        const float *d = distance + 8 * row, *ways = grown.way + 8 * row, *scale = grown.scale + 8 * row;
        unsigned bits = 0;
        PAVEL_ROLLED
        for (int z = 0; z < 8; ++z) {
            const float dz = outside(float(z0 + z) * toCoarse, rims.lower[2], rims.upper[2]), way = std::abs(ways[z]),
                        reach2 = way <= 2 * kBand ? far2 : close2;
            bits |= unsigned((d[z] > -kJustInside) & (d[z] < near) & (scale[z] > 0) &
                             ((way <= 4 * kBand) | (d[z] < 0)) & (dx * dx + dy * dy + dz * dz < reach2))
                    << z;
        }
        out[size_t(row)] = uint8_t(bits);
    }
}

/// Interpolation knows nothing of a field that turns around the rim like the hand of a clock.
void mendNearRim(const Front& front, const Coord& origin, int factor, const float* distance, GrownBlock& out) {
    // Coarse voxels from the rim: nothing of the wedge; nothing but it.
    const float none = std::min(2.5f, float(front.wedgeReach())), only = 0.75f * none;
    const float toCoarse = 1 / float(factor);
    const ContactDistance::Near rims =
        front.element.contact->near((centreOf(origin) + Vec3(3.5, 3.5, 3.5)) * double(toCoarse),
                                    3.5 * std::sqrt(3.0) * double(toCoarse), double(none));
    if (rims.empty()) return;
    NearRim q;
    BlockMask asked;
    besideRim(origin, toCoarse, none, rims.box(), distance, out, asked);
    for (int row = 0; row < 64; ++row)
        for (unsigned bits = asked[size_t(row)]; bits; bits &= bits - 1) {
            const int z = __builtin_ctz(bits), v = 8 * row + z;
            q.x[q.count] = float(origin[0] + (row >> 3)) * toCoarse;
            q.y[q.count] = float(origin[1] + (row & 7)) * toCoarse;
            q.z[q.count] = float(origin[2] + z) * toCoarse;
            q.voxel[q.count] = v, q.phi[q.count++] = distance[v] * toCoarse;
        }
    if (q.count == 0) return;
    rims.nearest(q);
    const double trusted = double(toCoarse);
    wedgeTimes(Wedge(front), toCoarse, q);
    for (int i = 0; i < q.count; ++i) {
        const float d = q.distance[i];
        if (d >= none) continue;
        double time = double(q.time[i]);
        if (double(d) < trusted) {
            const Vec3f p{q.x[i], q.y[i], q.z[i]}, rim = rims.nearestOn(q.piece[i], p);
            time = front.wedgeArrival(Vec3(p[0], p[1], p[2]), double(q.phi[i]), double(d),
                                      {Vec3(rim[0], rim[1], rim[2]), double(q.away[i])}, trusted);
        }
        if (time >= double(kNever)) continue;
        const float scale = float(factor) * q.scale[i], wedge = float(double(scale) * (time - double(front.stopTime))),
                    share = std::clamp((none - d) / (none - only), 0.f, 1.f);
        const int v = q.voxel[i];
        out.way[v] = share * wedge + (1 - share) * out.way[v];
        out.scale[v] = share * scale + (1 - share) * out.scale[v];
    }
}

/// Values of one fine block from the coarse nodes around it. `distance`: to the placed surface, beyond its band, too.
PAVEL_WIDE void interpolate(const FrontNodes::Window& nodes, int factor, float slowest, const float* placed,
                            float* distance, GrownBlock& out) {
    const float k = float(factor);
    upsample(nodes.way, nodes, out.way);
    upsample(nodes.scale, nodes, out.scale);
    upsample(nodes.phi, nodes, distance);
    for (int v = 0; v < 512; ++v) {
        // Details of the placed surface that the coarse grid does not know ride along with the front.
        float share = 0.5f * (kBand - std::abs(placed[v]));
        share = share > 1 ? 1 : share;
        share = share < 0 ? 0 : share;
        const float detail = share * (placed[v] - k * distance[v]);
        distance[v] = k * distance[v] + detail;
        out.way[v] = k * out.way[v] + detail;
        out.scale[v] = out.scale[v] * k < slowest ? 0 : out.scale[v] * k;
    }
}

/// Does the front come within reach?
PAVEL_WIDE bool reaches(const GrownBlock& block) {
    int count = 0;
    for (int v = 0; v < 512; ++v) count += int(block.scale[v] > 0) & int(block.way[v] < kReach);
    return count > 0;
}

}  // namespace

GrownField::GrownField(const Front& front, int factor)
    : front_(front), factor_(factor), nodes_(nodesOf(front, kReach / float(factor))) {
    for (int k = 0; k < factor; ++k) spans_.emplace_back(k, factor);
}

bool GrownField::read(const Coord& origin, const float* placed, GrownBlock& out) const {
    Coord corner;
    size_t at[3];  // of the fine block in the coarse one
    for (int k = 0; k < 3; ++k) {
        const int block = origin[k] >> 3, coarse = floorDivide(block, factor_);
        corner[k] = 8 * coarse;
        at[k] = size_t(block - coarse * factor_);
    }
    const GrowthBlock* grown = front_.probe(corner);
    const FrontNodes* nodes = grown ? nodes_[size_t(grown->number)].get() : nullptr;
    if (!nodes) return false;
    const FrontNodes::Window window = nodes->window(spans_[at[0]], spans_[at[1]], spans_[at[2]]);
    if (!(window.flags & FrontNodes::kTimed) || window.least > kReach / float(factor_)) return false;
    float distance[512];
    interpolate(window, factor_, 1e-3f * float(front_.weight * factor_), placed, distance, out);
    if (window.flags & FrontNodes::kNearRim) mendNearRim(front_, origin, factor_, distance, out);
    return reaches(out);
}

}  // namespace pavel
