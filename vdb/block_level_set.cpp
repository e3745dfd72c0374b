#include "pavel/vdb/block_level_set.h"

#include <algorithm>
#include <cstring>

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
        int beside[6];
        for (int side = 0; side < 6; ++side) {
            Coord c = origins_[b];
            c[side / 2] += side % 2 ? 8 : -8;
            beside[side] = numbers_.at(c);
        }
        fillHalo(
            values_[b], [&](int side) { return beside[side] >= 0 ? at(beside[side]) : nullptr; },
            [&](int side) { return beside[side] == BlockNumbers::kInside ? -band_ : band_; }, halo);
        m.add(measureBlock(halo));
    }
    return m;
}

void BlockLevelSet::shift(float by) {
    for (float* values : values_) shiftBand(values, by, band_);
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
        shift(float(by));
        volume = measure().volume;
    }
    return volume;
}

CompactLevelSet BlockLevelSet::compact() const {
    size_t active = 0;
    for (const BlockMask& mask : near_)
        for (const uint8_t row : mask) active += size_t(__builtin_popcount(row));
    CompactLevelSet out(band_, origins_.size(), active);
    for (size_t b = 0; b < origins_.size(); ++b) {
        WorkLeaf::NodeMaskType near;
        for (openvdb::Index slab = 0; slab < 8; ++slab)
            std::memcpy(&near.getWord<uint64_t>(slab), &near_[b][slab * 8], 8);
        out.add(origins_[b], near, values_[b]);
    }
    return out;
}

}  // namespace pavel
