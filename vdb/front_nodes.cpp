#include "pavel/vdb/front_nodes.h"

#include <algorithm>
#include <cstring>

namespace pavel {
namespace {

constexpr uint8_t kTimed = FrontNodes::kTimed, kNearRim = FrontNodes::kNearRim;

constexpr float kFar = 3;  ///< coarse voxels: what comes later than that would only make an interpolation swing

/// What a front holds in a cell, in the cell's order; as FrontBlock's.
struct CellNodes {
    float way[GrowthCell::kCount], scale[GrowthCell::kCount], speed[GrowthCell::kCount];
    uint8_t flags[GrowthCell::kCount];
};

/// False where no voxel is timed.
PAVEL_WIDE bool layOut(const GrowthCell& cell, const Front::CellField& read, CellNodes& out) {
    int count = 0;
    for (int i = 0; i < GrowthCell::kCount; ++i) {
        const bool timed = cell.time[i] < GrowthBlock::kNever;
        const float contact = cell.state[i] == kInner ? -1 : cell.contact[i], ahead = std::min(kFar, read.way[i]),
                    known = contact >= 0 ? read.scale[i] : -1;
        out.way[i] = timed ? ahead : read.phi[i];
        out.scale[i] = timed ? read.scale[i] : 0;
        out.speed[i] = timed ? -1 : known;
        const int atRim = contact < 3 ? kNearRim : 0, nearRim = contact >= 0 ? atRim : 0;
        out.flags[i] = uint8_t((timed ? kTimed : 0) | nearRim);
        count += int(timed);
    }
    return count > 0;
}

/// What a front holds in one of its blocks.
struct FrontBlock {
    float phi[512], way[512], scale[512];
    float speed[512];    ///< -1 where it is not known
    uint8_t flags[512];  ///< kTimed, kNearRim
    bool anyTimed = false;

    FrontBlock(const Front& front, const GrowthBlock& block) {
        block.placed->read(block.placedBlock, phi);
        std::copy(phi, phi + 512, way);
        std::fill(scale, scale + 512, 0.f);
        std::fill(speed, speed + 512, -1.f);
        std::fill(flags, flags + 512, uint8_t(0));
        Front::CellField read;
        CellNodes nodes;
        GrowthCell spread;
        for (int c = 0; c < 8; ++c) {
            const GrowthCell* cell = front.look(block, c, spread);
            if (!cell) continue;
            front.read(*cell, c, phi, read);
            anyTimed |= layOut(*cell, read, nodes);
            for (int i = 0; i < GrowthCell::kCount; i += 4) {
                const int v = GrowthBlock::voxelOf(c, i);
                std::copy_n(nodes.way + i, 4, way + v), std::copy_n(nodes.scale + i, 4, scale + v);
                std::copy_n(nodes.speed + i, 4, speed + v), std::copy_n(nodes.flags + i, 4, flags + v);
            }
        }
    }
};

uint8_t survey(const float* way, const uint8_t* flags, float& least);

/// A front's own nodes in and around one of its blocks: as FrontNodes, and two layers more on each side, so that the
/// times that go on beyond the front are known wherever the interpolation asks.
class Nodes {
  public:
    static constexpr int kBefore = 3, kSide = 15, kRow = 16, kSlab = kSide * kRow, kCount = kSide * kSlab;

    /// @param blocks of the front, by number; null where it touched nothing
    /// @param placed the placed shape
    /// False where it comes nowhere near.
    bool load(const Front& front, const std::vector<const FrontBlock*>& blocks, const CompactReader& placed,
              const Coord& block) {
        struct Source {
            const FrontBlock* front = nullptr;  // or else
            const float* phi = nullptr;         // or else
            float tile = 0;
        } sources[27];
        bool anyTimed = false;
        for (int part = 0; part < 27; ++part) {
            const Coord at = block.offsetBy(part / 9 * 8 - 8, part / 3 % 3 * 8 - 8, part % 3 * 8 - 8);
            const GrowthBlock* grown = front.probe(at);
            if (grown && blocks[size_t(grown->number)]) {
                sources[part].front = blocks[size_t(grown->number)];
                anyTimed |= sources[part].front->anyTimed;
            } else if (const float* phi = placed.probe(at)) {
                sources[part].phi = phi;
            } else {
                sources[part].tile = placed.getValue(at);
            }
        }
        if (!anyTimed) return false;
        forEachRowAround<kBefore, kSide - 8 - kBefore, kRow>([&](int part, int row, int at, auto n) {
            const auto& [grown, phi, tile] = sources[part];
            const auto copy = [&](const auto* from, auto* to) {
                std::memcpy(to + at, from + row, decltype(n)::value * sizeof *to);
            };
            const auto fill = [&](auto* to, auto value) { std::fill_n(to + at, int(n), value); };
            if (grown) {
                copy(grown->phi, phi_), copy(grown->way, way_), copy(grown->scale, scale_);
                copy(grown->speed, speed_), copy(grown->flags, flags_);
                return;
            }
            if (phi)
                copy(phi, phi_), copy(phi, way_);
            else
                fill(phi_, tile), fill(way_, tile);
            fill(scale_, 0.f), fill(speed_, -1.f), fill(flags_, uint8_t(0));
        });
        return survey(way_, flags_, least_) & kTimed;
    }
    /// Is there anything of the front within the band, in coarse voxels?
    bool within(float band) const { return least_ <= band; }

    void continueTimes();
    std::unique_ptr<FrontNodes> inner() const {
        std::unique_ptr<FrontNodes> inner(new FrontNodes);  // not cleared
        for (int x = 0; x < FrontNodes::kSide; ++x)
            for (int y = 0; y < FrontNodes::kSide; ++y) {
                constexpr int kMore = kBefore - FrontNodes::kBefore;
                const int from = index(x + kMore, y + kMore, kMore), to = FrontNodes::index(x, y, 0);
                const auto copy = [&](const auto* source, auto* row) {
                    std::memcpy(row + to, source + from, FrontNodes::kRow * sizeof *row);
                };
                copy(phi_, inner->phi), copy(way_, inner->way), copy(scale_, inner->scale);
                copy(flags_, inner->flags);
            }
        for (float* field : {inner->phi, inner->way, inner->scale})
            std::fill(field + FrontNodes::kSide * FrontNodes::kSlab, field + FrontNodes::kCount, 0.f);
        return inner;
    }

  private:
    static constexpr int index(int x, int y, int z) { return x * kSlab + y * kRow + z; }

    float phi_[kCount] = {}, way_[kCount] = {}, scale_[kCount] = {}, speed_[kCount] = {};
    uint8_t flags_[kCount] = {};
    float least_ = 0;
};

/// All flags of the nodes, and the least way.
PAVEL_WIDE uint8_t survey(const float* way, const uint8_t* flags, float& least) {
    constexpr int kRow = Nodes::kRow;
    float leasts[kRow];
    uint8_t all[kRow] = {};
    std::fill(leasts, leasts + kRow, kBand);
    for (int row = 0; row < Nodes::kCount; row += kRow) {
        PAVEL_ROLLED
        for (int z = 0; z < kRow; ++z) leasts[z] = way[row + z] < leasts[z] ? way[row + z] : leasts[z];
        PAVEL_ROLLED
        for (int z = 0; z < kRow; ++z) all[z] = uint8_t(all[z] | flags[row + z]);
    }
    // What lies beyond a row's last node is none.
    least = *std::min_element(leasts, leasts + Nodes::kSide);
    uint8_t any = 0;
    for (int z = 0; z < Nodes::kSide; ++z) any = uint8_t(any | all[z]);
    return any;
}

/// Gives the nodes beside those that the front reached times as if it had gone on, two layers of them: an interpolation
/// that took the placed surface's distance for them would put ripples into the front's. Its advance goes on as much as
/// the speed does: not at all where that is zero. The outermost layer only lends its values.
PAVEL_WIDE void continueTimes(const float* phi, const float* speed, float* way, float* scale) {
    constexpr int n = Nodes::kSide, kSlab = Nodes::kSlab, kRow = Nodes::kRow,
                  kSides[6] = {-kSlab, kSlab, -kRow, kRow, -1, 1};
    float ahead[Nodes::kCount], newWay[Nodes::kCount], newScale[Nodes::kCount];
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < Nodes::kCount; ++i) {
            const float lead = way[i] - phi[i];
            ahead[i] = scale[i] > 0 ? lead : 0;
        }
        for (int x = 1; x < n - 1; ++x)
            for (int y = 1; y < n - 1; ++y) {
                // Whole rows, which fill the registers; what lies outside is not taken over.
                const int row = x * kSlab + y * kRow;
                PAVEL_ROLLED
                for (int i = row; i < row + kRow; ++i) {
                    float lead = 0, beside = 0, known = 0;
                    for (const int side : kSides) {
                        lead += ahead[i + side];
                        beside += scale[i + side];
                        known += scale[i + side] > 0 ? 1.f : 0.f;
                    }
                    const float share = speed[i] * known / beside, slower = share < 1 ? share : 1,
                                goesOn = speed[i] < 0 ? 1 : slower;
                    const float farther = phi[i] + goesOn * lead / known, mean = goesOn * beside / known;
                    const bool open = (scale[i] <= 0) & (speed[i] != 0) & (known > 0);
                    newWay[i] = open ? farther : way[i];
                    newScale[i] = open ? mean : scale[i];
                }
            }
        for (int x = 1; x < n - 1; ++x)
            for (int y = 1; y < n - 1; ++y) {
                const int row = x * kSlab + y * kRow;
                std::memcpy(way + row + 1, newWay + row + 1, (n - 2) * sizeof *way);
                std::memcpy(scale + row + 1, newScale + row + 1, (n - 2) * sizeof *scale);
            }
    }
}

void Nodes::continueTimes() {
    pavel::continueTimes(phi_, speed_, way_, scale_);
}

}  // namespace

FrontNodes::Window FrontNodes::window(const FineSpan& sx, const FineSpan& sy, const FineSpan& sz) const {
    const int from = index(sx.first, sy.first, sz.first);
    Window w{phi + from, way + from, scale + from, &sx, &sy, &sz};
    for (int x = 1; x < sx.nodes - 1; ++x)
        for (int y = 1; y < sy.nodes - 1; ++y)
            for (int i = from + index(x, y, 1), end = i + sz.nodes - 2; i < end; ++i) {
                w.flags |= flags[i];
                w.least = (scale[i] > 0) & (way[i] < w.least) ? way[i] : w.least;
            }
    return w;
}

std::vector<std::unique_ptr<FrontNodes>> nodesOf(const Front& front, float reach) {
    static thread_local std::vector<FrontBlock> touched;  // scratch
    touched.clear();
    touched.reserve(front.blocks.size());
    std::vector<const FrontBlock*> blocks(front.blocks.size());
    for (const GrowthBlock& grown : front.blocks)
        if (front.touched(grown)) blocks[size_t(grown.number)] = &touched.emplace_back(front, grown);
    std::vector<std::unique_ptr<FrontNodes>> all(blocks.size());
    const CompactReader placed(front.element.placed);
    Nodes nodes;
    for (const GrowthBlock& grown : front.blocks) {
        if (!nodes.load(front, blocks, placed, grown.origin) || !nodes.within(reach)) continue;
        nodes.continueTimes();
        all[size_t(grown.number)] = nodes.inner();
    }
    return all;
}

}  // namespace pavel
