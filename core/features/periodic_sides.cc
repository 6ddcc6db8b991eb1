#include "core/features/periodic_sides.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/place.h"
#include "core/geometry/box.h"

namespace wellspace::core {
namespace {

// The two sides across one axis: their points, and the segments between them.
class SidePair {
 public:
  SidePair(const PlanarGraph& graph, const Box<2>& box, int axis)
      : graph_(graph), axis_(axis), at_{box.low[axis], box.high[axis]} {}

  // Sets the images of segments on the sides.
  absl::Status Match(const RunContext& context, std::vector<uint32_t>& images, std::vector<bool>& is_turned) {
    WELLSPACE_RETURN_IF_ERROR(FindPoints(context));
    WELLSPACE_RETURN_IF_ERROR(ComparePoints());
    WELLSPACE_RETURN_IF_ERROR(FindSegments(context));
    WELLSPACE_RETURN_IF_ERROR(CompareSegments());
    for (size_t i = 0; i < segments_[0].size(); ++i) {
      const uint32_t s = segments_[0][i].segment;
      const uint32_t t = segments_[1][i].segment;
      images[s] = t;
      images[t] = s;
      is_turned[s] = is_turned[t] = segments_[0][i].is_down != segments_[1][i].is_down;
    }
    return absl::OkStatus();
  }

 private:
  // A segment between the point of this rank on its side and the next one.
  struct OnSide {
    uint32_t rank = 0;
    uint32_t segment = 0;
    bool is_down = false;  // from the next one
  };

  double Along(uint32_t point) const { return graph_.points[point][1 - axis_]; }

  absl::Status FindPoints(const RunContext& context) {
    for (uint32_t p = 0; p < graph_.points.size(); ++p) {
      if (p % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      for (const int side : {0, 1}) {
        if (graph_.points[p][axis_] == at_[side]) {
          points_[side].push_back(p);
        }
      }
    }
    for (std::vector<uint32_t>& points : points_) {
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(
          points, [this](uint32_t p, uint32_t q) { return Along(p) < Along(q); }, context));
    }
    return absl::OkStatus();
  }

  absl::Status ComparePoints() const {
    const auto [low, high] = std::mismatch(points_[0].begin(), points_[0].end(), points_[1].begin(), points_[1].end(),
                                           [this](uint32_t p, uint32_t q) { return Along(p) == Along(q); });
    if (low == points_[0].end() && high == points_[1].end()) {
      return absl::OkStatus();
    }
    const int side = high == points_[1].end() || (low != points_[0].end() && Along(*low) < Along(*high)) ? 0 : 1;
    const uint32_t point = side == 0 ? *low : *high;
    const uint32_t input = graph_.input_of_point[point];
    const std::string name =
        input == PlanarGraph::kNoInput ? std::string("the vertex") : absl::StrCat("points[", input, "]");
    return absl::InvalidArgumentError(
        absl::StrCat("periodic_axes: ", name, " at ", PlaceText(graph_.points[point]), ", on the side ", NameOf(side),
                     ", has no image on the side ", NameOf(1 - side), "; expected a point at ",
                     PlaceText(ImageOf(point, side)), ", equal to the bit, or none on either side"));
  }

  absl::Status FindSegments(const RunContext& context) {
    for (const int side : {0, 1}) {
      const std::vector<uint32_t>& points = points_[side];
      for (uint32_t s = 0; s < graph_.segments.size(); ++s) {
        if (s % kStepsBetweenChecks == 0) {
          WELLSPACE_RETURN_IF_ERROR(context.Check());
        }
        const GraphSegment& segment = graph_.segments[s];
        if (graph_.points[segment.a][axis_] != at_[side] || graph_.points[segment.b][axis_] != at_[side]) {
          continue;
        }
        const bool is_down = Along(segment.b) < Along(segment.a);
        const double from = Along(is_down ? segment.b : segment.a);
        const auto found = std::lower_bound(points.begin(), points.end(), from,
                                            [this](uint32_t p, double along) { return Along(p) < along; });
        segments_[side].push_back({static_cast<uint32_t>(found - points.begin()), s, is_down});
      }
      WELLSPACE_RETURN_IF_ERROR(CancellableSort(
          segments_[side], [](const OnSide& s, const OnSide& t) { return s.rank < t.rank; }, context));
    }
    return absl::OkStatus();
  }

  absl::Status CompareSegments() const {
    for (const int side : {0, 1}) {
      if (segments_[side].empty()) {
        return absl::InvalidArgumentError(
            absl::StrCat("periodic_axes: no segment lies on the side ", NameOf(side),
                         " of the domain; expected segments on both sides of its bounding rectangle across that axis"));
      }
    }
    const auto [low, high] =
        std::mismatch(segments_[0].begin(), segments_[0].end(), segments_[1].begin(), segments_[1].end(),
                      [](const OnSide& s, const OnSide& t) { return s.rank == t.rank; });
    if (low == segments_[0].end() && high == segments_[1].end()) {
      return absl::OkStatus();
    }
    const int side = high == segments_[1].end() || (low != segments_[0].end() && low->rank < high->rank) ? 0 : 1;
    const GraphSegment& alone = graph_.segments[(side == 0 ? low : high)->segment];
    const std::string name =
        alone.IsBoxSide() ? std::string("a side of the box") : absl::StrCat("segments[", alone.source, "]");
    return absl::InvalidArgumentError(absl::StrCat(
        "periodic_axes: ", name, " from ", PlaceText(graph_.points[alone.a]), " to ", PlaceText(graph_.points[alone.b]),
        ", on the side ", NameOf(side), ", has no image on the side ", NameOf(1 - side), "; expected a segment from ",
        PlaceText(ImageOf(alone.a, side)), " to ", PlaceText(ImageOf(alone.b, side)), " that bounds what is meshed"));
  }

  Point<2> ImageOf(uint32_t point, int side) const {
    Point<2> image = graph_.points[point];
    image[axis_] = at_[1 - side];
    return image;
  }

  std::string NameOf(int side) const { return absl::StrCat(axis_ == 0 ? "x" : "y", " = ", at_[side]); }

  const PlanarGraph& graph_;
  const int axis_;
  const std::array<double, 2> at_;               // of the low and the high side
  std::array<std::vector<uint32_t>, 2> points_;  // by rank
  std::array<std::vector<OnSide>, 2> segments_;  // by rank
};

}  // namespace

absl::StatusOr<PeriodicSides> PeriodicSides::Find(const PlanarGraph& graph, std::span<const int> axes,
                                                  const RunContext& context) {
  PeriodicSides sides;
  if (axes.empty()) {
    return sides;
  }
  Box<2> box{graph.points[graph.segments[0].a], graph.points[graph.segments[0].a]};
  for (const Point<2>& p : graph.points) {
    box.Include({p, p});
  }
  sides.images_.assign(graph.segments.size(), kNone);
  sides.is_turned_.assign(graph.segments.size(), false);
  for (const int axis : axes) {
    WELLSPACE_RETURN_IF_ERROR(SidePair(graph, box, axis).Match(context, sides.images_, sides.is_turned_));
  }
  sides.box_ = PeriodicBox<2>(box, axes);
  return sides;
}

}  // namespace wellspace::core
