#include "pavel/vdb/region_builder.h"

#include <algorithm>
#include <array>

namespace pavel {
namespace {

/// Values this far from the surface, in voxels, need no block.
constexpr float kNear = 2;

std::vector<CoordBBox> reaches(const std::vector<WorkElement>& elements,
                               const std::vector<std::unique_ptr<Front>>& fronts, int factor) {
    std::vector<CoordBBox> boxes(elements.size());
    for (size_t i = 0; i < elements.size(); ++i) {
        CoordBBox box = elements[i].box;
        if (fronts[i])
            for (const GrowthBlock& b : fronts[i]->blocks) box.expand(b.origin), box.expand(b.origin.offsetBy(7));
        if (box.empty()) continue;
        const Coord lo = box.min(), hi = box.max().offsetBy(1);
        boxes[i] = CoordBBox(lo[0] * factor, lo[1] * factor, lo[2] * factor, hi[0] * factor - 1, hi[1] * factor - 1,
                             hi[2] * factor - 1);
    }
    return boxes;
}

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

/// Gives the nodes beside those that the front reached times as if it had gone on, two layers of them: an interpolation
/// that took the placed surface's distance for them would put ripples into the front's. Its advance goes on as much as
/// the speed does: not at all where that is zero.
/// @param speed of the nodes, -1 where it is not known
void continueTimes(int n, const float* phi, const float* speed, float* way, float* scale) {
    const int step[3] = {n * n, n, 1};
    float newWay[343], newScale[343];
    int list[343];
    for (int pass = 0; pass < 2; ++pass) {
        int count = 0;
        for (int x = 0, i = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 0; z < n; ++z, ++i) {
                    if (scale[i] > 0 || speed[i] == 0) continue;
                    const int at[3] = {x, y, z};
                    float ahead = 0, beside = 0;
                    int known = 0;
                    for (int k = 0; k < 3; ++k) {
                        if (at[k] > 0 && scale[i - step[k]] > 0)
                            ahead += way[i - step[k]] - phi[i - step[k]], beside += scale[i - step[k]], ++known;
                        if (at[k] + 1 < n && scale[i + step[k]] > 0)
                            ahead += way[i + step[k]] - phi[i + step[k]], beside += scale[i + step[k]], ++known;
                    }
                    if (!known) continue;
                    const float goesOn = speed[i] < 0 ? 1 : std::min(1.f, speed[i] * float(known) / beside);
                    newWay[i] = phi[i] + goesOn * ahead / float(known);
                    newScale[i] = goesOn * beside / float(known);
                    list[count++] = i;
                }
        for (int c = 0; c < count; ++c) way[list[c]] = newWay[list[c]], scale[list[c]] = newScale[list[c]];
    }
}

}  // namespace

RegionBuilder::RegionBuilder(const std::vector<WorkElement>& elements, const std::vector<WorkTree::Ptr>& placed,
                             const openvdb::FloatTree* base, const std::vector<std::unique_ptr<Front>>& fronts,
                             int factor)
    : elements_(elements),
      placed_(placed),
      base_(base),
      fronts_(fronts),
      factor_(factor),
      shift_(factor == 8   ? 3
             : factor == 4 ? 2
             : factor == 2 ? 1
                           : 0),
      reach_(reaches(elements, fronts, factor)),
      index_(reach_) {}

std::vector<int> RegionBuilder::rivalsOf(int i) const {
    std::vector<int> rivals = index_.meeting(reach_[size_t(i)]);
    rivals.erase(std::remove(rivals.begin(), rivals.end(), i), rivals.end());
    return rivals;
}

bool RegionBuilder::load(int i, const Coord& origin, OwnField& field) const {
    const WorkTree& placed = *placed_[size_t(i)];
    const WorkLeaf* leaf = placed.probeConstLeaf(origin);
    const float tile = leaf ? 0 : placed.getValue(origin);
    const Front* front = fronts_[size_t(i)].get();
    const Coord coarse(origin[0] >> shift_, origin[1] >> shift_, origin[2] >> shift_);
    const GrowthBlock* block = front ? front->probe(leafOrigin(coarse)) : nullptr;
    if (!leaf && tile > 0 && !block) return false;
    if (leaf)
        std::copy(leaf->buffer().data(), leaf->buffer().data() + 512, field.phi);
    else
        std::fill(field.phi, field.phi + 512, tile);
    field.grown = block != nullptr;
    if (!block) return true;
    if (factor_ > 1) {
        interpolate(*front, origin, field);
        return true;
    }
    const float stop = front->stopTime;
    for (int v = 0; v < 512; ++v) {
        field.scale[v] = block->hasTime(v) ? block->scale[v] : 0;
        field.way[v] = field.scale[v] > 0 ? field.scale[v] * (block->time[v] - stop) : field.phi[v];
    }
    return true;
}

void RegionBuilder::interpolate(const Front& front, const Coord& origin, OwnField& field) const {
    const int m = 8 / factor_, n = m + 3;
    const Coord lo(origin[0] / factor_ - 1, origin[1] / factor_ - 1, origin[2] / factor_ - 1);  // origins divide evenly
    const WorkTree& placed = *front.element.placed;
    float way[343], scale[343], phi[343], speed[343];
    bool any = false, nearRim = false;
    float least = kBand;  // of the front's own values, in coarse voxels
    forEachBlock(CoordBBox(lo, lo.offsetBy(n - 1)), [&](const Coord& at) {
        const GrowthBlock* block = front.probe(at);
        const WorkLeaf* leaf = placed.probeConstLeaf(at);
        const float tile = leaf ? 0 : placed.getValue(at);
        Coord from, to;
        for (int k = 0; k < 3; ++k) from[k] = std::max(lo[k], at[k]), to[k] = std::min(lo[k] + n, at[k] + 8);
        for (int x = from[0]; x < to[0]; ++x)
            for (int y = from[1]; y < to[1]; ++y)
                for (int z = from[2]; z < to[2]; ++z) {
                    const int v = (x - at[0]) * 64 + (y - at[1]) * 8 + z - at[2];
                    const int node = ((x - lo[0]) * n + y - lo[1]) * n + z - lo[2];
                    const float p = leaf ? leaf->buffer().data()[v] : tile;
                    const bool timed = block && block->hasTime(v);
                    phi[node] = p;
                    scale[node] = timed ? block->scale[v] : 0;
                    speed[node] = block && block->contact[v] >= 0 ? float(front.scaleFor(block->contact[v])) : -1;
                    way[node] = timed ? block->scale[v] * (block->time[v] - front.stopTime) : p;
                    any |= timed;
                    least = std::min(least, way[node]);
                    nearRim |= block && block->contact[v] >= 0 && block->contact[v] < 3;
                }
    });
    const float k = float(factor_);
    if (!any || least * k > kBand) {  // nothing of the front within the band
        field.grown = false;
        return;
    }
    continueTimes(n, phi, speed, way, scale);
    float coarsePhi[512];
    const float slowest = 1e-3f * float(front.weight) * k;
    upsample(way, factor_, field.way);
    upsample(scale, factor_, field.scale);
    upsample(phi, factor_, coarsePhi);
    for (int v = 0; v < 512; ++v) {
        // Details of the placed surface that the coarse grid does not know ride along with the front.
        const float detail = std::clamp(0.5f * (kBand - std::abs(field.phi[v])), 0.f, 1.f);
        field.way[v] = k * field.way[v] + detail * (field.phi[v] - k * coarsePhi[v]);
        field.scale[v] *= k;
        if (field.scale[v] < slowest) field.scale[v] = 0;
    }
    if (nearRim) mendNearRim(front, origin, field);
}

/// Interpolation knows nothing of a field that turns around the rim like the hand of a clock.
void RegionBuilder::mendNearRim(const Front& front, const Coord& origin, OwnField& field) const {
    constexpr double kOnly = 1, kNone = 2;  // coarse voxels from the rim: nothing but the wedge; nothing of it
    const double toCoarse = 1.0 / factor_;
    const ContactDistance::Near rims = front.element.contact->near((centreOf(origin) + Vec3(3.5, 3.5, 3.5)) * toCoarse,
                                                                   3.5 * std::sqrt(3.0) * toCoarse, kNone);
    if (rims.empty()) return;
    for (int v = 0; v < 512; ++v) {
        const double phi = field.phi[v] * toCoarse;
        if (phi <= 0 || phi >= kNone || !(field.scale[v] > 0) || field.way[v] > kBand * factor_) continue;
        const Vec3 p = centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))) * toCoarse;
        Vec3f rim;
        const double d = rims.nearest({float(p[0]), float(p[1]), float(p[2])}, rim);
        if (d >= kNone) continue;
        const double time = front.wedgeArrival(p, phi, d, Vec3(rim[0], rim[1], rim[2]), 2 * toCoarse);
        if (time > 1e30) continue;
        const double scale = factor_ * front.scaleFor(d), wedge = scale * (time - double(front.stopTime)),
                     share = std::clamp((kNone - d) / (kNone - kOnly), 0.0, 1.0);
        field.way[v] = float(share * wedge + (1 - share) * field.way[v]);
        field.scale[v] = float(share * scale + (1 - share) * field.scale[v]);
    }
}

void RegionBuilder::clipBy(int i, int j, const Coord& origin, const OwnField& a, float* clip) const {
    OwnField b;
    if (!load(j, origin, b)) return;
    const Bisector g(elements_[size_t(i)], elements_[size_t(j)]);
    const double fine = factor_;
    const float stopA = fronts_[size_t(i)] ? fronts_[size_t(i)]->stopTime : 0,
                stopB = fronts_[size_t(j)] ? fronts_[size_t(j)]->stopTime : 0, later = stopA - stopB;
    const auto bisector = [&](int v) {
        if (g.byDepth() && std::min(a.phi[v], b.phi[v]) > -kBand) return float(g.fromDistances(a.phi[v], b.phi[v]));
        return float(fine * g(centreOf(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))) / fine));
    };
    for (int v = 0; v < 512; ++v) {
        const float scaleA = a.grown ? a.scale[v] : 0, scaleB = b.grown ? b.scale[v] : 0;
        const bool inA = a.phi[v] < 0, inB = b.phi[v] < 0;
        float taken;
        if (inA && inB) {
            taken = std::min(-b.phi[v], bisector(v));
        } else if (scaleB > 0) {
            taken = inA ? -kBand : -std::min(b.phi[v], b.way[v]);
            if (scaleA > 0) {
                const float earlier =
                    (a.way[v] * scaleB - b.way[v] * scaleA + later * scaleA * scaleB) / (scaleA + scaleB);
                taken = inA ? earlier : std::min(taken, earlier);
            }
        } else {
            taken = -b.phi[v];
        }
        clip[v] = std::max(clip[v], taken);
    }
}

bool RegionBuilder::evaluate(int i, const std::vector<int>& rivals, const Coord& origin, float* own, float* clip,
                             float* slope) const {
    OwnField a;
    if (!load(i, origin, a)) return false;
    bool inReach = false;
    for (int v = 0; v < 512; ++v) {
        const bool front = a.grown && a.scale[v] > 0 && a.way[v] <= a.phi[v];
        slope[v] = front ? a.scale[v] : 0;
        own[v] = std::clamp(front ? a.way[v] : a.phi[v], -kBand, kBand);
        inReach |= own[v] < kNear;
    }
    if (!inReach) return false;
    std::fill(clip, clip + 512, -kBand);
    if (base_) {
        const auto* leaf = base_->probeConstLeaf(origin);
        const float tile = leaf ? 0 : base_->getValue(origin);
        for (int v = 0; v < 512; ++v) clip[v] = leaf ? -leaf->buffer().data()[v] : -tile;
    }
    const CoordBBox here(origin, origin.offsetBy(7));
    for (int j : rivals)
        if (reach_[size_t(j)].hasOverlap(here)) clipBy(i, j, origin, a, clip);
    for (int v = 0; v < 512; ++v) clip[v] = std::clamp(clip[v], -kBand, kBand);
    return true;
}

void RegionBuilder::addBlock(int i, const std::vector<int>& rivals, const Coord& origin, Region& region) const {
    float own[512], clip[512], slope[512];
    if (!evaluate(i, rivals, origin, own, clip, slope)) return;
    float least = kBand, most = -kBand;
    for (int v = 0; v < 512; ++v) {
        const float value = std::max(own[v], clip[v]);
        least = std::min(least, value);
        most = std::max(most, value);
    }
    if (least >= kNear) return;
    if (most <= -kNear)
        region.fill(origin);
    else
        region.add(origin, own, clip, slope);
}

Region RegionBuilder::build(int i) const {
    Region region(reach_[size_t(i)]);
    const WorkTree& body = *elements_[size_t(i)].body;
    const Front* front = fronts_[size_t(i)].get();
    const std::vector<int> rivals = rivalsOf(i);
    forEachBlock(reach_[size_t(i)], [&](const Coord& origin) {
        if (body.probeConstLeaf(origin) || (front && front->probe(origin)))
            addBlock(i, rivals, origin, region);
        else if (body.getValue(origin) < 0)
            region.fill(origin);
    });
    region.dropStrays();
    return region;
}

Region RegionBuilder::refine(int i, const Region& coarse) const {
    Region region(reach_[size_t(i)]);
    region.reserve(coarse.size() * size_t(factor_ * factor_));
    const std::vector<int> rivals = rivalsOf(i);
    const int m = 8 / factor_;  // coarse voxels along a block
    std::vector<float> all(coarse.size() * 512);
    for (size_t b = 0; b < coarse.size(); ++b) coarse.values(int(b), 0, &all[b * 512]);
    const auto valueAt = [&](const Coord& c) {
        const int b = coarse.at(leafOrigin(c));
        return b >= 0 ? all[size_t(b) * 512 + WorkLeaf::coordToOffset(c)] : b == Region::kInside ? -kBand : kBand;
    };
    forEachBlock(CoordBBox(coarse.lower(), coarse.upper()), [&](const Coord& leaf) {
        const int b = coarse.at(leaf);
        if (b == Region::kOutside) return;
        for (int x = 0; x < 8; x += m)
            for (int y = 0; y < 8; y += m)
                for (int z = 0; z < 8; z += m) {
                    const Coord lo = leaf.offsetBy(x, y, z), origin(lo[0] * factor_, lo[1] * factor_, lo[2] * factor_);
                    if (b == Region::kInside) {
                        region.fill(origin);
                        continue;
                    }
                    bool in = true, out = true;
                    for (int u = -1; u <= m; ++u)
                        for (int v = -1; v <= m; ++v)
                            for (int w = -1; w <= m; ++w) {
                                const float value = valueAt(lo.offsetBy(u, v, w));
                                in &= value <= -1;
                                out &= value >= 1;
                            }
                    if (in)
                        region.fill(origin);
                    else if (!out)
                        addBlock(i, rivals, origin, region);
                }
    });
    region.dropStrays();
    return region;
}

}  // namespace pavel
