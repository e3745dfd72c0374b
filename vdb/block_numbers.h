#pragma once
// Which block is where, without a search.
#include <vector>

#include "pavel/vdb/grid.h"

namespace pavel {

/// Numbers of the blocks in a box.
class BlockNumbers {
  public:
    static constexpr int kOutside = -1, kInside = -2;

    BlockNumbers() = default;
    /// All outside. @param box voxels that blocks may cover
    explicit BlockNumbers(const CoordBBox& box);
    /// Number of the block at a leaf origin, or kOutside, kInside.
    int at(const Coord& origin) const {
        const int i = index(origin);
        return i < 0 ? kOutside : numbers_[size_t(i)];
    }
    bool holds(const Coord& origin) const { return index(origin) >= 0; }
    void set(const Coord& origin, int number) { numbers_[size_t(index(origin))] = number; }
    /// Leaf origins of the first and last blocks that may exist.
    const Coord& lower() const { return lower_; }
    Coord upper() const { return lower_ + Coord(8 * (count_[0] - 1), 8 * (count_[1] - 1), 8 * (count_[2] - 1)); }

  private:
    int index(const Coord& origin) const;
    Coord lower_;
    int count_[3] = {};
    std::vector<int> numbers_;
};

}  // namespace pavel
