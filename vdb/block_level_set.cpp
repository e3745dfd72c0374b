#include "pavel/vdb/block_level_set.h"

#include <algorithm>
#include <cassert>

namespace pavel {
namespace {

/// Adds to a block's values within the band, and keeps them there.
PAVEL_WIDE void shiftBand(float* values, float by, float band) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float value = values[v], moved = value + by, above = moved > -band ? moved : -band,
                    kept = above < band ? above : band;
        values[v] = std::abs(value) < band ? kept : value;
    }
}

}  // namespace

BlockLevelSet::BlockLevelSet(const CompactLevelSet& at) : band_(at.background()), numbers_(at.numbers()) {
    storage_.emplace_back()->reserve(512 * at.size());
    for (int b = 0; b < int(at.size()); ++b) at.read(b, grow(at.origin(b), blockMask(at.active(b))));
    filled_ = 512 * numbers_.count(BlockNumbers::kInside);
}

/// A block more, where there is room without moving others.
float* BlockLevelSet::grow(const Coord& origin, const BlockMask& near) {
    constexpr size_t kMore = 16 * 512;
    if (storage_.empty() || storage_.back()->size() + 512 > storage_.back()->capacity())
        storage_.emplace_back()->reserve(kMore);
    std::vector<float>& store = *storage_.back();
    numbers_.set(origin, int(origins_.size()));
    store.resize(store.size() + 512);
    origins_.push_back(origin);
    near_.push_back(near);
    values_.push_back(store.data() + store.size() - 512);
    return values_.back();
}

float* BlockLevelSet::open(const Coord& origin) {
    if (float* known = values(origin)) return known;
    assert(numbers_.at(origin) == BlockNumbers::kInside);
    filled_ -= 512;
    float* made = grow(origin, {});
    std::fill(made, made + 512, -band_);
    return made;
}

void BlockLevelSet::clear(const Coord& origin) {
    if (numbers_.at(origin) == BlockNumbers::kInside) filled_ -= 512;
    numbers_.set(origin, BlockNumbers::kOutside);
}

void BlockLevelSet::tidy() {
    size_t kept = 0;
    for (size_t b = 0; b < origins_.size(); ++b) {
        if (numbers_.at(origins_[b]) != int(b)) continue;  // cleared
        const float* values = values_[b];
        const bool inside = values[0] < 0;
        const auto otherSide = [&](float v) { return (v < 0) != inside; };
        // What was erased deep inside is torn, not near.
        if (nearMask(values, band_, near_[kept]) || std::any_of(values, values + 512, otherSide)) {
            numbers_.set(origins_[b], int(kept));
            origins_[kept] = origins_[b], values_[kept] = values_[b];
            ++kept;
        } else if (inside) {
            fill(origins_[b]);
        } else {
            numbers_.set(origins_[b], BlockNumbers::kOutside);
        }
    }
    origins_.resize(kept), near_.resize(kept), values_.resize(kept);
}

void BlockLevelSet::Blocks::add(const Coord& origin, const float* of, const BlockMask& mask) {
    origins.push_back(origin);
    near.push_back(mask);
    values->insert(values->end(), of, of + 512);
}

void BlockLevelSet::add(Blocks&& blocks) {
    storage_.push_back(std::move(blocks.values));
    float* values = storage_.back()->data();
    for (size_t b = 0; b < blocks.origins.size(); ++b, values += 512) {
        numbers_.set(blocks.origins[b], int(origins_.size()));
        origins_.push_back(blocks.origins[b]);
        near_.push_back(blocks.near[b]);
        values_.push_back(values);
    }
}

void BlockLevelSet::fill(const Coord& origin) {
    numbers_.set(origin, BlockNumbers::kInside);
    filled_ += 512;
}

template <class F>
void BlockLevelSet::forEachHalo(F f) const {
    HaloBlock halo;
    for (size_t b = 0; b < origins_.size(); ++b) {
        const std::array<int, 6> beside = numbers_.beside(origins_[b]);
        fillHalo(
            values_[b],
            [&](int side) {
                const int n = beside[size_t(side)];
                return n >= 0 ? values_[size_t(n)] : nullptr;
            },
            [&](int side) { return beside[size_t(side)] == BlockNumbers::kInside ? -band_ : band_; }, halo);
        f(halo);
    }
}

InsideMeasure BlockLevelSet::measure() const {
    InsideMeasure m{double(filled_), filled_};
    forEachHalo([&](const HaloBlock& halo) { m.add(measureBlock(halo)); });
    return m;
}

double BlockLevelSet::settleVolume(double target, bool growing) {
    constexpr double kClose = 2e-5, kMostGrowth = 0.05, kMostAtOnce = 0.25, kProbe = 0.01;
    double volume = 0, grown = 0;
    for (int round = 0; round < 3; ++round) {
        SurfaceVoxels surface{float(kMostAtOnce)};
        surface.addInside(filled_);
        forEachHalo([&](const HaloBlock& halo) { surface.add(halo); });
        volume = surface.volume(0);
        const auto isClose = [&](double share) { return std::abs(volume - target) <= share * target; };
        if (isClose(kClose) || (volume < target && !growing)) break;
        const double most = std::min(kMostAtOnce, kMostGrowth - grown);
        double by = 0, slope = (surface.volume(kProbe) - volume) / kProbe;
        for (int step = 0; step < 4 && slope > 0 && !isClose(kClose / 4); ++step) {
            const double before = by, atBefore = volume;
            by = std::clamp(by + (target - volume) / slope, -kMostAtOnce, most);
            if (by == before) break;
            volume = surface.volume(by);
            slope = (volume - atBefore) / (by - before);
        }
        for (float* values : values_) shiftBand(values, -float(by), band_);
        grown += by;
        if (by > -kMostAtOnce) break;
    }
    return volume;
}

CompactLevelSet BlockLevelSet::compact() const {
    size_t active = 0;
    for (const BlockMask& mask : near_)
        for (const uint8_t row : mask) active += size_t(__builtin_popcount(row));
    CoordBBox box;
    for (const Coord& origin : origins_) box.expand(CoordBBox(origin, origin.offsetBy(7)));
    CompactLevelSet out(band_, box, origins_.size(), active);
    for (size_t b = 0; b < origins_.size(); ++b) out.add(origins_[b], nodeMask(near_[b]), values_[b]);
    if (filled_ > 0)
        forEachBlock(box, [&](const Coord& origin) {
            if (numbers_.at(origin) == BlockNumbers::kInside) out.fill(origin);
        });
    return out;
}

BlockMasks BlockLevelSet::inside() const {
    BlockMasks masks(numbers_, origins_.size());
    for (size_t b = 0; b < origins_.size(); ++b) masks.add(origins_[b], nodeMask(negativeMask(values_[b])));
    return masks;
}

}  // namespace pavel
