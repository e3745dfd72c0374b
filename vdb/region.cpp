#include "pavel/vdb/region.h"

#include <algorithm>

namespace pavel {

Region::Region(const CoordBBox& box) : lower_(leafOrigin(box.min())) {
    const Coord hi = leafOrigin(box.max());
    for (int k = 0; k < 3; ++k) count_[k] = box.empty() ? 0 : (hi[k] - lower_[k]) / 8 + 1;
    cells_.assign(size_t(count_[0]) * size_t(count_[1]) * size_t(count_[2]), kOutside);
}

int Region::cell(const Coord& origin) const {
    int c[3];
    for (int k = 0; k < 3; ++k) {
        c[k] = (origin[k] - lower_[k]) >> 3;
        if (c[k] < 0 || c[k] >= count_[k]) return -1;
    }
    return (c[0] * count_[1] + c[1]) * count_[2] + c[2];
}

int Region::at(const Coord& origin) const {
    const int c = cell(origin);
    return c < 0 ? kOutside : cells_[size_t(c)];
}

int Region::add(const Coord& origin, const float* own, const float* clip, const float* slope) {
    const int number = int(origins_.size());
    cells_[size_t(cell(origin))] = number;
    origins_.push_back(origin);
    own_.insert(own_.end(), own, own + 512);
    clip_.insert(clip_.end(), clip, clip + 512);
    slope_.insert(slope_.end(), slope, slope + 512);
    return number;
}

void Region::reserve(size_t blocks) {
    origins_.reserve(blocks);
    for (auto* field : {&own_, &clip_, &slope_}) field->reserve(blocks * 512);
}

void Region::fill(const Coord& origin) {
    cells_[size_t(cell(origin))] = kInside;
    filled_ += 512;
}

void Region::values(int block, double later, float* out) const {
    const float *own = &own_[size_t(block) * 512], *clip = &clip_[size_t(block) * 512],
                *slope = &slope_[size_t(block) * 512], t = float(later);
    for (int v = 0; v < 512; ++v) {
        const float o = own[v] - t * slope[v];
        out[v] = o > clip[v] ? o : clip[v];
    }
}

InsideMeasure Region::measure(double later) const {
    std::vector<float> all(size() * 512);
    for (size_t b = 0; b < size(); ++b) values(int(b), later, &all[b * 512]);
    InsideMeasure m;
    HaloBlock halo;
    for (size_t b = 0; b < size(); ++b) {
        int neighbours[6];
        for (int side = 0; side < 6; ++side) {
            Coord c = origins_[b];
            c[side / 2] += side % 2 ? 8 : -8;
            neighbours[side] = at(c);
        }
        fillHalo(
            &all[b * 512],
            [&](int side) { return neighbours[side] >= 0 ? &all[size_t(neighbours[side]) * 512] : nullptr; },
            [&](int side) { return neighbours[side] == kInside ? -kBand : kBand; }, halo);
        m.add(measureBlock(halo));
    }
    m.volume += double(filled_);
    m.voxels += filled_;
    return m;
}

void Region::advance(double later) {
    const float t = float(later);
    for (size_t i = 0; i < own_.size(); ++i) own_[i] -= t * slope_[i];
}

void Region::frontArea(double& voxels, double& slopes) const {
    voxels = slopes = 0;
    for (size_t i = 0; i < own_.size(); ++i) {
        if (!(slope_[i] > 0) || std::abs(own_[i]) >= 0.5f || clip_[i] > own_[i]) continue;
        voxels += 1;
        slopes += slope_[i];
    }
}

void Region::dropStrays() {
    std::vector<MaskedBlock> blocks;
    BlockMask full;
    full.fill(0xff);
    float value[512];
    for (size_t c = 0; c < cells_.size(); ++c) {
        if (cells_[c] == kOutside) continue;
        const int z = int(c) % count_[2], y = int(c) / count_[2] % count_[1], x = int(c) / (count_[2] * count_[1]);
        const Coord origin = lower_.offsetBy(8 * x, 8 * y, 8 * z);
        if (cells_[c] == kInside) {
            blocks.push_back({origin, full});
        } else {
            values(cells_[c], 0, value);
            blocks.push_back({origin, negativeMask(value)});
        }
    }
    for (const MaskedBlock& m : straysOf(blocks)) {
        const int b = at(m.origin);
        if (b == kInside) {  // a filled block that nothing touches
            cells_[size_t(cell(m.origin))] = kOutside;
            filled_ -= 512;
            continue;
        }
        for (int v = 0; v < 512; ++v) {
            if (!testMask(m.mask, v)) continue;
            const size_t i = size_t(b) * 512 + size_t(v);
            own_[i] = std::max(0.5f, std::abs(std::max(own_[i], clip_[i])));
            slope_[i] = 0;
        }
    }
}

}  // namespace pavel
