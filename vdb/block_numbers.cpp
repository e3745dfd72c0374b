#include "pavel/vdb/block_numbers.h"

namespace pavel {

BlockBox::BlockBox(const CoordBBox& box) : lower_(box.empty() ? Coord(0) : leafOrigin(box.min())) {
    const Coord hi = leafOrigin(box.max());
    for (int k = 0; k < 3; ++k) count_[k] = box.empty() ? 0 : (hi[k] - lower_[k]) / 8 + 1;
}

std::array<int, 6> BlockNumbers::beside(const Coord& origin) const {
    std::array<int, 6> numbers;
    for (int side = 0; side < 6; ++side) {
        Coord c = origin;
        c[side / 2] += side % 2 ? 8 : -8;
        numbers[size_t(side)] = at(c);
    }
    return numbers;
}

}  // namespace pavel
