#include "pavel/vdb/compact_level_set.h"

#include <tbb/parallel_for.h>

#include "pavel/vdb/pieces.h"

namespace pavel {

CompactLevelSet::CompactLevelSet(const WorkTree& tree)
    : CompactLevelSet(tree.background(), tree.leafCount(), tree.activeLeafVoxelCount()) {
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) add(leaf->origin(), leaf->getValueMask(), leaf->buffer().data());
}

CompactLevelSet::CompactLevelSet(float background, size_t blocks, size_t activeVoxels) : background_(background) {
    blocks_.reserve(blocks);
    values_.reserve(activeVoxels);
}

void CompactLevelSet::add(const Coord& origin, const WorkLeaf::NodeMaskType& active, const float* values) {
    Block& block = blocks_.emplace_back();
    block.origin = origin;
    block.active = active;
    block.inside = nodeMask(negativeMask(values));
    for (auto on = active.beginOn(); on; ++on) values_.push_back(values[on.pos()]);
}

WorkTree::Ptr CompactLevelSet::tree() const {
    if (empty()) return nullptr;
    auto tree = std::make_shared<WorkTree>(background_);
    const float* next = values_.data();
    for (const Block& block : blocks_) {
        auto leaf = std::make_unique<WorkLeaf>(block.origin, background_, false);
        float* values = leaf->buffer().data();
        for (auto in = block.inside.beginOn(); in; ++in) values[in.pos()] = -background_;
        for (auto on = block.active.beginOn(); on; ++on) values[on.pos()] = *next++;
        leaf->setValueMask(block.active);
        tree->addLeaf(leaf.release());
    }
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, background_, -background_, true, 1, kAboveLeaves);
    return tree;
}

std::vector<WorkTree::Ptr> treesOf(const std::vector<CompactLevelSet>& compact) {
    std::vector<WorkTree::Ptr> trees(compact.size());
    tbb::parallel_for(size_t(0), compact.size(), [&](size_t i) { trees[i] = compact[i].tree(); });
    return trees;
}

std::vector<WorkTree::Ptr> takeTrees(std::vector<CompactLevelSet>& compact) {
    std::vector<WorkTree::Ptr> trees(compact.size());
    tbb::parallel_for(size_t(0), compact.size(), [&](size_t i) {
        trees[i] = compact[i].tree();
        compact[i] = CompactLevelSet();
    });
    return trees;
}

std::vector<CompactLevelSet> putAway(std::vector<WorkTree::Ptr> trees) {
    std::vector<CompactLevelSet> compact(trees.size());
    tbb::parallel_for(size_t(0), trees.size(), [&](size_t i) {
        if (trees[i]) compact[i] = CompactLevelSet(*trees[i]);
        trees[i].reset();
    });
    return compact;
}

}  // namespace pavel
