#include "pavel/vdb/element_index.h"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>

namespace pavel {
namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;
using Point = bg::model::point<int, 3, bg::cs::cartesian>;
using Box = bg::model::box<Point>;

namespace {
Box boxOf(const CoordBBox& b) {
    return {{b.min()[0], b.min()[1], b.min()[2]}, {b.max()[0], b.max()[1], b.max()[2]}};
}
}  // namespace

struct ElementIndex::Tree {
    bgi::rtree<std::pair<Box, int>, bgi::linear<16>> boxes;
};

ElementIndex::ElementIndex(const std::vector<CoordBBox>& elements) : tree_(std::make_unique<Tree>()) {
    std::vector<std::pair<Box, int>> boxes;
    for (size_t i = 0; i < elements.size(); ++i)
        if (!elements[i].empty()) boxes.emplace_back(boxOf(elements[i]), int(i));
    tree_->boxes = decltype(tree_->boxes)(boxes);
}
ElementIndex::~ElementIndex() = default;
ElementIndex::ElementIndex(ElementIndex&&) noexcept = default;

std::vector<int> ElementIndex::meeting(const CoordBBox& box) const {
    std::vector<int> result;
    if (box.empty()) return result;
    for (auto it = tree_->boxes.qbegin(bgi::intersects(boxOf(box))); it != tree_->boxes.qend(); ++it)
        result.push_back(it->second);
    std::sort(result.begin(), result.end());
    return result;
}

}  // namespace pavel
