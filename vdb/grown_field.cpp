#include "pavel/vdb/grown_field.h"

#include <algorithm>
#include <array>

namespace pavel {
namespace {

/// Catmull-Rom weights of the four nodes around a place t in [0, 1) between the middle two.
std::array<float, 4> cubicWeights(float t) {
    const float t2 = t * t, t3 = t2 * t;
    return {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t), 0.5f * (t3 - t2)};
}

/// Values on (8 / factor + 3)^3 nodes, one before the block and two beyond it, to the block's 8^3 voxels.
PAVEL_WIDE void upsample(const float* nodes, int factor, float* out) {
    const int n = 8 / factor + 3;
    float alongZ[7 * 7 * 8], alongY[7 * 8 * 8];
    std::array<float, 4> weights[8];
    int first[8];
    for (int i = 0; i < 8; ++i) weights[i] = cubicWeights(float(i % factor) / float(factor)), first[i] = i / factor;
    for (int x = 0; x < n; ++x)
        for (int y = 0; y < n; ++y)
            for (int z = 0; z < 8; ++z) {
                const float* f = nodes + (x * n + y) * n + first[z];
                const auto& w = weights[z];
                alongZ[(x * n + y) * 8 + z] = w[0] * f[0] + w[1] * f[1] + w[2] * f[2] + w[3] * f[3];
            }
    for (int x = 0; x < n; ++x)
        for (int y = 0; y < 8; ++y) {
            const float* f = alongZ + (x * n + first[y]) * 8;
            const auto& w = weights[y];
            for (int z = 0; z < 8; ++z)
                alongY[(x * 8 + y) * 8 + z] = w[0] * f[z] + w[1] * f[8 + z] + w[2] * f[16 + z] + w[3] * f[24 + z];
        }
    for (int x = 0; x < 8; ++x) {
        const float* f = alongY + first[x] * 64;
        const auto& w = weights[x];
        for (int i = 0; i < 64; ++i)
            out[x * 64 + i] = w[0] * f[i] + w[1] * f[64 + i] + w[2] * f[128 + i] + w[3] * f[192 + i];
    }
}

/// A front's own nodes in and around one of its blocks: three layers on each side, so that two layers of times that go
/// on beyond the front are known wherever the interpolation asks, one node before the block and two beyond it.
class Nodes {
  public:
    static constexpr int kBefore = 3, kSide = 15, kCount = kSide * kSide * kSide;

    Nodes(const Front& front, const Coord& block) {
        const Coord lo = block.offsetBy(-kBefore), hi = lo.offsetBy(kSide - 1);
        const WorkTree& placed = *front.element.placed;
        forEachBlock(CoordBBox(lo, hi), [&](const Coord& at) {
            const GrowthBlock* grown = front.probe(at);
            const WorkLeaf* leaf = placed.probeConstLeaf(at);
            const float tile = leaf ? 0 : placed.getValue(at);
            Coord from, to;
            for (int k = 0; k < 3; ++k) from[k] = std::max(lo[k], at[k]), to[k] = std::min(hi[k] + 1, at[k] + 8);
            for (int x = from[0]; x < to[0]; ++x)
                for (int y = from[1]; y < to[1]; ++y)
                    for (int z = from[2]; z < to[2]; ++z) {
                        const int v = (x - at[0]) * 64 + (y - at[1]) * 8 + z - at[2];
                        const int node = index(x - lo[0], y - lo[1], z - lo[2]);
                        const float p = leaf ? leaf->buffer().data()[v] : tile;
                        phi_[node] = way_[node] = p;
                        scale_[node] = 0, speed_[node] = -1;
                        timed_[node] = nearRim_[node] = false;
                        if (const GrowthCell* cell = grown ? grown->cellAt(v) : nullptr) {
                            const int i = GrowthBlock::inCell(v);
                            const bool timed = cell->time[i] < GrowthBlock::kNever,
                                       asked = cell->contact[i] >= 0 && cell->state[i] != kInner;
                            const float scale = float(front.scaleAt(*cell, i));
                            if (timed) scale_[node] = scale, way_[node] = scale * (cell->time[i] - front.stopTime);
                            if (asked && !timed) speed_[node] = scale;
                            timed_[node] = timed;
                            nearRim_[node] = asked && cell->contact[i] < 3;
                        }
                        least_ = std::min(least_, way_[node]);
                        any_ |= timed_[node];
                    }
        });
    }
    /// Is there anything of the front within the band, in coarse voxels?
    bool within(float band) const { return any_ && least_ <= band; }

    /// The n^3 nodes around a part of the block, from the one before its first.
    struct Window {
        float phi[343], way[343], scale[343];
        bool timed = false, nearRim = false;  ///< any of them
        float least = kBand;                  ///< of the front's own values, in coarse voxels
    };
    void copy(const Coord& first, int n, Window& out) const {
        out.timed = out.nearRim = false;
        out.least = kBand;
        for (int x = 0, to = 0; x < n; ++x)
            for (int y = 0; y < n; ++y) {
                const int row = index(first[0] + x, first[1] + y, first[2]) + (kBefore - 1) * index(1, 1, 1);
                for (int i = row; i < row + n; ++i, ++to) {
                    out.phi[to] = phi_[i];
                    out.way[to] = way_[i];
                    out.scale[to] = scale_[i];
                    out.timed |= timed_[i];
                    out.nearRim |= nearRim_[i];
                    out.least = std::min(out.least, way_[i]);
                }
            }
    }

    void continueTimes();

  private:
    static int index(int x, int y, int z) { return (x * kSide + y) * kSide + z; }

    float phi_[kCount], way_[kCount], scale_[kCount];
    float speed_[kCount];  // -1 where it is not known
    bool timed_[kCount], nearRim_[kCount], any_ = false;
    float least_ = kBand;
};

/// Gives the nodes beside those that the front reached times as if it had gone on, two layers of them: an interpolation
/// that took the placed surface's distance for them would put ripples into the front's. Its advance goes on as much as
/// the speed does: not at all where that is zero.
void Nodes::continueTimes() {
    constexpr int n = kSide, step[3] = {n * n, n, 1};
    float newWay[kCount], newScale[kCount];
    int list[kCount];
    for (int pass = 0; pass < 2; ++pass) {
        int count = 0;
        for (int x = 0, i = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 0; z < n; ++z, ++i) {
                    if (scale_[i] > 0 || speed_[i] == 0) continue;
                    const int at[3] = {x, y, z};
                    float ahead = 0, beside = 0;
                    int known = 0;
                    for (int k = 0; k < 3; ++k) {
                        if (at[k] > 0 && scale_[i - step[k]] > 0)
                            ahead += way_[i - step[k]] - phi_[i - step[k]], beside += scale_[i - step[k]], ++known;
                        if (at[k] + 1 < n && scale_[i + step[k]] > 0)
                            ahead += way_[i + step[k]] - phi_[i + step[k]], beside += scale_[i + step[k]], ++known;
                    }
                    if (!known) continue;
                    const float goesOn = speed_[i] < 0 ? 1 : std::min(1.f, speed_[i] * float(known) / beside);
                    newWay[i] = phi_[i] + goesOn * ahead / float(known);
                    newScale[i] = goesOn * beside / float(known);
                    list[count++] = i;
                }
        for (int c = 0; c < count; ++c) way_[list[c]] = newWay[list[c]], scale_[list[c]] = newScale[list[c]];
    }
}

/// Interpolation knows nothing of a field that turns around the rim like the hand of a clock.
void mendNearRim(const Front& front, const Coord& origin, int factor, const float* placed, GrownBlock& out) {
    constexpr double kOnly = 1, kNone = 2;  // coarse voxels from the rim: nothing but the wedge; nothing of it
    const double toCoarse = 1.0 / factor;
    const ContactDistance::Near rims = front.element.contact->near((centreOf(origin) + Vec3(3.5, 3.5, 3.5)) * toCoarse,
                                                                   3.5 * std::sqrt(3.0) * toCoarse, kNone);
    if (rims.empty()) return;
    for (int v = 0; v < 512; ++v) {
        const double phi = placed[v] * toCoarse;
        if (phi <= 0 || phi >= kNone || !(out.scale[v] > 0) || std::abs(out.way[v]) > 2 * kBand) continue;
        const Vec3 p = centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))) * toCoarse;
        Vec3f rim;
        const double d = rims.nearest({float(p[0]), float(p[1]), float(p[2])}, float(kNone), rim);
        if (d >= kNone) continue;
        const double time = front.wedgeArrival(p, phi, d, Vec3(rim[0], rim[1], rim[2]), 2 * toCoarse);
        if (time > 1e30) continue;
        const double scale = factor * front.scaleFor(d), wedge = scale * (time - double(front.stopTime)),
                     share = std::clamp((kNone - d) / (kNone - kOnly), 0.0, 1.0);
        out.way[v] = float(share * wedge + (1 - share) * out.way[v]);
        out.scale[v] = float(share * scale + (1 - share) * out.scale[v]);
    }
}

/// Values of one fine block from the coarse nodes around it.
PAVEL_WIDE void interpolate(const Nodes::Window& nodes, int factor, float slowest, const float* placed,
                            GrownBlock& out) {
    const float k = float(factor);
    float coarsePhi[512];
    upsample(nodes.way, factor, out.way);
    upsample(nodes.scale, factor, out.scale);
    upsample(nodes.phi, factor, coarsePhi);
    for (int v = 0; v < 512; ++v) {
        // Details of the placed surface that the coarse grid does not know ride along with the front.
        float detail = 0.5f * (kBand - std::abs(placed[v]));
        detail = detail > 1 ? 1 : detail;
        detail = detail < 0 ? 0 : detail;
        out.way[v] = k * out.way[v] + detail * (placed[v] - k * coarsePhi[v]);
        out.scale[v] = out.scale[v] * k < slowest ? 0 : out.scale[v] * k;
    }
}

/// Does the front come within the band?
PAVEL_WIDE bool reaches(const GrownBlock& block) {
    int count = 0;
    for (int v = 0; v < 512; ++v) count += int(block.scale[v] > 0) & int(block.way[v] < kBand);
    return count > 0;
}

}  // namespace

GrownField::GrownField(const Front& front, const WorkTree& placed, int factor) {
    const int m = 8 / factor, n = m + 3;
    const float band = kBand / float(factor), slowest = 1e-3f * float(front.weight * factor);
    Nodes::Window window;
    float far[512];
    for (const GrowthBlock& grown : front.blocks) {
        Nodes nodes(front, grown.origin);
        if (!nodes.within(band)) continue;
        nodes.continueTimes();
        for (int x = 0; x < 8; x += m)
            for (int y = 0; y < 8; y += m)
                for (int z = 0; z < 8; z += m) {
                    nodes.copy(Coord(x, y, z), n, window);
                    if (!window.timed || window.least > band) continue;
                    const Coord at = grown.origin.offsetBy(x, y, z),
                                origin(at[0] * factor, at[1] * factor, at[2] * factor);
                    const WorkLeaf* leaf = placed.probeConstLeaf(origin);
                    const float tile = leaf ? 0 : placed.getValue(origin);
                    if (tile < 0) continue;  // times run backwards there, but nobody else can come
                    if (!leaf) std::fill(far, far + 512, tile);
                    const float* values = leaf ? leaf->buffer().data() : far;
                    auto block = std::make_unique<GrownBlock>();
                    interpolate(window, factor, slowest, values, *block);
                    if (window.nearRim) mendNearRim(front, origin, factor, values, *block);
                    if (!reaches(*block)) continue;
                    blocks_.emplace(origin, std::move(block));
                }
    }
}

}  // namespace pavel
