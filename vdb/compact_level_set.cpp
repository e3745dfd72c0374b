#include "pavel/vdb/compact_level_set.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

#include "pavel/vdb/pieces.h"

namespace pavel {

CompactLevelSet::CompactLevelSet(const WorkTree& tree)
    : CompactLevelSet(tree.background(), tree.leafCount(), tree.activeLeafVoxelCount()) {
    std::vector<const WorkLeaf*> leaves;
    tree.getNodes(leaves);
    std::sort(leaves.begin(), leaves.end(),
              [](const WorkLeaf* a, const WorkLeaf* b) { return a->origin() < b->origin(); });
    for (const WorkLeaf* leaf : leaves) add(leaf->origin(), leaf->getValueMask(), leaf->buffer().data());
}

CompactLevelSet::CompactLevelSet(float background, size_t blocks, size_t activeVoxels) : background_(background) {
    blocks_.reserve(blocks);
    values_.reserve(activeVoxels);
}

void CompactLevelSet::add(const Coord& origin, const WorkLeaf::NodeMaskType& active, const float* values) {
    assert(blocks_.empty() || blocks_.back().origin < origin);
    Block& block = blocks_.emplace_back();
    block.first = uint32_t(values_.size());
    block.origin = origin;
    block.active = active;
    block.inside = nodeMask(negativeMask(values));
    for (auto on = active.beginOn(); on; ++on) values_.push_back(values[on.pos()]);
}

void CompactLevelSet::expand(const Block& block, float* values) const {
    std::fill(values, values + 512, background_);
    for (auto in = block.inside.beginOn(); in; ++in) values[in.pos()] = -background_;
    const float* next = &values_[block.first];
    for (auto on = block.active.beginOn(); on; ++on) values[on.pos()] = *next++;
}

bool CompactLevelSet::read(const Coord& origin, float* values, float& tile) const {
    const auto after = std::upper_bound(blocks_.begin(), blocks_.end(), origin,
                                        [](const Coord& o, const Block& block) { return o < block.origin; });
    tile = background_;
    if (after == blocks_.begin()) return false;
    const Block& last = *(after - 1);
    if (last.origin == origin) {
        expand(last, values);
        return true;
    }
    if (last.origin[0] == origin[0] && last.origin[1] == origin[1] && goesOnInside(last)) tile = -background_;
    return false;
}

CoordBBox CompactLevelSet::box() const {
    CoordBBox box;
    for (const Block& block : blocks_) box.expand(CoordBBox(block.origin, block.origin.offsetBy(7)));
    return box;
}

WorkTree::Ptr CompactLevelSet::tree() const {
    if (empty()) return nullptr;
    auto tree = std::make_shared<WorkTree>(background_);
    for (const Block& block : blocks_) {
        auto leaf = std::make_unique<WorkLeaf>(block.origin, background_, false);
        expand(block, leaf->buffer().data());
        leaf->setValueMask(block.active);
        tree->addLeaf(leaf.release());
    }
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, background_, -background_, true, 1, kAboveLeaves);
    return tree;
}

std::vector<CoordBBox> boxesOf(const std::vector<const CompactLevelSet*>& sets) {
    std::vector<CoordBBox> boxes(sets.size());
    for (size_t i = 0; i < sets.size(); ++i) boxes[i] = sets[i]->box();
    return boxes;
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
