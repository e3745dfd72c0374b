#include "pavel/vdb/fuse.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <numeric>

#include "pavel/vdb/creases.h"
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

/// Blocks of all packed elements: the union's surface is part of theirs.
std::vector<Coord> unionOrigins(const std::vector<const CompactLevelSet*>& elements) {
    std::vector<Coord> origins;
    for (const CompactLevelSet* e : elements)
        for (int b = 0; b < int(e->size()); ++b) origins.push_back(e->origin(b));
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

/// All voxels go active, so that a later flood fill takes every sign as it stands.
void setLeaf(openvdb::FloatTree& tree, const Coord& origin, const float* values) {
    auto* leaf = tree.touchLeaf(origin);
    std::copy(values, values + 512, leaf->buffer().data());
    leaf->setValuesOn();
}

}  // namespace

openvdb::FloatTree::Ptr unionOf(const std::vector<const CompactLevelSet*>& elements, bool touching) {
    const ElementUnion all(elements);
    const std::vector<Coord> origins = unionOrigins(elements);
    auto tree = std::make_shared<openvdb::FloatTree>(kBand);
    constexpr size_t kChunk = 4096;
    std::vector<float> values(kChunk * 512);
    for (size_t first = 0; first < origins.size(); first += kChunk) {
        const size_t count = std::min(kChunk, origins.size() - first);
        tbb::parallel_for(size_t(0), count, [&](size_t k) {
            float second[512];
            all.read(origins[first + k], &values[k * 512], second);
        });
        for (size_t k = 0; k < count; ++k) setLeaf(*tree, origins[first + k], &values[k * 512]);
    }
    openvdb::tools::signedFloodFillWithValues(*tree, kBand, -kBand);
    if (touching) all.fillCreases(*tree);
    return tree;
}

namespace {

/// In a block, max(union, clearance - base).
bool outsideBlock(const openvdb::FloatTree& all, const openvdb::FloatTree& base, float clearance, const Coord& origin,
                  float* values, float& tile) {
    float below[512];
    const bool u = readBlock(all, origin, values), b = (u || values[0] < 0) && readBlock(base, origin, below);
    if (!u && !b) {
        tile = values[0] < 0 ? std::max(values[0], clearance - base.getValue(origin)) : kBand;
        return false;
    }
    if (!b) std::fill(below, below + 512, base.getValue(origin));
    for (int v = 0; v < 512; ++v) values[v] = std::max(values[v], clearance - below[v]);
    return true;
}

/// In a block, union and base as one solid. Where there is no union the base stays as it is.
bool solidBlock(const openvdb::FloatTree& all, const openvdb::FloatTree& base, bool touching, const Coord& origin,
                float* values, float& tile) {
    float above[512];
    const bool b = readBlock(base, origin, values), u = readBlock(all, origin, above);
    if (!u && above[0] > 0) {
        tile = values[0];
        return b;
    }
    if (!u && !b) {
        tile = std::min(values[0], above[0]);
        return false;
    }
    if (touching) {
        float below[512];
        std::copy(values, values + 512, below);
        blendMin(above, below, values);
    } else {
        std::transform(above, above + 512, values, values, [](float x, float y) { return std::min(x, y); });
    }
    return true;
}

}  // namespace

openvdb::FloatTree::Ptr outside(const openvdb::FloatTree& all, const openvdb::FloatTree& base, float clearance) {
    auto out = std::make_shared<openvdb::FloatTree>(kBand);
    float values[512], tile;
    for (const Coord& origin : combinedOrigins(all, base))
        if (outsideBlock(all, base, clearance, origin, values, tile)) setLeaf(*out, origin, values);
    openvdb::tools::signedFloodFillWithValues(*out, kBand, -kBand);
    return out;
}

namespace {

/// Ids inside the packed elements; a voxel inside two (by rounding) goes to the one in which it lies deeper.
openvdb::Int32Tree::Ptr elementIds(const std::vector<CompactLevelSet>& elements) {
    auto ids = std::make_shared<openvdb::Int32Tree>(0);
    float values[512], others[512];
    for (size_t i = 0; i < elements.size(); ++i) {
        const int id = int(i) + 1;
        elements[i].forEachFilled([&](const Coord& lo, const Coord& hi) { ids->fill(CoordBBox(lo, hi), id, true); });
        for (int b = 0; b < int(elements[i].size()); ++b) {
            const Coord& origin = elements[i].origin(b);
            elements[i].read(b, values);
            openvdb::Int32Tree::LeafNodeType* out = nullptr;
            int other = 0;  // whose values are at hand
            for (openvdb::Index v = 0; v < 512; ++v) {
                const float d = values[v];
                if (!(d < 0)) continue;
                if (!out) out = ids->touchLeaf(origin);
                if (const int held = out->getValue(v); held > 0) {
                    const CompactLevelSet& holder = elements[size_t(held) - 1];
                    if (held != other) holder.read(holder.at(origin), others);
                    other = held;
                    if (others[v] <= d) continue;
                }
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

void fuse(double volume, bool withSolid, bool touching, PackedGrids& grids) {
    std::vector<const CompactLevelSet*> elements;
    for (const CompactLevelSet& e : grids.elements) elements.push_back(&e);
    openvdb::FloatTree::Ptr all = unionOf(elements, touching);
    const openvdb::FloatTree& base = *grids.base;
    std::vector<Coord> origins = combinedOrigins(*all, base);
    const auto within = [](float ahead) { return std::clamp(ahead + 0.5f, 0.f, 1.f); };  // not a step at the seam
    grids.surface = redistanced(origins, [&](const Coord& origin, float* values, float& tile) {
        return outsideBlock(*all, base, 0, origin, values, tile);
    });
    if (touching) settleVolume(*grids.surface, volume, *all, base, [&](float u, float b) { return within(u + b); });
    if (withSolid) {
        for (auto leaf = base.cbeginLeaf(); leaf; ++leaf) origins.push_back(leaf->origin());
        grids.solid = redistanced(sortedOnce(std::move(origins)), [&](const Coord& origin, float* values, float& tile) {
            return solidBlock(*all, base, touching, origin, values, tile);
        });
        if (touching)
            settleVolume(*grids.solid, volume + measureInside(base).volume, *all, base,
                         [&](float u, float b) { return within(b - u); });
    }
    all.reset();
    grids.ids = elementIds(grids.elements);
}

}  // namespace pavel
