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

/// Sets a whole block to one side.
void fillBlock(WorkTree& tree, const Coord& origin, float value) {
    tree.addTile(1, origin, value, false);
}

/// Cuts a block by what another keeps.
PAVEL_WIDE void takeAway(const float* theirs, const float* bisector, float* values) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float inOther = -theirs[v], taken = inOther < bisector[v] ? inOther : bisector[v];
        values[v] = taken > values[v] ? taken : values[v];
    }
}

void trimByNeighbour(const WorkElement& element, const WorkElement& other, WorkTree& body) {
    const WorkTree& cutter = *other.placed;
    const Bisector g(element, other);
    CoordBBox shared = element.box;
    shared.intersect(other.box);
    if (shared.empty()) return;
    forEachBlock(shared, [&](const Coord& origin) {
        WorkLeaf* leaf = body.probeLeaf(origin);
        if (!leaf && body.getValue(origin) > 0) return;
        const WorkLeaf* cut = cutter.probeConstLeaf(origin);
        if (!cut && cutter.getValue(origin) > 0) return;
        const double middle = g(centreOf(origin) + Vec3(3.5, 3.5, 3.5));
        if (middle < -kBand - kHalfBlock) return;
        if (!cut && middle > kBand + kHalfBlock) {
            fillBlock(body, origin, kBand);
            return;
        }
        if (!leaf) leaf = body.touchLeaf(origin);
        const WorkLeaf* placed = element.placed->probeConstLeaf(origin);
        const float *own = placed ? placed->buffer().data() : uniformValues(true),
                    *theirs = cut ? cut->buffer().data() : uniformValues(true);
        float bisector[512];
        g.over(origin, 1, own, theirs, bisector);
        takeAway(theirs, bisector, leaf->buffer().data());
    });
}

void trimByBase(const CoordBBox& box, const openvdb::FloatTree& base, WorkTree& body) {
    const BaseReader reader(base);
    forEachBlock(box, [&](const Coord& origin) {
        WorkLeaf* leaf = body.probeLeaf(origin);
        if (!leaf && body.getValue(origin) > 0) return;
        const auto* solid = reader.probeConstLeaf(origin);
        if (!solid) {
            if (reader.getValue(origin) < 0) fillBlock(body, origin, kBand);
            return;
        }
        if (!leaf) leaf = body.touchLeaf(origin);
        const float* inBase = solid->buffer().data();
        float* values = leaf->buffer().data();
        for (int v = 0; v < 512; ++v) values[v] = std::max(values[v], -inBase[v]);
    });
}

/// Blocks that ended up uniform become tiles.
void tidy(WorkTree& tree) {
    std::vector<std::pair<Coord, float>> uniform;
    for (auto leaf = tree.beginLeaf(); leaf; ++leaf) {
        bool in = true, out = true;
        const float* values = leaf->buffer().data();
        for (int v = 0; v < 512; ++v) {
            in &= values[v] <= -kBand;
            out &= values[v] >= kBand;
        }
        if (in || out) uniform.emplace_back(leaf->origin(), in ? -kBand : kBand);
    }
    for (const auto& [origin, value] : uniform) fillBlock(tree, origin, value);
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

WorkTree::Ptr trimElement(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base,
                          bool recoverBaseLoss) {
    auto body = std::make_shared<WorkTree>(*element.placed);
    element.targetVolume = element.placedVolume;
    if (base && (!recoverBaseLoss || std::isinf(element.stiffness))) {
        trimByBase(element.box, *base, *body);
        element.targetVolume = measureInside(*body).volume;
    }
    for (int n : element.neighbours) trimByNeighbour(element, all[size_t(n)], *body);
    if (base) trimByBase(element.box, *base, *body);
    tidy(*body);
    const InsideMeasure m = measureInside(*body);
    element.bodyVolume = m.volume;
    element.bodyVoxels = m.voxels;
    element.body = insideOf(*body);
    return body;
}

BodyTree::Ptr insideOf(const WorkTree& tree) {
    auto inside = std::make_shared<BodyTree>(false);
    auto tile = tree.cbeginValueAll();
    tile.setMaxDepth(WorkTree::ValueAllCIter::LEAF_DEPTH - 1);
    for (; tile; ++tile)
        if (*tile < 0) inside->addTile(tile.getLevel(), tile.getBoundingBox().min(), true, true);
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
        auto* out = inside->touchLeaf(leaf->origin());
        const float* values = leaf->buffer().data();
        for (openvdb::Index v = 0; v < 512; ++v) out->setActiveState(v, values[v] < 0);
    }
    return inside;
}

std::vector<MaskedBlock> findStrays(const BodyTree& body) {
    std::vector<MaskedBlock> blocks;
    CoordBBox box;
    body.evalLeafBoundingBox(box);
    if (box.empty()) return {};
    BlockMask full;
    full.fill(0xff);
    forEachBlock(box, [&](const Coord& origin) {
        if (const auto* leaf = body.probeConstLeaf(origin)) {
            BlockMask mask;
            for (size_t row = 0; row < 64; ++row)
                mask[row] = leaf->getValueMask().template getWord<uint8_t>(openvdb::Index(row));
            blocks.push_back({origin, mask});
        } else if (body.getValue(origin)) {
            blocks.push_back({origin, full});
        }
    });
    return straysOf(blocks);
}

void erase(WorkTree& tree, const std::vector<MaskedBlock>& voxels) {
    for (const MaskedBlock& m : voxels) {
        WorkLeaf* leaf = tree.touchLeaf(m.origin);
        for (int v = 0; v < 512; ++v)
            if (testMask(m.mask, v))
                leaf->setValueOnly(openvdb::Index(v), std::max(0.5f, std::abs(leaf->getValue(openvdb::Index(v)))));
    }
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
            strays[size_t(e.id) - 1] = findStrays(*e.body);
        });
        std::vector<int> again;
        for (WorkElement& e : elements) {
            const auto& own = strays[size_t(e.id) - 1];
            if (own.empty()) continue;
            erase(*e.placed, own);
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
    tbb::parallel_for(size_t(0), elements.size(), [&](size_t i) {
        if (elements[i].bodyVoxels) findContacts(elements[i], elements, base);
    });
}

}  // namespace pavel
