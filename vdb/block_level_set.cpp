#include "pavel/vdb/block_level_set.h"

#include <algorithm>
#include <numeric>

namespace pavel {
namespace {

PAVEL_WIDE int surfaceVoxels(const float* values) {
    int count = 0;
    for (int v = 0; v < 512; ++v) count += std::abs(values[v]) < 0.5f;
    return count;
}

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

InsideMeasure BlockLevelSet::measure() const {
    InsideMeasure m{double(filled_), filled_};
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
        m.add(measureBlock(halo));
    }
    return m;
}

double BlockLevelSet::settleVolume(double target, bool growing) {
    constexpr double kClose = 2e-5, kMost = 0.05;
    double volume = measure().volume, total = 0;
    for (int step = 0; step < 3 && std::abs(volume - target) > target * kClose; ++step) {
        if (volume < target && !growing) break;
        int area = 0;
        for (const float* values : values_) area += surfaceVoxels(values);
        double by = (volume - target) / std::max(area, 1);
        if (volume < target) by = std::max(by, -kMost - total);
        by = std::min(by, 0.5);
        total += by;
        for (float* values : values_) shiftBand(values, float(by), band_);
        volume = measure().volume;
    }
    return volume;
}

CompactLevelSet BlockLevelSet::compact() const {
    size_t active = 0;
    for (const BlockMask& mask : near_)
        for (const uint8_t row : mask) active += size_t(__builtin_popcount(row));
    CompactLevelSet out(band_, origins_.size(), active);
    std::vector<size_t> order(origins_.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return origins_[a] < origins_[b]; });
    for (const size_t b : order) out.add(origins_[b], nodeMask(near_[b]), values_[b]);
    return out;
}

}  // namespace pavel
