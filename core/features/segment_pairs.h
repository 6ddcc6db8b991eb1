// Which segments and points of the plane may meet: found by a quadtree over both.
#ifndef WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_
#define WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"

namespace wellspace::core {

// The ends of a segment, by point.
using SegmentEnds = std::array<uint32_t, 2>;

// Calls compare(segments, points) for groups of features, so that every two of which one is a segment, and which come
// within `reach` of each other, are together in some group. Two segments with a common end may be in none.
//
// Thread safety: thread-compatible.
class SegmentPairs {
 public:
  // REQUIRES:   all spans outlive this; reach >= 0.
  SegmentPairs(std::span<const Point<2>> points, std::span<const SegmentEnds> segments, double reach)
      : points_(points), segments_(segments), reach_(reach) {}

  // Stops when `compare`, or a look at whether it is to stop, returns false.
  //
  // Complexity: O((n + m) log) for most inputs.
  template <typename Compare>
  bool ForEachGroup(Compare compare) const {
    Group all;
    all.box = {{points_[0]}, {points_[0]}};
    for (uint32_t i = 0; i < points_.size(); ++i) {
      all.points.push_back(i);
      all.box.Include({points_[i], points_[i]});
    }
    for (uint32_t i = 0; i < segments_.size(); ++i) {
      all.segments.push_back(i);
    }
    // A square, so that the children are.
    const double side = all.box.LongestSide();
    for (int axis = 0; axis < 2; ++axis) {
      all.box.high[axis] = all.box.low[axis] + side;
    }
    return Visit(std::move(all), 0, compare);
  }

 private:
  static constexpr size_t kComparedTogether = 16;
  static constexpr int kMostDepth = 50;

  struct Group {
    Box<2> box;
    std::vector<uint32_t> segments;
    std::vector<uint32_t> points;
  };

  template <typename Compare>
  bool Visit(Group group, int depth, Compare& compare) const {
    if (group.segments.empty()) {
      return true;
    }
    if (group.segments.size() + group.points.size() <= kComparedTogether || depth == kMostDepth ||
        (group.points.size() <= 2 && HaveACommonEnd(group.segments))) {
      return compare(std::span<const uint32_t>(group.segments), std::span<const uint32_t>(group.points));
    }
    const Point<2> middle = {0.5 * (group.box.low[0] + group.box.high[0]),
                             0.5 * (group.box.low[1] + group.box.high[1])};
    for (int quarter = 0; quarter < 4; ++quarter) {
      Group child;
      child.box = group.box;
      for (int axis = 0; axis < 2; ++axis) {
        (((quarter >> axis) & 1) != 0 ? child.box.low : child.box.high)[axis] = middle[axis];
      }
      const double room = reach_ + 0x1p-45 * (std::abs(child.box.low[0]) + std::abs(child.box.high[0]) +
                                              std::abs(child.box.low[1]) + std::abs(child.box.high[1]));
      Box<2> wide = child.box;
      for (int axis = 0; axis < 2; ++axis) {
        wide.low[axis] -= room;
        wide.high[axis] += room;
      }
      std::copy_if(group.points.begin(), group.points.end(), std::back_inserter(child.points),
                   [&](uint32_t p) { return wide.Contains(points_[p]); });
      std::copy_if(group.segments.begin(), group.segments.end(), std::back_inserter(child.segments),
                   [&](uint32_t s) { return !SurelyMisses(points_[segments_[s][0]], points_[segments_[s][1]], wide); });
      if (!Visit(std::move(child), depth + 1, compare)) {
        return false;
      }
    }
    return true;
  }

  bool HaveACommonEnd(std::span<const uint32_t> group) const {
    const auto all_have = [&](uint32_t p) {
      return std::all_of(group.begin(), group.end(),
                         [&](uint32_t s) { return segments_[s][0] == p || segments_[s][1] == p; });
    };
    return all_have(segments_[group[0]][0]) || all_have(segments_[group[0]][1]);
  }

  const std::span<const Point<2>> points_;
  const std::span<const SegmentEnds> segments_;
  const double reach_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_
