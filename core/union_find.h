#pragma once
#include <numeric>
#include <vector>

namespace pavel {

/// Disjoint sets of 0..n-1, with path halving.
class UnionFind {
  public:
    explicit UnionFind(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
    int find(int i) {
        while (parent_[size_t(i)] != i) i = parent_[size_t(i)] = parent_[size_t(parent_[size_t(i)])];
        return i;
    }
    void join(int a, int b) { parent_[size_t(find(a))] = find(b); }

  private:
    std::vector<int> parent_;
};

}  // namespace pavel
