#include "core/meshers/point_placer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/features/near_segment.h"
#include "core/features/place.h"
#include "core/geometry/box.h"

namespace wellspace::core {
namespace {

// A point is on a segment within this times the least separation. Vertices on one side of it and on the other, which
// are that far apart, are so far apart along it that their order is theirs.
constexpr double kOnSegment = 0.25;

// The search around a point goes so much farther, relatively, to allow for rounding.
constexpr double kRoom = 1e-9;

}  // namespace

absl::StatusOr<std::vector<PlanePlace>> PointPlacer::FindAll(std::span<const double> points,
                                                             const std::function<VertexId(size_t)>& start,
                                                             const RunContext& context) {
  std::vector<PlanePlace> places(points.size() / 2);
  const double within = kOnSegment * frame_.MinSeparation();
  Refused refused;
  for (uint32_t i = 0; i < places.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const Point<2> given = PointAt<2>(points, i);
    if (!std::isfinite(given[0]) || !std::isfinite(given[1])) {
      continue;
    }
    const Point<2> p = frame_.Scaled(given);
    if (!(DistanceSq<2>(p, structure_.box_of_cells()) <= within * within)) {
      refused.not_meshed.Add(i, NotMeshedError(given, i));
      continue;
    }
    const Neighbor nearest = structure_.NearestTo(p, start(i), workspace_);
    if (nearest.distance_sq < own_ * own_) {
      continue;
    }
    places[i] = Find(p, i, nearest, refused);
  }
  if (!refused.not_meshed.IsEmpty()) {
    return refused.not_meshed.InAll("nor are");
  }
  if (!refused.too_close.IsEmpty()) {
    return refused.too_close.InAll("so are");
  }
  return places;
}

// The place of point `index`, which is `p` and no vertex; if it has none, `refused` has it then. Nothing is between it
// and the nearest segment or vertex: so its face is the one there.
PlanePlace PointPlacer::Find(const Point<2>& p, uint32_t index, const Neighbor& nearest, Refused& refused) {
  PlanePlace place;
  const double reach = std::max(std::sqrt(nearest.distance_sq) * (1 + kRoom), frame_.MinSeparation());
  structure_.SegmentsWithin(p, reach, nearest.vertex, workspace_);
  Beside first;  // the nearest, where its foot is between its ends; the next
  Beside second;
  for (const uint32_t segment : workspace_.segments) {
    const PlanarDomain::Foot foot = planar_.FootOf(p, segment);
    if (segment == first.segment || foot.from_a <= 0 || foot.from_a >= planar_.LengthOf(segment)) {
      continue;
    }
    const Beside beside{segment, foot.away};
    if (!first.IsThere() || std::abs(beside.away) < std::abs(first.away)) {
      second = std::exchange(first, beside);
    } else if (!second.IsThere() || std::abs(beside.away) < std::abs(second.away)) {
      second = beside;
    }
  }
  const bool is_on = first.IsThere() && std::abs(first.away) <= kOnSegment * frame_.MinSeparation();
  const Beside& other = is_on ? second : first;
  if (other.IsThere() && std::abs(other.away) < frame_.MinSeparation()) {
    refused.too_close.Add(index, TooCloseError(p, index, other));
    return place;
  }
  if (is_on && first.away != 0 && planar_.sides().ImageOf(first.segment) != PeriodicSides::kNone) {
    refused.too_close.Add(index, TooCloseError(p, index, first));
    return place;
  }
  if (is_on) {
    place.on = planar_.PlaceBeside(p, first.segment);
    return place;
  }
  if (first.IsThere() && first.away * first.away <= nearest.distance_sq) {
    place.face = planar_.faces().left_face[HalfEdgeOf(first.segment, first.away < 0)];
  } else {
    const Point<2> toward = Difference<2>(p, structure_.point(nearest.vertex));
    place.face = planar_.FaceOfSector(nearest.vertex, planar_.SectorToward(nearest.vertex, toward));
  }
  if (!planar_.faces().IsMeshed(place.face)) {
    refused.not_meshed.Add(index, NotMeshedError(frame_.Unscaled(p), index));
  }
  return place;
}

absl::Status PointPlacer::TooCloseError(const Point<2>& p, size_t index, const Beside& beside) const {
  const double least = frame_.MinSeparation() / frame_.scale;
  return NearSegmentError(DescribeNearSegment(absl::StrCat("points[", index, "]"), frame_.Unscaled(p),
                                              std::abs(beside.away) / frame_.scale, NameOf(beside.segment)),
                          least, kOnSegment * least);
}

std::string PointPlacer::NameOf(uint32_t segment) const {
  const GraphSegment& named = planar_.graph().segments[segment];
  return named.IsBoxSide() ? "a side of the box" : absl::StrCat("segments[", named.source, "]");
}

absl::Status PointPlacer::NotMeshedError(const Point<2>& p, size_t index) {
  return absl::InvalidArgumentError(
      absl::StrCat("points[", index, "] = ", PlaceText(p),
                   " is not in the domain that is meshed: inside a face of it, or on a segment"));
}

}  // namespace wellspace::core
