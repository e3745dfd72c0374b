#pragma once
// A level set at rest, in a quarter of the memory.
#include <vector>

#include "pavel/vdb/block_numbers.h"
#include "pavel/vdb/scratch.h"
#include "pavel/vdb/voxel_mask.h"

namespace pavel {

/// Keeps a level set's active values in 16 bits each, steps of 1e-4 voxels in a band of 3, and masks for the rest,
/// which are all plus or minus the background. Signs stay as they are; what is read once and put away again stays
/// equal.
class CompactLevelSet {
  public:
    using ValueType = float;
    static constexpr int kOutside = BlockNumbers::kOutside, kInside = BlockNumbers::kInside;

    /// Nothing: of an element that was swallowed.
    CompactLevelSet() = default;
    /// @param tree tiles and inactive values are the background outside and minus it inside, as signed flood filling
    /// leaves them
    explicit CompactLevelSet(const WorkTree& tree);
    /// Room for blocks to come. @param box voxels that they may cover
    CompactLevelSet(float background, const CoordBBox& box, size_t blocks, size_t activeVoxels);
    /// A block with 512 values. `active`: those that are not the background, outside or inside.
    void add(const Coord& origin, const VoxelMask& active, const float* values);
    /// A block that lies inside.
    void fill(const Coord& origin) { numbers_.set(origin, kInside); }
    /// The tree again; null where there is nothing. O(voxels of its leaves).
    WorkTree::Ptr tree() const;

    /// Number of the block at a leaf origin, or kOutside, kInside.
    int at(const Coord& origin) const { return numbers_.at(origin); }
    /// The 512 values of a block by its number, or those of all outside, all inside.
    void read(int block, float* values) const;
    /// One of them. O(1), but dearer than one of many: see CompactReader.
    float value(int block, int v) const {
        if (block < 0) return block == kInside ? -background_ : background_;
        return blocks_[size_t(block)].value(v, values_.data(), background_, step());
    }
    float getValue(const Coord& c) const { return value(at(leafOrigin(c)), int(WorkLeaf::coordToOffset(c))); }
    float background() const { return background_; }

    const Coord& origin(int block) const { return blocks_[size_t(block)].origin; }
    const VoxelMask& active(int block) const { return blocks_[size_t(block)].active; }
    size_t size() const { return blocks_.size(); }
    const BlockNumbers& numbers() const { return numbers_; }
    /// Calls f(first voxel, last voxel) for rows of blocks' size that lie inside and are not blocks.
    template <class F>
    void forEachFilled(F f) const {
        const Coord &lo = numbers_.lower(), hi = numbers_.upper();
        for (int x = lo[0]; x <= hi[0]; x += 8)
            for (int y = lo[1]; y <= hi[1]; y += 8)
                for (int z = lo[2], from = z; z <= hi[2]; from = z += 8) {
                    while (at({x, y, z}) == kInside) z += 8;
                    if (z > from) f(Coord(x, y, from), Coord(x + 7, y + 7, z - 1));
                }
    }
    /// Around all blocks; empty where there is none.
    CoordBBox box() const;
    bool empty() const { return blocks_.empty(); }
    uint64_t activeVoxels() const { return values_.empty() ? 0 : values_.size() - kPad; }

  private:
    struct Block {
        Coord origin;
        VoxelMask active, inside;
        uint32_t first;      // of its values
        uint16_t before[8];  // how many of them come before those of a mask's word
        float value(int v, const int16_t* values, float background, float step) const;
    };
    float step() const { return background_ / 32767; }
    float background_ = kResultBand;
    BlockNumbers numbers_;
    std::vector<Block> blocks_;
    static constexpr size_t kPad = 8;  // so that rows of eight can be read at the end, too
    std::vector<int16_t> values_;      // active ones in steps, block by block, and the pad
};

inline float CompactLevelSet::Block::value(int v, const int16_t* values, float background, float step) const {
    const int word = v >> 6, bit = v & 63;
    const uint64_t on = active.getWord<uint64_t>(openvdb::Index(word));
    if (on >> bit & 1)
        return step *
               float(values[first + before[word] + unsigned(__builtin_popcountll(on & ((uint64_t(1) << bit) - 1)))]);
    return inside.isOn(openvdb::Index(v)) ? -background : background;
}

/// Reads one level set in many places: a block is spread out when it is first asked for. For one thread.
class CompactReader {
  public:
    using ValueType = float;
    /// The level set must outlive it unchanged.
    explicit CompactReader(const CompactLevelSet& of);
    /// The 512 values of the block at a leaf origin; null where it lies all outside or inside.
    const float* probe(const Coord& origin) const {
        const int block = of_->at(origin);
        return block < 0 ? nullptr : spread_[size_t(block)] ? spread_[size_t(block)] : spread(block);
    }
    float getValue(const Coord& c) const {
        const int block = of_->at(leafOrigin(c));
        if (block < 0) return of_->value(block, 0);
        const float* known = spread_[size_t(block)];
        return (known ? known : spread(block))[WorkLeaf::coordToOffset(c)];
    }

  private:
    const float* spread(int block) const;
    const CompactLevelSet* of_;
    mutable std::vector<const float*> spread_;  // by block; null until asked for
    mutable Scratch values_;
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
