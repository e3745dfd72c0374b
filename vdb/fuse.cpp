#include "pavel/vdb/fuse.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <set>

#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

/// Leaf origins where any element, or the base within an element, has values of its own.
std::vector<Coord> unionOrigins(const std::vector<WorkElement>& elements, const Growth& growth, const ElementIndex& index, const openvdb::FloatTree* base) {
    std::vector<Coord> origins;
    for (size_t i = 0; i < elements.size(); ++i) {
        for (auto leaf = elements[i].placed->cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
        if (const Front* f = growth.front(int(i)))
            for (const GrowthBlock& b : f->blocks) origins.push_back(b.origin);
    }
    if (base)
        for (auto leaf = base->cbeginLeaf(); leaf; ++leaf) {
            const Coord c = leaf->origin();
            for (int i : index.meeting(CoordBBox(c, c.offsetBy(7)))) {
                if (elements[size_t(i)].placed->getValue(c) < 0 && !elements[size_t(i)].placed->probeConstLeaf(c)) {
                    origins.push_back(c);
                    break;
                }
            }
        }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    return origins;
}

/// Minimum over all elements in one block, unclipped by each other.
void unionValues(const std::vector<WorkElement>& elements, const Growth& growth, const ElementIndex& index,
                 const std::vector<std::set<Coord>>& islands, const Coord& origin, float* values) {
    std::fill(values, values + 512, kBand);
    for (int i : index.meeting(CoordBBox(origin.offsetBy(-24), origin.offsetBy(31)))) {
        const WorkElement& e = elements[size_t(i)];
        if (!e.bodyVoxels) continue;
        const WorkLeaf* leaf = e.placed->probeConstLeaf(origin);
        const float tile = leaf ? 0 : e.placed->getValue(origin);
        if (leaf || tile < 0) {
            for (int v = 0; v < 512; ++v) {
                if (!islands[size_t(i)].empty() && islands[size_t(i)].count(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v)))) continue;
                values[v] = std::min(values[v], leaf ? leaf->getValue(openvdb::Index(v)) : tile);
            }
        }
        const Front* front = growth.front(i);
        if (const GrowthBlock* block = front ? front->probe(origin) : nullptr)
            for (int v = 0; v < 512; ++v)
                if (front->hasTime(*block, v) || block->state[v] == kBody) values[v] = std::min(values[v], std::max(-kBand, growth.ownValue(i, *block, v)));
    }
}

void setLeaf(openvdb::FloatTree& tree, const Coord& origin, const float* values) {
    auto* leaf = tree.touchLeaf(origin);
    for (openvdb::Index v = 0; v < 512; ++v) {
        leaf->setValueOnly(v, values[v]);
        leaf->setActiveState(v, std::abs(values[v]) < kBand);
    }
}

}  // namespace

void fuse(const std::vector<WorkElement>& elements, const Growth& growth, const openvdb::FloatTree::Ptr& base, bool withSolid, PackedGrids& grids) {
    const ElementIndex index(elements);
    const std::vector<Coord> origins = unionOrigins(elements, growth, index, base.get());
    std::vector<std::set<Coord>> islands(elements.size());
    for (size_t i = 0; i < elements.size(); ++i) islands[i].insert(elements[i].islands.begin(), elements[i].islands.end());
    openvdb::FloatTree surface(kBand);
    if (withSolid) grids.solid = std::make_shared<openvdb::FloatTree>(*base);
    constexpr size_t kChunk = 4096;
    std::vector<float> values(kChunk * 512);
    for (size_t first = 0; first < origins.size(); first += kChunk) {
        const size_t count = std::min(kChunk, origins.size() - first);
        tbb::parallel_for(size_t(0), count, [&](size_t k) { unionValues(elements, growth, index, islands, origins[first + k], &values[k * 512]); });
        for (size_t k = 0; k < count; ++k) {
            const Coord& origin = origins[first + k];
            float* u = &values[k * 512];
            const auto* leaf = base ? base->probeConstLeaf(origin) : nullptr;
            const float tile = base && !leaf ? base->getValue(origin) : kBand;
            const auto baseAt = [&](openvdb::Index v) { return leaf ? leaf->getValue(v) : tile; };
            if (withSolid && (leaf || tile > 0)) {
                float solid[512];
                for (openvdb::Index v = 0; v < 512; ++v) solid[v] = std::min(u[v], baseAt(v));
                setLeaf(*grids.solid, origin, solid);
            }
            if (!leaf && tile < 0) continue;
            for (openvdb::Index v = 0; v < 512; ++v) u[v] = std::max(u[v], -baseAt(v));
            setLeaf(surface, origin, u);
        }
    }
    openvdb::tools::signedFloodFillWithValues(surface, kBand, -kBand);
    grids.surface = redistanced(surface);
    if (grids.solid) openvdb::tools::signedFloodFillWithValues(*grids.solid, kBand, -kBand);
}

openvdb::Int32Tree::Ptr elementIds(const std::vector<WorkTree::Ptr>& elements) {
    auto ids = std::make_shared<openvdb::Int32Tree>(0);
    for (size_t i = 0; i < elements.size(); ++i) {
        if (!elements[i]) continue;
        const int id = int(i) + 1;
        auto tile = elements[i]->cbeginValueAll();
        tile.setMaxDepth(WorkTree::ValueAllCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile)
            if (*tile < 0) ids->fill(tile.getBoundingBox(), id, true);
        for (auto leaf = elements[i]->cbeginLeaf(); leaf; ++leaf) {
            openvdb::Int32Tree::LeafNodeType* out = nullptr;
            for (openvdb::Index v = 0; v < 512; ++v) {
                const float d = leaf->getValue(v);
                if (!(d < 0)) continue;
                if (!out) out = ids->touchLeaf(leaf->origin());
                const int held = out->getValue(v);
                if (held > 0 && elements[size_t(held) - 1]->getValue(leaf->offsetToGlobalCoord(v)) <= d) continue;
                out->setValueOn(v, id);
            }
        }
    }
    return ids;
}

}  // namespace pavel
