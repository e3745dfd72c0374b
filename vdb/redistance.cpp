#include "pavel/vdb/redistance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <deque>
#include <memory>

#include "pavel/vdb/distance_window.h"

namespace pavel {
namespace {

/// Largest window, in blocks a side; the outer layer is halo.
constexpr int kMostBlocks = 20;

/// One window's work: `size` blocks from `origin`, the halo not counted.
struct Part {
    Coord origin;
    std::array<int, 3> size;
};

/// Calls use(origin, values, mask of those in the band) for the part's blocks that hold any.
template <class Values, class Use>
void solvePart(const Part& part, float band, Values values, const Use& use) {
    static thread_local DistanceWindow window;  // scratch that would else be mapped anew for every element
    const std::array<int, 3> blocks{part.size[0] + 2, part.size[1] + 2, part.size[2] + 2};
    if (!window.load(part.origin.offsetBy(-8), blocks, band, band, values)) return;
    window.solve();
    float d[512];
    BlockMask near;
    for (int x = 1; x <= part.size[0]; ++x)
        for (int y = 1; y <= part.size[1]; ++y)
            for (int z = 1; z <= part.size[2]; ++z)
                if (window.read(x, y, z, d, near))
                    use(part.origin.offsetBy(8 * (x - 1), 8 * (y - 1), 8 * (z - 1)), d, near);
}

template <class Tree>
typename Tree::Ptr treeOf(const std::vector<std::vector<typename Tree::LeafNodeType*>>& leaves, float band) {
    auto tree = std::make_shared<Tree>(band);
    for (const auto& list : leaves)
        for (auto* leaf : list) tree->addLeaf(leaf);
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, band, -band, true, 1, kAboveLeaves);
    return tree;
}

/// A tree's blocks, for a window.
template <class Reader>
auto valuesOf(const Reader& reader) {
    return [&reader](const Coord& origin) {
        BlockValues f;
        if (const auto* leaf = reader.probeConstLeaf(origin))
            f.own = leaf->buffer().data();
        else
            f.tile = reader.getValue(origin);
        return f;
    };
}

/// Windows on a fixed lattice wherever there are blocks. makeValues() -> values, for one window.
template <class Tree, class MakeValues>
typename Tree::Ptr redistancedBlocks(const std::vector<Coord>& blocks, const MakeValues& makeValues) {
    using Leaf = typename Tree::LeafNodeType;
    constexpr int kBlocks = 8, kVoxels = 8 * kBlocks;
    std::vector<Coord> origins;
    const auto down = [](int v) { return v & ~(kVoxels - 1); };
    for (const Coord& block : blocks) {
        // The band reaches kResultBand beyond the block: into up to eight windows.
        const Coord lo = block.offsetBy(-4), hi = block.offsetBy(11);
        for (int x = down(lo[0]); x <= hi[0]; x += kVoxels)
            for (int y = down(lo[1]); y <= hi[1]; y += kVoxels)
                for (int z = down(lo[2]); z <= hi[2]; z += kVoxels) origins.emplace_back(x, y, z);
        if (origins.size() > 1000000) {
            std::sort(origins.begin(), origins.end());
            origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
        }
    }
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    std::vector<std::vector<Leaf*>> made(origins.size());
    tbb::parallel_for(size_t(0), origins.size(), [&](size_t k) {
        solvePart(Part{origins[k], {kBlocks, kBlocks, kBlocks}}, kResultBand, makeValues(),
                  [&](const Coord& origin, const float* d, const BlockMask& near) {
                      auto leaf = std::make_unique<Leaf>(origin, 0.f, false);
                      std::copy(d, d + 512, leaf->buffer().data());
                      leaf->setValueMask(nodeMask(near));
                      made[k].push_back(leaf.release());
                  });
    });
    return treeOf<Tree>(made, kResultBand);
}

template <class Tree>
typename Tree::Ptr redistancedTree(const Tree& raw) {
    std::vector<Coord> blocks;
    for (auto leaf = raw.cbeginLeaf(); leaf; ++leaf) blocks.push_back(leaf->origin());
    return redistancedBlocks<Tree>(blocks, [&] { return valuesOf(raw); });
}

}  // namespace

openvdb::FloatTree::Ptr widened(const openvdb::FloatTree& narrow, float outside, float inside) {
    constexpr float kGood = 2;  // nearer to the surface, values are taken over
    CoordBBox box;
    auto tree = std::make_shared<openvdb::FloatTree>(outside);
    if (!narrow.evalLeafBoundingBox(box)) return tree;
    const int reach = 8 * (int(outside) / 8 + 1);
    const Coord lo = box.min().offsetBy(-reach), hi = box.max().offsetBy(reach + 1);
    const std::array<int, 3> blocks{(hi[0] - lo[0]) / 8, (hi[1] - lo[1]) / 8, (hi[2] - lo[2]) / 8};
    const BaseReader reader(narrow);
    DistanceWindow window;
    if (!window.load(lo, blocks, outside, inside, valuesOf(reader))) return tree;
    window.solve();
    float d[512];
    BlockMask near;
    for (int x = 0; x < blocks[0]; ++x)
        for (int y = 0; y < blocks[1]; ++y)
            for (int z = 0; z < blocks[2]; ++z) {
                if (!window.read(x, y, z, d, near)) continue;
                auto leaf = std::make_unique<WorkLeaf>(lo.offsetBy(8 * x, 8 * y, 8 * z), outside, true);
                const auto* known = reader.probeConstLeaf(leaf->origin());
                float* values = leaf->buffer().data();
                for (int v = 0; v < 512; ++v) {
                    const bool good = known && std::abs(known->buffer().data()[v]) < kGood;
                    values[v] = std::clamp(good ? known->buffer().data()[v] : d[v], -inside, outside);
                }
                tree->addLeaf(leaf.release());
            }
    openvdb::tools::signedFloodFillWithValues(*tree, outside, -inside);
    return tree;
}

openvdb::FloatTree::Ptr redistanced(const openvdb::FloatTree& raw) {
    return redistancedTree(raw);
}

WorkTree::Ptr redistanced(const WorkTree& raw) {
    return redistancedTree(raw);
}

openvdb::FloatTree::Ptr redistanced(const std::vector<Coord>& blocks, const RawBlock& raw) {
    return redistancedBlocks<openvdb::FloatTree>(blocks, [&] {
        static thread_local std::deque<std::array<float, 512>> made;  // of one window
        return [&raw, used = size_t(0)](const Coord& origin) mutable {
            if (used == made.size()) made.emplace_back();
            BlockValues f;
            if (raw(origin, made[used].data(), f.tile)) f.own = made[used++].data();
            return f;
        };
    });
}

BlockLevelSet redistanced(const Region& raw, float band) {
    if (raw.size() == 0) return BlockLevelSet(CoordBBox(), band);
    // The band may leave the region's blocks by one; cut into equal parts that fit a window.
    const Coord lo = raw.numbers().lower().offsetBy(-8), hi = raw.numbers().upper().offsetBy(8);
    BlockLevelSet clean(CoordBBox(lo, hi), band);
    int count[3], parts[3];
    for (int k = 0; k < 3; ++k) {
        count[k] = (hi[k] - lo[k]) / 8 + 1;
        parts[k] = (count[k] + kMostBlocks - 3) / (kMostBlocks - 2);
    }
    std::vector<Part> list;
    const auto cut = [&](int k, int i) { return count[k] * i / parts[k]; };
    for (int x = 0; x < parts[0]; ++x)
        for (int y = 0; y < parts[1]; ++y)
            for (int z = 0; z < parts[2]; ++z)
                list.push_back({lo.offsetBy(8 * cut(0, x), 8 * cut(1, y), 8 * cut(2, z)),
                                {cut(0, x + 1) - cut(0, x), cut(1, y + 1) - cut(1, y), cut(2, z + 1) - cut(2, z)}});
    std::vector<BlockLevelSet::Blocks> made(list.size());
    tbb::parallel_for(size_t(0), list.size(), [&](size_t k) {
        const auto values = [&](const Coord& origin) {
            BlockValues f;
            const int b = raw.at(origin);
            if (b >= 0)
                f.own = raw.own(b), f.clip = raw.clip(b);
            else
                f.tile = b == Region::kInside ? -kBand : kBand;
            return f;
        };
        solvePart(list[k], band, values,
                  [&](const Coord& origin, const float* d, const BlockMask& near) { made[k].add(origin, d, near); });
    });
    for (auto& blocks : made) clean.add(std::move(blocks));
    forEachBlock(CoordBBox(lo, hi), [&](const Coord& origin) {
        if (clean.numbers().at(origin) >= 0) return;
        // Away from the band a block is of one sign.
        const int b = raw.at(origin);
        if (b == Region::kInside || (b >= 0 && raw.own(b)[0] < 0 && raw.clip(b)[0] < 0)) clean.fill(origin);
    });
    return clean;
}

}  // namespace pavel
