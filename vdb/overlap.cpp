#include "pavel/vdb/overlap.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "pavel/vdb/bisector.h"
#include "pavel/vdb/contact.h"
#include "pavel/vdb/element_index.h"
#include "pavel/vdb/measure.h"

namespace pavel {
namespace {

constexpr double kHalfBlock = 3.5 * 1.7320508;

/// Cuts a block by what another keeps.
PAVEL_WIDE void takeAway(const float* theirs, const float* bisector, float* values) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float inOther = -theirs[v], taken = inOther < bisector[v] ? inOther : bisector[v];
        values[v] = taken > values[v] ? taken : values[v];
    }
}

/// @param placed the element's own, and `cutter` the other's shape
void trimByNeighbour(const WorkElement& element, const WorkElement& other, const CompactReader& placed,
                     BlockLevelSet& body) {
    const CompactLevelSet& cutter = other.placed;
    const Bisector g(element, other);
    CoordBBox shared = element.box;
    shared.intersect(other.box);
    if (shared.empty()) return;
    forEachBlock(shared, [&](const Coord& origin) {
        if (body.numbers().at(origin) == BlockNumbers::kOutside) return;
        const int cut = cutter.at(origin);
        if (cut == CompactLevelSet::kOutside) return;
        const double middle = g(centreOf(origin) + Vec3(3.5, 3.5, 3.5));
        if (middle < -kBand - kHalfBlock) return;
        if (cut == CompactLevelSet::kInside && middle > kBand + kHalfBlock) return body.clear(origin);
        const float* known = placed.probe(origin);
        const float* own = known ? known : uniformValues(true);
        float theirs[512], bisector[512];
        cutter.read(cut, theirs);
        g.over(origin, 1, own, theirs, bisector);
        takeAway(theirs, bisector, body.open(origin));
    });
}

void trimByBase(const CoordBBox& box, const openvdb::FloatTree& base, BlockLevelSet& body) {
    const BaseReader reader(base);
    forEachBlock(box, [&](const Coord& origin) {
        if (body.numbers().at(origin) == BlockNumbers::kOutside) return;
        const auto* solid = reader.probeConstLeaf(origin);
        if (!solid) {
            if (reader.getValue(origin) < 0) body.clear(origin);
            return;
        }
        const float* inBase = solid->buffer().data();
        float* values = body.open(origin);
        for (int v = 0; v < 512; ++v) values[v] = std::max(values[v], -inBase[v]);
    });
}

}  // namespace

void findNeighbours(std::vector<WorkElement>& elements) {
    const ElementIndex index(boxesOf(elements));
    for (size_t i = 0; i < elements.size(); ++i) {
        elements[i].neighbours = index.meeting(elements[i].box);
        auto& n = elements[i].neighbours;
        n.erase(std::remove(n.begin(), n.end(), int(i)), n.end());
    }
}

BlockLevelSet trimElement(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base,
                          bool recoverBaseLoss) {
    BlockLevelSet body(element.placed);
    element.targetVolume = element.placedVolume;
    if (base && (!recoverBaseLoss || std::isinf(element.stiffness))) {
        trimByBase(element.box, *base, body);
        body.tidy();
        element.targetVolume = body.measure().volume;
    }
    const CompactReader placed(element.placed);
    for (int n : element.neighbours) trimByNeighbour(element, all[size_t(n)], placed, body);
    if (base) trimByBase(element.box, *base, body);
    body.tidy();
    const InsideMeasure m = body.measure();
    element.bodyVolume = m.volume;
    element.bodyVoxels = m.voxels;
    element.body = body.inside();
    return body;
}

std::vector<MaskedBlock> findStrays(const BlockMasks& body) {
    std::vector<MaskedBlock> blocks;
    forEachBlock(CoordBBox(body.numbers().lower(), body.numbers().upper()), [&](const Coord& origin) {
        if (body.at(origin) != BlockNumbers::kOutside) blocks.push_back({origin, blockMask(body.mask(origin))});
    });
    return straysOf(blocks);
}

void erase(CompactLevelSet& of, const std::vector<MaskedBlock>& voxels) {
    BlockLevelSet blocks(of);
    for (const MaskedBlock& m : voxels) {
        float* values = blocks.open(m.origin);
        for (int v = 0; v < 512; ++v)
            if (testMask(m.mask, v)) values[v] = std::max(0.5f, std::abs(values[v]));
    }
    blocks.tidy();
    of = blocks.compact();
}

void resolveOverlap(std::vector<WorkElement>& elements, const openvdb::FloatTree* base, bool recoverBaseLoss,
                    const RunContext& context) {
    constexpr int kRounds = 3;
    findNeighbours(elements);
    std::vector<int> open(elements.size());
    std::iota(open.begin(), open.end(), 0);
    const auto each = [&](const std::vector<int>& list, const auto& f) {
        tbb::parallel_for(size_t(0), list.size(), [&](size_t k) { f(elements[size_t(list[k])]); });
    };
    for (int round = 0; round < kRounds && !open.empty(); ++round) {
        context.progress("overlap", 0.3 * round);
        std::vector<std::vector<MaskedBlock>> strays(elements.size());
        each(open, [&](WorkElement& e) {
            trimElement(e, elements, base, recoverBaseLoss);
            strays[size_t(e.id) - 1] = findStrays(e.body);
        });
        std::vector<int> again;
        for (WorkElement& e : elements) {
            const auto& own = strays[size_t(e.id) - 1];
            if (own.empty()) continue;
            erase(e.placed, own);
            again.push_back(e.id - 1);
            again.insert(again.end(), e.neighbours.begin(), e.neighbours.end());
            e.strays.insert(e.strays.end(), own.begin(), own.end());
        }
        std::sort(again.begin(), again.end());
        again.erase(std::unique(again.begin(), again.end()), again.end());
        open = std::move(again);
    }
    each(open, [&](WorkElement& e) { trimElement(e, elements, base, recoverBaseLoss); });
    context.progress("overlap", 0.9);
    findContacts(elements, base);
}

}  // namespace pavel
