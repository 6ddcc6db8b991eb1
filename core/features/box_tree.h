// Boxes in space, of which those that a line or another box meets are found.
#ifndef WELLSPACE_CORE_FEATURES_BOX_TREE_H_
#define WELLSPACE_CORE_FEATURES_BOX_TREE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/geometry/box.h"

namespace wellspace::core {

// A binary tree over boxes: those of a node are halved at the middle of their centres, along the longer side of what
// holds them.
//
// Thread safety: thread-compatible; const functions may run at once.
class BoxTree {
 public:
  // Complexity: O(n log n).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(std::span<const Box<3>> boxes, const RunContext& context) {
    boxes_ = boxes;
    order_.resize(boxes.size());
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.clear();
    nodes_.reserve(2 * (boxes.size() / kLeaf + 1));
    return boxes.empty() ? absl::OkStatus() : Build(0, static_cast<uint32_t>(boxes.size()), context);
  }

  // Calls visit(i) for every box for which meets(box) is true. `meets` is true of what holds a box of which it is.
  template <typename Meets, typename Visit>
  void ForEach(const Meets& meets, const Visit& visit) const {
    for (uint32_t node = 0; node < nodes_.size();) {
      if (!meets(nodes_[node].box)) {
        node = nodes_[node].next;
        continue;
      }
      for (uint32_t i = nodes_[node].begin; i < nodes_[node].end; ++i) {
        if (meets(boxes_[order_[i]])) {
          visit(order_[i]);
        }
      }
      ++node;
    }
  }

  // What a tree over so many boxes takes. Unit: bytes.
  static uint64_t Bytes(uint64_t boxes) { return boxes * sizeof(uint32_t) + 2 * (boxes / kLeaf + 1) * sizeof(Node); }

 private:
  static constexpr uint32_t kLeaf = 8;

  struct Node {
    Box<3> box;
    uint32_t begin = 0;  // of a leaf, in order_; else both are 0
    uint32_t end = 0;
    uint32_t next = 0;  // the node behind its subtree
  };

  absl::Status Build(uint32_t begin, uint32_t end, const RunContext& context) {
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
      const Box<3>& box = nodes_[node].box;
      int longest = 0;
      for (int axis = 1; axis < 3; ++axis) {
        longest = box.high[axis] - box.low[axis] > box.high[longest] - box.low[longest] ? axis : longest;
      }
      const uint32_t middle = begin + (end - begin) / 2;
      std::nth_element(
          order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](uint32_t i, uint32_t k) {
            return boxes_[i].low[longest] + boxes_[i].high[longest] < boxes_[k].low[longest] + boxes_[k].high[longest];
          });
      WELLSPACE_RETURN_IF_ERROR(Build(begin, middle, context));
      WELLSPACE_RETURN_IF_ERROR(Build(middle, end, context));
    }
    nodes_[node].next = static_cast<uint32_t>(nodes_.size());
    return absl::OkStatus();
  }

  std::span<const Box<3>> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;  // each before its subtree
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_BOX_TREE_H_
