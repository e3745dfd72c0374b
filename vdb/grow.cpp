#include "pavel/vdb/grow.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "pavel/vdb/last_calls.h"
#include "pavel/vdb/region_builder.h"
#include "pavel/vdb/sweep.h"

namespace pavel {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A front is stuck when its fastest point has fallen under this share of its largest speed (algorithm, section 3).
constexpr double kStuckShare = 0.01;
/// Fronts go on past their end, so that times are known on both sides of it: by so many voxels where they are fastest,
/// and then by layers, wherever they are slow. With one layer around what they reached, elements end short of room.
constexpr double kBeyond = 0.5;
constexpr int kLayersBeyond = 2;

}  // namespace

Growth::Growth(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
               const std::vector<Material>& materials)
    : elements_(elements),
      base_(base),
      claims_(elements, base),
      fronts_(elements.size()),
      horizons_(elements.size(), kInfinity) {
    double most = 0;
    for (const WorkElement& e : elements)
        if (e.bodyVoxels && !std::isinf(e.stiffness)) most = std::max(most, e.lost() / e.placedVolume);
    for (size_t i = 0; i < elements.size(); ++i) {
        const WorkElement& e = elements[i];
        const double share = e.placedVolume > 0 && !std::isinf(e.stiffness) ? e.lost() / e.placedVolume : 0;
        if (!e.bodyVoxels || share < 1e-5 || !e.contact || e.contact->empty()) continue;
        const Material& m = materials[size_t(e.kind)];
        fronts_[i] = std::make_unique<Front>(e, claims_, m.a, m.b, share / most);
    }
}

void Growth::march(const RunContext& context, double roundVoxels) {
    std::vector<Front*> active;
    for (const auto& f : fronts_)
        if (f) active.push_back(f.get());
    const size_t all = active.size();
    const auto each = [&](const std::vector<Front*>& fronts, const auto& f) {
        tbb::parallel_for(size_t(0), fronts.size(), [&](size_t i) { f(*fronts[i]); });
    };
    each(active, [](Front& f) {
        f.start();
        f.frontSpeed();
        f.rest();
    });
    std::vector<float> stopTimes(elements_.size() + 1, std::numeric_limits<float>::infinity());
    std::vector<double> speeds(all), arrivals(all);
    double now = 0;
    // Fronts that start anew do so when all have given back what they held: else it would matter who is first.
    std::vector<char> anew;
    while (!active.empty()) {
        anew.assign(active.size(), 0);
        const auto allOf = [&](const auto& f) { tbb::parallel_for(size_t(0), active.size(), f); };
        context.progress("growth", 0.6 * (1 - double(active.size()) / double(all)));
        // Fronts that are stuck get more room; those that have none left end here.
        allOf([&](size_t i) {
            Front& f = *active[i];
            const bool stuck = f.frontSpeed() < kStuckShare * f.weight;
            anew[i] = stuck && f.couldWiden() && f.widen();
            f.exhausted = stuck && !anew[i];
        });
        allOf([&](size_t i) {
            Front& f = *active[i];
            if (anew[i]) f.start();
            if (f.nextArrival() == kInfinity) f.exhausted = true;
            speeds[i] = f.frontSpeed();
            arrivals[i] = f.nextArrival();
        });
        double speed = 0, first = kInfinity;
        for (size_t i = 0; i < active.size(); ++i) {
            if (active[i]->exhausted) continue;
            speed = std::max(speed, speeds[i]);
            first = std::min(first, arrivals[i]);
        }
        if (first < kInfinity) {
            const double window = roundVoxels / speed;
            now = first + window;  // back to the start, where a front started anew
            each(active, [&](Front& f) {
                f.march(now, stopTimes, true);
                f.frontSpeed();  // asked for in the next round
                if (f.mayRest()) f.rest();
            });
            each(active, [](Front& f) { f.commit(); });
            each(active, [](Front& f) { f.settle(); });
            anew.assign(active.size(), 0);
            allOf([&](size_t i) {
                Front& f = *active[i];
                if (!f.stopped) return;
                // One that just made it has a steep, ragged last layer and no room to settle its stop time in.
                anew[i] = f.frontSpeed() < 5 * kStuckShare * f.weight && f.couldWiden() && f.widen();
                f.stopped = !anew[i];
                if (f.stopped) f.release();
            });
            allOf([&](size_t i) {
                if (anew[i]) active[i]->start();
            });
        }
        std::vector<Front*> ended, next;
        for (Front* f : active) {
            if (f->exhausted && !f->stopped) f->stopTime = f->lastArrival;
            if (f->stopped || f->exhausted) {
                stopTimes[size_t(f->element.id)] = f->stopTime;
                ended.push_back(f);
            } else {
                next.push_back(f);
            }
        }
        each(ended, [&](Front& f) {
            f.marchBeyond(f.stopTime + kBeyond / f.weight, kLayersBeyond, stopTimes);
            f.finish();
            f.rest();
        });
        active = std::move(next);
    }
    leaveClaims();  // hardly any front has to go on later
}

StopShift solveShift(const Region& region, double target, double most, double close) {
    constexpr int kSteps = 5;
    constexpr double kSure = 0.15;  // voxels: a first step this small lands well enough
    StopShift s;
    RegionMeasure measure(region);
    const double voxels = measure.frontVoxels();
    double slope = measure.frontSlopes();
    double volume = measure(0).volume;
    s.missing = target - volume;
    if (!(slope > 0)) return s;
    s.reach = voxels / slope;
    double early = -most * s.reach, late = most * s.reach;
    for (int step = 0; step < kSteps && std::abs(target - volume) > close * target; ++step) {
        const double before = s.later, atBefore = volume;
        (volume < target ? early : late) = before;
        s.later = std::clamp(before + (target - volume) / slope, -most * s.reach, most * s.reach);
        if (s.later <= early || s.later >= late) s.later = 0.5 * (early + late);
        if (step == 0 && std::abs(s.later) < kSure * s.reach) break;
        volume = measure(s.later).volume;
        if (const double moved = s.later - before; std::abs(moved) > 1e-12) {
            const double secant = (volume - atBefore) / moved;
            if (secant > 0.2 * slope) slope = secant;
        }
    }
    return s;
}

void Growth::solveStopTimes(const std::vector<double>& targets, double still, double close, const RunContext& context,
                            const UseRegion& use, const std::function<void(int)>& done) {
    // Jacobi rounds: elements depend on each other only where one stopped before the other came.
    constexpr int kMostRounds = 8;
    constexpr double kClose = 1e-3;
    const size_t n = fronts_.size();
    std::vector<StopShift> shifts(n);
    stopTimes_.assign(n + 1, std::numeric_limits<float>::infinity());
    std::vector<int> open, all;
    for (int i : sweepOrder(elements_)) {
        if (!fronts_[size_t(i)]) continue;
        all.push_back(i);
        stopTimes_[size_t(i) + 1] = fronts_[size_t(i)]->stopTime;
    }
    const auto each = [](const std::vector<int>& list, const auto& f) {
        tbb::parallel_for(size_t(0), list.size(), [&](size_t k) { f(list[k]); });
    };
    open = all;
    std::unique_ptr<LastCalls> calls;
    for (int round = 0; round < kMostRounds && !open.empty(); ++round) {
        const RegionBuilder builder(elements_, base_, fronts_);
        if (done && round == 0) calls = std::make_unique<LastCalls>(elements_, fronts_, builder);
        const auto moves = [&](int i) { return std::abs(shifts[size_t(i)].later) > still * shifts[size_t(i)].reach; };
        inOrder(open, context, "growth", round == 0 ? 0.6 : 0.8, 0.8, [&](int i) {
            Region region = builder.build(i);
            StopShift& s = shifts[size_t(i)];
            s = solveShift(region, targets[size_t(i)], 1, close);
            if (fronts_[size_t(i)]->exhausted && s.missing > 0) s.later = 0;
            if (use) use(i, region, s.later);
            // Later rounds only mend what the neighbours' moves did; halved, so that two cannot chase each other.
            if (round > 1) s.later *= 0.5;
            if (calls && round == 0 && !moves(i)) calls->standsStill(i, done);
        });
        std::vector<char> moved(n, 0);
        for (int i : open) {
            const StopShift& s = shifts[size_t(i)];
            Front& f = *fronts_[size_t(i)];
            f.stopTime = stopTimes_[size_t(i) + 1] = float(f.stopTime + s.later);
            moved[size_t(i)] = moves(i);
            // As far beyond as before this move; after a small one, or one backwards, what is known already will do.
            if (moved[size_t(i)] && s.later > 0) horizons_[size_t(i)] = f.stopTime + kBeyond / f.weight;
        }
        // A front may have run dry by its neighbours' late moves.
        std::vector<int> dry;
        for (int i : open)
            if (round > 0 && shifts[size_t(i)].missing > kClose * targets[size_t(i)] && !fronts_[size_t(i)]->exhausted)
                dry.push_back(i);
        if (!dry.empty()) restoreClaims();
        each(dry, [&](int i) {
            Front& f = *fronts_[size_t(i)];
            f.exhausted = f.frontSpeed() < kStuckShare * f.weight;
            f.rest();
        });
        open.clear();
        for (int i : all) {
            if (calls && !calls->mayAsk(i)) continue;  // its last shape stands
            const auto& around = elements_[size_t(i)].neighbours;
            if (moved[size_t(i)] || std::any_of(around.begin(), around.end(), [&](int k) { return moved[size_t(k)]; }))
                open.push_back(i);
        }
        catchUp(seenBy(open, builder));
    }
}

std::vector<int> Growth::seenBy(const std::vector<int>& elements, const RegionBuilder& builder) const {
    std::vector<std::vector<int>> rivals(elements.size());
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t k) { rivals[k] = builder.rivalsOf(elements[k]); });
    std::vector<char> isSeen(fronts_.size(), 0);
    for (size_t k = 0; k < elements.size(); ++k) {
        isSeen[size_t(elements[k])] = 1;
        for (int j : rivals[k]) isSeen[size_t(j)] = 1;
    }
    std::vector<int> seen;
    for (size_t i = 0; i < isSeen.size(); ++i)
        if (isSeen[i]) seen.push_back(int(i));
    return seen;
}

void Growth::leaveClaims() {
    tbb::parallel_for(size_t(0), fronts_.size(), [&](size_t i) {
        if (fronts_[i]) fronts_[i]->leaveClaims();
    });
    claims_.clear();
    hasClaims_ = false;
}

void Growth::restoreClaims() {
    if (hasClaims_) return;
    tbb::parallel_for(size_t(0), fronts_.size(), [&](size_t i) {
        if (fronts_[i]) fronts_[i]->returnToClaims();
    });
    hasClaims_ = true;
}

void Growth::catchUp(const std::vector<int>& elements) {
    const auto goesOn = [&](int i) { return fronts_[size_t(i)] && horizons_[size_t(i)] < kInfinity; };
    if (std::none_of(elements.begin(), elements.end(), goesOn)) return;
    restoreClaims();
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t k) {
        if (!goesOn(elements[k])) return;
        const size_t i = size_t(elements[k]);
        fronts_[i]->marchBeyond(horizons_[i], kLayersBeyond, stopTimes_);
        fronts_[i]->finish();
        fronts_[i]->rest();
        horizons_[i] = kInfinity;
    });
}

void Growth::catchUp() {
    std::vector<int> all(fronts_.size());
    std::iota(all.begin(), all.end(), 0);
    catchUp(all);
}

void Growth::lookBeyond() {
    catchUp();
    tbb::parallel_for(size_t(0), fronts_.size(), [&](size_t i) {
        if (!fronts_[i]) return;
        fronts_[i]->lookBeyond();
        fronts_[i]->rest();
    });
}

size_t Growth::grownVoxels() const {
    double sum = 0;
    for (const auto& f : fronts_)
        if (f) sum += f->grown;
    return size_t(sum);
}

}  // namespace pavel
