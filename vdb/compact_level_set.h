#pragma once
// A finished level set at rest, in half the memory.
#include <vector>

#include "pavel/vdb/grid.h"

namespace pavel {

/// Keeps a level set's active values, and masks for the rest, which are all plus or minus the background. Lossless.
class CompactLevelSet {
  public:
    /// Nothing: of an element that was swallowed.
    CompactLevelSet() = default;
    /// @param tree tiles and inactive values are the background outside and minus it inside, as signed flood filling
    /// leaves them
    explicit CompactLevelSet(const WorkTree& tree);
    /// Room for blocks to come.
    CompactLevelSet(float background, size_t blocks, size_t activeVoxels);
    /// A block with 512 values, beyond those before it (x slowest). `active`: those that are not the background,
    /// outside or inside.
    void add(const Coord& origin, const WorkLeaf::NodeMaskType& active, const float* values);
    /// The same tree again; null where there is nothing. O(voxels of its leaves).
    WorkTree::Ptr tree() const;
    /// The 512 values of a block, and true; or false where there is none, and the background that stands for all of
    /// them, outside or inside. O(log blocks).
    bool read(const Coord& origin, float* values, float& tile) const;
    /// Calls f(origin) for all blocks, in order.
    template <class F>
    void forEachBlock(F f) const {
        for (const Block& block : blocks_) f(block.origin);
    }
    /// Calls f(first voxel, last voxel) for boxes of blocks' size or rows of them that lie inside and are not blocks.
    template <class F>
    void forEachFilled(F f) const {
        for (size_t k = 1; k < blocks_.size(); ++k) {
            const Coord from = blocks_[k - 1].origin.offsetBy(0, 0, 8), &to = blocks_[k].origin;
            if (from[0] == to[0] && from[1] == to[1] && from[2] < to[2] && goesOnInside(blocks_[k - 1]))
                f(from, Coord(to[0] + 7, to[1] + 7, to[2] - 1));
        }
    }
    /// Around all blocks; empty where there is none.
    CoordBBox box() const;
    bool empty() const { return blocks_.empty(); }
    uint64_t activeVoxels() const { return values_.size(); }

  private:
    struct Block {
        Coord origin;
        WorkLeaf::NodeMaskType active, inside;
        uint32_t first;  // of its values
    };
    /// Is what lies beyond a block along z, if it is no block, inside? As the voxel beside it is.
    static bool goesOnInside(const Block& block) { return block.inside.isOn(7); }
    void expand(const Block& block, float* values) const;
    float background_ = 0;
    std::vector<Block> blocks_;  // x slowest
    std::vector<float> values_;  // active ones, block by block
};

/// The boxes of all, in order.
std::vector<CoordBBox> boxesOf(const std::vector<const CompactLevelSet*>& sets);
/// The trees of all.
std::vector<WorkTree::Ptr> treesOf(const std::vector<CompactLevelSet>& compact);
/// Takes the trees out, leaving nothing behind.
std::vector<WorkTree::Ptr> takeTrees(std::vector<CompactLevelSet>& compact);
/// Puts them back.
std::vector<CompactLevelSet> putAway(std::vector<WorkTree::Ptr> trees);

}  // namespace pavel
