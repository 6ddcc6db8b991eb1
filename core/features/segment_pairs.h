// The search for segments, and points beside segments, of the plane that may meet: by a quadtree over both.
#ifndef WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_
#define WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/base/thread_team.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// The ends of a segment, by point.
using SegmentEnds = std::array<uint32_t, 2>;

// Calls compare(segments, points) for groups of features, so that every two of which one is a segment, and which come
// within `reach` of each other, are together in some group. Two segments with a common end may be in none.
//
// A square of the quadtree is quartered until it holds few features, or segments with a common end alone. One that many
// segments pass through, side by side, would be quartered until it is narrower than the gap between two of them. It is
// halved along one of them instead, which the others do not cross.
//
// Thread safety: thread-compatible; const functions may run at once.
class SegmentPairs {
 public:
  // Returns false to stop.
  using Compare = absl::FunctionRef<bool(std::span<const uint32_t> segments, std::span<const uint32_t> points)>;

  // REQUIRES:   all that is given outlives this; reach >= 0.
  SegmentPairs(std::span<const Point<2>> points, std::span<const SegmentEnds> segments, double reach,
               const RunContext& context)
      : points_(points), segments_(segments), reach_(reach), context_(context) {}

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
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::vector<Group>> Parts(ThreadTeam& team) const;

  // Calls `compare` for the groups of a part. Stops when it returns false, or the run is cancelled.
  //
  // Complexity: O((n + m) log) for all parts of most inputs.
  bool ForEachGroupOf(const Group& part, Compare compare) const;

 private:
  // A stretch of a segment, from one share of its length to another.
  struct Stretch {
    uint32_t segment = 0;
    double from = 0;
    double to = 1;
  };
  // Features on one side of some lines.
  struct Slice {
    std::vector<Stretch> stretches;
    std::vector<uint32_t> points;
    int depth = 0;
  };
  // A line: its points x have Dot(normal, x) = offset. The normal has length 1.
  struct Line {
    Point<2> normal{};
    double offset = 0;
  };

  bool IsCompared(const Group& group) const;
  Group QuarterOf(const Group& group, int quarter) const;
  bool HaveACommonEnd(std::span<const uint32_t> group) const;

  bool ForEachGroupOf(Slice slice, Compare compare) const;
  Point<2> PlaceOn(uint32_t segment, double share) const;
  Line LineAlong(const Slice& slice) const;
  std::optional<Line> LineAcross(const Slice& slice) const;
  Slice SideOf(const Slice& slice, const Line& line, double sign) const;

  const std::span<const Point<2>> points_;
  const std::span<const SegmentEnds> segments_;
  const double reach_;
  const RunContext& context_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SEGMENT_PAIRS_H_
