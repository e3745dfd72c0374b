#include "pavel/vdb/compact_level_set.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "pavel/vdb/pieces.h"

namespace pavel {
namespace {

CoordBBox leafBox(const WorkTree& tree) {
    CoordBBox box;
    tree.evalLeafBoundingBox(box);
    return box;
}

/// The background on both sides of a mask's word.
PAVEL_WIDE void fillSides(uint64_t inside, float background, float* values) {
    for (int row = 0; row < 64; row += 8) {
        const unsigned bits = unsigned(inside >> row) & 255;
        PAVEL_ROLLED
        for (unsigned z = 0; z < 8; ++z) values[row + int(z)] = bits >> z & 1 ? -background : background;
    }
}

}  // namespace

CompactLevelSet::CompactLevelSet(const WorkTree& tree)
    : CompactLevelSet(tree.background(), leafBox(tree), tree.leafCount(), tree.activeLeafVoxelCount()) {
    if (const CoordBBox box = leafBox(tree); !box.empty())
        forEachBlock(box, [&](const Coord& origin) {
            if (const WorkLeaf* leaf = tree.probeConstLeaf(origin))
                add(origin, leaf->getValueMask(), leaf->buffer().data());
            else if (tree.getValue(origin) < 0)
                fill(origin);
        });
}

CompactLevelSet::CompactLevelSet(float background, const CoordBBox& box, size_t blocks, size_t activeVoxels)
    : background_(background), numbers_(box) {
    blocks_.reserve(blocks);
    values_.reserve(activeVoxels);
}

void CompactLevelSet::add(const Coord& origin, const VoxelMask& active, const float* values) {
    numbers_.set(origin, int(blocks_.size()));
    Block& block = blocks_.emplace_back();
    block.first = uint32_t(values_.size());
    block.origin = origin;
    block.active = active;
    block.inside = nodeMask(negativeMask(values));
    for (int word = 0; word < 8; ++word) {
        block.before[word] = uint16_t(values_.size() - block.first);
        for (uint64_t on = active.getWord<uint64_t>(openvdb::Index(word)); on; on &= on - 1)
            values_.push_back(values[64 * word + __builtin_ctzll(on)]);
    }
}

void CompactLevelSet::read(int number, float* values) const {
    if (number < 0) {
        std::fill(values, values + 512, number == kInside ? -background_ : background_);
        return;
    }
    const Block& block = blocks_[size_t(number)];
    const float* next = values_.data() + block.first;
    for (int word = 0; word < 8; ++word, values += 64) {
        const uint64_t active = block.active.getWord<uint64_t>(openvdb::Index(word)),
                       inside = block.inside.getWord<uint64_t>(openvdb::Index(word));
        if (~active != 0) fillSides(inside, background_, values);
        for (uint64_t on = active; on; on &= on - 1) values[__builtin_ctzll(on)] = *next++;
    }
}

CoordBBox CompactLevelSet::box() const {
    CoordBBox box;
    for (const Block& block : blocks_) box.expand(CoordBBox(block.origin, block.origin.offsetBy(7)));
    return box;
}

WorkTree::Ptr CompactLevelSet::tree() const {
    if (empty()) return nullptr;
    auto tree = std::make_shared<WorkTree>(background_);
    for (size_t k = 0; k < blocks_.size(); ++k) {
        auto leaf = std::make_unique<WorkLeaf>(blocks_[k].origin, background_, false);
        read(int(k), leaf->buffer().data());
        leaf->setValueMask(blocks_[k].active);
        tree->addLeaf(leaf.release());
    }
    constexpr openvdb::Index kAboveLeaves = 1;
    openvdb::tools::signedFloodFillWithValues(*tree, background_, -background_, true, 1, kAboveLeaves);
    return tree;
}

CompactReader::CompactReader(const CompactLevelSet& of) : of_(&of), spread_(of.size(), nullptr) {
    values_->reserve(512 * of.size());  // so that values stay where they are
}

const float* CompactReader::spread(int block) const {
    const size_t from = values_->size();
    values_->resize(from + 512);
    float* values = values_->data() + from;
    of_->read(block, values);
    return spread_[size_t(block)] = values;
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
