#include "core/features/segment_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

constexpr size_t kComparedTogether = 16;
constexpr int kMostDepth = 50;
constexpr int kDepthOfParts = 3;

// Segments side by side are sliced if they are so many times as many as the points among them.
constexpr size_t kSegmentsPerPoint = 4;
// A direction is bad if both halves together hold more than this many times the segments that were halved.
constexpr double kMostTogether = 1.25;
constexpr int kMostSlices = 100;

// The rounding of coordinates in a box, and much more.
constexpr double kRoom = 0x1p-45;

}  // namespace

absl::StatusOr<std::vector<SegmentPairs::Group>> SegmentPairs::Parts(ThreadTeam& team) const {
  std::vector<Group> parts(1);
  Group& all = parts.front();
  all.box = {{points_[0]}, {points_[0]}};
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context_.Check());
    }
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
    WELLSPACE_RETURN_IF_ERROR(context_.Check());
    std::erase_if(next, [](const Group& group) { return group.segments.empty(); });
    parts = std::move(next);
  }
  return parts;
}

bool SegmentPairs::ForEachGroupOf(const Group& part, Compare compare) const {
  if (context_.IsCancelled()) {
    return false;
  }
  if (part.segments.empty()) {
    return true;
  }
  if (IsCompared(part)) {
    return compare(part.segments, part.points);
  }
  if (part.segments.size() >= kSegmentsPerPoint * part.points.size()) {
    Slice slice;
    slice.stretches.reserve(part.segments.size());
    for (const uint32_t segment : part.segments) {
      slice.stretches.push_back({segment});
    }
    slice.points = part.points;
    // The part beyond the square is no matter of this group.
    for (int axis = 0; axis < 2; ++axis) {
      Line line;
      line.normal[axis] = 1;
      line.offset = part.box.low[axis];
      slice = SideOf(slice, line, 1);
      line.offset = part.box.high[axis];
      slice = SideOf(slice, line, -1);
    }
    slice.depth = 0;
    return ForEachGroupOf(std::move(slice), compare);
  }
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (!ForEachGroupOf(QuarterOf(part, quarter), compare)) {
      return false;
    }
  }
  return true;
}

// Whether a group is small enough, or smaller ones would not do.
bool SegmentPairs::IsCompared(const Group& group) const {
  return group.segments.size() + group.points.size() <= kComparedTogether || group.depth == kMostDepth ||
         group.box.LongestSide() <= reach_ ||  // its quarters would hold as much
         (group.points.size() <= 2 && HaveACommonEnd(group.segments));
}

SegmentPairs::Group SegmentPairs::QuarterOf(const Group& group, int quarter) const {
  Group child;
  child.box = group.box;
  child.depth = group.depth + 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double middle = 0.5 * (group.box.low[axis] + group.box.high[axis]);
    (((quarter >> axis) & 1) != 0 ? child.box.low : child.box.high)[axis] = middle;
  }
  const double room = reach_ + kRoom * (std::abs(child.box.low[0]) + std::abs(child.box.high[0]) +
                                        std::abs(child.box.low[1]) + std::abs(child.box.high[1]));
  Box<2> wide = child.box;
  for (int axis = 0; axis < 2; ++axis) {
    wide.low[axis] -= room;
    wide.high[axis] += room;
  }
  const auto take = [this](const std::vector<uint32_t>& from, std::vector<uint32_t>& to, const auto& is_in) {
    for (size_t i = 0; i < from.size(); ++i) {
      if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
        return;
      }
      if (is_in(from[i])) {
        to.push_back(from[i]);
      }
    }
  };
  take(group.points, child.points, [&](uint32_t p) { return wide.Contains(points_[p]); });
  take(group.segments, child.segments,
       [&](uint32_t s) { return !SurelyMisses(points_[segments_[s][0]], points_[segments_[s][1]], wide); });
  return child;
}

bool SegmentPairs::HaveACommonEnd(std::span<const uint32_t> group) const {
  const auto all_have = [&](uint32_t p) {
    return std::all_of(group.begin(), group.end(),
                       [&](uint32_t s) { return segments_[s][0] == p || segments_[s][1] == p; });
  };
  return !group.empty() && (all_have(segments_[group[0]][0]) || all_have(segments_[group[0]][1]));
}

bool SegmentPairs::ForEachGroupOf(Slice slice, Compare compare) const {
  if (context_.IsCancelled()) {
    return false;
  }
  if (slice.stretches.empty()) {
    return true;
  }
  std::vector<uint32_t> segments;
  segments.reserve(slice.stretches.size());
  for (const Stretch& stretch : slice.stretches) {
    segments.push_back(stretch.segment);
  }
  const size_t count = segments.size() + slice.points.size();
  if (count <= kComparedTogether || slice.depth == kMostSlices ||
      (slice.points.size() <= 2 && HaveACommonEnd(segments))) {
    return compare(segments, slice.points);
  }
  if (segments.size() >= kSegmentsPerPoint * slice.points.size()) {
    const Line line = LineAlong(slice);
    Slice low = SideOf(slice, line, -1);
    Slice high = SideOf(slice, line, 1);
    const size_t together = low.stretches.size() + high.stretches.size();
    if (static_cast<double>(together) <= kMostTogether * static_cast<double>(segments.size()) &&
        std::max(low.stretches.size(), high.stretches.size()) < segments.size()) {
      slice = Slice();  // its room is needed for the halves
      return ForEachGroupOf(std::move(low), compare) && ForEachGroupOf(std::move(high), compare);
    }
  }
  const std::optional<Line> line = LineAcross(slice);
  if (!line.has_value()) {
    return compare(segments, slice.points);
  }
  Slice low = SideOf(slice, *line, -1);
  Slice high = SideOf(slice, *line, 1);
  slice = Slice();
  return ForEachGroupOf(std::move(low), compare) && ForEachGroupOf(std::move(high), compare);
}

Point<2> SegmentPairs::PlaceOn(uint32_t segment, double share) const {
  const Point<2>& a = points_[segments_[segment][0]];
  const Point<2>& b = points_[segments_[segment][1]];
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
}

// The line along the stretch in the middle, as seen across one of them.
SegmentPairs::Line SegmentPairs::LineAlong(const Slice& slice) const {
  const auto normal_of = [&](const Stretch& stretch) -> Point<2> {
    const Point<2> along =
        Difference<2>(points_[segments_[stretch.segment][1]], points_[segments_[stretch.segment][0]]);
    const double length = std::sqrt(NormSq<2>(along));
    return {-along[1] / length, along[0] / length};
  };
  const Point<2> across = normal_of(slice.stretches[slice.stretches.size() / 2]);
  std::vector<std::pair<double, size_t>> places;
  places.reserve(slice.stretches.size());
  for (size_t i = 0; i < slice.stretches.size(); ++i) {
    const Stretch& stretch = slice.stretches[i];
    places.emplace_back(Dot<2>(across, PlaceOn(stretch.segment, 0.5 * (stretch.from + stretch.to))), i);
  }
  const auto middle = places.begin() + static_cast<std::ptrdiff_t>(places.size() / 2);
  std::nth_element(places.begin(), middle, places.end());
  const Stretch& stretch = slice.stretches[middle->second];
  const Point<2> normal = normal_of(stretch);
  return {normal, Dot<2>(normal, PlaceOn(stretch.segment, 0.5 * (stretch.from + stretch.to)))};
}

// The line that halves the box of the stretches across its longer side; none if that is no wider than four times the
// reach.
std::optional<SegmentPairs::Line> SegmentPairs::LineAcross(const Slice& slice) const {
  Box<2> box{{PlaceOn(slice.stretches[0].segment, slice.stretches[0].from)},
             {PlaceOn(slice.stretches[0].segment, slice.stretches[0].from)}};
  for (const Stretch& stretch : slice.stretches) {
    for (const double share : {stretch.from, stretch.to}) {
      const Point<2> p = PlaceOn(stretch.segment, share);
      box.Include({p, p});
    }
  }
  const int axis = box.high[0] - box.low[0] >= box.high[1] - box.low[1] ? 0 : 1;
  const double rounding = kRoom * (std::abs(box.low[axis]) + std::abs(box.high[axis]));
  if (!(box.high[axis] - box.low[axis] > 4 * (reach_ + rounding))) {
    return std::nullopt;
  }
  Line line;
  line.normal[axis] = 1;
  line.offset = 0.5 * (box.low[axis] + box.high[axis]);
  return line;
}

// The part on the side of `line` that `sign` tells, or within reach of it.
SegmentPairs::Slice SegmentPairs::SideOf(const Slice& slice, const Line& line, double sign) const {
  Slice side;
  side.depth = slice.depth + 1;
  const auto distance_of = [&](const Point<2>& p) { return sign * (Dot<2>(line.normal, p) - line.offset); };
  const auto room_at = [&](const Point<2>& p) {
    return reach_ + kRoom * (std::abs(p[0]) + std::abs(p[1]) + std::abs(line.offset));
  };
  const auto end_of = [&](uint32_t segment, int end) { return points_[segments_[segment][end]]; };
  for (size_t i = 0; i < slice.points.size(); ++i) {
    if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
      return side;
    }
    const Point<2>& p = points_[slice.points[i]];
    if (distance_of(p) >= -room_at(p)) {
      side.points.push_back(slice.points[i]);
    }
  }
  for (size_t i = 0; i < slice.stretches.size(); ++i) {
    if (i % kStepsBetweenChecks == 0 && context_.IsCancelled()) {
      return side;
    }
    Stretch stretch = slice.stretches[i];
    const Point<2> from = PlaceOn(stretch.segment, stretch.from);
    const Point<2> to = PlaceOn(stretch.segment, stretch.to);
    const double room = std::max(room_at(end_of(stretch.segment, 0)), room_at(end_of(stretch.segment, 1)));
    const double at_from = distance_of(from) + room;
    const double at_to = distance_of(to) + room;
    if (at_from < 0 && at_to < 0) {
      continue;
    }
    // The share where the line, moved by the room, is crossed.
    const double cut = stretch.from + (stretch.to - stretch.from) * (at_from / (at_from - at_to));
    if (at_from < 0) {
      stretch.from = std::clamp(cut, stretch.from, stretch.to);
    } else if (at_to < 0) {
      stretch.to = std::clamp(cut, stretch.from, stretch.to);
    }
    side.stretches.push_back(stretch);
  }
  return side;
}

}  // namespace wellspace::core
