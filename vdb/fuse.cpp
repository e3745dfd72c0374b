#include "pavel/vdb/fuse.h"

#include <openvdb/tree/LeafManager.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <set>

#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

std::vector<Coord> sortedOnce(std::vector<Coord> origins) {
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    return origins;
}

/// Leaf origins where any element has values of its own.
std::vector<Coord> unionOrigins(const std::vector<WorkElement>& elements, const Growth& growth) {
    std::vector<Coord> origins;
    for (size_t i = 0; i < elements.size(); ++i) {
        for (auto leaf = elements[i].placed->cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
        if (const Front* f = growth.front(int(i)))
            for (const GrowthBlock& b : f->blocks) origins.push_back(b.origin);
    }
    return sortedOnce(std::move(origins));
}

/// Leaf origins of the union, and of the base where it runs through the union's inside.
std::vector<Coord> combinedOrigins(const std::vector<WorkElement>& elements, const openvdb::FloatTree& all,
                                   const openvdb::FloatTree& base) {
    std::vector<Coord> origins;
    for (auto leaf = all.cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    CoordBBox box;
    for (const WorkElement& e : elements) box.expand(e.box);
    const BaseReader reader(all);
    for (auto leaf = base.cbeginLeaf(); leaf; ++leaf)
        if (box.isInside(leaf->origin()) && !reader.probeConstLeaf(leaf->origin()) &&
            reader.getValue(leaf->origin()) < 0)
            origins.push_back(leaf->origin());
    return sortedOnce(std::move(origins));
}

/// A block's values, from its leaf or the tile that covers it.
class BlockReader {
  public:
    explicit BlockReader(const openvdb::FloatTree& tree) : reader_(tree) {}
    void read(const Coord& origin, float* values) const {
        const auto* leaf = reader_.probeConstLeaf(origin);
        if (leaf)
            std::copy(leaf->buffer().data(), leaf->buffer().data() + 512, values);
        else
            std::fill(values, values + 512, reader_.getValue(origin));
    }

  private:
    BaseReader reader_;
};

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
                if (!islands[size_t(i)].empty() &&
                    islands[size_t(i)].count(origin + WorkLeaf::offsetToLocalCoord(openvdb::Index(v))))
                    continue;
                values[v] = std::min(values[v], leaf ? leaf->getValue(openvdb::Index(v)) : tile);
            }
        }
        const Front* front = growth.front(i);
        if (const GrowthBlock* block = front ? front->probe(origin) : nullptr)
            for (int v = 0; v < 512; ++v)
                if (front->hasTime(*block, v) || block->state[v] == kBody)
                    values[v] = std::min(values[v], std::max(-kBand, growth.ownValue(i, *block, v)));
    }
}

/// All voxels go active, so that a later flood fill takes every sign as it stands.
void setLeaf(openvdb::FloatTree& tree, const Coord& origin, const float* values) {
    auto* leaf = tree.touchLeaf(origin);
    for (openvdb::Index v = 0; v < 512; ++v) leaf->setValueOnly(v, values[v]);
    leaf->setValuesOn();
}

openvdb::FloatTree::Ptr unionTree(const std::vector<WorkElement>& elements, const Growth& growth) {
    const ElementIndex index(elements);
    const std::vector<Coord> origins = unionOrigins(elements, growth);
    std::vector<std::set<Coord>> islands(elements.size());
    for (size_t i = 0; i < elements.size(); ++i)
        islands[i].insert(elements[i].islands.begin(), elements[i].islands.end());
    auto tree = std::make_shared<openvdb::FloatTree>(kBand);
    constexpr size_t kChunk = 4096;
    std::vector<float> values(kChunk * 512);
    for (size_t first = 0; first < origins.size(); first += kChunk) {
        const size_t count = std::min(kChunk, origins.size() - first);
        tbb::parallel_for(size_t(0), count, [&](size_t k) {
            unionValues(elements, growth, index, islands, origins[first + k], &values[k * 512]);
        });
        for (size_t k = 0; k < count; ++k) setLeaf(*tree, origins[first + k], &values[k * 512]);
    }
    openvdb::tools::signedFloodFillWithValues(*tree, kBand, -kBand);
    return tree;
}

void offset(openvdb::FloatTree& tree, float by) {
    openvdb::tree::LeafManager<openvdb::FloatTree> leaves(tree);
    leaves.foreach ([by](openvdb::FloatTree::LeafNodeType& leaf, size_t) {
        for (openvdb::Index v = 0; v < 512; ++v) leaf.setValueOnly(v, leaf.getValue(v) + by);
    });
}

/// Morphological closing by three quarters of a voxel: slits between neighbours that are thinner than that, which no
/// grid or printer can show, are filled instead of leaving a row of pits and specks; everything else keeps its place.
openvdb::FloatTree::Ptr closed(const openvdb::FloatTree& raw) {
    constexpr float kRadius = 0.75f;
    openvdb::FloatTree::Ptr tree = redistanced(raw);
    offset(*tree, -kRadius);
    tree = redistanced(*tree);
    offset(*tree, kRadius);
    return tree;
}

/// Sets f(union, base) wherever the union has values.
template <class F>
void combine(const std::vector<WorkElement>& elements, const openvdb::FloatTree& all, const openvdb::FloatTree& base,
             openvdb::FloatTree& out, F f) {
    const BlockReader above(all), below(base);
    for (const Coord& origin : combinedOrigins(elements, all, base)) {
        float u[512], b[512];
        above.read(origin, u);
        below.read(origin, b);
        for (int v = 0; v < 512; ++v) u[v] = f(u[v], b[v]);
        setLeaf(out, origin, u);
    }
    openvdb::tools::signedFloodFillWithValues(out, kBand, -kBand);
}

}  // namespace

void fuse(const std::vector<WorkElement>& elements, const Growth& growth, const openvdb::FloatTree::Ptr& base,
          bool withSolid, PackedGrids& grids) {
    openvdb::FloatTree::Ptr all = unionTree(elements, growth);
    if (withSolid) {
        openvdb::FloatTree solid(*base);
        combine(elements, *all, *base, solid, [](float u, float b) { return std::min(u, b); });
        grids.solid = closed(solid);
    }
    all = closed(*all);
    openvdb::FloatTree outside(kBand);
    combine(elements, *all, *base, outside, [](float u, float b) { return std::max(u, -b); });
    all.reset();
    grids.surface = redistanced(outside);
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
