#include "pavel/vdb/region_builder.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "pavel/vdb/bisector.h"

namespace pavel {
namespace {

std::vector<CoordBBox> reaches(const std::vector<WorkElement>& elements,
                               const std::vector<std::unique_ptr<Front>>& fronts, int factor) {
    std::vector<CoordBBox> boxes;
    for (size_t i = 0; i < elements.size(); ++i) boxes.push_back(reachOf(elements[i], fronts[i].get(), factor));
    return boxes;
}

/// Blocks of the fronts' grid in which an element is or may have grown, sorted.
std::vector<Coord> blocksOf(const WorkElement& e, const Front* front) {
    std::vector<Coord> blocks;
    if (!e.box.empty())
        forEachBlock(e.box, [&](const Coord& origin) {
            if (e.placed.at(origin) != CompactLevelSet::kOutside) blocks.push_back(origin);
        });
    if (front)
        for (const GrowthBlock& b : front->blocks) blocks.push_back(b.origin);
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    return blocks;
}

bool haveCommon(const std::vector<Coord>& a, const std::vector<Coord>& b) {
    for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
        if (*i == *j) return true;
        *i < *j ? ++i : ++j;
    }
    return false;
}

const std::array<float, 512> kNowhere{};

/// What an element holds by itself, and how fast its front is there. False where nothing is near.
PAVEL_WIDE bool ownValues(const OwnField& a, float* own, float* slope) {
    int near = 0;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float phi = a.phi[v], way = a.way[v], scale = a.scale[v];
        const bool front = (scale > 0) & (way <= phi);
        const float value = front ? way : phi, least = value > -kBand ? value : -kBand;
        slope[v] = front ? scale : 0;
        own[v] = least < kBand ? least : kBand;
        near += int(value < Region::kNear);
    }
    return near > 0;
}

/// The least and the most of max(own, clip), clip kept in the band.
PAVEL_WIDE std::pair<float, float> clipped(const float* own, float* clip) {
    float values[512];
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float above = clip[v] > -kBand ? clip[v] : -kBand, kept = above < kBand ? above : kBand;
        values[v] = own[v] > kept ? own[v] : kept;
        clip[v] = kept;
    }
    constexpr int kLanes = 16;
    float least[kLanes], most[kLanes];
    std::fill(least, least + kLanes, kBand);
    std::fill(most, most + kLanes, -kBand);
    for (int v = 0; v < 512; v += kLanes) {
        PAVEL_ROLLED
        for (int k = 0; k < kLanes; ++k) {
            const float value = values[v + k];
            least[k] = value < least[k] ? value : least[k];
            most[k] = value > most[k] ? value : most[k];
        }
    }
    return {*std::min_element(least, least + kLanes), *std::max_element(most, most + kLanes)};
}

/// What another holds. `bisector`: where both were placed.
PAVEL_WIDE void takenBy(const OwnField& a, const OwnField& b, const float* bisector, bool byDepth, float later,
                        float* taken) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float phiA = a.phi[v], phiB = b.phi[v], wayA = a.way[v], wayB = b.way[v], scaleA = a.scale[v],
                    scaleB = b.scale[v], side = bisector[v];
        const bool inA = phiA < 0, inBoth = inA & (phiB < 0);
        const float placed = -phiB < side ? -phiB : side;
        const float sum = scaleA + scaleB, product = scaleA * scaleB;
        const float earlier = (wayA * scaleB - wayB * scaleA + later * product) / (sum > 0 ? sum : 1);
        const float ahead = -(phiB < wayB ? phiB : wayB), sooner = ahead < earlier ? ahead : earlier;
        // Near the rims interpolated times are rough: no front may take what only the other was placed on.
        const float least = inA       ? -1e9f
                            : byDepth ? side
                                      : phiA,
                    most = inA ? (byDepth ? side : -phiB) : 1e9f, lower = phiB < 0 ? least : -1e9f,
                    came = inA ? earlier : sooner, above = came > lower ? came : lower,
                    raced = above < most ? above : most, alone = inA ? -kBand : ahead;
        const float front = scaleA > 0 ? raced : alone, outside = scaleB > 0 ? front : -phiB;
        taken[v] = inBoth ? placed : outside;
    }
}

PAVEL_WIDE void keepLarger(const float* values, float* kept) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) kept[v] = values[v] > kept[v] ? values[v] : kept[v];
}

}  // namespace

RegionBuilder::RegionBuilder(const std::vector<WorkElement>& elements, const openvdb::FloatTree* base,
                             const std::vector<std::unique_ptr<Front>>& fronts, int factor, const FineShapes* fine)
    : elements_(elements),
      base_(base),
      fronts_(fronts),
      factor_(factor),
      fine_(fine),
      reach_(reaches(elements, fronts, factor)),
      index_(reach_),
      blocks_(elements.size()) {
    tbb::parallel_for(size_t(0), elements.size(),
                      [&](size_t i) { blocks_[i] = blocksOf(elements[i], fronts[i].get()); });
}

std::vector<int> RegionBuilder::rivalsOf(int i) const {
    std::vector<int> rivals = index_.meeting(reach_[size_t(i)]);
    const auto isApart = [&](int j) { return j == i || !haveCommon(blocks_[size_t(i)], blocks_[size_t(j)]); };
    rivals.erase(std::remove_if(rivals.begin(), rivals.end(), isApart), rivals.end());
    return rivals;
}

bool RegionBuilder::load(int i, const Coord& origin, OwnField& field) const {
    field.scale = kNowhere.data();
    if (fine_) {
        const FineBlock& block = fine_->shape(i).at(origin);
        field.phi = field.way = block.phi;
        if (block.grown) field.way = block.grown->way, field.scale = block.grown->scale;
        return &block != &FineShape::nothing();
    }
    const CompactLevelSet& placed = elements_[size_t(i)].placed;
    const int known = placed.at(origin);
    if (known >= 0) placed.read(known, field.placed);
    field.phi = field.way = known >= 0 ? field.placed : uniformValues(known == CompactLevelSet::kInside);
    if (const Front* front = fronts_[size_t(i)].get()) {
        if (const GrowthBlock* block = front->probe(origin)) {
            GrownBlock& made = field.made;
            std::copy(field.phi, field.phi + 512, made.way);
            std::fill(made.scale, made.scale + 512, 0.f);
            Front::CellField read;
            GrowthCell spread;
            for (int number = 0; number < 8; ++number) {
                const GrowthCell* cell = front->look(*block, number, spread);
                if (!cell) continue;
                front->read(*cell, number, field.phi, read);
                const float* times = cell->time;
                for (int k = 0; k < GrowthCell::kCount; k += 4) {
                    const int row = GrowthBlock::voxelOf(number, k);
                    for (int z = 0; z < 4; ++z) {
                        made.scale[row + z] = times[k + z] < GrowthBlock::kNever ? read.scale[k + z] : 0;
                        made.way[row + z] = read.way[k + z];
                    }
                }
            }
            field.way = made.way;
            field.scale = made.scale;
            return true;
        }
    }
    return known != CompactLevelSet::kOutside;
}

void RegionBuilder::clipBy(int i, int j, const Coord& origin, const OwnField& a, float* clip) const {
    OwnField b;
    if (!load(j, origin, b)) return;
    const Bisector g(elements_[size_t(i)], elements_[size_t(j)]);
    const float stopA = fronts_[size_t(i)] ? fronts_[size_t(i)]->stopTime : 0,
                stopB = fronts_[size_t(j)] ? fronts_[size_t(j)]->stopTime : 0;
    float bisector[512], taken[512];
    g.over(origin, factor_, a.phi, b.phi, bisector);
    takenBy(a, b, bisector, g.byDepth(), stopA - stopB, taken);
    keepLarger(taken, clip);
}

bool RegionBuilder::evaluate(int i, const std::vector<int>& rivals, const Coord& origin, float* own, float* clip,
                             float* slope) const {
    OwnField a;
    if (!load(i, origin, a)) return false;
    if (!ownValues(a, own, slope)) return false;
    const auto* leaf = base_ ? base_->probeConstLeaf(origin) : nullptr;
    if (leaf)
        std::transform(leaf->buffer().data(), leaf->buffer().data() + 512, clip, [](float v) { return -v; });
    else
        std::fill(clip, clip + 512, base_ ? -base_->getValue(origin) : -kBand);
    for (int j : rivals) clipBy(i, j, origin, a, clip);
    return true;
}

std::vector<int> RegionBuilder::meeting(const std::vector<int>& rivals, const Coord& coarseBlock) const {
    std::vector<int> here;
    for (int j : rivals)
        if (std::binary_search(blocks_[size_t(j)].begin(), blocks_[size_t(j)].end(), coarseBlock)) here.push_back(j);
    return here;
}

void RegionBuilder::addBlock(int i, const std::vector<int>& rivals, const Coord& origin, Region& region) const {
    float own[512], clip[512], slope[512];
    if (!evaluate(i, rivals, origin, own, clip, slope)) return region.clear(origin);
    const auto [least, most] = clipped(own, clip);
    if (least >= Region::kNear)
        region.clear(origin);
    else if (most <= -Region::kNear)
        region.fill(origin);
    else
        region.add(origin, own, clip, slope);
}

Region RegionBuilder::build(int i) const {
    Region region(reach_[size_t(i)]);
    const BlockMasks& body = elements_[size_t(i)].body;
    const Front* front = fronts_[size_t(i)].get();
    const std::vector<int> rivals = rivalsOf(i);
    forEachBlock(reach_[size_t(i)], [&](const Coord& origin) {
        const int own = body.at(origin);
        if (own >= 0 || (front && front->probe(origin)))
            addBlock(i, meeting(rivals, origin), origin, region);
        else if (own == BlockNumbers::kInside)
            region.fill(origin);
    });
    region.dropStrays();
    return region;
}

Region RegionBuilder::refine(int i, const Outline& coarse) const {
    Region region(reach_[size_t(i)]);
    region.reserve(coarse.surfaceBlocks());
    const std::vector<int> rivals = rivalsOf(i);
    const BlockNumbers& numbers = coarse.numbers();
    forEachBlock(CoordBBox(numbers.lower(), numbers.upper()), [&](const Coord& leaf) {
        const int b = numbers.at(leaf);
        if (b == Region::kOutside) return;
        const uint8_t* side = b >= 0 ? coarse.sides(b) : nullptr;
        const std::vector<int> here = meeting(rivals, leaf);
        for (int x = 0; x < factor_; ++x)
            for (int y = 0; y < factor_; ++y)
                for (int z = 0; z < factor_; ++z) {
                    const Coord origin(leaf[0] * factor_ + 8 * x, leaf[1] * factor_ + 8 * y, leaf[2] * factor_ + 8 * z);
                    const uint8_t lies = side ? *side++ : uint8_t(Outline::kIn);
                    if (lies == Outline::kIn)
                        region.fill(origin);
                    else if (lies == Outline::kSurface)
                        addBlock(i, here, origin, region);
                }
    });
    followSurface(i, rivals, region);
    region.dropStrays();
    return region;
}

/// Adds the blocks that the surface goes on into, or comes near to, though the outline does not show them.
void RegionBuilder::followSurface(int i, const std::vector<int>& rivals, Region& region) const {
    constexpr int kStep[3] = {64, 8, 1};
    float values[512];
    for (int b = 0; b < int(region.size()); ++b) {
        const std::array<int, 6> beside = region.beside(b);
        if (std::all_of(beside.begin(), beside.end(), [](int n) { return n >= 0; })) continue;
        region.values(b, 0, values);
        for (int side = 0; side < 6; ++side) {
            if (beside[size_t(side)] >= 0) continue;
            const bool inside = beside[size_t(side)] == Region::kInside;
            const int axis = side / 2, u = kStep[axis == 0 ? 1 : 0], w = kStep[axis == 2 ? 1 : 2];
            const float* face = values + (side % 2 ? 7 * kStep[axis] : 0);
            bool goesOn = false;
            for (int j = 0; j < 8; ++j)
                for (int k = 0; k < 8; ++k) goesOn |= inside ? face[j * u + k * w] > -1 : face[j * u + k * w] < 1;
            Coord next = region.origin(b);
            next[axis] += side % 2 ? 8 : -8;
            if (!goesOn || !region.numbers().holds(next)) continue;
            Coord coarse;
            for (int k = 0; k < 3; ++k) coarse[k] = floorDivide(next[k], 8 * factor_) * 8;
            addBlock(i, meeting(rivals, coarse), next, region);
        }
    }
}

}  // namespace pavel
