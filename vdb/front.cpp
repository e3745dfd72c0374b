#include "pavel/vdb/front.h"

#include <algorithm>

#include "pavel/vdb/recovery_function.h"
#include "pavel/vdb/voxelize.h"

namespace pavel {
namespace {

constexpr float kNever = GrowthBlock::kNever;
constexpr double kTrusted = 1;  // voxels from the rim within which a distance tells no angle

/// Godunov's upwind solution of |grad T| = 1 / speed from the earliest times along the axes, kNever for none.
double arrival(const float times[3], double speed) {
    double a = times[0], b = times[1], c = times[2];
    if (a > b) std::swap(a, b);
    if (b > c) std::swap(b, c);
    if (a > b) std::swap(a, b);
    if (a >= kNever) return kNever;
    const double slowness = 1 / speed;
    double result = a + slowness;
    if (result <= b) return result;
    double sum = a + b, squares = a * a + b * b, disc = sum * sum - 2 * (squares - slowness * slowness);
    if (disc < 0) return result;
    result = (sum + std::sqrt(disc)) / 2;
    if (result <= c) return result;
    sum += c, squares += c * c, disc = sum * sum - 3 * (squares - slowness * slowness);
    return disc < 0 ? result : (sum + std::sqrt(disc)) / 3;
}

float waitingTime(double time) {
    return std::max(float(time), 1e-6f);  // zero is the bodies' own
}

/// The voxels of a block that are not in the body, but beside it.
VoxelMask besideBody(const BlockMasks& body, const Coord& origin) {
    const VoxelMask* sides[6];
    for (int side = 0; side < 6; ++side) {
        Coord c = origin;
        c[side / 2] += side % 2 ? 8 : -8;
        sides[side] = &body.mask(c);
    }
    VoxelMask beside = besideMask(body.mask(origin), sides);
    beside -= body.mask(origin);
    return beside;
}

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
    b0.body = &element.body.mask(origin);
    b0.placed = &element.placed;
    b0.placedBlock = element.placed.at(origin);
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

/// A new cell of a block.
GrowthCell& Front::add(GrowthBlock& block, int cell) {
    if (usedOfLast_ == kChunk) {
        cells_.emplace_back(new GrowthCell[kChunk]);
        usedOfLast_ = 0;
    }
    block.cells[cell] = &cells_.back()[usedOfLast_++];
    return *block.cells[cell];
}

GrowthCell& Front::touch(GrowthBlock& block, int v) {
    if (GrowthCell* cell = block.cells[cellOf(v)]) return *cell;
    GrowthCell& cell = add(block, cellOf(v));
    for (int i = 0; i < GrowthCell::kCount; ++i) {
        cell.time[i] = kNever;
        cell.contact[i] = -1;
        cell.state[i] = block.untouched(GrowthBlock::voxelOf(cellOf(v), i));
    }
    return cell;
}

GrowthBlock* Front::stepOrMake(GrowthBlock* block, int v, int side, int& n) {
    GrowthBlock* other = step(block, v, side, n);
    if (other) return other;
    Coord c = block->origin;
    c[side / 2] += side % 2 ? 8 : -8;
    return make(c);
}

double Front::speedAt(double contact) const {
    return weight * recoveryFunction(contact / element.size, a, b);
}

double Front::speedOf(GrowthBlock* block, int v) {
    float& contact = touch(*block, v).contact[inCell(v)];
    if (contact < 0) {
        const Vec3 p = centreOf(block->origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
        const ContactDistance::Measure m = element.contact->measure(p);
        contact = float(m.distance);
        nearestRim_ = m.rim, rimAskedFor_ = keyOf(*block, v);
    }
    return speedAt(contact);
}

/// Arrival near the contact rim, where the speed changes too fast within a voxel to march: with F = k d the front
/// sweeps the wedge between body and neighbour like a hand of a clock, T = angle / k. Nearer than `trusted` the
/// angle is read farther out on the same ray from the rim. Never, away from the rim.
double Front::wedgeArrival(const Vec3& p, double phi, double d, const ContactDistance::Foot& foot,
                           double trusted) const {
    if (d > wedgeReach() || d <= 0 || phi > 3) return kNever;
    const double side = foot.away / d;
    if (d < trusted) {
        const Vec3 ray = p - foot.rim;
        const double l = length(ray);
        if (l < 1e-3) return kNever;
        const Vec3 farther = foot.rim + (trusted / l) * ray;
        phi = element.fine ? placedDistance(*element.fine, element.indexFromElement, farther)
                           : sampleAt(element.placed, farther);
        d = trusted;
    }
    const double speed = speedAt(d), rise = std::asin(std::clamp(phi / d, -1.0, 1.0)),
                 angle = rise + behind(side) * (kPi - 2 * rise);
    return speed > 0 ? angle * d / speed : kNever;
}

double Front::wedgeArrival(const GrowthBlock& block, int v) const {
    const double d = block.contact(v);
    if (d > wedgeReach() || d <= 0) return kNever;
    const double phi = block.placedAt(v);
    if (phi <= 0 || phi > 3) return kNever;
    const Vec3 p = centreOf(block.origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)));
    const ContactDistance& contact = *element.contact;
    const int rim = rimAskedFor_ == keyOf(block, v) ? nearestRim_ : contact.measure(p).rim;
    return wedgeArrival(p, phi, d, contact.footOn(rim, p), kTrusted);
}

void Front::push(GrowthBlock* block, int v, double time) {
    const float t = waitingTime(time);
    GrowthCell& cell = touch(*block, v);
    const int i = inCell(v);
    if (!(t < cell.time[i])) return;
    changed_ = true;
    cell.time[i] = t;
    cell.state[i] = kTrial;
    heap_.push({t, keyOf(*block, v)});
}

void Front::start() {
    // The body has a block wherever its surface is near, even where none of its voxels lie in it.
    for (const Coord& origin : element.body.origins()) {
        const ClaimBlock* claims = nullptr;
        const VoxelMask beside = besideBody(element.body, origin);
        for (auto at = beside.beginOn(); at; ++at) {
            const int v = int(at.pos());
            if (!claims) claims = claims_.block(origin);
            if (claims->at(v) == kFree) enter(*make(origin), v);
        }
    }
}

/// From the body into a voxel beside it. The body may lie in the next block: from here on the front knows that.
void Front::enter(GrowthBlock& block, int v) {
    const float phi = block.placedAt(v);
    if (phi > 1.8f) return;
    const double speed = speedOf(&block, v);
    if (speed <= 0) {
        dormant_ = true;
        return;
    }
    for (int side = 0, n; side < 6; ++side) stepOrMake(&block, v, side, n);
    const double wedge = wedgeArrival(block, v);
    push(&block, v, wedge < kNever ? wedge : std::max(0.f, phi) / speed);
}

Front::Upwind Front::upwind(GrowthBlock* block, int v) {
    Upwind times;
    for (int axis = 0; axis < 3; ++axis) {
        float held = kNever, any = kNever;
        for (int side = 2 * axis; side < 2 * axis + 2; ++side) {
            int n;
            const GrowthBlock* other = step(block, v, side, n);
            const GrowthCell* cell = other ? other->cellAt(n) : nullptr;
            if (!cell) continue;
            const int i = inCell(n);
            const uint8_t s = cell->state[i];
            const float time = cell->time[i];
            if (s == kReal) held = std::min(held, time);
            if (s == kReal || s == kGhost) any = std::min(any, time);
        }
        times.held[axis] = held, times.any[axis] = any;
    }
    return times;
}

bool Front::heldByOther(const GrowthBlock* block, int v, float time, const std::vector<float>& stopTimes) const {
    const Claim c = block->claims->at(v);
    if (c == kFree || claimOwner(c) == element.id) return false;
    if (claimTime(c) == 0) return true;  // a body
    if (claimTime(c) > stopTimes[size_t(claimOwner(c))]) return false;
    return c < makeClaim(time, element.id);
}

bool Front::accept(GrowthBlock* block, int v, const std::vector<float>& stopTimes, bool claiming) {
    changed_ = true;
    bool besideReal = false, besideGhost = false;
    for (int side = 0; side < 6; ++side) {
        int n;
        const GrowthBlock* other = step(block, v, side, n);
        if (!other) continue;
        const VoxelState s = other->state(n);
        besideReal |= s == kReal || s == kBody || s == kInner;
        besideGhost |= s == kGhost;
    }
    GrowthCell& cell = touch(*block, v);
    uint8_t& state = cell.state[inCell(v)];
    float& time = cell.time[inCell(v)];
    if (!heldByOther(block, v, time, stopTimes)) {
        if (!besideReal) {  // only a way through foreign ground leads here
            state = kFar;
            time = kNever;
            return false;
        }
        state = kReal;
        if (claiming) claimed_.push_back({time, keyOf(*block, v)});
        return true;
    }
    state = besideReal ? kGhost : kDeepGhost;
    if (!besideReal && !besideGhost) {
        state = kFar;
        time = kNever;
    }
    // Past the end, times are asked for beside a body's surface, not in it.
    return state == kGhost && (claiming || claimTime(block->claims->at(v)) > 0);
}

/// From the neighbours that were accepted; kNever where only foreign ground leads there.
double Front::arrivalAt(GrowthBlock* block, int v, double speed, const std::vector<float>& stopTimes) const {
    const Upwind times = upwind(block, v);
    double t = arrival(times.held, speed);
    if (t >= kNever) {
        t = arrival(times.any, speed);
        return t < kNever && !heldByOther(block, v, float(t), stopTimes) ? kNever : t;
    }
    if (!heldByOther(block, v, float(t), stopTimes)) return t;
    // Along a face the way there runs through ghosts. It may not come out earlier than the holder's, though.
    const float held = claimTime(block->claims->at(v));
    return std::max(arrival(times.any, speed), double(std::nextafter(held, kNever)));
}

/// Gives the neighbours of an accepted voxel their times.
void Front::pushBeside(GrowthBlock* block, int v, const std::vector<float>& stopTimes) {
    for (int side = 0; side < 6; ++side) {
        int n;
        GrowthBlock* other = stepOrMake(block, v, side, n);
        const VoxelState s = other->state(n);
        if (s != kFar && s != kTrial) continue;
        const double speed = speedOf(other, n);
        if (speed <= 0) {
            dormant_ = true;
            continue;
        }
        const double t = arrivalAt(other, n, speed, stopTimes);
        if (t >= kNever) continue;
        const bool waits = other->hasTime(n);  // its time is no later than its wedge's
        push(other, n, waits ? t : std::min(t, wedgeArrival(*other, n)));
    }
}

void Front::march(double until, const std::vector<float>& stopTimes, bool claiming) {
    wake();
    findQueues();
    claimed_.clear();
    acceptedBefore_ += accepted_;
    accepted_ = 0;
    while (!heap_.empty() && heap_.top().time() < until) {
        const Arrival next = heap_.top();
        heap_.pop();
        GrowthBlock* block = &blocks[next.voxel() / 512];
        const int v = int(next.voxel() % 512);
        if (block->state(v) != kTrial || block->time(v) != next.time()) continue;
        if (accept(block, v, stopTimes, claiming)) pushBeside(block, v, stopTimes);
        ++accepted_;
        if (claiming) lastArrival = next.time();
        speedKnown_ = false;
    }
}

/// The front before a time and layers of voxels around it, the body beside it and one layer around that.
std::vector<VoxelMask> Front::around(double horizon, int layers) {
    std::vector<VoxelMask> masks(blocks.size()), timed(blocks.size());
    for (GrowthBlock& block : blocks)
        block.forEachVoxel([&](int v, const GrowthCell& cell, int i) {
            if (!(cell.time[i] < kNever) || cell.state[i] == kInner) return;
            timed[size_t(block.number)].setOn(openvdb::Index(v));
            if (cell.state[i] == kReal && double(cell.time[i]) <= horizon)
                masks[size_t(block.number)].setOn(openvdb::Index(v));
        });
    const auto beside = [&](const std::vector<VoxelMask>& of, const GrowthBlock& block) {
        const VoxelMask* sides[6];
        for (int side = 0; side < 6; ++side)
            sides[side] = block.next[side] ? &of[size_t(block.next[side]->number)] : nullptr;
        return besideMask(of[size_t(block.number)], sides);
    };
    std::vector<VoxelMask> body(blocks.size());
    for (const GrowthBlock& block : blocks) {
        body[size_t(block.number)] = beside(timed, block);
        body[size_t(block.number)] &= *block.body;
    }
    for (int layer = 0; layer < layers; ++layer) {
        if (layer == layers - 1)
            for (size_t k = 0; k < body.size(); ++k) masks[k] |= body[k];
        const size_t made = blocks.size();
        for (size_t k = 0; k < made; ++k)
            for (int side = 0; side < 6; ++side) {
                if (blocks[k].next[side] || !touchesFace(masks[k], side)) continue;
                Coord c = blocks[k].origin;
                c[side / 2] += side % 2 ? 8 : -8;
                make(c);
            }
        masks.resize(blocks.size());
        std::vector<VoxelMask> wider = masks;
        for (const GrowthBlock& block : blocks) wider[size_t(block.number)] |= beside(masks, block);
        masks.swap(wider);
    }
    return masks;
}

void Front::marchBeyond(double horizon, int layers, const std::vector<float>& stopTimes) {
    wake();
    findQueues();
    pastEnd_ = true;
    std::vector<uint32_t> goOn;
    goOn.swap(leftOut_);
    for (const uint32_t voxel : goOn) pushBeside(&blocks[voxel / 512], int(voxel % 512), stopTimes);
    march(horizon, stopTimes, false);
    const std::vector<VoxelMask> limits = around(horizon, layers);
    std::vector<Arrival> layer, waiting;
    for (const Arrival& next : heap_)
        (limits[next.voxel() / 512].isOn(next.voxel() % 512) ? layer : waiting).push_back(next);
    while (!layer.empty()) layer = layerBeside(std::move(layer), limits, stopTimes);
    heap_.clear();
    for (const Arrival& next : waiting) heap_.push(next);
    std::vector<Arrival>().swap(claimed_);
    speedKnown_ = false;
}

/// Accepts a layer of voxels, and gives those beside it within the limits their times, all from it and from layers
/// before: past the end, who of one layer comes first makes no difference worth a queue.
std::vector<Front::Arrival> Front::layerBeside(std::vector<Arrival> layer, const std::vector<VoxelMask>& limits,
                                               const std::vector<float>& stopTimes) {
    std::sort(layer.begin(), layer.end(), [](const Arrival& x, const Arrival& y) { return y < x; });
    std::vector<std::pair<GrowthBlock*, int>> on, beside;
    for (const Arrival& next : layer) {
        GrowthBlock* block = &blocks[next.voxel() / 512];
        const int v = int(next.voxel() % 512);
        if (block->state(v) != kTrial || block->time(v) != next.time()) continue;
        // Those of its own layer that are earlier may know a shorter way.
        const double t = arrivalAt(block, v, speedOf(block, v), stopTimes);
        float& time = block->cells[cellOf(v)]->time[inCell(v)];
        time = std::min(time, waitingTime(t));
        if (accept(block, v, stopTimes, false)) on.emplace_back(block, v);
    }
    for (const auto& [block, v] : on) {
        bool leftOut = false;
        for (int side = 0; side < 6; ++side) {
            int n;
            GrowthBlock* other = step(block, v, side, n);
            if (!other || !limits[size_t(other->number)].isOn(openvdb::Index(n))) {
                leftOut = true;
            } else if (other->state(n) == kFar) {
                touch(*other, n).state[inCell(n)] = kTrial;
                beside.emplace_back(other, n);
            }
        }
        if (leftOut) leftOut_.push_back(keyOf(*block, v));
    }
    layer.clear();
    for (const auto& [block, v] : beside) {
        const double speed = speedOf(block, v), t = speed > 0 ? arrivalAt(block, v, speed, stopTimes) : kNever;
        if (speed <= 0) dormant_ = true;
        GrowthCell& cell = touch(*block, v);
        cell.state[inCell(v)] = t < kNever ? kTrial : kFar;
        if (t >= kNever) continue;
        cell.time[inCell(v)] = waitingTime(std::min(t, wedgeArrival(*block, v)));
        layer.emplace_back(cell.time[inCell(v)], keyOf(*block, v));
    }
    return layer;
}

void Front::commit() {
    for (const Arrival& c : claimed_)
        blocks[c.voxel() / 512].claims->enter(int(c.voxel() % 512), makeClaim(c.time(), element.id));
}

void Front::settle() {
    won = 0;
    size_t kept = 0;
    for (const Arrival& c : claimed_) {
        GrowthBlock& block = blocks[c.voxel() / 512];
        const int v = int(c.voxel() % 512);
        if (block.claims->at(v) == makeClaim(c.time(), element.id))
            claimed_[kept++] = c;
        else if (resting_.empty())
            touch(block, v).state[inCell(v)] = kGhost;
        else
            resting_.setState(block.number, v, kGhost);
    }
    claimed_.erase(claimed_.begin() + std::ptrdiff_t(kept), claimed_.end());
    won = kept;
    const double needed = element.lost() - grown;
    if (double(won) < needed) {
        grown += double(won);
        return;
    }
    std::sort(claimed_.begin(), claimed_.end(), [](const Arrival& x, const Arrival& y) { return y < x; });
    const size_t last = std::min(won, size_t(std::max(1.0, std::ceil(needed)))) - (won ? 1 : 0);
    if (won) stopTime = claimed_[last].time();
    grown += needed;
    stopped = true;
}

void Front::release() {
    for (const Arrival& c : claimed_)
        if (c.time() > stopTime) blocks[c.voxel() / 512].claims->free(int(c.voxel() % 512));
}

double Front::nextArrival() const {
    if (queuesGone_) return double(waits_);
    return heap_.empty() ? std::numeric_limits<double>::infinity() : double(heap_.top().time());
}

double Front::frontSpeed() {
    if (speedKnown_) return speed_;
    wake();
    findQueues();
    double most = 0;
    for (const Arrival& h : heap_) {
        const GrowthBlock& block = blocks[h.voxel() / 512];
        const int v = int(h.voxel() % 512);
        if (block.state(v) == kTrial && block.time(v) == h.time()) most = std::max(most, speedAt(block.contact(v)));
    }
    for (const uint32_t voxel : leftOut_) most = std::max(most, speedAt(blocks[voxel / 512].contact(int(voxel % 512))));
    speedKnown_ = true;
    return speed_ = most;
}

bool Front::widen() {
    constexpr double kStepFactor = 1.3;
    if (b * kStepFactor > kWidest) return false;
    wake();
    b *= kStepFactor;
    changed_ = true;
    queuesGone_ = false;
    accepted_ = acceptedBefore_ = 0;
    for (GrowthBlock& block : blocks)
        block.forEachVoxel([&](int v, GrowthCell& cell, int i) {
            if (block.untouched(v) == kBody) return;
            if (claimOwner(block.claims->at(v)) == element.id) block.claims->free(v);
            cell.state[i] = kFar;
            cell.time[i] = kNever;
        });
    heap_.clear();
    leftOut_.clear();
    speedKnown_ = false;
    dormant_ = false;
    claimed_.clear();
    grown = 0;
    lastArrival = 0;
    return true;
}

}  // namespace pavel
