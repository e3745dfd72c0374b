#include "pavel/vdb/compact_level_set.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "pavel/vdb/pieces.h"

namespace pavel {
namespace {

CoordBBox leafBox(const WorkTree& tree) {
    CoordBBox box;
    for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)  // those without active voxels, too
        box.expand(CoordBBox(leaf->origin(), leaf->origin().offsetBy(7)));
    return box;
}

/// For each row of a mask, which of the values that follow each other lies at which of its bits.
struct Ranks {
    int32_t rank[256][8];
    constexpr Ranks() : rank() {
        for (int mask = 0; mask < 256; ++mask)
            for (int z = 0, n = 0; z < 8; ++z)
                if (mask >> z & 1) rank[mask][z] = n++;
    }
};
constexpr Ranks kRanks;

// A shuffle is one instruction with wide registers, but the compiler makes it of no loop.
typedef float Row __attribute__((vector_size(32)));
typedef int32_t RowBits __attribute__((vector_size(32)));
typedef int16_t RowSteps __attribute__((vector_size(16)));
[[gnu::always_inline]] inline void shuffle(Row& row, const RowBits& at) {
#if defined(__clang__)
    const Row from = row;
    for (int z = 0; z < 8; ++z) row[z] = from[at[z]];
#else
    row = __builtin_shuffle(row, at);
#endif
}

/// A block's 512 values from its active ones, a row at a time. Reads up to eight values on from the last.
PAVEL_WIDE void spreadRows(const uint64_t* active, const uint64_t* inside, float background, float step,
                           const int16_t* next, float* out) {
    const RowBits bits{1, 2, 4, 8, 16, 32, 64, 128};
    const Row outside = background - Row{}, within = -outside;
    for (int row = 0; row < 64; ++row, out += 8) {
        const int on = int(active[row >> 3] >> 8 * (row & 7)) & 255, in = int(inside[row >> 3] >> 8 * (row & 7)) & 255;
        RowSteps steps;
        RowBits ranks;
        std::memcpy(&steps, next, sizeof steps);
        std::memcpy(&ranks, kRanks.rank[on], sizeof ranks);
        Row known = __builtin_convertvector(steps, Row) * step;
        shuffle(known, ranks);
        const Row side = (bits & in) != 0 ? within : outside, values = (bits & on) != 0 ? known : side;
        std::memcpy(out, &values, sizeof values);
        next += __builtin_popcount(unsigned(on));
    }
}

/// The nearest steps of a block's values, within the background; never zero, which would be no side at all.
PAVEL_WIDE void inSteps(const float* values, float perVoxel, int16_t* out) {
    PAVEL_ROLLED
    for (int v = 0; v < 512; ++v) {
        const float size = std::abs(values[v]) * perVoxel + 0.5f, least = size > 1 ? size : 1,
                    kept = least < 32766 ? least : 32766;
        const int steps = int(kept);
        out[v] = int16_t(values[v] < 0 ? -steps : steps);
    }
}

}  // namespace

CompactLevelSet::CompactLevelSet(const WorkTree& tree)
    : CompactLevelSet(tree.background(), leafBox(tree), tree.leafCount(), tree.activeLeafVoxelCount()) {
    forEachBlock(CoordBBox(numbers_.lower(), numbers_.upper()), [&](const Coord& origin) {
        if (const WorkLeaf* leaf = tree.probeConstLeaf(origin))
            add(origin, leaf->getValueMask(), leaf->buffer().data());
        else if (tree.getValue(origin) < 0)
            fill(origin);
    });
}

CompactLevelSet::CompactLevelSet(float background, const CoordBBox& box, size_t blocks, size_t activeVoxels)
    : background_(background), numbers_(box) {
    blocks_.reserve(blocks);
    values_.reserve(activeVoxels + kPad);
    values_.resize(kPad);
}

void CompactLevelSet::add(const Coord& origin, const VoxelMask& active, const float* values) {
    numbers_.set(origin, int(blocks_.size()));
    Block& block = blocks_.emplace_back();
    block.first = uint32_t(activeVoxels());
    block.origin = origin;
    block.active = active;
    block.inside = nodeMask(negativeMask(values));
    values_.resize(values_.size() + active.countOn());
    int16_t *const first = values_.data() + block.first, *next = first;
    int16_t steps[512];
    inSteps(values, 1 / step(), steps);
    for (int word = 0; word < 8; ++word) {
        block.before[word] = uint16_t(next - first);
        for (uint64_t on = active.getWord<uint64_t>(openvdb::Index(word)); on; on &= on - 1)
            *next++ = steps[64 * word + __builtin_ctzll(on)];
    }
}

void CompactLevelSet::read(int number, float* values) const {
    if (number < 0) {
        std::fill(values, values + 512, number == kInside ? -background_ : background_);
        return;
    }
    const Block& block = blocks_[size_t(number)];
    uint64_t active[8], inside[8];
    for (int word = 0; word < 8; ++word) {
        active[word] = block.active.getWord<uint64_t>(openvdb::Index(word));
        inside[word] = block.inside.getWord<uint64_t>(openvdb::Index(word));
    }
    spreadRows(active, inside, background_, step(), values_.data() + block.first, values);
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
