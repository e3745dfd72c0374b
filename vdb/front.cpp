#include "pavel/vdb/front.h"

#include <algorithm>

#include "pavel/vdb/measure.h"
#include "pavel/vdb/recovery_function.h"

namespace pavel {
namespace {

constexpr float kNever = std::numeric_limits<float>::max();
constexpr int kStep[3] = {64, 8, 1};
constexpr double kTrusted = 2;  // voxels from the rim within which a distance tells no angle

}  // namespace

Front::Front(const WorkElement& e, ClaimMap& claims, double a_, double b_, double w)
    : element(e), a(a_), b(b_), weight(w), firstB(b_), claims_(claims) {}

GrowthBlock* Front::probe(const Coord& origin) const {
    const auto found = map_.find(origin);
    return found == map_.end() ? nullptr : found->second;
}

GrowthBlock* Front::make(const Coord& origin) {
    if (GrowthBlock* known = probe(origin)) return known;
    GrowthBlock& b0 = blocks.emplace_back();
    b0.origin = origin;
    b0.number = int(blocks.size()) - 1;
    b0.claims = claims_.block(origin);
    const WorkLeaf* leaf = element.body->probeConstLeaf(origin);
    const float *body = leaf ? leaf->buffer().data() : nullptr, tile = leaf ? 0 : element.body->getValue(origin);
    const WorkLeaf* placed = element.placed->probeConstLeaf(origin);
    b0.placed = placed ? placed->buffer().data() : nullptr;
    b0.placedTile = placed ? 0 : element.placed->getValue(origin);
    for (int v = 0; v < 512; ++v) {
        const float phi = body ? body[v] : tile;
        b0.contact[v] = -1;
        b0.scale[v] = 0;
        b0.state[v] = phi < 0 ? kBody : kFar;
        b0.time[v] = phi < 0 ? phi : kNever;
    }
    changed_ = true;
    map_[origin] = &b0;
    for (int side = 0; side < 6; ++side) {
        Coord c = origin;
        c[side / 2] += side % 2 ? 8 : -8;
        if (GrowthBlock* n = probe(c)) {
            b0.next[side] = n;
            n->next[side ^ 1] = &b0;
        }
    }
    return &b0;
}

GrowthBlock* Front::step(GrowthBlock* block, int v, int side, int& n) {
    const int axis = side / 2, x = v / kStep[axis] & 7;
    if (side % 2 ? x < 7 : x > 0) {
        n = v + (side % 2 ? kStep[axis] : -kStep[axis]);
        return block;
    }
    n = v + (side % 2 ? -7 : 7) * kStep[axis];
    return block->next[side];
}

GrowthBlock* Front::stepOrMake(GrowthBlock* block, int v, int side, int& n) {
    GrowthBlock* other = step(block, v, side, n);
    if (other) return other;
    Coord c = block->origin;
    c[side / 2] += side % 2 ? 8 : -8;
    return make(c);
}

double Front::speedAt(const GrowthBlock& block, int v) const {
    return weight * recoveryFunction(block.contact[v] / element.size, a, b);
}

double Front::scaleFor(double contact) const {
    const double least = std::min(2.0, a * element.size);
    return weight * recoveryFunction(std::max(least, contact) / element.size, a, b);
}

double Front::speedOf(GrowthBlock* block, int v) {
    if (block->contact[v] < 0) {
        block->contact[v] =
            float((*element.contact)(centreOf(block->origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)))));
        block->scale[v] = float(scaleFor(block->contact[v]));
    }
    return speedAt(*block, v);
}

/// Arrival near the contact rim, where the speed changes too fast within a voxel to march: with F = k d the front
/// sweeps the wedge between body and neighbour like a hand of a clock, T = angle / k. Nearer than `trusted` the
/// angle is read farther out on the same ray from the rim. Never, away from the rim.
double Front::wedgeArrival(const Vec3& p, double phi, double d, const Vec3& rim, double trusted) const {
    if (d > wedgeReach() || d <= 0 || phi <= 0 || phi > 3) return kNever;
    if (d < trusted) {
        const Vec3 ray = p - rim;
        const double l = length(ray);
        if (l < 1e-3) return kNever;
        phi = sampleAt(*element.placed, rim + (trusted / l) * ray);
        d = trusted;
    }
    const double speed = weight * recoveryFunction(d / element.size, a, b);
    return speed > 0 ? std::asin(std::clamp(phi / d, 0.0, 1.0)) * d / speed : kNever;
}

double Front::wedgeArrival(const GrowthBlock& block, int v) const {
    const double d = block.contact[v];
    if (d > wedgeReach() || d <= 0) return kNever;
    const double phi = block.placedAt(v);
    if (phi <= 0 || phi > 3) return kNever;
    const Coord c = block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
    return wedgeArrival(centreOf(c), phi, d, d < kTrusted ? element.contact->nearest(centreOf(c)) : Vec3(0, 0, 0),
                        kTrusted);
}

/// Mean scale of the neighbours that have times, for a body voxel beside them; 0 where there are none.
double Front::innerScale(GrowthBlock& block, int v) const {
    double sum = 0;
    int count = 0;
    for (int side = 0; side < 6; ++side) {
        int n;
        const GrowthBlock* other = step(&block, v, side, n);
        if (!other || !other->hasTime(n)) continue;
        sum += other->scale[n];
        ++count;
    }
    return count ? sum / count : 0;
}

void Front::finish() {
    if (!changed_) return;
    changed_ = false;
    for (GrowthBlock& block : blocks)
        for (int v = 0; v < 512; ++v)
            if (block.state[v] == kBody) block.scale[v] = 0;
    constexpr float kListed = -1;  // no scale, and not to be listed again
    std::vector<std::pair<GrowthBlock*, int>> layer, first;
    const auto listBeside = [&](GrowthBlock& block, int v) {
        for (int side = 0; side < 6; ++side) {
            int n;
            GrowthBlock* other = step(&block, v, side, n);
            if (!other || other->state[n] != kBody || other->scale[n] != 0) continue;
            other->scale[n] = kListed;
            layer.emplace_back(other, n);
        }
    };
    const auto giveTimes = [&] {
        std::vector<float> scales;
        for (const auto& [block, v] : layer) scales.push_back(float(innerScale(*block, v)));
        for (size_t i = 0; i < layer.size(); ++i) {
            const auto [block, v] = layer[i];
            block->scale[v] = scales[i];
            block->time[v] = std::min(-1e-6f, block->placedAt(v) / scales[i]);
        }
    };
    for (GrowthBlock& block : blocks)
        for (int v = 0; v < 512; ++v)
            if (block.state[v] != kFar && block.state[v] != kBody && block.hasTime(v)) listBeside(block, v);
    giveTimes();
    first.swap(layer);
    for (const auto& [block, v] : first) listBeside(*block, v);
    giveTimes();
}

void Front::lookBeyond() {
    std::vector<std::pair<GrowthBlock*, int>> layer, next;
    const auto contactAt = [&](const GrowthBlock& block, int v) {
        return float((*element.contact)(centreOf(block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)))));
    };
    const auto askBeside = [&](GrowthBlock* block, int v) {
        for (int side = 0; side < 6; ++side) {
            int n;
            GrowthBlock* other = stepOrMake(block, v, side, n);
            if (other->contact[n] >= 0) continue;
            other->contact[n] = contactAt(*other, n);
            next.emplace_back(other, n);
        }
    };
    // Elsewhere the speed changes little within two voxels.
    const float slow = float(weight * recoveryFunction(b - 3 / element.size, a, b));
    const size_t made = blocks.size();
    for (size_t i = 0; i < made; ++i)
        for (int v = 0; v < 512; ++v) {
            GrowthBlock& block = blocks[i];
            if (!block.hasTime(v) || block.scale[v] > slow) continue;
            askBeside(&block, v);
            if (block.state[v] != kBody) continue;
            // Its neighbours' mean will do for marching; where the speed ends within a voxel it would leave warts.
            block.contact[v] = contactAt(block, v);
            const float scale = float(scaleFor(block.contact[v]));
            if (scale > 0) block.time[v] = std::min(-1e-6f, block.placedAt(v) / scale);
            block.scale[v] = scale;
        }
    layer.swap(next);
    for (const auto& [block, v] : layer) askBeside(block, v);
}

void Front::push(GrowthBlock* block, int v, double time) {
    const float t = std::max(float(time), 1e-6f);  // zero is the bodies' own
    if (!(t < block->time[v])) return;
    changed_ = true;
    block->time[v] = t;
    block->state[v] = kTrial;
    heap_.push_back({t, uint32_t(block->number) * 512 + uint32_t(v)});
    std::push_heap(heap_.begin(), heap_.end());
}

void Front::start() {
    HaloBlock halo;
    for (auto leaf = element.body->cbeginLeaf(); leaf; ++leaf) {
        loadHalo(*element.body, *leaf, halo);
        const ClaimBlock* claims = nullptr;
        for (int v = 0; v < 512; ++v) {
            const float* at = &halo[size_t(((v >> 6) + 1) * 100 + ((v >> 3 & 7) + 1) * 10 + (v & 7) + 1)];
            const float phi = *at;
            if (phi < 0 || phi > 1.8f) continue;
            const float beside = std::min({at[-100], at[100], at[-10], at[10], at[-1], at[1]});
            if (!(beside < 0)) continue;
            if (!claims) claims = claims_.block(leaf->origin());
            if (claims->claims[v].load(std::memory_order_relaxed) != kFree) continue;
            GrowthBlock* block = make(leaf->origin());
            const double speed = speedOf(block, v);
            if (speed > 0) {
                const double wedge = wedgeArrival(*block, v);
                push(block, v, wedge < kNever ? wedge : std::max(0.f, phi) / speed);
            } else
                dormant_ = true;
        }
    }
}

/// Godunov's upwind solution of |grad T| = 1 / speed from the accepted neighbours.
double Front::arrival(GrowthBlock* block, int v, double speed, bool withGhosts) const {
    double t[3];
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) {
        double best = kNever;
        for (int side = 2 * axis; side < 2 * axis + 2; ++side) {
            int n;
            const GrowthBlock* other = step(block, v, side, n);
            if (!other) continue;
            const uint8_t s = other->state[n];
            if (s == kReal || (withGhosts && s == kGhost)) best = std::min(best, double(other->time[n]));
        }
        if (best >= kNever) continue;
        int k = count++;  // insertion sort
        for (; k > 0 && t[k - 1] > best; --k) t[k] = t[k - 1];
        t[k] = best;
    }
    if (count == 0) return kNever;
    const double slowness = 1 / speed;
    double result = t[0] + slowness, sum = t[0], squares = t[0] * t[0];
    for (int k = 1; k < count && result > t[k]; ++k) {
        sum += t[k];
        squares += t[k] * t[k];
        const double m = k + 1, disc = sum * sum - m * (squares - slowness * slowness);
        if (disc < 0) break;
        result = (sum + std::sqrt(disc)) / m;
    }
    return result;
}

bool Front::heldByOther(const GrowthBlock* block, int v, float time, const std::vector<float>& stopTimes) const {
    const Claim c = block->claims->claims[v].load(std::memory_order_relaxed);
    if (c == kFree || claimOwner(c) == element.id) return false;
    if (claimTime(c) == 0) return true;  // a body
    if (claimTime(c) > stopTimes[size_t(claimOwner(c))]) return false;
    return c < makeClaim(time, element.id);
}

void Front::accept(GrowthBlock* block, int v, const std::vector<float>& stopTimes, bool claiming) {
    changed_ = true;
    bool besideReal = false, besideGhost = false;
    for (int side = 0; side < 6; ++side) {
        int n;
        const GrowthBlock* other = step(block, v, side, n);
        if (!other) continue;
        besideReal |= other->state[n] == kReal || other->state[n] == kBody;
        besideGhost |= other->state[n] == kGhost;
    }
    const float time = block->time[v];
    if (!heldByOther(block, v, time, stopTimes)) {
        if (!besideReal) {  // only a way through foreign ground leads here
            block->state[v] = kFar;
            block->time[v] = kNever;
            return;
        }
        block->state[v] = kReal;
        if (claiming) claimed_.push_back({time, uint32_t(block->number) * 512 + uint32_t(v)});
    } else {
        block->state[v] = besideReal ? kGhost : kDeepGhost;
        if (!besideReal && !besideGhost) {
            block->state[v] = kFar;
            block->time[v] = kNever;
        }
        if (block->state[v] != kGhost) return;
    }
    for (int side = 0; side < 6; ++side) {
        int n;
        GrowthBlock* other = stepOrMake(block, v, side, n);
        if (other->state[n] != kFar && other->state[n] != kTrial) continue;
        const double speed = speedOf(other, n);
        if (speed <= 0) {
            dormant_ = true;
            continue;
        }
        double t = arrival(other, n, speed, false);
        if (t >= kNever) {
            t = arrival(other, n, speed, true);
            if (t < kNever && !heldByOther(other, n, float(t), stopTimes)) continue;
        }
        if (t >= kNever) continue;
        const bool waits = other->time[n] < kNever;  // its time is no later than its wedge's
        push(other, n, waits ? t : std::min(t, wedgeArrival(*other, n)));
    }
}

void Front::march(double until, const std::vector<float>& stopTimes, bool claiming) {
    claimed_.clear();
    while (!heap_.empty() && heap_.front().time < until) {
        std::pop_heap(heap_.begin(), heap_.end());
        const Arrival next = heap_.back();
        heap_.pop_back();
        GrowthBlock* block = &blocks[next.voxel / 512];
        const int v = int(next.voxel % 512);
        if (block->state[v] != kTrial || block->time[v] != next.time) continue;
        accept(block, v, stopTimes, claiming);
        if (claiming) lastArrival = next.time;
        speedKnown_ = false;
    }
}

void Front::commit() {
    for (const Arrival& c : claimed_) {
        std::atomic<Claim>& slot = blocks[c.voxel / 512].claims->claims[c.voxel % 512];
        const Claim mine = makeClaim(c.time, element.id);
        Claim held = slot.load(std::memory_order_relaxed);
        while (mine < held && !slot.compare_exchange_weak(held, mine, std::memory_order_relaxed)) {
        }
    }
}

void Front::settle() {
    won = 0;
    size_t kept = 0;
    for (const Arrival& c : claimed_) {
        GrowthBlock& block = blocks[c.voxel / 512];
        const int v = int(c.voxel % 512);
        if (block.claims->claims[v].load(std::memory_order_relaxed) == makeClaim(c.time, element.id))
            claimed_[kept++] = c;
        else
            block.state[v] = kGhost;
    }
    claimed_.resize(kept);
    won = kept;
    const double needed = element.lost() - grown;
    if (double(won) < needed) {
        grown += double(won);
        return;
    }
    std::sort(claimed_.begin(), claimed_.end(), [](const Arrival& x, const Arrival& y) { return y < x; });
    const size_t last = std::min(won, size_t(std::max(1.0, std::ceil(needed)))) - (won ? 1 : 0);
    if (won) stopTime = claimed_[last].time;
    grown += needed;
    stopped = true;
}

void Front::release() {
    for (const Arrival& c : claimed_)
        if (c.time > stopTime)
            blocks[c.voxel / 512].claims->claims[c.voxel % 512].store(kFree, std::memory_order_relaxed);
}

double Front::nextArrival() const {
    return heap_.empty() ? std::numeric_limits<double>::infinity() : double(heap_.front().time);
}

double Front::frontSpeed() {
    if (speedKnown_) return speed_;
    double most = 0;
    for (const Arrival& h : heap_) {
        const GrowthBlock& block = blocks[h.voxel / 512];
        if (block.state[h.voxel % 512] == kTrial && block.time[h.voxel % 512] == h.time)
            most = std::max(most, speedAt(block, int(h.voxel % 512)));
    }
    speedKnown_ = true;
    return speed_ = most;
}

bool Front::widen() {
    constexpr double kStepFactor = 1.3, kLimit = 2;
    if (b * kStepFactor > kLimit) return false;
    b *= kStepFactor;
    changed_ = true;
    for (GrowthBlock& block : blocks)
        for (int v = 0; v < 512; ++v) {
            if (block.state[v] == kBody) continue;
            std::atomic<Claim>& slot = block.claims->claims[v];
            if (claimOwner(slot.load(std::memory_order_relaxed)) == element.id)
                slot.store(kFree, std::memory_order_relaxed);
            block.state[v] = kFar;
            block.time[v] = kNever;
            if (block.contact[v] >= 0) block.scale[v] = float(scaleFor(block.contact[v]));
        }
    heap_.clear();
    speedKnown_ = false;
    dormant_ = false;
    claimed_.clear();
    grown = 0;
    lastArrival = 0;
    start();
    return true;
}

}  // namespace pavel
