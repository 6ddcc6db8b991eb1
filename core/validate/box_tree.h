// Boxes in the plane, among which those near by are found.
#ifndef WELLSPACE_CORE_VALIDATE_BOX_TREE_H_
#define WELLSPACE_CORE_VALIDATE_BOX_TREE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// A tree of boxes, halved by their middles.
//
// Thread safety: thread-compatible; const functions may run at once.
class BoxTree {
 public:
  // Complexity: O(n log n).
  explicit BoxTree(std::vector<Box<2>> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    if (!order_.empty()) {
      Split(0, static_cast<uint32_t>(order_.size()));
    }
  }

  // Calls f(index) for boxes, among them all for which meets(box) holds, until it returns false. `meets` holds for each
  // box around one for which it does.
  //
  // Complexity: O(sqrt(n) + k) for most of what is asked.
  template <typename Meets, typename F>
  void ForEach(const Meets& meets, const F& f) const {
    if (!nodes_.empty()) {
      Visit(0, meets, f);
    }
  }

 private:
  static constexpr uint32_t kLeafSize = 4;

  struct Node {
    Box<2> box;
    uint32_t begin = 0;  // in order_
    uint32_t end = 0;
    uint32_t second = 0;  // child; the first one comes next, unless this is a leaf
  };

  uint32_t Split(uint32_t begin, uint32_t end) {
    const auto number = static_cast<uint32_t>(nodes_.size());
    Box<2> box = boxes_[order_[begin]];
    for (uint32_t i = begin; i < end; ++i) {
      box.Include(boxes_[order_[i]]);
    }
    nodes_.push_back({box, begin, end, 0});
    if (end - begin > kLeafSize) {
      const int axis = box.high[0] - box.low[0] >= box.high[1] - box.low[1] ? 0 : 1;
      const auto middle_of = [&](uint32_t i) { return 0.5 * boxes_[i].low[axis] + 0.5 * boxes_[i].high[axis]; };
      const uint32_t middle = begin + (end - begin) / 2;
      std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                       [&](uint32_t i, uint32_t j) { return middle_of(i) < middle_of(j); });
      Split(begin, middle);
      nodes_[number].second = Split(middle, end);
    }
    return number;
  }

  template <typename Meets, typename F>
  bool Visit(uint32_t number, const Meets& meets, const F& f) const {
    const Node& node = nodes_[number];
    if (!meets(node.box)) {
      return true;
    }
    if (node.second != 0) {
      return Visit(number + 1, meets, f) && Visit(node.second, meets, f);
    }
    for (uint32_t i = node.begin; i < node.end; ++i) {
      if (meets(boxes_[order_[i]]) && !f(order_[i])) {
        return false;
      }
    }
    return true;
  }

  std::vector<Box<2>> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

// `box`, wider by `room` on every side.
inline Box<2> Widened(Box<2> box, double room) {
  for (int axis = 0; axis < 2; ++axis) {
    box.low[axis] -= room;
    box.high[axis] += room;
  }
  return box;
}

// Whether a place of the box is within `reach` of `p`.
inline auto WithinReachOf(const Point<2>& p, double reach) {
  return [p, reach](const Box<2>& box) { return DistanceSq<2>(p, box) <= reach * reach; };
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_BOX_TREE_H_
