// Sets of numbers that are joined.
#ifndef WELLSPACE_CORE_FEATURES_UNION_FIND_H_
#define WELLSPACE_CORE_FEATURES_UNION_FIND_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace wellspace::core {

// Thread safety: thread-compatible.
// Invariants: the least number of a set stands for it, in whatever order sets were joined.
class UnionFind {
 public:
  // The sets {0}, …, {count - 1}.
  explicit UnionFind(size_t count = 0) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  size_t size() const { return parent_.size(); }
  // Adds one more set, and returns its number, which is the next.
  uint32_t Add() {
    parent_.push_back(static_cast<uint32_t>(parent_.size()));
    return parent_.back();
  }

  // The number that stands for the set of `i`.
  //
  // Complexity: O(log n), amortised.
  uint32_t Find(uint32_t i) {
    while (parent_[i] != i) {
      i = parent_[i] = parent_[parent_[i]];
    }
    return i;
  }
  // The lower number stands for both.
  void Join(uint32_t i, uint32_t j) {
    i = Find(i);
    j = Find(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_UNION_FIND_H_
