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
    /// A block with 512 values. `active`: those that are not the background, outside or inside.
    void add(const Coord& origin, const WorkLeaf::NodeMaskType& active, const float* values);
    /// The same tree again; null where there is nothing. O(voxels of its leaves).
    WorkTree::Ptr tree() const;
    bool empty() const { return blocks_.empty(); }
    uint64_t activeVoxels() const { return values_.size(); }

  private:
    struct Block {
        Coord origin;
        WorkLeaf::NodeMaskType active, inside;
    };
    float background_ = 0;
    std::vector<Block> blocks_;
    std::vector<float> values_;  // active ones, block by block
};

/// The trees of all.
std::vector<WorkTree::Ptr> treesOf(const std::vector<CompactLevelSet>& compact);
/// Takes the trees out, leaving nothing behind.
std::vector<WorkTree::Ptr> takeTrees(std::vector<CompactLevelSet>& compact);
/// Puts them back.
std::vector<CompactLevelSet> putAway(std::vector<WorkTree::Ptr> trees);

}  // namespace pavel
