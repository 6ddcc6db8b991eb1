#include "core/refine/step_rules.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/dimensions.h"
#include "core/refine/rounding.h"

namespace wellspace::core {
namespace {

// A cell is clipped at this times the longest edge of its bucket; for a large rho at that and a quarter more, so that a
// bad node is seen.
constexpr double kClipFactor = 4;
constexpr double kClipRatioFactor = 1.25;

// A cell is clipped by the square around this times the petal of an edge, so that the petal is surely within.
constexpr double kPetalShare = 1.01;

constexpr std::pair<int, int> kNoNode = {-1, -1};

// The node of a cell in the plane that lies on the bisectors of `u` and `w`, and the plane of u's; kNoNode if there is
// none.
std::pair<int, int> NodeBetween(const Polytope<2>& cell, VertexId u, VertexId w) {
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    const auto [first, second] = cell.nodes()[i].planes;
    if (cell.plane(first).vertex == u && cell.plane(second).vertex == w) {
      return {static_cast<int>(i), first};
    }
    if (cell.plane(first).vertex == w && cell.plane(second).vertex == u) {
      return {static_cast<int>(i), second};
    }
  }
  return kNoNode;
}

// For the bad node of the cell of `v` in the plane, at most sqrt(top_sq) away: the point that PetalPoint finds in that
// cell, or in that of the other end of the edge where the way away from all vertices is there. `cell_of` computes the
// other cell, clipped by a box that holds the petal and by `clip` around its site.
template <typename CellOf>
SteinerPoint<2> PointInPetal(VertexId v, const Polytope<2>& cell, const Assessment& found, double top_sq, double rho,
                             double clip, CellOf cell_of) {
  const Plane<2>& edge = cell.plane(found.bad_plane);
  const std::array<uint16_t, 2>& planes = cell.nodes()[found.bad_node].planes;
  const Plane<2>& third = cell.plane(planes[planes[0] == found.bad_plane ? 1 : 0]);
  // If the angle at v is obtuse, points farther than the node are on the boundary of the other cell.
  if (third.kind == PlaneKind::kBisector && Dot<2>(edge.normal, third.normal) < 0) {
    const auto [centre, radius] = PetalOf(cell, found.bad_node, found.bad_plane, top_sq);
    Box<2> bounds = CubeAround<2>(edge.source.generator, clip);
    for (int i = 0; i < 2; ++i) {
      const double middle = cell.site()[i] + centre[i];
      bounds.low[i] = std::max(bounds.low[i], middle - kPetalShare * radius);
      bounds.high[i] = std::min(bounds.high[i], middle + kPetalShare * radius);
    }
    const Polytope<2>* const other = cell_of(edge.vertex, bounds);
    const auto [node, plane] = other != nullptr ? NodeBetween(*other, v, third.vertex) : kNoNode;
    if (node >= 0) {
      return PetalPoint(*other, node, plane, top_sq, rho);
    }
  }
  return PetalPoint(cell, found.bad_node, found.bad_plane, top_sq, rho);
}

}  // namespace

template <int D>
StepRules<D>::StepRules(const QueryStructure<D>& structure, const MeshCriteria<D>& criteria, double min_edge)
    : structure_(structure),
      criteria_(criteria),
      min_edge_(min_edge),
      off_center_factor_(OffCenterFactor<D>(criteria.rho, false)),
      boundary_factor_(OffCenterFactor<D>(criteria.rho, criteria.criterion == Criterion::kRadiusEdge)),
      plain_ratio_(criteria.criterion == Criterion::kRadiusEdge && criteria.sizes.IsUnbounded() ? criteria.rho : 0),
      clip_factor_(std::max(kClipFactor, kClipRatioFactor * criteria.rho)) {}

template <int D>
Assessment StepRules<D>::AssessCell(Polytope<D>& cell, FaceMask site_faces, double edge_limit_sq) const {
  if (cell.PlaceUnlessKeeps(plain_ratio_)) {
    Assessment plain;
    plain.is_plain = true;
    return plain;
  }
  return Assess<D>(cell, site_faces, criteria_, edge_limit_sq);
}

template <int D>
std::optional<InsertionRequest<D>> StepRules<D>::NextRequest(VertexId v, const Polytope<D>& cell,
                                                             const Assessment& found, double edge_limit_sq,
                                                             CellOf cell_of) const {
  InsertionRequest<D> request;
  Insertion& insertion = request.insertion;
  insertion.near = v;
  insertion.edge_limit_sq = edge_limit_sq;
  if (found.bad_node >= 0) {
    insertion.reason = found.is_too_large ? Reason::kSize : Reason::kRatio;
    insertion.edge_sq = found.bound_sq / (criteria_.rho * criteria_.rho);
    insertion.other = found.bad_plane >= 0 ? cell.plane(found.bad_plane).vertex : kNoVertex;
    request.candidate = CandidateFor(v, cell, found, IsAtBoundary(v, cell, found.bad_node), edge_limit_sq, cell_of);
  } else if (found.encroached_face >= 0) {
    insertion.reason = Reason::kEncroachment;
    const double distance = structure_.box().DistanceToFace(structure_.point(v), found.encroached_face);
    insertion.edge_sq = distance * distance;
    request.candidate = EncroachmentPoint<D>(cell, structure_.faces(v), found.encroached_face);
  } else {
    return std::nullopt;
  }
  request.point = SnapToBoundary<D>(structure_.box(), request.candidate);
  insertion.empty_radius_sq = request.point.empty_radius_sq;
  return request;
}

// How far from the site an off-centre for the bad node lies at most, squared.
template <int D>
double StepRules<D>::DistanceSqFor(const Assessment& found, bool is_at_boundary) const {
  const double factor = found.is_too_large ? kSizeFactor : is_at_boundary ? boundary_factor_ : off_center_factor_;
  return factor * factor * found.bound_sq;
}

// An off-centre, unless the node is nearer; then the node, or for a triangle a better point.
template <int D>
SteinerPoint<D> StepRules<D>::CandidateFor(VertexId v, const Polytope<D>& cell, const Assessment& found,
                                           bool is_at_boundary, double edge_limit_sq, CellOf cell_of) const {
  if constexpr (D == 2) {
    const double distance_sq = DistanceSqFor(found, is_at_boundary);
    const bool is_within = cell.nodes()[found.bad_node].radius_sq <= distance_sq;
    if (is_within && !found.is_too_large && criteria_.criterion == Criterion::kRadiusEdge) {
      const double clip = clip_factor_ * std::sqrt(edge_limit_sq);
      return PointInPetal(v, cell, found, distance_sq, criteria_.rho, clip, cell_of);
    }
  }
  return OffCenterFor(cell, found, is_at_boundary);
}

template <int D>
SteinerPoint<D> StepRules<D>::OffCenterFor(const Polytope<D>& cell, const Assessment& found,
                                           bool is_at_boundary) const {
  return OffCenter<D>(cell, found.bad_node, found.bad_plane, DistanceSqFor(found, is_at_boundary));
}

// Whether `node` of `cell`, that of `v`, is the circumcentre of a simplex with a corner on the boundary of the box.
template <int D>
bool StepRules<D>::IsAtBoundary(VertexId v, const Polytope<D>& cell, int node) const {
  const std::array<uint16_t, D>& planes = cell.nodes()[node].planes;
  return structure_.faces(v) != 0 || std::any_of(planes.begin(), planes.end(), [&](uint16_t index) {
           const Plane<D>& plane = cell.plane(index);
           return plane.kind == PlaneKind::kBisector && structure_.box().FacesOf(plane.source.generator) != 0;
         });
}

template <int D>
void StepRules<D>::AppendNotices(const Polytope<D>& cell, FaceMask site_faces, const Assessment& found,
                                 std::vector<NeighborNotice>& notices) const {
  const bool is_well_spaced = criteria_.criterion == Criterion::kWellSpaced;
  if (!is_well_spaced && site_faces == 0 && found.encroached_face < 0) {
    return;
  }
  for (const CellNode<D>& node : cell.nodes()) {
    const bool is_on_boundary = cell.FacesOf(node) != 0;
    if (!is_on_boundary && !is_well_spaced) {
      continue;
    }
    for (const uint16_t index : node.planes) {
      const Plane<D>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        notices.push_back({plane.vertex, 2 * plane.offset, is_on_boundary});
      }
    }
  }
}

template <int D>
void StepRules<D>::AppendNodesToWatch(VertexId v, const Polytope<D>& cell, const Assessment& found,
                                      std::vector<WatchedNode<D>>& watched) const {
  if (found.own_boundary_edge_sq == Assessment::kNone) {
    return;
  }
  const double rounding = 4 * std::sqrt(D) * RoundingIn<D>(structure_.box());
  const double least_sq = criteria_.rho * criteria_.rho * found.own_boundary_edge_sq * (1 - kLengthRounding);
  for (const CellNode<D>& node : cell.nodes()) {
    const auto faces = static_cast<FaceMask>(cell.FacesOf(node) & structure_.faces(v));
    if (faces == 0 || node.radius_sq <= least_sq) {
      continue;
    }
    WatchedNode<D> one{cell.site(), (1 + kLengthRounding) * std::sqrt(node.radius_sq) + rounding, faces};
    for (int i = 0; i < D; ++i) {
      one.centre[i] += (faces >> (2 * i) & 3) == 0 ? node.x[i] : 0;
    }
    watched.push_back(one);
  }
}

#define WELLSPACE_INSTANTIATE(D) template class StepRules<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
