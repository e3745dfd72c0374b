#include "pavel/vdb/sweep.h"

#include <algorithm>
#include <numeric>

namespace pavel {

std::vector<int> sweepOrder(const std::vector<WorkElement>& elements) {
    CoordBBox all;
    for (const WorkElement& e : elements) all.expand(e.box);
    const size_t axis = all.empty() ? 0 : all.maxExtent();
    std::vector<int> order(elements.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return elements[size_t(a)].centre[axis] < elements[size_t(b)].centre[axis]; });
    return order;
}

}  // namespace pavel
