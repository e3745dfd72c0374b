#pragma once
// Which block is where, without a search.
#include <algorithm>
#include <array>
#include <vector>

#include "pavel/vdb/grid.h"

namespace pavel {

/// The leaf-sized blocks of a box, counted x slowest.
class BlockBox {
  public:
    BlockBox() = default;
    /// @param box voxels that the blocks cover
    explicit BlockBox(const CoordBBox& box);
    /// Which one lies at a leaf origin; negative outside the box.
    int index(const Coord& origin) const {
        const unsigned x = unsigned((origin[0] - lower_[0]) >> 3), y = unsigned((origin[1] - lower_[1]) >> 3),
                       z = unsigned((origin[2] - lower_[2]) >> 3);
        if (x >= unsigned(count_[0]) || y >= unsigned(count_[1]) || z >= unsigned(count_[2])) return -1;
        return (int(x) * count_[1] + int(y)) * count_[2] + int(z);
    }
    size_t size() const { return size_t(count_[0]) * size_t(count_[1]) * size_t(count_[2]); }
    /// Leaf origins of the first and last blocks.
    const Coord& lower() const { return lower_; }
    Coord upper() const { return lower_ + Coord(8 * (count_[0] - 1), 8 * (count_[1] - 1), 8 * (count_[2] - 1)); }

  private:
    Coord lower_;
    int count_[3] = {};
};

/// Numbers of the blocks in a box.
class BlockNumbers {
  public:
    static constexpr int kOutside = -1, kInside = -2;

    BlockNumbers() = default;
    /// All outside. @param box voxels that blocks may cover
    explicit BlockNumbers(const CoordBBox& box) : box_(box), numbers_(box_.size(), kOutside) {}
    /// Number of the block at a leaf origin, or kOutside, kInside.
    int at(const Coord& origin) const {
        const int i = box_.index(origin);
        return i < 0 ? kOutside : numbers_[size_t(i)];
    }
    /// Of the blocks at the faces -x +x -y +y -z +z of one.
    std::array<int, 6> beside(const Coord& origin) const;
    bool holds(const Coord& origin) const { return box_.index(origin) >= 0; }
    /// How many have a number or state.
    size_t count(int number) const { return size_t(std::count(numbers_.begin(), numbers_.end(), number)); }
    void set(const Coord& origin, int number) { numbers_[size_t(box_.index(origin))] = number; }
    /// Leaf origins of the first and last blocks that may exist.
    const Coord& lower() const { return box_.lower(); }
    Coord upper() const { return box_.upper(); }

  private:
    BlockBox box_;
    std::vector<int> numbers_;
};

}  // namespace pavel
