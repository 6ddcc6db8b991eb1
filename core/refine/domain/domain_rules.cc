#include "core/refine/domain/domain_rules.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/refine/steiner_point.h"

namespace wellspace::core {
namespace {

// A part of a segment that is shorter than this, relative to its distance from the site, is what was rounded.
constexpr double kLeastPart = 1e-9;

// Distances from a common end that differ by less than this, relatively, are equal: those of segments that are given
// are rounded.
constexpr double kSameDistance = 1e-9;

// A vertex that is inserted for another reason than an equal distance on another segment lies at a round distance from
// an end with a small angle, within this times its empty radius: independent reasons then find the same distances, or
// ones that differ.
constexpr double kRoundingShare = 0.3;

// Leaves are looked into a little beyond a distance, so that rounding leaves out no segment within it.
constexpr double kBeyond = 1 + 1e-9;

// From this rho on, by the square, no vertex that takes the place of another comes nearer than the edge that asks.
constexpr double kSafeRhoSq = 2 * (1 - 1e-12);

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

// Whether all nodes of `cell` lie on one side of a line, surely: the one through `from`, relative to the site, in the
// direction `along`, which has length 1.
bool AreBeside(const Polytope<2>& cell, const Point<2>& from, const Point<2>& along) {
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (const CellNode<2>& node : cell.nodes()) {
    const double away = Cross(along, Difference<2>(node.x, from));
    least = std::min(least, away);
    most = std::max(most, away);
  }
  const double rounding = kLeastPart * (std::abs(from[0]) + std::abs(from[1]) + std::sqrt(cell.reach_sq()));
  return least > rounding || most < -rounding;
}

// Whether the segments p q and a b cross each other in their interiors, as doubles tell.
bool CrossEachOther(const Point<2>& p, const Point<2>& q, const Point<2>& a, const Point<2>& b) {
  const Point<2> way = Difference<2>(q, p);
  const Point<2> along = Difference<2>(b, a);
  return Cross(way, Difference<2>(a, p)) * Cross(way, Difference<2>(b, p)) < 0 &&
         Cross(along, Difference<2>(p, a)) * Cross(along, Difference<2>(q, a)) < 0;
}

}  // namespace

// The part of `segment` that `cell` meets: cut by all planes of the cell.
MetPart DomainRules::MeetSegment(const Polytope<2>& cell, uint32_t segment) const {
  const Point<2>& a = domain_.EndOf(segment, false);
  const double length = domain_.LengthOf(segment);
  const Point<2> from = Difference<2>(a, cell.site());
  Point<2> along = Difference<2>(domain_.EndOf(segment, true), a);
  const double away = Cross(along, from) / length;  // of the line
  MetPart part;
  if (away * away > kBeyond * cell.reach_sq()) {
    return part;
  }
  along = {along[0] / length, along[1] / length};
  const double foot = std::clamp(-Dot<2>(from, along), 0.0, length);
  const Point<2> nearest = {from[0] + foot * along[0], from[1] + foot * along[1]};
  if (NormSq<2>(nearest) > cell.reach_sq()) {
    return part;
  }
  if (AreBeside(cell, from, along)) {
    return part;
  }
  double low = 0;
  double high = length;
  for (const CellNode<2>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      const Plane<2>& plane = cell.plane(index);
      const double outward = plane.kind == PlaneKind::kBisector || plane.face % 2 == 1 ? 1 : -1;
      const double slope = outward * Dot<2>(plane.normal, along);
      const double gap = outward * (plane.offset - Dot<2>(plane.normal, from));
      if (slope > 0) {
        high = std::min(high, gap / slope);
      } else if (slope < 0) {
        low = std::max(low, gap / slope);
      } else if (gap < 0) {
        return part;
      }
    }
  }
  const double at = std::clamp(foot, low, std::max(low, high));
  const double distance = std::sqrt(NormSq<2>({from[0] + at * along[0], from[1] + at * along[1]}));
  const double rounding = kPlaceRounding * (std::abs(cell.site()[0]) + std::abs(cell.site()[1]));
  if (high - low > kLeastPart * distance + rounding) {
    part = {segment, low, high, distance};
  }
  return part;
}

// The nearest of `segments` that the cell of `v` meets; of those that are as near the one of the lowest number.
MetPart DomainRules::NearestMet(VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments) const {
  MetPart nearest;
  for (const uint32_t segment : segments) {
    if (segment == nearest.segment || domain_.IsOn(v, segment)) {
      continue;
    }
    const MetPart part = MeetSegment(cell, segment);
    if (part.IsThere() &&
        (!nearest.IsThere() || std::tie(part.distance, part.segment) < std::tie(nearest.distance, nearest.segment))) {
      nearest = part;
    }
  }
  return nearest;
}

// Whether `v` and `u` are at the same distance from a common end of their segments, which make an angle of less than 60
// degrees there; and the triangle on their edge, which lies in the direction `toward` from v, is on the side of that
// end, or between both segments. No vertex could make it better.
bool DomainRules::IsAcross(VertexId v, VertexId u, const Point<2>& toward) const {
  const Point<2> edge = Difference<2>(PointOf(u), structure_.point(v));
  const double edge_sq = NormSq<2>(edge);
  for (const HalfEdge h : domain_.WaysFrom(v)) {
    const uint32_t segment = SegmentOf(h);
    for (const bool is_b : {false, true}) {
      const VertexId apex = domain_.EndVertex(segment, is_b);
      if (apex == v || apex == u) {
        continue;
      }
      const double distance = domain_.DistanceFromEnd(v, segment, is_b);
      if (!(edge_sq < distance * distance)) {
        continue;
      }
      for (const HalfEdge k : WaysFrom(u)) {
        const uint32_t other = SegmentOf(k);
        for (const bool other_b : {false, true}) {
          if (other == segment || domain_.EndVertex(other, other_b) != apex ||
              std::abs(DistanceFromEnd(u, other, other_b) - distance) > kSameDistance * distance) {
            continue;
          }
          const Point<2> back = Difference<2>(domain_.EndOf(segment, is_b), structure_.point(v));
          const bool is_inward = Cross(edge, toward) * Cross(edge, back) > 0;
          const double beyond = (1 + kSameDistance) * distance;
          const bool both_go_on = domain_.LengthOf(segment) > beyond && domain_.LengthOf(other) > beyond;
          if (is_inward || both_go_on) {
            return true;
          }
        }
      }
    }
  }
  return false;
}

// What a node of a cell is between: the vertices whose bisectors meet there.
struct DomainRules::NodeView {
  NodeView(const Polytope<2>& cell, const CellNode<2>& node) : toward(node.x) {
    Point<2> sum = {};
    for (const uint16_t index : node.planes) {
      const Plane<2>& plane = cell.plane(index);
      if (plane.kind != PlaneKind::kBisector) {
        continue;
      }
      generators[bisectors++] = &plane;
      sum = {sum[0] + plane.normal[0] / plane.length, sum[1] + plane.normal[1] / plane.length};
      if (2 * plane.offset < edge_sq || (2 * plane.offset == edge_sq && plane.vertex < cell.plane(nearest).vertex)) {
        edge_sq = 2 * plane.offset;
        nearest = index;
      }
    }
    if (IsTriangle()) {
      toward = sum;
    }
  }

  // Whether it is the circumcentre of a triangle, and not on the clip.
  bool IsTriangle() const { return bisectors == 2; }
  double AreaOfTriangle() const { return 0.5 * std::abs(Cross(generators[0]->normal, generators[1]->normal)); }
  NodeName Name() const {
    const VertexId first = bisectors > 0 ? generators[0]->vertex : kNoVertex;
    const VertexId second = bisectors > 1 ? generators[1]->vertex : kNoVertex;
    return std::minmax(first, second);
  }

  std::array<const Plane<2>*, 2> generators = {};
  size_t bisectors = 0;
  double edge_sq = Assessment::kNone;  // squared distance to the nearest generator
  int nearest = -1;                    // plane of the nearest generator
  Point<2> toward;                     // from the site into the triangle
};

// Whether an own segment of `v` lies between the generators of a node: it is not yet what it will be, and no triangle
// lies there.
bool DomainRules::IsCrossed(VertexId v, const NodeView& node) const {
  if (!node.IsTriangle()) {
    return false;
  }
  const Plane<2>& first = *node.generators[0];
  const Plane<2>& second = *node.generators[1];
  const double turn = Cross(first.normal, second.normal) > 0 ? 1 : -1;
  const std::span<const HalfEdge> ways = domain_.WaysFrom(v);
  return std::any_of(ways.begin(), ways.end(), [&](HalfEdge h) {
    const Point<2> d = domain_.DirectionOf(h);
    return turn * Cross(first.normal, d) > 0 && turn * Cross(d, second.normal) > 0 &&
           !IsOn(first.vertex, SegmentOf(h)) && !IsOn(second.vertex, SegmentOf(h));
  });
}

// The squared distance from the site that a node in `face` must not exceed, if it does; else kNone.
DomainRules::Bound DomainRules::BoundOf(const Polytope<2>& cell, const CellNode<2>& node, const NodeView& view,
                                        uint32_t face) const {
  const MeshCriteria<2>& criteria = rules_.criteria();
  Bound bound{criteria.rho * criteria.rho * view.edge_sq, false};
  if (node.radius_sq <= bound.sq) {
    bound.sq = Assessment::kNone;
  }
  if (!criteria.sizes.IsUnbounded()) {
    const Point<2> x = {cell.site()[0] + node.x[0], cell.site()[1] + node.x[1]};
    const double size_sq = criteria.sizes.AtSq(x, std::min(node.radius_sq, bound.sq));
    if (node.radius_sq > size_sq && size_sq < bound.sq) {
      bound = {size_sq, true};
    }
  }
  const double max_area = domain_.faces().faces[face].max_area;
  if (view.IsTriangle() && kRadiusSqOfArea * max_area < bound.sq && view.AreaOfTriangle() > max_area) {
    bound = {kRadiusSqOfArea * max_area, true};
  }
  return bound;
}

Assessment DomainRules::AssessCell(VertexId v, Polytope<2>& cell, std::span<const uint32_t> segments,
                                   double edge_limit_sq, std::span<const NodeName> refused, MetPart& met) const {
  cell.Place();
  Assessment result;
  met = NearestMet(v, cell, segments);
  result.encroached_face = met.IsThere() ? 0 : -1;
  const double rho_sq = rules_.criteria().rho * rules_.criteria().rho;
  std::tuple<double, NodeName, Point<2>> best;  // of the bad node; its place, since some on the clip have no name
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    const CellNode<2>& node = cell.nodes()[i];
    const NodeView view(cell, node);
    const uint32_t face = domain_.FaceOfSector(v, domain_.SectorToward(v, view.toward));
    if (!domain_.faces().IsMeshed(face)) {
      continue;
    }
    result.radius_sq = std::max(result.radius_sq, node.radius_sq);
    result.is_clipped = result.is_clipped || !view.IsTriangle();
    const Bound bound = BoundOf(cell, node, view, face);
    if (bound.sq == Assessment::kNone) {
      continue;
    }
    if (IsCrossed(v, view)) {
      result.own_face_edge_sq = std::min(result.own_face_edge_sq, bound.sq / rho_sq);
      continue;
    }
    if (!bound.is_size && view.nearest >= 0 && IsAcross(v, cell.plane(view.nearest).vertex, view.toward)) {
      continue;
    }
    const NodeName name = view.Name();
    if (std::find(refused.begin(), refused.end(), name) != refused.end()) {
      continue;
    }
    const std::tuple<double, NodeName, Point<2>> own = {node.radius_sq, name, node.x};
    if (bound.sq > rho_sq * edge_limit_sq) {
      result.next_edge_sq = std::min(result.next_edge_sq, bound.sq / rho_sq);
    } else if (result.bad_node < 0 || bound.sq < result.bound_sq || (bound.sq == result.bound_sq && best < own)) {
      result.bound_sq = bound.sq;
      result.bad_node = static_cast<int>(i);
      result.bad_plane = view.nearest;
      result.is_too_large = bound.is_size;
      best = own;
    }
  }
  return result;
}

// Whether a node of the cell of `v` is the circumcentre of a triangle with a corner on a segment.
bool DomainRules::IsAtSegment(VertexId v, const NodeView& node) const {
  const auto generators = std::span(node.generators).first(node.bisectors);
  return !domain_.IsFree(v) || std::any_of(generators.begin(), generators.end(),
                                           [&](const Plane<2>* plane) { return !IsFree(plane->vertex); });
}

// Where a vertex is to split `met`, which the cell of `v` meets.
PlaceInDomain DomainRules::SplitPlace(VertexId v, const MetPart& met) const {
  const uint32_t segment = met.segment;
  const double length = domain_.LengthOf(segment);
  // At the distance of v from a common end, if the angle there is acute: no new distance comes into being.
  for (const HalfEdge h : domain_.WaysFrom(v)) {
    for (const bool is_b : {false, true}) {
      const VertexId apex = domain_.EndVertex(SegmentOf(h), is_b);
      for (const bool other_b : {false, true}) {
        if (apex == v || domain_.EndVertex(segment, other_b) != apex) {
          continue;
        }
        const Point<2> own = domain_.DirectionOf(HalfEdgeOf(SegmentOf(h), is_b));
        const Point<2> other = domain_.DirectionOf(HalfEdgeOf(segment, other_b));
        const double distance = domain_.DistanceFromEnd(v, SegmentOf(h), is_b);
        if (Dot<2>(own, other) > 0 && distance < (1 - kSameDistance) * length) {
          return {.on = {segment, other_b, distance}};
        }
      }
    }
  }
  // Else at the foot of v, as far as that is in the part.
  const double at = std::clamp(domain_.FootOf(structure_.point(v), segment).from_a, met.from, met.to);
  return RoundPlace(domain_.FromNearerEnd(segment, at), met.distance);
}

// The place of a vertex that comes for another reason than an equal distance, with nothing within `room` of it: at a
// round distance from an end with a small angle.
PlaceInDomain DomainRules::RoundPlace(SegmentPoint on, double room) const {
  const uint32_t segment = on.segment;
  const double length = domain_.LengthOf(segment);
  const bool is_acute_at_a = domain_.IsAcute(HalfEdgeOf(segment, false));
  const bool is_acute_at_b = domain_.IsAcute(HalfEdgeOf(segment, true));
  SplitOrder order = SplitOrder::kAny;
  if (is_acute_at_a && is_acute_at_b && domain_.SplitsOf(segment) == 0) {
    order = expected_ != nullptr && expected_->AreOn(segment) ? SplitOrder::kAfterExpected : SplitOrder::kFirst;
  }
  if (order == SplitOrder::kFirst) {
    on.distance = std::max(on.distance, length / 3);
  }
  if (on.is_from_b ? is_acute_at_b : is_acute_at_a) {
    const double rounded = RoundNear(on.distance, kRoundingShare * room);
    if (rounded < length) {
      on.distance = rounded;
    }
  }
  return {.on = on, .order = order};
}

// The insertion of a vertex at `place`, for `v`.
InsertionRequest<2> DomainRules::RequestAt(VertexId v, const PlaceInDomain& place, double edge_limit_sq,
                                           Workspace<2>& workspace) const {
  InsertionRequest<2> request;
  request.place = place;
  request.insertion.reason = Reason::kEncroachment;
  request.insertion.near = v;
  const Point<2> position = domain_.PositionOf(place.on);
  const double committed_sq = structure_.NearestTo(position, v, workspace).distance_sq;
  request.point.position = position;
  request.point.empty_radius_sq = expected_ != nullptr ? expected_->NearestSq(position, committed_sq)
                                                       : structure_.NearestUncommittedSq(position, committed_sq);
  request.insertion.empty_radius_sq = request.point.empty_radius_sq;
  request.insertion.edge_sq = request.point.empty_radius_sq;
  request.insertion.edge_limit_sq = edge_limit_sq;
  request.candidate = request.point;
  return request;
}

// The point that the bad node asks for, in the sector of its triangle if it can be; workspace.segments has the segments
// that are nearer to it than any vertex, whatever the leaves of the tree.
SteinerPoint<2> DomainRules::CandidateIn(size_t sector, VertexId v, const Polytope<2>& cell, const Assessment& found,
                                         bool is_at_segment, double edge_limit_sq, StepRules<2>::CellOf cell_of,
                                         Workspace<2>& workspace) const {
  const auto find_segments = [&](const SteinerPoint<2>& point) {
    structure_.SegmentsWithin(point.position, kBeyond * std::sqrt(point.empty_radius_sq), v, workspace);
    std::erase_if(workspace.segments, [&](uint32_t segment) {
      return domain_.DistanceSqTo(point.position, segment) > point.empty_radius_sq;
    });
  };
  SteinerPoint<2> candidate = rules_.CandidateFor(v, cell, found, is_at_segment, edge_limit_sq, cell_of);
  find_segments(candidate);
  const bool is_beyond = std::any_of(workspace.segments.begin(), workspace.segments.end(), [&](uint32_t s) {
    return !domain_.IsOn(v, s) &&
           CrossEachOther(cell.site(), candidate.position, domain_.EndOf(s, false), domain_.EndOf(s, true));
  });
  if (is_beyond || !LeadsInto(v, sector, candidate.position)) {
    // It is in the cell of another vertex, beyond a segment: a point of this cell takes its place.
    candidate = rules_.OffCenterFor(cell, found, is_at_segment);
    find_segments(candidate);
  }
  return candidate;
}

// The foot of `candidate` on the nearest of `segments`, if that is nearer than the empty radius over the square root of
// 2; or, if the candidate is not in the sector, on the nearest segment of `v`. `distance_sq` is how far it is then.
SegmentPoint DomainRules::YieldPlace(const SteinerPoint<2>& candidate, VertexId v, bool is_in_sector,
                                     std::span<const uint32_t> segments, double& distance_sq) const {
  distance_sq = is_in_sector ? 0.5 * candidate.empty_radius_sq : std::numeric_limits<double>::infinity();
  SegmentPoint place;
  for (const uint32_t segment : segments) {
    const auto [foot, away] = domain_.FootOf(candidate.position, segment);
    if (foot > 0 && foot < domain_.LengthOf(segment) && (is_in_sector || domain_.IsOn(v, segment)) &&
        (away * away < distance_sq || (away * away == distance_sq && segment < place.segment))) {
      distance_sq = away * away;
      place = domain_.FromNearerEnd(segment, foot);
    }
  }
  return place;
}

DomainRules::Answer DomainRules::NextRequest(VertexId v, const Polytope<2>& cell, const Assessment& found,
                                             const MetPart& met, double edge_limit_sq, StepRules<2>::CellOf cell_of,
                                             Workspace<2>& workspace) const {
  Answer answer;
  if (met.IsThere()) {
    answer.request = RequestAt(v, SplitPlace(v, met), edge_limit_sq, workspace);
    return answer;
  }
  if (found.bad_node < 0) {
    return answer;
  }
  const NodeView view(cell, cell.nodes()[found.bad_node]);
  const size_t sector = domain_.SectorToward(v, view.toward);
  const SteinerPoint<2> candidate =
      CandidateIn(sector, v, cell, found, IsAtSegment(v, view), edge_limit_sq, cell_of, workspace);
  double distance_sq = 0;
  const SegmentPoint place =
      YieldPlace(candidate, v, LeadsInto(v, sector, candidate.position), workspace.segments, distance_sq);
  const double rho_sq = rules_.criteria().rho * rules_.criteria().rho;
  if (place.IsOnSegment()) {
    const double rest_sq = std::max(0.0, candidate.empty_radius_sq - distance_sq);
    const bool is_acute =
        domain_.IsAcute(HalfEdgeOf(place.segment, false)) || domain_.IsAcute(HalfEdgeOf(place.segment, true));
    if (is_acute && rho_sq < kSafeRhoSq && !found.is_too_large && rest_sq < found.bound_sq / rho_sq) {
      answer.refused = view.Name();
    } else {
      answer.request = RequestAt(v, RoundPlace(place, std::sqrt(rest_sq)), edge_limit_sq, workspace);
    }
    return answer;
  }
  InsertionRequest<2>& request = answer.request.emplace();
  request.place.face = domain_.FaceOfSector(v, sector);
  request.candidate = candidate;
  request.point = candidate;
  request.insertion = {.reason = found.is_too_large ? Reason::kSize : Reason::kRatio,
                       .near = v,
                       .other = found.bad_plane >= 0 ? cell.plane(found.bad_plane).vertex : kNoVertex,
                       .edge_sq = found.bound_sq / rho_sq,
                       .edge_limit_sq = edge_limit_sq,
                       .empty_radius_sq = candidate.empty_radius_sq};
  return answer;
}

bool DomainRules::AreInOrder(std::span<const InsertionRequest<2>> requests) const {
  for (size_t i = 0; i < requests.size(); ++i) {
    const PlaceInDomain& place = requests[i].place;
    if (place.order == SplitOrder::kAny) {
      continue;
    }
    const auto is_there = [&](const InsertionRequest<2>& request) {
      return request.place.on.segment == place.on.segment;
    };
    const std::span<const InsertionRequest<2>> own = requests.first(i);
    const bool is_split = domain_.SplitsOf(place.on.segment) > 0 || std::any_of(own.begin(), own.end(), is_there);
    if (is_split != (place.order == SplitOrder::kAfterExpected)) {
      return false;
    }
  }
  return true;
}

double DomainRules::NearestSegmentSq(VertexId v, double limit_sq, Workspace<2>& workspace) const {
  const Point<2>& p = structure_.point(v);
  structure_.SegmentsWithin(p, std::sqrt(limit_sq), v, workspace);
  for (const uint32_t segment : workspace.segments) {
    if (domain_.IsOn(v, segment)) {
      continue;
    }
    limit_sq = std::min(limit_sq, domain_.DistanceSqTo(p, segment));
  }
  return limit_sq;
}

}  // namespace wellspace::core
