#include "core/refine/plane/planar_domain.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace wellspace::core {
namespace {

// Grows with the angle of `d` from the first axis, from 0 to 4.
double PseudoAngle(const Point<2>& d) {
  const double size = std::abs(d[0]) + std::abs(d[1]);
  const double t = d[1] / size;
  if (d[0] < 0) {
    return 2 - t;
  }
  return d[1] < 0 ? 4 + t : t;
}

// PseudoAngle from the direction of pseudo-angle `from` on.
double PseudoAngleFrom(double from, const Point<2>& d) {
  const double angle = PseudoAngle(d) - from;
  return angle < 0 ? angle + 4 : angle;
}

}  // namespace

PlanarDomain::PlanarDomain(PlanarGraph graph, PlanarFaces faces, PeriodicSides sides)
    : graph_(std::move(graph)),
      faces_(std::move(faces)),
      sides_(std::move(sides)),
      has_small_angle_(2 * graph_.segments.size()),
      splits_(graph_.segments.size()),
      has_area_bounds_(std::any_of(faces_.faces.begin(), faces_.faces.end(),
                                   [](const Face& face) { return !std::isinf(face.max_area); })) {
  for (uint32_t s = 0; s < segment_count(); ++s) {
    lengths_.push_back(Distance<2>(EndOf(s, false), EndOf(s, true)));
    ways_.push_back(HalfEdgeOf(s, false));
    ways_.push_back(HalfEdgeOf(s, true));
  }
  for (uint32_t p = 0; p < point_count(); ++p) {
    const std::span<const HalfEdge> ways = faces_.Around(p);
    for (size_t i = 0; i < ways.size() && ways.size() > 1; ++i) {
      const HalfEdge h = ways[i];
      const HalfEdge next = ways[(i + 1) % ways.size()];
      const Point<2> d = DirectionOf(h);
      const Point<2> e = DirectionOf(next);
      min_angle_ = std::min(min_angle_, std::atan2(std::abs(Cross(d, e)), Dot<2>(d, e)));
      const double cosine =
          Dot<2>(DirectionOf(h), DirectionOf(next)) / lengths_[SegmentOf(h)] / lengths_[SegmentOf(next)];
      if (cosine > 0.5 * (1 + 1e-12)) {
        has_small_angle_[h] = has_small_angle_[next] = true;
      }
    }
  }
}

std::vector<SegmentLists::Ends> PlanarDomain::Ends() const {
  std::vector<SegmentLists::Ends> ends;
  ends.reserve(segment_count());
  for (uint32_t s = 0; s < segment_count(); ++s) {
    ends.push_back({EndOf(s, false), EndOf(s, true)});
  }
  return ends;
}

void PlanarDomain::AddVertex(const SegmentPoint& place, uint32_t face) {
  places_.push_back(place.IsOnSegment() ? InsertedPlace{place.segment, place.is_from_b ? 1u : 0u, place.distance}
                                        : InsertedPlace{SegmentPoint::kNone, face, 0});
  if (place.IsOnSegment()) {
    splits_[place.segment].fetch_add(1, std::memory_order_relaxed);
  }
}

void PlanarDomain::MakeRoom(size_t vertices) {
  if (places_.capacity() - places_.size() < vertices) {
    places_.reserve(std::max(2 * places_.capacity(), places_.size() + vertices));
  }
}

std::span<const HalfEdge> PlanarDomain::WaysFrom(VertexId v) const {
  if (IsGraphPoint(v)) {
    return faces_.Around(Index(v));
  }
  return WaysFrom(PlaceOf(v));
}

size_t PlanarDomain::SectorToward(std::span<const HalfEdge> ways, const Point<2>& d) const {
  if (ways.size() < 2) {
    return 0;
  }
  const double first = PseudoAngle(DirectionOf(ways[0]));
  const double angle = PseudoAngleFrom(first, d);
  size_t low = 0;  // the last way whose angle is at most that of d
  size_t high = ways.size();
  while (high - low > 1) {
    const size_t middle = (low + high) / 2;
    (PseudoAngleFrom(first, DirectionOf(ways[middle])) <= angle ? low : high) = middle;
  }
  return low;
}

double PlanarDomain::DistanceFromEnd(VertexId v, uint32_t segment, bool is_b) const {
  if (IsGraphPoint(v)) {
    return EndVertex(segment, is_b) == v ? 0 : LengthOf(segment);
  }
  return DistanceFromEnd(PlaceOf(v), is_b);
}

double PlanarDomain::DistanceSqTo(const Point<2>& p, uint32_t segment) const {
  const auto [foot, away] = FootOf(p, segment);
  const double beyond = foot - std::clamp(foot, 0.0, LengthOf(segment));  // an end
  return away * away + beyond * beyond;
}

Point<2> PlanarDomain::PositionOf(const SegmentPoint& place) const {
  const double length = LengthOf(place.segment);
  const bool is_nearer = place.distance <= 0.5 * length;
  const bool is_from_b = is_nearer ? place.is_from_b : !place.is_from_b;
  const double t = (is_nearer ? place.distance : length - place.distance) / length;
  const Point<2>& from = EndOf(place.segment, is_from_b);
  const Point<2>& to = EndOf(place.segment, !is_from_b);
  return {from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])};
}

PlanarDomain::Chains PlanarDomain::FindChains() const {
  Chains chains;
  chains.first.assign(segment_count() + 1, 0);
  for (uint32_t s = 0; s < segment_count(); ++s) {
    chains.first[s + 1] = chains.first[s] + 2 + SplitsOf(s);
  }
  chains.vertices.resize(chains.first.back());
  std::vector<uint32_t> next(chains.first.begin(), chains.first.end() - 1);
  for (uint32_t s = 0; s < segment_count(); ++s) {
    chains.vertices[next[s]++] = EndVertex(s, false);
    chains.vertices[chains.first[s + 1] - 1] = EndVertex(s, true);
  }
  for (uint32_t v = point_count(); v < vertex_count(); ++v) {
    if (const SegmentPoint place = PlaceOf(VertexId{v}); place.IsOnSegment()) {
      chains.vertices[next[place.segment]++] = VertexId{v};
    }
  }
  for (uint32_t s = 0; s < segment_count(); ++s) {
    std::sort(chains.vertices.begin() + chains.first[s] + 1, chains.vertices.begin() + chains.first[s + 1] - 1,
              [&](VertexId u, VertexId w) { return DistanceFromEnd(u, s, false) < DistanceFromEnd(w, s, false); });
  }
  return chains;
}

uint64_t PlanarDomain::MemoryBytes() const {
  return graph_.points.size() * (sizeof(Point<2>) + 4 * sizeof(uint32_t)) +
         segment_count() * (sizeof(GraphSegment) + sizeof(double) + 7 * sizeof(uint32_t)) + sides_.MemoryBytes() +
         places_.size() * sizeof(InsertedPlace);
}

}  // namespace wellspace::core
