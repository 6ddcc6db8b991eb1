#include "core/features/overlaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/place.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"

namespace wellspace::core {
namespace {

// Lines are the same only if these differ by less: the rounding of an angle, in radians, and of a distance from the
// origin, relative to the largest coordinate.
constexpr double kSameAngle = 0x1p-48;
constexpr double kSameOffset = 0x1p-46;

// Lines that doubles can hardly tell apart are compared exactly with so many at most. Where more of them lie side by
// side, vertices are too close to segments, which is found later.
constexpr size_t kMostLines = 32;

// The line through a segment, as doubles tell: its angle with the first axis, and how far the origin is from it.
struct LineOf {
  double angle = 0;
  double offset = 0;
  uint32_t segment = 0;
};

// Finds segments that lie on each other, and makes parts of them.
class OverlapFinder {
 public:
  OverlapFinder(PlanarGraph& graph, const RunContext& context)
      : graph_(graph), context_(context), is_replaced_(graph.segments.size()) {}

  absl::Status Unite() {
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<LineOf> lines, FindLines());
    const auto by_angle = [](const LineOf& s, const LineOf& t) {
      return std::tie(s.angle, s.segment) < std::tie(t.angle, t.segment);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(lines, by_angle, context_));
    WELLSPACE_RETURN_IF_ERROR(ForEachRun(
        std::span<LineOf>(lines), [](const LineOf& s, const LineOf& t) { return t.angle - s.angle <= kSameAngle; },
        [&](std::span<LineOf> parallel) { return UniteParallel(parallel); }));
    return parts_.empty() ? absl::OkStatus() : Replace();
  }

 private:
  const Point<2>& Low(uint32_t segment) const { return graph_.points[graph_.segments[segment].a]; }
  const Point<2>& High(uint32_t segment) const { return graph_.points[graph_.segments[segment].b]; }

  // Calls f for each longest run of two items or more of which each continues the one before it.
  template <typename T, typename Continues, typename F>
  absl::Status ForEachRun(std::span<T> items, const Continues& continues, const F& f) {
    size_t first = 0;
    for (size_t i = 1; i <= items.size(); ++i) {
      if (i % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      if (i < items.size() && continues(items[i - 1], items[i])) {
        continue;
      }
      if (i - first > 1) {
        WELLSPACE_RETURN_IF_ERROR(f(items.subspan(first, i - first)));
      }
      first = i;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<LineOf>> FindLines() {
    std::vector<LineOf> lines;
    lines.reserve(graph_.segments.size());
    double size = 0;
    for (uint32_t s = 0; s < graph_.segments.size(); ++s) {
      if (s % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      const Point<2> along = Difference<2>(High(s), Low(s));
      const double length = std::hypot(along[0], along[1]);
      lines.push_back({std::atan2(along[1], along[0]), Cross({along[0] / length, along[1] / length}, Low(s)), s});
      for (const double coordinate : {Low(s)[0], Low(s)[1], High(s)[0], High(s)[1]}) {
        size = std::max(size, std::abs(coordinate));
      }
    }
    same_offset_ = kSameOffset * size;
    return lines;
  }

  absl::Status UniteParallel(std::span<LineOf> lines) {
    std::vector<LineOf> by_offset(lines.begin(), lines.end());
    const auto is_before = [](const LineOf& s, const LineOf& t) {
      return std::tie(s.offset, s.segment) < std::tie(t.offset, t.segment);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(by_offset, is_before, context_));
    return ForEachRun(
        std::span<LineOf>(by_offset),
        [this](const LineOf& s, const LineOf& t) { return t.offset - s.offset <= same_offset_; },
        [this](std::span<LineOf> near) {
          std::vector<uint32_t> segments;
          segments.reserve(near.size());
          for (const LineOf& line : near) {
            segments.push_back(line.segment);
          }
          return UniteNear(std::move(segments));
        });
  }

  // Among segments on lines that doubles do not tell apart.
  absl::Status UniteNear(std::vector<uint32_t> segments) {
    return ForEachPile(std::move(segments), [this](std::span<const uint32_t> pile) {
      std::vector<std::vector<uint32_t>> lines;  // each exact
      for (size_t i = 0; i < pile.size(); ++i) {
        if (i % 1024 == 0) {
          WELLSPACE_RETURN_IF_ERROR(context_.Check());
        }
        const auto own = std::find_if(lines.begin(), lines.end(), [&](const std::vector<uint32_t>& line) {
          return IsOnLine(line.front(), Low(pile[i])) && IsOnLine(line.front(), High(pile[i]));
        });
        if (own != lines.end()) {
          own->push_back(pile[i]);
        } else if (lines.size() < kMostLines) {
          lines.push_back({pile[i]});
        }
      }
      for (std::vector<uint32_t>& line : lines) {
        WELLSPACE_RETURN_IF_ERROR(ForEachPile(
            std::move(line), [this](std::span<const uint32_t> overlapping) { return UniteOverlapping(overlapping); }));
      }
      return absl::OkStatus();
    });
  }

  bool IsOnLine(uint32_t segment, const Point<2>& p) const {
    return Orientation<2>({Low(segment), High(segment), p}).sign == Sign::kZero;
  }

  // Calls f for those of `segments`, at least one, that follow each other so that each begins before all that are ahead
  // of it have ended.
  template <typename F>
  absl::Status ForEachPile(std::vector<uint32_t> segments, const F& f) {
    const auto is_before = [this](uint32_t s, uint32_t t) { return Low(s) != Low(t) ? Low(s) < Low(t) : s < t; };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(segments, is_before, context_));
    Point<2> end = High(segments.front());  // of the pile
    return ForEachRun(
        std::span<const uint32_t>(segments),
        [&](uint32_t s, uint32_t t) {
          end = std::max(end, High(s));
          const bool is_in_pile = Low(t) < end;
          end = is_in_pile ? end : High(t);
          return is_in_pile;
        },
        f);
  }

  // Makes parts of segments on one line.
  absl::Status UniteOverlapping(std::span<const uint32_t> overlapping) {
    struct End {
      Point<2> at;
      uint32_t point = 0;
      uint32_t segment = 0;
      bool is_begin = false;
    };
    std::vector<End> ends;
    ends.reserve(2 * overlapping.size());
    for (const uint32_t s : overlapping) {
      ends.push_back({Low(s), graph_.segments[s].a, s, true});
      ends.push_back({High(s), graph_.segments[s].b, s, false});
      is_replaced_[s] = true;
    }
    const auto is_before = [](const End& s, const End& t) {
      return std::tie(s.at, s.segment, s.is_begin) < std::tie(t.at, t.segment, t.is_begin);
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(ends, is_before, context_));
    std::set<uint32_t> open;                                // segments, by source
    std::set<std::pair<int32_t, uint32_t>> open_by_marker;  // but for sides of the box
    uint32_t open_rings = 0;
    uint32_t open_polygons = OddSets::kEmpty;
    uint32_t open_groups = OddSets::kEmpty;
    uint64_t places = 0;  // so far
    for (size_t i = 0; i < ends.size(); ++i) {
      if (i % 1024 == 0) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
      }
      if (i > 0 && ends[i].point != ends[i - 1].point) {
        ++places;
        if (!open.empty()) {
          WELLSPACE_RETURN_IF_ERROR(AddPart({ends[i - 1].point, ends[i].point}, open, open_by_marker, open_rings,
                                            open_polygons, open_groups));
        }
      }
      const uint32_t s = ends[i].segment;
      const GraphSegment& segment = graph_.segments[s];
      open_polygons = graph_.polygons.Join(open_polygons, segment.polygons);  // the second time it is taken out
      open_groups = graph_.groups.Join(open_groups, segment.groups);
      if (ends[i].is_begin) {
        open.insert(s);
        open_rings += segment.rings;
        // The number of places strictly between both ends: that at the end, less that at the begin, less 1.
        graph_.counts.touching_vertices -= places + 1;
      } else {
        open.erase(s);
        open_rings -= segment.rings;
        open_polygons = open.empty() ? OddSets::kEmpty : open_polygons;
        open_groups = open.empty() ? OddSets::kEmpty : open_groups;
        graph_.counts.touching_vertices += places;
      }
      if (!segment.IsBoxSide()) {
        const std::pair<int32_t, uint32_t> entry(segment.marker, s);
        if (ends[i].is_begin) {
          open_by_marker.insert(entry);
        } else {
          open_by_marker.erase(entry);
        }
      }
    }
    return absl::OkStatus();
  }

  // The part between two points of all that are open, of which the first by source keeps its name.
  absl::Status AddPart(const std::array<uint32_t, 2>& points, const std::set<uint32_t>& open,
                       const std::set<std::pair<int32_t, uint32_t>>& open_by_marker, uint32_t rings, uint32_t polygons,
                       uint32_t groups) {
    GraphSegment part = graph_.segments[*open.begin()];
    if (!open_by_marker.empty() && open_by_marker.begin()->first != open_by_marker.rbegin()->first) {
      const auto next = std::find_if(open.begin(), open.end(), [&](uint32_t s) {
        return !graph_.segments[s].IsBoxSide() && graph_.segments[s].marker != part.marker;
      });
      return MarkersDifferError(graph_, part, graph_.segments[*next], points[0], points[1]);
    }
    graph_.counts.duplicate_segments += open_by_marker.empty() ? 0 : open_by_marker.size() - 1;
    part.a = points[0];
    part.b = points[1];
    part.rings = rings;
    part.polygons = polygons;
    part.groups = groups;
    parts_.push_back(part);
    return absl::OkStatus();
  }

  absl::Status Replace() {
    std::vector<GraphSegment> all = std::move(parts_);
    for (uint32_t s = 0; s < graph_.segments.size(); ++s) {
      if (!is_replaced_[s]) {
        all.push_back(graph_.segments[s]);
      }
    }
    const auto is_before = [this](const GraphSegment& s, const GraphSegment& t) {
      return s.source != t.source ? s.source < t.source : graph_.points[s.a] < graph_.points[t.a];
    };
    WELLSPACE_RETURN_IF_ERROR(CancellableSort(all, is_before, context_));
    graph_.segments = std::move(all);
    return absl::OkStatus();
  }

  PlanarGraph& graph_;
  const RunContext& context_;
  double same_offset_ = 0;
  std::vector<bool> is_replaced_;  // by segment
  std::vector<GraphSegment> parts_;
};

}  // namespace

absl::Status UniteOverlaps(PlanarGraph& graph, const RunContext& context) {
  return OverlapFinder(graph, context).Unite();
}

absl::Status MarkersDifferError(const PlanarGraph& graph, const GraphSegment& first, const GraphSegment& next,
                                uint32_t a, uint32_t b) {
  return absl::InvalidArgumentError(absl::StrCat("markers: segments[", first.source, "] and segments[", next.source,
                                                 "] lie on each other from ", PlaceText(graph.points[a]), " to ",
                                                 PlaceText(graph.points[b]), ", and have the markers ", first.marker,
                                                 " and ", next.marker, "; give both the same, or leave one out"));
}

}  // namespace wellspace::core
