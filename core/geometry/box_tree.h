// A tree of boxes, by which the boxes that something meets are found.
#ifndef WELLSPACE_CORE_GEOMETRY_BOX_TREE_H_
#define WELLSPACE_CORE_GEOMETRY_BOX_TREE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"

namespace wellspace::core {

// A binary tree over boxes: the boxes of a node are halved at the middle of their centres, along the longest side of
// the box that holds them.
//
// Thread safety: thread-compatible; const functions may run at once.
template <int D>
class BoxTree {
 public:
  BoxTree() = default;
  // As Build, in a run that is never ended.
  explicit BoxTree(std::vector<Box<D>> boxes) { Build(std::move(boxes), RunContext()).IgnoreError(); }

  // Complexity: O(n log n).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(std::vector<Box<D>> boxes, const RunContext& context) {
    boxes_ = std::move(boxes);
    order_.resize(boxes_.size());
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.clear();
    nodes_.reserve(2 * (boxes_.size() / kLeaf + 1));
    return boxes_.empty() ? absl::OkStatus() : Split(0, static_cast<uint32_t>(boxes_.size()), context);
  }

  // Calls visit(i) for every box for which meets(box) is true, or until visit returns false. `meets` is true of a box
  // that holds another of which it is true, but may grow stricter on the way.
  //
  // Complexity: O(n^(1 - 1/D) + k) for most queries.
  template <typename Meets, typename Visit>
  void ForEach(const Meets& meets, const Visit& visit) const {
    for (uint32_t node = 0; node < nodes_.size();) {
      if (!meets(nodes_[node].box)) {
        node = nodes_[node].next;
        continue;
      }
      for (uint32_t i = nodes_[node].begin; i < nodes_[node].end; ++i) {
        if (meets(boxes_[order_[i]]) && !GoesOn(visit, order_[i])) {
          return;
        }
      }
      ++node;
    }
  }

  bool IsEmpty() const { return boxes_.empty(); }
  // The hull of all boxes. REQUIRES: there is one.
  const Box<D>& Hull() const { return nodes_[0].box; }

  // The memory of a tree over so many boxes. Unit: bytes.
  static uint64_t Bytes(uint64_t boxes) {
    return boxes * (sizeof(Box<D>) + sizeof(uint32_t)) + 2 * (boxes / kLeaf + 1) * sizeof(Node);
  }

 private:
  static constexpr uint32_t kLeaf = 8;

  struct Node {
    Box<D> box;
    uint32_t begin = 0;  // of a leaf, in order_; else both are 0
    uint32_t end = 0;
    uint32_t next = 0;  // the node behind its subtree
  };

  template <typename Visit>
  static bool GoesOn(const Visit& visit, uint32_t i) {
    if constexpr (std::is_void_v<decltype(visit(i))>) {
      visit(i);
      return true;
    } else {
      return visit(i);
    }
  }

  absl::Status Split(uint32_t begin, uint32_t end, const RunContext& context) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const auto node = static_cast<uint32_t>(nodes_.size());
    nodes_.push_back({.box = boxes_[order_[begin]]});
    for (uint32_t i = begin + 1; i < end; ++i) {
      nodes_[node].box.Include(boxes_[order_[i]]);
    }
    if (end - begin <= kLeaf) {
      nodes_[node].begin = begin;
      nodes_[node].end = end;
    } else {
      const Box<D>& box = nodes_[node].box;
      int longest = 0;
      for (int axis = 1; axis < D; ++axis) {
        longest = box.high[axis] - box.low[axis] > box.high[longest] - box.low[longest] ? axis : longest;
      }
      const uint32_t middle = begin + (end - begin) / 2;
      std::nth_element(
          order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](uint32_t i, uint32_t k) {
            return boxes_[i].low[longest] + boxes_[i].high[longest] < boxes_[k].low[longest] + boxes_[k].high[longest];
          });
      WELLSPACE_RETURN_IF_ERROR(Split(begin, middle, context));
      WELLSPACE_RETURN_IF_ERROR(Split(middle, end, context));
    }
    nodes_[node].next = static_cast<uint32_t>(nodes_.size());
    return absl::OkStatus();
  }

  std::vector<Box<D>> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;  // each before its subtree
};

// `box`, wider by `room` on every side.
template <int D>
Box<D> Widened(Box<D> box, double room) {
  for (int axis = 0; axis < D; ++axis) {
    box.low[axis] -= room;
    box.high[axis] += room;
  }
  return box;
}

// Whether a place of the box is within `reach` of `p`.
template <int D>
auto WithinReachOf(const Point<D>& p, double reach) {
  return [p, reach](const Box<D>& box) { return DistanceSq<D>(p, box) <= reach * reach; };
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_BOX_TREE_H_
