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

#include "core/base/thread_team.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/segment.h"

namespace wellspace::core {

// The ends of a segment, by point.
using SegmentEnds = std::array<uint32_t, 2>;

// Calls compare(segments, points) for groups of features, so that every two of which one is a segment, and which come
// within `reach` of each other, are together in some group. Two segments with a common end may be in none.
//
// Thread safety: thread-compatible; const functions may run at once.
class SegmentPairs {
 public:
  // REQUIRES:   all spans outlive this; reach >= 0.
  SegmentPairs(std::span<const Point<2>> points, std::span<const SegmentEnds> segments, double reach)
      : points_(points), segments_(segments), reach_(reach) {}

  // Features in a square of the quadtree.
  struct Group {
    Box<2> box;
    std::vector<uint32_t> segments;
    std::vector<uint32_t> points;
    int depth = 0;
  };

  // Parts that threads may look at at once: together, their groups are all.
  //
  // Complexity: O(n + m) for most inputs.
  std::vector<Group> Parts(ThreadTeam& team) const {
    std::vector<Group> parts(1);
    Group& all = parts.front();
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
    for (int depth = 0; depth < kDepthOfParts; ++depth) {
      std::vector<Group> next(4 * parts.size());
      team.ForEach(next.size(), [&](size_t i) {
        if (!IsCompared(parts[i / 4])) {
          next[i] = QuarterOf(parts[i / 4], static_cast<int>(i % 4));
        } else if (i % 4 == 0) {
          next[i] = parts[i / 4];
        }
      });
      std::erase_if(next, [](const Group& group) { return group.segments.empty(); });
      parts = std::move(next);
    }
    return parts;
  }

  // Calls `compare` for the groups of a part. Stops when it returns false.
  //
  // Complexity: O((n + m) log) for all parts of most inputs.
  template <typename Compare>
  bool ForEachGroupOf(const Group& part, const Compare& compare) const {
    if (part.segments.empty()) {
      return true;
    }
    if (IsCompared(part)) {
      return compare(std::span<const uint32_t>(part.segments), std::span<const uint32_t>(part.points));
    }
    for (int quarter = 0; quarter < 4; ++quarter) {
      if (!ForEachGroupOf(QuarterOf(part, quarter), compare)) {
        return false;
      }
    }
    return true;
  }

 private:
  static constexpr size_t kComparedTogether = 16;
  static constexpr int kMostDepth = 50;
  static constexpr int kDepthOfParts = 3;

  // Whether a group is small enough, or smaller ones would not do.
  bool IsCompared(const Group& group) const {
    return group.segments.size() + group.points.size() <= kComparedTogether || group.depth == kMostDepth ||
           (group.points.size() <= 2 && HaveACommonEnd(group.segments));
  }

  Group QuarterOf(const Group& group, int quarter) const {
    Group child;
    child.box = group.box;
    child.depth = group.depth + 1;
    for (int axis = 0; axis < 2; ++axis) {
      const double middle = 0.5 * (group.box.low[axis] + group.box.high[axis]);
      (((quarter >> axis) & 1) != 0 ? child.box.low : child.box.high)[axis] = middle;
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
    return child;
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
