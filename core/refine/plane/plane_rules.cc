#include "core/refine/plane/plane_rules.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/geometry/segment.h"
#include "core/refine/assess_nodes.h"
#include "core/refine/plane/split_place.h"
#include "core/refine/rounding.h"
#include "core/refine/steiner_point.h"

namespace wellspace::core {
namespace {

// From this rho on, by the square, no vertex that takes the place of another comes nearer than the edge that asks.
constexpr double kSafeRhoSq = 2 * (1 - 1e-12);

// Whether the segments p q and a b cross each other in their interiors, as doubles tell.
bool CrossEachOther(const Point<2>& p, const Point<2>& q, const Point<2>& a, const Point<2>& b) {
  const Point<2> way = Difference<2>(q, p);
  const Point<2> along = Difference<2>(b, a);
  return Cross(way, Difference<2>(a, p)) * Cross(way, Difference<2>(b, p)) < 0 &&
         Cross(along, Difference<2>(p, a)) * Cross(along, Difference<2>(q, a)) < 0;
}

// The faces around a vertex, by direction.
class FacesAround {
 public:
  // REQUIRES:   `domain` outlives this.
  FacesAround(const PlanarDomain& domain, VertexId v) : domain_(domain), ways_(domain.WaysFrom(v)) {
    const std::vector<uint32_t>& left_face = domain.faces().left_face;
    first_ = ways_.empty() ? domain.FaceOf(v) : left_face[ways_[0]];
    are_equal_ = std::all_of(ways_.begin(), ways_.end(), [&](HalfEdge h) { return left_face[h] == first_; });
  }

  // The face of the sector which `d` leads into.
  uint32_t Toward(const Point<2>& d) const {
    return are_equal_ ? first_ : domain_.faces().left_face[ways_[domain_.SectorToward(ways_, d)]];
  }

 private:
  const PlanarDomain& domain_;
  const std::span<const HalfEdge> ways_;
  uint32_t first_ = 0;
  bool are_equal_ = false;
};

}  // namespace

double PlaneRules::NearestFeatureSq(VertexId v, double limit_sq, Workspace<2>& workspace) const {
  const Point<2>& p = structure().point(v);
  structure().SegmentsWithin(p, std::sqrt(limit_sq), v, workspace);
  for (const uint32_t segment : workspace.segments) {
    if (domain().IsOn(v, segment)) {
      continue;
    }
    limit_sq = std::min(limit_sq, domain().DistanceSqTo(p, segment));
  }
  return limit_sq;
}

// Whether `v` and `u` are at the same distance from a common end of their segments, which make an angle of less than 60
// degrees there; and the triangle on their edge, which lies in the direction `toward` from v, is on the side of that
// end, or between both segments. No vertex could make it better.
bool PlaneRules::IsAcross(VertexId v, VertexId u, const Point<2>& toward) const {
  for (const HalfEdge h : domain().WaysFrom(v)) {
    for (const bool is_b : {false, true}) {
      if (IsAcrossFrom(SegmentOf(h), is_b, v, u, toward)) {
        return true;
      }
    }
  }
  return false;
}

// IsAcross with the end of `segment`, which v is on, as the common end.
bool PlaneRules::IsAcrossFrom(uint32_t segment, bool is_b, VertexId v, VertexId u, const Point<2>& toward) const {
  const VertexId apex = domain().EndVertex(segment, is_b);
  if (apex == v || apex == u) {
    return false;
  }
  const Point<2>& p = structure().point(v);
  const Point<2> edge = Difference<2>(visible_.point(u), p);
  const double distance = domain().DistanceFromEnd(v, segment, is_b);
  if (!(NormSq<2>(edge) < distance * distance)) {
    return false;  // at equal distances: an angle of 60 degrees or more
  }
  const bool is_inward = Cross(edge, toward) * Cross(edge, Difference<2>(domain().EndOf(segment, is_b), p)) > 0;
  const double beyond = (1 + kSameDistance) * distance;
  for (const HalfEdge h : visible_.WaysFrom(u)) {
    const uint32_t other = SegmentOf(h);
    for (const bool other_b : {false, true}) {
      if (other == segment || domain().EndVertex(other, other_b) != apex ||
          std::abs(visible_.DistanceFromEnd(u, other, other_b) - distance) > kSameDistance * distance) {
        continue;
      }
      const bool both_go_on = domain().LengthOf(segment) > beyond && domain().LengthOf(other) > beyond;
      if (is_inward || both_go_on) {
        return true;
      }
    }
  }
  return false;
}

// Whether an own segment of `v` lies between the generators of a node: the node is not final yet, and no triangle
// lies there.
bool PlaneRules::IsCrossed(VertexId v, const NodeView& node) const {
  if (!node.IsTriangle()) {
    return false;
  }
  const Plane<2>& first = *node.generators[0];
  const Plane<2>& second = *node.generators[1];
  const double turn = Cross(first.normal, second.normal) > 0 ? 1 : -1;
  const std::span<const HalfEdge> ways = domain().WaysFrom(v);
  return std::any_of(ways.begin(), ways.end(), [&](HalfEdge h) {
    const Point<2> d = domain().DirectionOf(h);
    return turn * Cross(first.normal, d) > 0 && turn * Cross(d, second.normal) > 0 &&
           !visible_.IsOn(first.vertex, SegmentOf(h)) && !visible_.IsOn(second.vertex, SegmentOf(h));
  });
}

// The squared distance from the site that a node in `face` must not exceed, if it does; else kNone.
PlaneRules::Bound PlaneRules::BoundOf(const Polytope<2>& cell, const CellNode<2>& node, const NodeView& view,
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
  const double max_area = domain().faces().faces[face].max_area;
  if (view.IsTriangle() && kRadiusSqOfArea * max_area < bound.sq && view.AreaOfTriangle() > max_area) {
    bound = {kRadiusSqOfArea * max_area, true};
  }
  return bound;
}

PlaneAssessment PlaneRules::AssessCell(VertexId v, Polytope<2>& cell, std::span<const uint32_t> segments,
                                       double edge_limit_sq, const PassedOver& passed_over) const {
  PlaneAssessment result;
  const bool keeps_ratio = cell.KeepsRatio(plain_ratio_);
  if (keeps_ratio && !MayMeetAny(domain(), v, cell, segments)) {
    result.is_plain = true;
    return result;
  }
  cell.Place();
  result.met = NearestMet(domain(), v, cell, segments, passed_over.segments);
  result.is_segment_encroached = result.met.IsThere();
  if (keeps_ratio) {
    return result;  // no node is on the clip, or bad
  }
  const FacesAround around(domain(), v);
  const double rho_sq = rules_.criteria().rho * rules_.criteria().rho;
  // The farthest first; then by name and place, since some on the clip have no name.
  using Rank = std::tuple<double, NodeName, Point<2>>;
  const auto look = [&](const CellNode<2>& node) -> NodeVerdict<Rank> {
    const NodeView view(cell, node);
    const uint32_t face = around.Toward(view.toward);
    if (!domain().faces().IsMeshed(face)) {
      return {};
    }
    result.radius_sq = std::max(result.radius_sq, node.radius_sq);
    result.is_clipped = result.is_clipped || !view.IsTriangle();
    const Bound bound = BoundOf(cell, node, view, face);
    if (bound.sq == Assessment::kNone) {
      return {};
    }
    if (IsCrossed(v, view)) {
      return {.bound_sq = bound.sq, .is_at_own_wall = true};
    }
    if (!bound.is_size && view.nearest >= 0 && IsAcross(v, cell.plane(view.nearest).vertex, view.toward)) {
      return {};
    }
    const NodeName name = view.Name();
    if (std::find(passed_over.nodes.begin(), passed_over.nodes.end(), name) != passed_over.nodes.end()) {
      return {};
    }
    return {bound.sq, bound.is_size, false, view.nearest, {node.radius_sq, name, node.x}};
  };
  AssessNodes(cell, rho_sq, edge_limit_sq, look, result);
  return result;
}

// Whether a node of the cell of `v` is the circumcentre of a triangle with a corner on a segment.
bool PlaneRules::IsAtSegment(VertexId v, const NodeView& node) const {
  const auto generators = std::span(node.generators).first(node.bisectors);
  return !domain().IsInFace(v) || std::any_of(generators.begin(), generators.end(),
                                              [&](const Plane<2>* plane) { return !visible_.IsInFace(plane->vertex); });
}

// The insertion of a vertex at `place`, for `v`.
PlaneRequest PlaneRules::RequestAt(VertexId v, const PlanePlace& place, double edge_limit_sq,
                                   Workspace<2>& workspace) const {
  PlaneRequest request;
  request.place = place;
  request.insertion.reason = Reason::kEncroachment;
  request.insertion.near = v;
  request.point.position = domain().PositionOf(place.on);
  request.point.empty_radius_sq = visible_.NearestSq(request.point.position, v, workspace);
  request.insertion.empty_radius_sq = request.point.empty_radius_sq;
  request.insertion.edge_sq = request.point.empty_radius_sq;
  request.insertion.edge_limit_sq = edge_limit_sq;
  request.candidate = request.point;
  return request;
}

// The point that the bad node asks for, in the sector of its triangle if it can be; workspace.segments has the segments
// that are nearer to it than any vertex, whatever the leaves of the tree: the ball about a point of a cell that touches
// its site is covered by those about the nodes, so that leaves it meets have been opened for the cell. That is the own
// one, for which `segments` are listed, or the one of cell_of, for which they are in the workspace.
SteinerPoint<2> PlaneRules::CandidateIn(size_t sector, VertexId v, const Polytope<2>& cell,
                                        std::span<const uint32_t> segments, const Assessment& found, bool is_at_segment,
                                        double edge_limit_sq, StepRules<2>::CellOf cell_of,
                                        Workspace<2>& workspace) const {
  workspace.segments.clear();
  const SteinerPoint<2> candidate = rules_.CandidateFor(v, cell, found, is_at_segment, edge_limit_sq, cell_of);
  AddSegmentsNear(candidate, segments, workspace);
  const bool is_beyond = std::any_of(workspace.segments.begin(), workspace.segments.end(), [&](uint32_t s) {
    return !domain().IsOn(v, s) &&
           CrossEachOther(cell.site(), candidate.position, domain().EndOf(s, false), domain().EndOf(s, true));
  });
  if (is_beyond || !LeadsInto(v, sector, candidate.position)) {
    // It is in the cell of another vertex, beyond a segment: a point of this cell takes its place.
    return OffCenterIn(cell, segments, found, is_at_segment, workspace);
  }
  return candidate;
}

// The off-centre for the bad node, and in workspace.segments those that are nearer to it than any vertex.
SteinerPoint<2> PlaneRules::OffCenterIn(const Polytope<2>& cell, std::span<const uint32_t> segments,
                                        const Assessment& found, bool is_at_segment, Workspace<2>& workspace) const {
  const SteinerPoint<2> candidate = rules_.OffCenterFor(cell, found, is_at_segment);
  workspace.segments.clear();
  AddSegmentsNear(candidate, segments, workspace);
  return candidate;
}

// Adds `segments` to those in the workspace, and leaves of all those that are nearer to `point` than any vertex.
void PlaneRules::AddSegmentsNear(const SteinerPoint<2>& point, std::span<const uint32_t> segments,
                                 Workspace<2>& workspace) const {
  workspace.segments.insert(workspace.segments.end(), segments.begin(), segments.end());
  std::erase_if(workspace.segments, [&](uint32_t segment) {
    return domain().DistanceSqTo(point.position, segment) > point.empty_radius_sq;
  });
}

// The foot of `candidate` on the nearest of `segments`, if that is nearer than the empty radius over the square root of
// 2; or, if the candidate is not in the sector, on the nearest segment of `v`. `distance_sq` is how far it is then.
SegmentPoint PlaneRules::YieldPlace(const SteinerPoint<2>& candidate, VertexId v, bool is_in_sector,
                                    std::span<const uint32_t> segments, double& distance_sq) const {
  distance_sq = is_in_sector ? 0.5 * candidate.empty_radius_sq : std::numeric_limits<double>::infinity();
  SegmentPoint place;
  for (const uint32_t segment : segments) {
    const auto [foot, away] = domain().FootOf(candidate.position, segment);
    if (foot > 0 && foot < domain().LengthOf(segment) && (is_in_sector || domain().IsOn(v, segment)) &&
        (away * away < distance_sq || (away * away == distance_sq && segment < place.segment))) {
      distance_sq = away * away;
      place = domain().FromNearerEnd(segment, foot);
    }
  }
  return place;
}

PlaneRules::Answer PlaneRules::NextRequest(VertexId v, const Polytope<2>& cell, std::span<const uint32_t> segments,
                                           const PlaneAssessment& found, double edge_limit_sq,
                                           StepRules<2>::CellOf cell_of, Workspace<2>& workspace) const {
  Answer answer;
  if (found.met.IsThere()) {  // rule 1
    answer.request = RequestAt(v, SplitPlace(visible_, v, found.met), edge_limit_sq, workspace);
    if (!rules_.IsLongEnough(answer.request->point)) {
      // Two vertices at one distance from the end of a tiny angle: either is in the disc of the other's segment by
      // rounding. PlaneMesher::Conform has the last word.
      answer.request.reset();
      answer.passed_segment = found.met.segment;
    }
    return answer;
  }
  if (found.bad_node < 0) {  // rule 3
    return answer;
  }
  const NodeView view(cell, cell.nodes()[found.bad_node]);
  const size_t sector = domain().SectorToward(v, view.toward);
  const bool is_at_segment = IsAtSegment(v, view);
  SteinerPoint<2> candidate =
      CandidateIn(sector, v, cell, segments, found, is_at_segment, edge_limit_sq, cell_of, workspace);
  double distance_sq = 0;
  const auto yield_place = [&] {
    return YieldPlace(candidate, v, LeadsInto(v, sector, candidate.position), workspace.segments, distance_sq);
  };
  const auto has_small_angle = [&](uint32_t segment) {
    return domain().HasSmallAngle(HalfEdgeOf(segment, false)) || domain().HasSmallAngle(HalfEdgeOf(segment, true));
  };
  SegmentPoint place = yield_place();
  const double rho_sq = rules_.criteria().rho * rules_.criteria().rho;
  if (place.IsOnSegment() && is_at_segment && (rho_sq >= kSafeRhoSq || has_small_angle(place.segment))) {
    // A point that was walked to is worth no more than its foot. Nearer by there may be one that need not yield.
    candidate = OffCenterIn(cell, segments, found, is_at_segment, workspace);
    place = yield_place();
  }
  if (place.IsOnSegment()) {  // the point yields to its foot
    const double rest_sq = std::max(0.0, candidate.empty_radius_sq - distance_sq);
    const bool is_small = has_small_angle(place.segment);
    if (is_small && rho_sq < kSafeRhoSq && !found.is_too_large && rest_sq < found.bound_sq / rho_sq) {
      answer.refused_node = view.Name();
      return answer;
    }
    answer.request = RequestAt(v, RoundPlace(visible_, place, std::sqrt(rest_sq)), edge_limit_sq, workspace);
    if (is_small && !found.is_too_large && !rules_.IsLongEnough(answer.request->point)) {
      answer.request.reset();
      answer.refused_node = view.Name();
    }
    return answer;
  }
  PlaneRequest& request = answer.request.emplace();
  request.place.face = domain().FaceOfSector(v, sector);
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

}  // namespace wellspace::core
