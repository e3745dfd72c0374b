#include "pavel/vdb/grow.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/vdb/measure.h"
#include "pavel/vdb/overlap.h"

namespace pavel {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Voxels that the fastest front covers in one round: how old another's claim may be before it is seen.
constexpr double kRoundVoxels = 1.5;
/// A front is stuck when its fastest point has fallen under this share of its largest speed (algorithm, section 3).
constexpr double kStuckShare = 0.01;

/// Stop times known to be too early and too late: Newton's steps are kept between them.
struct Bracket {
    double early = 0, late = kInfinity;
    void narrow(double time, bool tooEarly) {
        if (tooEarly)
            early = time;
        else
            late = time;
        if (early >= late) (tooEarly ? late : early) = tooEarly ? kInfinity : 0;  // neighbours have moved since
    }
    double within(double time) const {
        if (time > early && time < late) return time;
        return late < kInfinity ? 0.5 * (early + late) : std::max(time, early);
    }
};

}  // namespace

Growth::Growth(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
               const std::vector<Material>& materials)
    : elements_(elements),
      base_(base),
      claims_(elements, base),
      fronts_(elements.size()),
      fixedVolume_(elements.size(), 0),
      touched_(elements.size()),
      measuredBlocks_(elements.size(), 0) {
    double most = 0;
    for (const WorkElement& e : elements)
        if (e.bodyVoxels) most = std::max(most, e.lost() / e.placedVolume);
    for (size_t i = 0; i < elements.size(); ++i) {
        const WorkElement& e = elements[i];
        const double share = e.placedVolume > 0 ? e.lost() / e.placedVolume : 0;
        if (!e.bodyVoxels || share < 1e-5 || !e.contact || e.contact->empty()) continue;
        const Material& m = materials[size_t(e.kind)];
        fronts_[i] = std::make_unique<Front>(e, claims_, m.a, m.b, share / most);
    }
}

void Growth::march(const RunContext& context) {
    std::vector<Front*> active;
    for (const auto& f : fronts_)
        if (f) active.push_back(f.get());
    const size_t all = active.size();
    const auto each = [&](const std::vector<Front*>& fronts, const auto& f) {
        tbb::parallel_for(size_t(0), fronts.size(), [&](size_t i) { f(*fronts[i]); });
    };
    each(active, [](Front& f) { f.start(); });
    std::vector<float> stopTimes(elements_.size() + 1, std::numeric_limits<float>::infinity());
    std::vector<double> speeds(all), arrivals(all);
    double now = 0;
    while (!active.empty()) {
        context.progress("growth", 0.6 * (1 - double(active.size()) / double(all)));
        // Fronts that are stuck get more room; those that have none left end here.
        tbb::parallel_for(size_t(0), active.size(), [&](size_t i) {
            Front& f = *active[i];
            while (f.frontSpeed() < kStuckShare * f.weight && !f.exhausted) f.exhausted = !f.widen(now);
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
            const double window = kRoundVoxels / speed;
            now = std::max(now, first) + window;
            each(active, [&](Front& f) { f.march(now, stopTimes, true); });
            each(active, [](Front& f) { f.commit(); });
            each(active, [](Front& f) { f.settle(); });
            each(active, [](Front& f) {
                if (f.stopped) f.release();
            });
        }
        std::vector<Front*> ended, next;
        for (Front* f : active) {
            if (f->exhausted && !f->stopped) f->stopTime = float(now);
            if (f->stopped || f->exhausted) {
                stopTimes[size_t(f->element.id)] = f->stopTime;
                ended.push_back(f);
            } else {
                next.push_back(f);
            }
        }
        // Three voxels past its end each front still needs times on the far side of its contour.
        each(ended, [&](Front& f) { f.march(f.stopTime + 3 / f.weight, stopTimes, false); });
        active = std::move(next);
    }
    registerBlocks();
}

void Growth::registerBlocks() {
    here_.clear();
    for (size_t i = 0; i < fronts_.size(); ++i)
        if (fronts_[i])
            for (const GrowthBlock& b : fronts_[i]->blocks) here_[b.origin].push_back(int(i));
    tbb::parallel_for(size_t(0), fronts_.size(), [&](size_t i) {
        if (fronts_[i] && fronts_[i]->blocks.size() != measuredBlocks_[i]) measureFixedPart(int(i));
    });
}

/// Moves the surface seen by body voxels along with the front beside them, so that values on both sides of the surface
/// belong to one field.
void Growth::displaceBodies(int i) {
    Front& f = *fronts_[size_t(i)];
    for (GrowthBlock& block : f.blocks) {
        for (int v = 0; v < 512; ++v) {
            if (block.state[v] != kBody) continue;
            double shift = 0;
            int count = 0;
            for (int side = 0; side < 6; ++side) {
                int n;
                const GrowthBlock* other = Front::step(&block, v, side, n);
                if (!other || !f.hasTime(*other, n)) continue;
                shift += std::max(0.f, other->bodyAt(n) - f.displaced(*other, n));
                ++count;
            }
            block.time[v] = block.bodyAt(v) - (count ? float(shift / count) : 0);
        }
    }
}

float Growth::ownValue(int i, const GrowthBlock& block, int v) const {
    if (block.state[v] == kBody) return block.time[v];
    const Front& f = *fronts_[size_t(i)];
    const float body = std::max(0.f, block.bodyAt(v));
    // The grown surface is nowhere farther than the body's.
    return f.hasTime(block, v) ? std::min(body, f.displaced(block, v)) : body;
}

void Growth::fillRegion(int i, const GrowthBlock& block, float* values) const {
    const Front& own = *fronts_[size_t(i)];
    for (int v = 0; v < 512; ++v) values[v] = std::clamp(ownValue(i, block, v), -kBand, kBand);
    for (int j : claims_.index().meeting(CoordBBox(block.origin, block.origin.offsetBy(7)))) {
        if (j == i || (fronts_[size_t(j)] && fronts_[size_t(j)]->probe(block.origin))) continue;
        const WorkLeaf* leaf = elements_[size_t(j)].body->probeConstLeaf(block.origin);
        const float tile = leaf ? 0 : elements_[size_t(j)].body->getValue(block.origin);
        if (!leaf && tile > 0) continue;
        for (int v = 0; v < 512; ++v)
            values[v] = std::max(values[v], leaf ? -leaf->getValue(openvdb::Index(v)) : -tile);
    }
    const auto others = here_.find(block.origin);
    if (others != here_.end()) {
        for (int j : others->second) {
            if (j == i) continue;
            const Front& f = *fronts_[size_t(j)];
            const GrowthBlock& theirs = *f.probe(block.origin);
            for (int v = 0; v < 512; ++v) {
                if (values[v] > 2) continue;  // well outside whatever the others did
                const float psi = ownValue(j, theirs, v);
                float taken = -psi;
                if (f.hasTime(theirs, v)) {
                    if (block.state[v] == kBody) continue;
                    if (own.hasTime(block, v)) {
                        // zero set of T_i - T_j, as far as j really got; the gradients point against each other
                        const double slowness =
                            1 / std::max(own.scaleAt(block, v), 1e-6) + 1 / std::max(f.scaleAt(theirs, v), 1e-6);
                        taken = std::min(taken, float((double(block.time[v]) - double(theirs.time[v])) / slowness));
                    }
                }
                values[v] = std::max(values[v], std::clamp(taken, -kBand, kBand));
            }
        }
    }
    if (base_) {
        const auto* leaf = base_->probeConstLeaf(block.origin);
        const float tile = leaf ? 0 : base_->getValue(block.origin);
        if (leaf || tile < 0)
            for (int v = 0; v < 512; ++v)
                values[v] = std::max(values[v], leaf ? -leaf->getValue(openvdb::Index(v)) : kBand);
    }
}

WorkTree::Ptr Growth::region(int i) const {
    const WorkTree::Ptr tree = rawRegion(i);
    if (fronts_[size_t(i)]) dropIslands(*tree);
    return tree;
}

WorkTree::Ptr Growth::rawRegion(int i) const {
    auto tree = std::make_shared<WorkTree>(*elements_[size_t(i)].body);
    if (!fronts_[size_t(i)]) return tree;
    float values[512];
    for (const GrowthBlock& block : fronts_[size_t(i)]->blocks) {
        fillRegion(i, block, values);
        WorkLeaf* leaf = tree->touchLeaf(block.origin);
        for (openvdb::Index v = 0; v < 512; ++v) leaf->setValueOnly(v, values[v]);
    }
    return tree;
}

/// Leaves more than a block away from any growth keep their volume whatever the stop times are.
void Growth::measureFixedPart(int i) {
    std::vector<Coord>& touched = touched_[size_t(i)];
    touched.clear();
    measuredBlocks_[size_t(i)] = fronts_[size_t(i)]->blocks.size();
    for (const GrowthBlock& b : fronts_[size_t(i)]->blocks) {
        touched.push_back(b.origin);
        for (int side = 0; side < 6; ++side) {
            Coord c = b.origin;
            c[side / 2] += side % 2 ? 8 : -8;
            touched.push_back(c);
        }
    }
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    const WorkElement& e = elements_[size_t(i)];
    const WorkReader reader(*e.body);
    double moving = 0;
    for (const Coord& c : touched) {
        if (const WorkLeaf* leaf = e.body->probeConstLeaf(c))
            moving += leafVolume(reader, *leaf);
        else if (e.body->getValue(c) < 0)
            moving += 512;
    }
    fixedVolume_[size_t(i)] = e.bodyVolume - moving;
}

Growth::Evaluation Growth::evaluate(int i) const {
    const WorkTree::Ptr tree = rawRegion(i);
    const WorkReader reader(*tree);
    Evaluation result;
    result.volume = fixedVolume_[size_t(i)];
    for (const Coord& c : touched_[size_t(i)]) {
        if (const WorkLeaf* leaf = tree->probeConstLeaf(c))
            result.volume += leafVolume(reader, *leaf);
        else if (tree->getValue(c) < 0)
            result.volume += 512;
    }
    // dV/dT = integral of the speed over the free front
    const Front& f = *fronts_[size_t(i)];
    for (const GrowthBlock& block : f.blocks) {
        const WorkLeaf* leaf = tree->probeConstLeaf(block.origin);
        for (int v = 0; leaf && v < 512; ++v) {
            if (!f.hasTime(block, v)) continue;
            const float own = f.displaced(block, v);
            if (std::abs(own) >= 0.5f || leaf->getValue(openvdb::Index(v)) > own + 1e-4f) continue;
            result.slope += f.speedAt(block, v);
            result.area += 1;
        }
    }
    return result;
}

void Growth::solveStopTimes(const std::vector<double>& targets, const RunContext& context) {
    // Jacobi rounds with Newton steps: elements depend on each other only where one stopped before the other came.
    constexpr int kRounds = 3, kMostRounds = 14;
    constexpr double kClose = 1e-4;
    const size_t n = fronts_.size();
    struct Search {
        Bracket bracket;
        double missing = 0, step = 0, reach = 0;
        float bestTime = 0;
        double bestFault = kInfinity;
    };
    std::vector<Search> searches(n);
    std::vector<float> stopTimes(n + 1, std::numeric_limits<float>::infinity());
    std::vector<int> open;
    for (size_t i = 0; i < n; ++i) {
        if (!fronts_[i]) continue;
        open.push_back(int(i));
        stopTimes[i + 1] = fronts_[i]->stopTime;
    }
    const auto each = [](const std::vector<int>& list, const auto& f) {
        tbb::parallel_for(size_t(0), list.size(), [&](size_t k) { f(list[k]); });
    };
    const auto setStop = [&](int i, float time) { fronts_[size_t(i)]->stopTime = stopTimes[size_t(i) + 1] = time; };
    const auto isClose = [&](int i) { return std::abs(searches[size_t(i)].missing) <= kClose * targets[size_t(i)]; };
    each(open, [&](int i) { displaceBodies(i); });
    const std::vector<int> all = open;
    for (int round = 0; round < kMostRounds && !open.empty(); ++round) {
        context.progress("growth", 0.6 + 0.3 * std::min(1.0, double(round) / kRounds));
        each(open, [&](int i) {
            const Front& f = *fronts_[size_t(i)];
            Search& s = searches[size_t(i)];
            const Evaluation e = evaluate(i);
            s.missing = targets[size_t(i)] - e.volume;
            // Too little can be named in the report, too much would be invented.
            const double fault = s.missing > 0 ? s.missing : -1000 * s.missing;
            if (fault < s.bestFault) s.bestFault = fault, s.bestTime = f.stopTime;
            s.bracket.narrow(f.stopTime, s.missing > 0);
            s.reach = e.slope > 0 ? e.area / e.slope : 1 / f.weight;  // time in which the contour moves by a voxel
            s.step =
                std::clamp(e.slope > 0 ? s.missing / e.slope : std::copysign(s.reach, s.missing), -s.reach, s.reach);
            if (f.exhausted && s.missing > 0) s.step = 0;
        });
        std::vector<int> next;
        std::vector<char> moved(n, 0), goesOn(n, 0);
        for (int i : open) {
            const Search& s = searches[size_t(i)];
            if (round >= kRounds && (isClose(i) || s.step == 0)) continue;
            const double before = fronts_[size_t(i)]->stopTime, after = s.bracket.within(before + s.step);
            setStop(i, float(after));
            next.push_back(i);
            goesOn[size_t(i)] = 1;
            moved[size_t(i)] = std::abs(after - before) > 0.02 * s.reach;
        }
        // Who had settled beside one that still moves is looked at again.
        for (int i : all) {
            const auto& around = elements_[size_t(i)].neighbours;
            if (goesOn[size_t(i)] ||
                std::none_of(around.begin(), around.end(), [&](int k) { return moved[size_t(k)]; }))
                continue;
            searches[size_t(i)].bracket = {};
            searches[size_t(i)].bestFault = kInfinity;
            next.push_back(i);
        }
        std::sort(next.begin(), next.end());
        // Times must be known for three voxels past the stop; a front that has run dry gets a wider b.
        each(next, [&](int i) {
            Front& f = *fronts_[size_t(i)];
            const Search& s = searches[size_t(i)];
            const bool dry = s.missing > 0 && f.frontSpeed() < kStuckShare * f.weight;
            if (round >= kRounds && round % 2 == 0 && dry) f.widen(f.stopTime);
            f.march(f.stopTime + 3 * s.reach, stopTimes, false);
        });
        registerBlocks();
        each(next, [&](int i) { displaceBodies(i); });
        open = std::move(next);
    }
    // Those that did not settle keep the best that was seen; the report says what is missing.
    for (int i : open) setStop(i, searches[size_t(i)].bestTime);
    each(open, [&](int i) { displaceBodies(i); });
}

size_t Growth::grownVoxels() const {
    double sum = 0;
    for (const auto& f : fronts_)
        if (f) sum += f->grown;
    return size_t(sum);
}

}  // namespace pavel
