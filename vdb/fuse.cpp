#include "pavel/vdb/fuse.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "pavel/vdb/measure.h"
#include "pavel/vdb/packed_blocks.h"
#include "pavel/vdb/redistance.h"

namespace pavel {
namespace {

std::vector<Coord> sortedOnce(std::vector<Coord> origins) {
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    return origins;
}

/// Leaf origins of all packed elements: the union's surface is part of theirs.
std::vector<Coord> unionOrigins(const std::vector<WorkTree::Ptr>& elements) {
    std::vector<Coord> origins;
    for (const WorkTree::Ptr& tree : elements)
        if (tree)
            for (auto leaf = tree->cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    return sortedOnce(std::move(origins));
}

/// Leaf origins of the union, and of the base where it runs through the union's inside.
std::vector<Coord> combinedOrigins(const openvdb::FloatTree& all, const openvdb::FloatTree& base) {
    std::vector<Coord> origins;
    for (auto leaf = all.cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
    const BaseReader reader(all);
    for (auto leaf = base.cbeginLeaf(); leaf; ++leaf)
        if (!reader.probeConstLeaf(leaf->origin()) && reader.getValue(leaf->origin()) < 0)
            origins.push_back(leaf->origin());
    return sortedOnce(std::move(origins));
}

/// Minimum of two distances with a fillet in the crease between them, a quarter of the blend deep: slits thinner than a
/// voxel, which no grid or printer can show, are filled instead of leaving a row of beads, and both sides of a contact
/// face are well inside.
float blendedMin(float a, float b) {
    constexpr float kBlend = 2.5f;
    const float h = std::max(0.f, kBlend - std::abs(a - b));
    return std::min(a, b) - h * h / (4 * kBlend);
}

/// Union of all elements in one block.
void unionValues(const ElementIndex& index, const std::vector<WorkTree::Ptr>& elements, const Coord& origin,
                 bool touching, float* values) {
    float second[512];
    std::fill(values, values + 512, kBand);
    std::fill(second, second + 512, kBand);
    for (int i : index.meeting(CoordBBox(origin, origin.offsetBy(7)))) {
        const WorkLeaf* leaf = elements[size_t(i)]->probeConstLeaf(origin);
        const float tile = leaf ? 0 : elements[size_t(i)]->getValue(origin);
        if (!leaf && tile > 0) continue;
        for (int v = 0; v < 512; ++v) {
            const float own = leaf ? leaf->buffer().data()[v] : tile;
            second[v] = std::min(second[v], std::max(values[v], own));
            values[v] = std::min(values[v], own);
        }
    }
    for (int v = 0; v < 512; ++v)
        values[v] = std::clamp(touching ? blendedMin(values[v], second[v]) : values[v], -kBand, kBand);
}

/// All voxels go active, so that a later flood fill takes every sign as it stands.
void setLeaf(openvdb::FloatTree& tree, const Coord& origin, const float* values) {
    auto* leaf = tree.touchLeaf(origin);
    for (openvdb::Index v = 0; v < 512; ++v) leaf->setValueOnly(v, values[v]);
    leaf->setValuesOn();
}

}  // namespace

openvdb::FloatTree::Ptr unionOf(const std::vector<WorkTree::Ptr>& elements, bool touching) {
    const ElementIndex index(leafBoxes(elements));
    const std::vector<Coord> origins = unionOrigins(elements);
    auto tree = std::make_shared<openvdb::FloatTree>(kBand);
    constexpr size_t kChunk = 4096;
    std::vector<float> values(kChunk * 512);
    for (size_t first = 0; first < origins.size(); first += kChunk) {
        const size_t count = std::min(kChunk, origins.size() - first);
        tbb::parallel_for(size_t(0), count, [&](size_t k) {
            unionValues(index, elements, origins[first + k], touching, &values[k * 512]);
        });
        for (size_t k = 0; k < count; ++k) setLeaf(*tree, origins[first + k], &values[k * 512]);
    }
    openvdb::tools::signedFloodFillWithValues(*tree, kBand, -kBand);
    return tree;
}

namespace {

/// Sets f(union, base) wherever the union has values.
template <class F>
void combine(const openvdb::FloatTree& all, const openvdb::FloatTree& base, openvdb::FloatTree& out, F f) {
    const BaseReader above(all), below(base);
    for (const Coord& origin : combinedOrigins(all, base)) {
        float u[512], b[512];
        readBlock(above, origin, u);
        readBlock(below, origin, b);
        for (int v = 0; v < 512; ++v) u[v] = f(u[v], b[v]);
        setLeaf(out, origin, u);
    }
    openvdb::tools::signedFloodFillWithValues(out, kBand, -kBand);
}

}  // namespace

openvdb::FloatTree::Ptr outside(const openvdb::FloatTree& all, const openvdb::FloatTree& base, float clearance) {
    auto out = std::make_shared<openvdb::FloatTree>(kBand);
    combine(all, base, *out, [clearance](float u, float b) { return std::max(u, clearance - b); });
    return out;
}

namespace {

/// Ids inside the packed elements; a voxel inside two (by rounding) goes to the one in which it lies deeper.
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

/// Moves the surface of a clean level set until its volume is the target, by a quarter of a voxel at most. share(union,
/// base): how much of the move a voxel joins in, 0 to 1.
template <class Share>
void settleVolume(openvdb::FloatTree& tree, double target, const openvdb::FloatTree& all,
                  const openvdb::FloatTree& base, Share share) {
    constexpr double kClose = 1e-4, kMost = 0.25;
    constexpr int kSteps = 2;
    std::vector<WorkLeaf*> leaves;
    tree.getNodes(leaves);
    // Calls f(leaf number, value, share) for active voxels.
    const auto eachVoxel = [&](const auto& f) {
        tbb::parallel_for(size_t(0), leaves.size(), [&](size_t k) {
            const BaseReader above(all), below(base);
            float u[512], b[512];
            readBlock(above, leaves[k]->origin(), u);
            readBlock(below, leaves[k]->origin(), b);
            float* values = leaves[k]->buffer().data();
            for (auto it = leaves[k]->beginValueOn(); it; ++it) f(k, values[it.pos()], share(u[it.pos()], b[it.pos()]));
        });
    };
    const float band = tree.background();
    double moved = 0;
    for (int step = 0; step < kSteps; ++step) {
        const double excess = measureInside(tree).volume - target;
        if (std::abs(excess) <= kClose * target) return;
        std::vector<double> areas(leaves.size(), 0);
        eachVoxel([&](size_t k, float value, float part) { areas[k] += std::abs(value) < 0.5f ? double(part) : 0; });
        const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
        const auto by = float(std::clamp(excess / std::max(area, 1.0), -kMost - moved, kMost - moved));
        moved += double(by);
        eachVoxel([&](size_t, float& value, float part) { value = std::clamp(value + part * by, -band, band); });
    }
}

}  // namespace

void fuse(const std::vector<WorkTree::Ptr>& elements, double volume, bool withSolid, bool touching,
          PackedGrids& grids) {
    const openvdb::FloatTree::Ptr all = unionOf(elements, touching);
    const auto within = [](float ahead) { return std::clamp(ahead + 0.5f, 0.f, 1.f); };  // not a step at the seam
    if (withSolid) {
        openvdb::FloatTree solid(*grids.base);
        combine(*all, *grids.base, solid,
                [touching](float u, float b) { return touching ? blendedMin(u, b) : std::min(u, b); });
        grids.solid = redistanced(solid);
        if (touching)
            settleVolume(*grids.solid, volume + measureInside(*grids.base).volume, *all, *grids.base,
                         [&](float u, float b) { return within(b - u); });
    }
    grids.surface = redistanced(*outside(*all, *grids.base, 0));
    if (touching)
        settleVolume(*grids.surface, volume, *all, *grids.base, [&](float u, float b) { return within(u + b); });
    grids.ids = elementIds(elements);
}

}  // namespace pavel
