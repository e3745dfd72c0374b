#include "pavel/vdb/region.h"

#include <algorithm>

namespace pavel {
namespace {

/// Of a block: the free front, and what is inside.
PAVEL_WIDE void survey(const float* own, const float* clip, const float* slope, Region::FrontArea& front,
                       BlockMask& inside) {
    constexpr int kLanes = 16;
    // One condition at a time, and sums apart: the compiler would not vectorise them together.
    float atFront[512];
    int count = 0, moving = 0;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float moves = slope[v] > 0 ? slope[v] : 0, near = std::abs(own[v]) < 0.5f ? moves : 0,
                    free = clip[v] <= own[v] ? near : 0;
        atFront[v] = free;
        count += int(free > 0);
        moving += int(moves > 0);
    }
    float sum[kLanes] = {};
    for (int v = 0; v < 512; v += kLanes) {
        PAVEL_ROLLED
        for (int k = 0; k < kLanes; ++k) sum[k] += atFront[v + k];
    }
    front = {double(count), 0, moving > 0};
    for (const float s : sum) front.slopes += double(s);
    for (size_t row = 0; row < 64; ++row) {
        unsigned bits = 0;
        PAVEL_ROLLED
        for (size_t z = 0; z < 8; ++z) bits |= unsigned((own[8 * row + z] < 0) & (clip[8 * row + z] < 0)) << z;
        inside[row] = uint8_t(bits);
    }
}

/// Values of a front that stops later.
PAVEL_WIDE void laterValues(const float* own, const float* clip, const float* slope, float later, float* out) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float o = own[v] - later * slope[v];
        out[v] = o > clip[v] ? o : clip[v];
    }
}

PAVEL_WIDE void advanced(float later, const float* slope, float* own) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) own[v] -= later * slope[v];
}

}  // namespace

int Region::add(const Coord& origin, const float* own, const float* clip, const float* slope) {
    const int number = int(origins_.size());
    clear(origin);
    numbers_.set(origin, number);
    origins_.push_back(origin);
    own_->insert(own_->end(), own, own + 512);
    clip_->insert(clip_->end(), clip, clip + 512);
    slope_->insert(slope_->end(), slope, slope + 512);
    survey(own, clip, slope, front_.emplace_back(), inside_.emplace_back());
    return number;
}

void Region::reserve(size_t blocks) {
    origins_.reserve(blocks), front_.reserve(blocks), inside_.reserve(blocks);
    for (auto* field : {&own_, &clip_, &slope_}) (*field)->reserve(blocks * 512);
}

void Region::fill(const Coord& origin) {
    clear(origin);
    numbers_.set(origin, kInside);
    filled_ += 512;
}

void Region::clear(const Coord& origin) {
    if (at(origin) != kInside) return;
    numbers_.set(origin, kOutside);
    filled_ -= 512;
}

void Region::values(int block, double later, float* out) const {
    const size_t at = size_t(block) * 512;
    laterValues(&(*own_)[at], &(*clip_)[at], &(*slope_)[at], float(later), out);
}

Outline::Outline(const Region& region, double later, int factor)
    : numbers_(region.numbers()),
      perBlock_(size_t(factor) * size_t(factor) * size_t(factor)),
      sides_(region.size() * perBlock_) {
    // Coarse voxels: what a fine block knows of the surface beyond it is asked for there, and details that the coarse
    // grid does not show move it.
    const float near = std::max(0.7f, Region::kNear / float(factor));
    constexpr int kSide = 9;  // a block and the first layer of the next ones
    std::vector<float> values(region.size() * 512);
    for (size_t b = 0; b < region.size(); ++b) region.values(int(b), later, &values[b * 512]);
    float around[kSide * kSide * kSide];
    uint8_t* side = sides_.data();
    for (size_t b = 0; b < region.size(); ++b) {
        const Coord& origin = region.origin(int(b));
        int beside[27];
        for (int part = 0; part < 27; ++part)
            beside[part] = region.at(origin.offsetBy(part / 9 * 8 - 8, part / 3 % 3 * 8 - 8, part % 3 * 8 - 8));
        forEachRowAround<0, 1, kSide>([&](int part, int row, int at, auto n) {
            const int from = beside[part];
            if (from >= 0)
                std::copy_n(&values[size_t(from) * 512 + size_t(row)], int(n), around + at);
            else
                std::fill_n(around + at, int(n), from == Region::kInside ? -kBand : kBand);
        });
        // Coarse voxels at or before a fine block's first, and beyond its last.
        const auto first = [&](int k) { return 8 * k / factor; };
        const auto last = [&](int k) { return (8 * k + 7) / factor + 1; };
        for (int x = 0; x < factor; ++x)
            for (int y = 0; y < factor; ++y)
                for (int z = 0; z < factor; ++z, ++side) {
                    float least = kBand, most = -kBand;
                    for (int u = first(x); u <= last(x); ++u)
                        for (int v = first(y); v <= last(y); ++v)
                            for (int w = first(z); w <= last(z); ++w) {
                                const float value = around[(u * kSide + v) * kSide + w];
                                least = value < least ? value : least;
                                most = value > most ? value : most;
                            }
                    *side = least >= near ? kOut : most <= -near ? kIn : kSurface;
                }
    }
}

size_t Outline::surfaceBlocks() const {
    return size_t(std::count(sides_.begin(), sides_.end(), uint8_t(kSurface)));
}

RegionMeasure::RegionMeasure(const Region& region) : region_(region) {
    values_->resize(region.size() * 512);
    std::vector<char> changes(region.size(), 0);
    for (int b = 0; b < int(region.size()); ++b) {
        region.values(b, 0, &(*values_)[size_t(b) * 512]);
        const Region::FrontArea& front = region.front(b);
        if (!front.moves) continue;
        moving_.push_back(b);
        frontVoxels_ += front.voxels, frontSlopes_ += front.slopes;
        changes[size_t(b)] = 1;
        for (int n : region.beside(b))
            if (n >= 0) changes[size_t(n)] = 1;
    }
    for (int b = 0; b < int(region.size()); ++b) {
        if (changes[size_t(b)])
            beside_.push_back(b);
        else
            rest_.add(measure(b));
    }
    rest_.add({double(region.filledVoxels()), region.filledVoxels()});
}

InsideMeasure RegionMeasure::measure(int block) const {
    const std::array<int, 6> beside = region_.beside(block);
    HaloBlock halo;
    fillHalo(
        &(*values_)[size_t(block) * 512],
        [&](int side) {
            const int n = beside[size_t(side)];
            return n >= 0 ? &(*values_)[size_t(n) * 512] : nullptr;
        },
        [&](int side) { return beside[size_t(side)] == Region::kInside ? -kBand : kBand; }, halo);
    return measureBlock(halo);
}

InsideMeasure RegionMeasure::operator()(double later) {
    if (later != later_)
        for (int b : moving_) region_.values(b, later, &(*values_)[size_t(b) * 512]);
    later_ = later;
    InsideMeasure m = rest_;
    for (int b : beside_) m.add(measure(b));
    return m;
}

void Region::advance(double later) {
    for (size_t i = 0; i < own_->size(); i += 512) advanced(float(later), &(*slope_)[i], &(*own_)[i]);
}

void Region::dropStrays() {
    std::vector<MaskedBlock> blocks;
    BlockMask full;
    full.fill(0xff);
    forEachBlock(CoordBBox(numbers_.lower(), numbers_.upper()), [&](const Coord& origin) {
        const int b = at(origin);
        if (b != kOutside) blocks.push_back({origin, b == kInside ? full : inside_[size_t(b)]});
    });
    for (const MaskedBlock& m : straysOf(blocks)) {
        const int b = at(m.origin);
        if (b == kInside) {  // a filled block that nothing touches
            clear(m.origin);
            continue;
        }
        for (int v = 0; v < 512; ++v) {
            if (!testMask(m.mask, v)) continue;
            const size_t i = size_t(b) * 512 + size_t(v);
            float& own = (*own_)[i];
            own = std::max(0.5f, std::abs(std::max(own, (*clip_)[i])));
            (*slope_)[i] = 0;
        }
        survey(own(b), clip(b), &(*slope_)[size_t(b) * 512], front_[size_t(b)], inside_[size_t(b)]);
    }
}

}  // namespace pavel
