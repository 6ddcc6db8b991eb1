#include "core/refine/plane/split_place.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/features/planar_faces.h"
#include "core/geometry/point.h"

namespace wellspace::core {
namespace {

// A round distance differs from the exact one by at most this times the empty radius.
constexpr double kRoundingShare = 0.3;

// The multiple of the largest power of two that lies within `room` of `distance`.
double RoundNear(double distance, double room) {
  double unit = std::exp2(std::ceil(std::log2(distance + room)));
  for (; unit > 0; unit *= 0.5) {
    const double rounded = std::round(distance / unit) * unit;
    if (rounded > 0 && std::abs(rounded - distance) <= room) {
      return rounded;
    }
  }
  return distance;
}

}  // namespace

PlanePlace SplitPlace(const VisibleDomain& visible, VertexId v, const MetPart& met) {
  const PlanarDomain& domain = visible.domain();
  const uint32_t segment = met.segment;
  const double length = domain.LengthOf(segment);
  // At the distance of v from a common end, if the angle there is below 90 degrees.
  for (const HalfEdge h : domain.WaysFrom(v)) {
    for (const bool is_b : {false, true}) {
      const VertexId apex = domain.EndVertex(SegmentOf(h), is_b);
      for (const bool other_b : {false, true}) {
        if (apex == v || domain.EndVertex(segment, other_b) != apex) {
          continue;
        }
        const Point<2> own = domain.DirectionOf(HalfEdgeOf(SegmentOf(h), is_b));
        const Point<2> other = domain.DirectionOf(HalfEdgeOf(segment, other_b));
        const double distance = domain.DistanceFromEnd(v, SegmentOf(h), is_b);
        if (Dot<2>(own, other) > 0 && distance < (1 - kSameDistance) * length) {
          return {.on = {segment, other_b, distance}};
        }
      }
    }
  }
  // Else at the foot of v, as far as that is in the part.
  const double at = std::clamp(domain.FootOf(visible.structure().point(v), segment).from_a, met.from, met.to);
  return RoundPlace(visible, domain.FromNearerEnd(segment, at), met.distance);
}

PlanePlace RoundPlace(const VisibleDomain& visible, SegmentPoint on, double room) {
  const PlanarDomain& domain = visible.domain();
  const uint32_t segment = on.segment;
  const double length = domain.LengthOf(segment);
  const bool is_small_at_a = domain.HasSmallAngleAcross(HalfEdgeOf(segment, false));
  const bool is_small_at_b = domain.HasSmallAngleAcross(HalfEdgeOf(segment, true));
  const SplitOrder order = is_small_at_a && is_small_at_b ? visible.OrderOfSplit(segment) : SplitOrder::kAny;
  if (order == SplitOrder::kFirst) {
    on.distance = std::max(on.distance, length / 3);
  }
  if (on.is_from_b ? is_small_at_b : is_small_at_a) {
    const double rounded = RoundNear(on.distance, kRoundingShare * room);
    if (rounded < length) {
      on.distance = rounded;
    }
  }
  return {.on = on, .order = order};
}

bool AreSplitsInOrder(const PlanarDomain& domain, std::span<const PlaneRequest> requests) {
  for (size_t i = 0; i < requests.size(); ++i) {
    const PlanePlace& place = requests[i].place;
    if (place.order == SplitOrder::kAny) {
      continue;
    }
    const auto is_there = [&](const PlaneRequest& request) { return request.place.on.segment == place.on.segment; };
    const std::span<const PlaneRequest> own = requests.first(i);
    const bool is_split = domain.SplitsOf(place.on.segment) > 0 || std::any_of(own.begin(), own.end(), is_there);
    if (is_split != (place.order == SplitOrder::kAfterExpected)) {
      return false;
    }
  }
  return true;
}

}  // namespace wellspace::core
