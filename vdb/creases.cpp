#include "pavel/vdb/creases.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <unordered_map>

#include "pavel/vdb/leaf_tables.h"
#include "pavel/vdb/packed_blocks.h"
#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

/// Share of a fillet where normals meet at an angle: none up to 35 degrees, all of it from 55 on.
float filletShare(float cosine) {
    constexpr float kNone = 0.82f, kAll = 0.57f;
    return std::clamp((kNone - cosine) / (kNone - kAll), 0.f, 1.f);
}

/// Central differences, twice.
Vec3f slopeAt(const CompactLevelSet& field, const Coord& c) {
    return {field.getValue(c.offsetBy(1, 0, 0)) - field.getValue(c.offsetBy(-1, 0, 0)),
            field.getValue(c.offsetBy(0, 1, 0)) - field.getValue(c.offsetBy(0, -1, 0)),
            field.getValue(c.offsetBy(0, 0, 1)) - field.getValue(c.offsetBy(0, 0, -1))};
}

using SeamMap = std::unordered_map<Coord, Seams, CoordHash>;

/// Shares of fillets in a block, from its seams and those around it: between the middles of cells they change evenly.
/// False where there is all of it everywhere.
bool filletShares(const SeamMap& seams, const Coord& origin, float* share) {
    float cosines[4][4][4], count[4][4][4];  // the block's cells and one around
    float least = 1;
    for (int x = 0; x < 4; ++x)
        for (int y = 0; y < 4; ++y)
            for (int z = 0; z < 4; ++z) {
                const int at[3] = {x + 1, y + 1, z + 1};  // from the block before
                const auto found =
                    seams.find(origin + Coord(8 * (at[0] / 2) - 8, 8 * (at[1] / 2) - 8, 8 * (at[2] / 2) - 8));
                const int cell = (at[0] % 2) << 2 | (at[1] % 2) << 1 | (at[2] % 2);
                cosines[x][y][z] = found == seams.end() ? 0 : found->second.cosines[cell];
                count[x][y][z] = found == seams.end() ? 0 : found->second.count[cell];
                if (count[x][y][z] > 0) least = std::min(least, filletShare(cosines[x][y][z] / count[x][y][z]));
            }
    if (least >= 1) return false;
    for (int v = 0; v < 512; ++v) {
        const int at[3] = {v >> 6, v >> 3 & 7, v & 7};
        int first[3];
        float part[3];
        for (int k = 0; k < 3; ++k) {
            const float place = 0.25f * (float(at[k]) - 1.5f) + 1;  // in cells, from the middle of the first
            first[k] = int(place), part[k] = place - float(first[k]);
        }
        float sum = 0, weights = 0;
        for (int n = 0; n < 8; ++n) {
            const int x = first[0] + (n >> 2), y = first[1] + (n >> 1 & 1), z = first[2] + (n & 1);
            if (!(count[x][y][z] > 0)) continue;
            const float weight = count[x][y][z] * (n >> 2 ? part[0] : 1 - part[0]) *
                                 (n >> 1 & 1 ? part[1] : 1 - part[1]) * (n & 1 ? part[2] : 1 - part[2]);
            sum += weight * filletShare(cosines[x][y][z] / count[x][y][z]);
            weights += weight;
        }
        share[v] = weights > 0 ? sum / weights : 1;
    }
    return true;
}

}  // namespace

PAVEL_WIDE void blendMin(const float* a, const float* b, float* out) {
    constexpr float kBlend = kResultBand, kDeeper = 0.25f;  // as a mere parabola it would be three quarters deep
    constexpr float kFade = 1.5f;
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float one = a[v], two = b[v], least = two < one ? two : one, farther = two < one ? one : two,
                    apart = farther - least, over = kBlend - apart, h = over > 0 ? over : 0,
                    round = 1 - apart * apart / (kBlend * kBlend), u = round > 0 ? round : 0,
                    fades = (kBlend - farther) / kFade, some = fades > 0 ? fades : 0, share = some < 1 ? some : 1;
        out[v] = least - share * (h * h / (4 * kBlend) + kDeeper * u * u);
    }
}

bool Seams::flush() const {
    for (int c = 0; c < 8; ++c)
        if (count[c] > 0 && filletShare(cosines[c] / count[c]) < 1) return true;
    return false;
}

ElementUnion::ElementUnion(const std::vector<const CompactLevelSet*>& elements)
    : elements_(elements), index_(boxesOf(elements)) {}

void ElementUnion::read(const Coord& origin, float* least, float* second) const {
    float one[512];
    std::fill(least, least + 512, kBand);
    std::fill(second, second + 512, kBand);
    for (int i : index_.meeting(CoordBBox(origin, origin.offsetBy(7)))) {
        const int block = elements_[size_t(i)]->at(origin);
        if (block == CompactLevelSet::kOutside) continue;
        elements_[size_t(i)]->read(block, one);
        for (int v = 0; v < 512; ++v) {
            const float own = one[v];
            second[v] = std::min(second[v], std::max(least[v], own));
            least[v] = std::min(least[v], own);
        }
    }
}

Seams ElementUnion::seams(const Coord& origin) const {
    // Above a seam: outside, about as far from one as from the other. Lower, differences would reach in between them,
    // and higher up beyond their bands.
    constexpr float kAside = 0.35f, kLow = 0.9f, kHigh = 1.95f;
    Seams seams;
    float least[512], second[512];
    read(origin, least, second);
    for (int v = 0; v < 512; ++v) {
        if (!((least[v] > kLow) & (least[v] < kHigh) & (second[v] - least[v] < kAside))) continue;
        const Coord c = origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v));
        const CompactLevelSet *a = nullptr, *b = nullptr;
        for (int i : index_.meeting(CoordBBox(c, c))) {
            const CompactLevelSet* e = elements_[size_t(i)];
            const float value = e->getValue(c);
            if (!a && value == least[v])
                a = e;
            else if (value == second[v])
                b = e;
        }
        if (!a || !b) continue;
        const Vec3f ga = slopeAt(*a, c), gb = slopeAt(*b, c);
        seams.cosines[cellOf(v)] += (ga | gb) / std::max(ga.length() * gb.length(), 1e-6f);
        seams.count[cellOf(v)] += 1;
    }
    return seams;
}

void ElementUnion::fillCreases(openvdb::FloatTree& tree) const {
    constexpr float kBall = 1, kRough = 0.03f;  // what is not to be closed, the closing leaves as it is to that
    std::vector<WorkLeaf*> leaves;
    tree.getNodes(leaves);
    std::vector<Seams> found(leaves.size());
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t k) { found[k] = seams(leaves[k]->origin()); });
    SeamMap known;
    std::vector<Coord> flush;
    for (size_t k = 0; k < leaves.size(); ++k) {
        if (std::all_of(found[k].count, found[k].count + 8, [](float n) { return n == 0; })) continue;
        known[leaves[k]->origin()] = found[k];
        if (!found[k].flush()) continue;
        for (int n = 0; n < 27; ++n)
            flush.push_back(leaves[k]->origin().offsetBy(8 * (n / 9) - 8, 8 * (n / 3 % 3) - 8, 8 * (n % 3) - 8));
    }
    found = {};
    std::sort(flush.begin(), flush.end());
    flush.erase(std::unique(flush.begin(), flush.end()), flush.end());
    const auto isFlush = [&](const Coord& origin) { return std::binary_search(flush.begin(), flush.end(), origin); };
    const openvdb::FloatTree::Ptr offset = redistanced(flush, [&](const Coord& origin, float* values, float& tile) {
        const bool there = readBlock(tree, origin, values);
        tile = values[0] - kBall;
        for (int v = 0; v < 512; ++v) values[v] -= kBall;
        return there;
    });
    tbb::parallel_for(size_t(0), leaves.size(), [&](size_t k) {
        const Coord& origin = leaves[k]->origin();
        float least[512], second[512], blended[512], closed[512], share[512];
        read(origin, least, second);  // once more: to keep all second distances would double the memory
        float* values = leaves[k]->buffer().data();
        const bool mixed = isFlush(origin) && filletShares(known, origin, share);
        blendMin(least, second, blended);
        if (mixed) {
            readBlock(*offset, origin, closed);
            for (int v = 0; v < 512; ++v) {
                if (!(second[v] < kResultBand)) continue;
                const float flat = std::min(least[v], closed[v] + kBall + kRough);
                blended[v] = flat + share[v] * (blended[v] - flat);
            }
        }
        for (int v = 0; v < 512; ++v) values[v] = std::clamp(blended[v], -kBand, kBand);
    });
}

}  // namespace pavel
