#pragma once
#include <memory>

#include "pavel/vdb/element.h"

namespace pavel {

/// Which elements' boxes meet a box: an R-tree. Empty boxes meet nothing.
class ElementIndex {
  public:
    explicit ElementIndex(const std::vector<CoordBBox>& boxes);
    ~ElementIndex();
    ElementIndex(ElementIndex&&) noexcept;
    /// Indices, ascending. O(log n + found).
    std::vector<int> meeting(const CoordBBox& box) const;

  private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

}  // namespace pavel
