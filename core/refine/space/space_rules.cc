#include "core/refine/space/space_rules.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "core/geometry/box.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"
#include "core/refine/assess_in_box.h"
#include "core/refine/space/near_planes.h"
#include "core/refine/space/space_bounds.h"
#include "core/refine/space/surface_in_cell.h"
#include "core/refine/space/whole_cells.h"

namespace wellspace::core {
namespace {

// A cell whose farthest node is nearer than this share of the clear distance around its site does not meet the surface.
constexpr double kClear = 1 - 1e-6;

// Points are looked for on the surface as far away as so many times the distance to the nearest vertex: as far as the
// cell of the new vertex reaches, mostly.
constexpr double kLookAhead = 2;

// If more triangles may meet a trial cell, they are not looked at one by one.
constexpr size_t kMostInTrial = 1024;

Point<3> Sum(const Point<3>& a, const Point<3>& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

// The box of the nodes of a cell, in the coordinates of the input.
Box<3> BoxOfNodes(const Polytope<3>& cell) {
  Box<3> box{cell.site(), cell.site()};
  for (const CellNode<3>& node : cell.nodes()) {
    const Point<3> x = Sum(cell.site(), node.x);
    box.Include({x, x});
  }
  return box;
}

const char* NameOf(SurfaceRule rule) {
  switch (rule) {
    case SurfaceRule::kPatch:
      return "facets that meet another patch";
    case SurfaceRule::kSize:
      return "size of facets";
    case SurfaceRule::kDeviation:
      return "deviation of facets";
    case SurfaceRule::kShape:
      return "shape of facets";
    case SurfaceRule::kNone:
      break;
  }
  return "facets";
}

// The neighbours of the site of a cell, ascending, into `neighbours`.
void FindNeighbours(const Polytope<3>& cell, std::vector<VertexId>& neighbours) {
  neighbours.clear();
  for (const CellNode<3>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      if (cell.plane(index).kind == PlaneKind::kBisector) {
        neighbours.push_back(cell.plane(index).vertex);
      }
    }
  }
  std::sort(neighbours.begin(), neighbours.end());
  neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
}

// A vertex at `point` on the surface, next to which `near` is; its own distance from all vertices asks for it.
SpaceRequest RequestOnSurface(const SpacePlace& place, const SteinerPoint<3>& point, VertexId near,
                              double edge_limit_sq) {
  SpaceRequest request;
  request.insertion.reason = Reason::kEncroachment;
  request.insertion.near = near;
  request.insertion.empty_radius_sq = point.empty_radius_sq;
  request.insertion.edge_sq = point.empty_radius_sq;
  request.insertion.edge_limit_sq = edge_limit_sq;
  request.candidate = point;
  request.point = point;
  request.place = place;
  return request;
}

// Whether `a` comes before `b`: by rule, then the farther from all vertices, then by place.
bool IsBefore(const SurfaceAsk& a, const SurfaceAsk& b) {
  if (b.rule == SurfaceRule::kNone) {
    return true;
  }
  return std::tie(a.rule, b.radius_sq, a.at) < std::tie(b.rule, a.radius_sq, b.at);
}

}  // namespace

struct SpaceRules::Scratch {
  Scratch(const SpatialDomain& domain) : crossings(domain.index(), domain.curves().patch_of) {}

  EdgeCrossings crossings;
  std::vector<uint32_t> solids;  // by node
  std::vector<VertexId> neighbours;
  NearPlanes planes;  // of the cell that is looked at
  SurfaceInCell in_trial;
  std::vector<uint32_t> triangles;
  std::vector<VertexId> owners;
  Workspace<3> trial;
  Workspace<3> other;
  WholeCells whole;
};

SpaceRules::SpaceRules(const QueryStructure<3>& structure, SpatialDomain& domain, const StepRules<3>& rules)
    : structure_(structure),
      domain_(domain),
      rules_(rules),
      has_sizes_(!rules.criteria().sizes.IsUnbounded()),
      has_volumes_(std::any_of(domain.roles().begin(), domain.roles().end(),
                               [](const SolidRole& role) { return role.is_meshed && !std::isinf(role.max_volume); })),
      scratch_(std::make_shared<Scratch>(domain)) {}

double SpaceRules::FacetRadiusSqAt(const Point<3>& p) const {
  const double radius = domain_.criteria().facet_radius;
  if (!has_sizes_) {
    return radius * radius;
  }
  const double share = domain_.criteria().facet_share;
  return share * share * rules_.criteria().sizes.AtSq(p, radius * radius / (share * share));
}

double SpaceRules::ShareInBall(const Point<3>& p, const Point<3>& a, const Point<3>& b) {
  return DistanceSq<3>(p, Between(a, b, 0.5)) / (0.25 * DistanceSq<3>(a, b));
}

bool SpaceRules::IsTooCoarse(const Subsegment& subsegment, const Point<3>& a, const Point<3>& b) const {
  const double length_sq = DistanceSq<3>(a, b);
  const double bound_sq = FacetRadiusSqAt(Between(a, b, 0.5)) / (kRadiusPerEdge * kRadiusPerEdge);
  if (length_sq > bound_sq * (1 + kBallTolerance)) {
    return true;
  }
  const SurfaceCriteria& criteria = domain_.criteria();
  return length_sq > criteria.min_size * criteria.min_size &&
         domain_.DeviationOf(subsegment.curve, subsegment.from_arc, subsegment.to_arc) > criteria.tolerance;
}

bool SpaceRules::IsBad(const Subsegment& subsegment) const {
  if (domain_.IsFrozen(subsegment)) {
    return false;
  }
  const Point<3>& a = structure_.point(subsegment.from);
  const Point<3>& b = structure_.point(subsegment.to);
  if (!domain_.IsStrand(subsegment.curve) && IsTooCoarse(subsegment, a, b)) {
    return true;
  }
  const double length_sq = DistanceSq<3>(a, b);
  const Neighbor nearest = structure_.NearestTo(Between(a, b, 0.5), subsegment.from, scratch_->other);
  return nearest.vertex != subsegment.from && nearest.vertex != subsegment.to &&
         nearest.distance_sq < 0.25 * length_sq * (1 - kBallTolerance);
}

// Whether `p` is in the diametral ball of a subsegment; `share_sq` is how far from its centre, by the radius, squared.
bool SpaceRules::IsInBallOf(const Point<3>& p, const Subsegment& subsegment, double& share_sq) const {
  const Point<3>& a = structure_.point(subsegment.from);
  const Point<3>& b = structure_.point(subsegment.to);
  share_sq = ShareInBall(p, a, b);
  return share_sq < 1 - kBallTolerance;
}

std::optional<SpaceRequest> SpaceRules::NextCurveRequest(double edge_limit_sq) const {
  while (domain_.HasPending()) {
    const SpatialDomain::Pending pending = domain_.LastPending();
    if (pending.is_split) {
      if (!domain_.HasVertexAt(pending.curve, pending.from_arc)) {
        const Subsegment subsegment = domain_.SubsegmentAround(pending.curve, pending.from_arc);
        return RequestOnCurve(subsegment, edge_limit_sq,
                              (pending.from_arc - subsegment.from_arc) / (subsegment.to_arc - subsegment.from_arc));
      }
      domain_.DropLastPending();
      continue;
    }
    if (pending.vertex == kNoVertex) {
      const Subsegment subsegment = domain_.SubsegmentAt(pending.curve, pending.from_arc);
      if (IsBad(subsegment)) {
        domain_.NoteAsk({structure_.point(subsegment.from), "curves"});
        return RequestOnCurve(subsegment, edge_limit_sq);
      }
      domain_.DropLastPending();
      continue;
    }
    domain_.DropLastPending();
    structure_.UnplacedClippedVoronoi(pending.vertex, structure_.box(), scratch_->trial);
    scratch_->trial.cell.Place();
    const Point<3>& p = structure_.point(pending.vertex);
    FindNeighbours(scratch_->trial.cell, scratch_->neighbours);
    std::vector<Subsegment> near;
    const auto look_at = [&](const Subsegment& subsegment) {
      double share_sq = 0;
      if (subsegment.from != pending.vertex && subsegment.to != pending.vertex && IsInBallOf(p, subsegment, share_sq)) {
        near.push_back(subsegment);
      }
    };
    for (const VertexId u : scratch_->neighbours) {
      domain_.ForEachSubsegmentAt(domain_.PlaceOf(u), look_at);
    }
    domain_.ForEachNearStrand(p, look_at);
    const auto key = [](const Subsegment& s) { return std::tie(s.curve, s.from_arc); };
    std::sort(near.begin(), near.end(), [&](const Subsegment& s, const Subsegment& t) { return key(s) < key(t); });
    near.erase(std::unique(near.begin(), near.end(),
                           [&](const Subsegment& s, const Subsegment& t) { return key(s) == key(t); }),
               near.end());
    for (const Subsegment& subsegment : near) {
      domain_.AddPending({subsegment.curve, subsegment.from_arc});
    }
  }
  return std::nullopt;
}

SpaceRequest SpaceRules::RequestOnCurve(const Subsegment& subsegment, double edge_limit_sq, double share) const {
  const double arc = subsegment.from_arc + share * (subsegment.to_arc - subsegment.from_arc);
  const Point<3> position = domain_.PointAt(subsegment.curve, arc);
  const double empty_radius_sq = structure_.NearestTo(position, subsegment.from, scratch_->other).distance_sq;
  return RequestOnSurface({SpacePlace::Kind::kCurve, subsegment.curve, arc}, {position, empty_radius_sq},
                          subsegment.from, edge_limit_sq);
}

SpaceAssessment SpaceRules::AssessCell(VertexId v, Polytope<3>& cell, double edge_limit_sq, bool asks_surface,
                                       std::span<const TetrahedronName> passed_over) const {
  SpaceAssessment result;
  const SpacePlace& place = domain_.PlaceOf(v);
  const double rho = rules_.criteria().rho;
  if (!place.IsOnSurface() && cell.reach_sq() < kClear * place.along * place.along) {
    const bool is_meshed = domain_.IsMeshed(place.number);
    const bool asks_ratio_alone = !is_meshed || !(has_sizes_ || has_volumes_);
    if (cell.PlaceUnlessKeeps(asks_ratio_alone ? (is_meshed ? rho : domain_.criteria().outside_rho) : 0)) {
      result.is_plain = true;
      return result;
    }
    AssessVolume(v, cell, edge_limit_sq, {}, place.number, passed_over, result);
    return result;
  }
  cell.Place();
  const IndexNode from = domain_.index().Holding(BoxOfNodes(cell));
  const bool has_planes = TakePlanes(cell, from, NearPlanes::kMostForAll);
  FindSolids(cell, from, has_planes);
  AssessVolume(v, cell, edge_limit_sq, scratch_->solids, 0, passed_over, result);
  if (domain_.index().IsLeaf(from) && domain_.index().IsEmpty(from)) {
    return result;
  }
  result.is_at_surface = true;
  if (asks_surface) {
    AssessFacets(v, cell, edge_limit_sq, from, has_planes, result);
  }
  return result;
}

// Finds the solids of the nodes of a cell, into the scratch space. Nodes that no triangle parts lie in one.
void SpaceRules::FindSolids(const Polytope<3>& cell, IndexNode from, bool has_planes) const {
  std::vector<uint32_t>& solids = scratch_->solids;
  solids.clear();
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    const size_t known = has_planes ? scratch_->planes.FirstBeside(i) : i;
    solids.push_back(known < i ? solids[known] : domain_.index().SolidAt(Sum(cell.site(), cell.nodes()[i].x), from));
  }
}

void SpaceRules::AssessVolume(VertexId v, const Polytope<3>& cell, double edge_limit_sq,
                              std::span<const uint32_t> solids, uint32_t solid,
                              std::span<const TetrahedronName> passed_over, SpaceAssessment& result) const {
  const MeshCriteria<3>& criteria = rules_.criteria();
  const double rho_sq = criteria.rho * criteria.rho;
  SpaceBounds bounds{domain_, cell, criteria.sizes, solids, solid, rho_sq, has_sizes_, has_volumes_, passed_over};
  AssessInBox<3>(cell, rules_.FacesOf(v), rho_sq, Assessment::kNone, edge_limit_sq, bounds, result);
}

// Whether the middle of a facet or of one of its sides is farther from the surface than it may be; the triangle `near`
// is near it.
bool SpaceRules::IsFarFromSurface(const FacetCorners& corners, double most_sq, uint32_t near) const {
  for (const auto& [u_share, w_share] :
       {std::pair(1.0 / 3, 1.0 / 3), std::pair(0.5, 0.0), std::pair(0.0, 0.5), std::pair(0.5, 0.5)}) {
    Point<3> p = corners.site;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] += u_share * corners.u[axis] + w_share * corners.w[axis];
    }
    if (!domain_.index().IsWithin(p, most_sq, near)) {
      return true;
    }
  }
  return false;
}

SurfaceAsk SpaceRules::AskOf(const std::array<SpacePlace, 3>& places, const FacetCorners& corners,
                             const EdgeCrossings& crossings) const {
  const SurfaceCriteria& criteria = domain_.criteria();
  const double min_size_sq = criteria.min_size * criteria.min_size;
  const double u_sq = NormSq<3>(corners.u);
  const double w_sq = NormSq<3>(corners.w);
  const double third_sq = DistanceSq<3>(corners.u, corners.w);
  const double edge_sq = std::min({u_sq, w_sq, third_sq});
  SurfaceAsk ask;
  for (const Crossing& crossing : crossings.all()) {
    const double radius_sq = DistanceSq<3>(crossing.at, corners.site);
    const auto is_on_patch = [&](const SpacePlace& place) { return domain_.IsOnPatch(place, crossing.patch); };
    if (radius_sq > min_size_sq && !std::all_of(places.begin(), places.end(), is_on_patch) &&
        !domain_.creases().Shields(crossing.at)) {
      const SurfaceAsk other{SurfaceRule::kPatch, crossing.at, crossing.patch, radius_sq, std::min(edge_sq, radius_sq)};
      ask = IsBefore(other, ask) ? other : ask;
    }
  }
  if (ask.rule != SurfaceRule::kNone || !crossings.IsBoundary()) {
    return ask;
  }
  const Crossing& crossing = *crossings.NearestTo(corners.site);
  if (domain_.creases().Shields(crossing.at)) {
    return ask;
  }
  ask = {SurfaceRule::kNone, crossing.at, crossing.patch, DistanceSq<3>(crossing.at, corners.site), edge_sq};
  const double bound_sq = FacetRadiusSqAt(crossing.at);
  if (ask.radius_sq > bound_sq) {
    ask.rule = SurfaceRule::kSize;
    ask.edge_sq = bound_sq / (rules_.criteria().rho * rules_.criteria().rho);
    return ask;
  }
  if (ask.radius_sq <= min_size_sq) {
    return ask;
  }
  const Point<3> normal = Cross(corners.u, corners.w);
  const double normal_sq = NormSq<3>(normal);
  const Point<3> from_site = Difference<3>(crossing.at, corners.site);
  const double height = Dot<3>(normal, from_site);
  if (height * height > criteria.tolerance * criteria.tolerance * normal_sq ||
      IsFarFromSurface(corners, criteria.tolerance * criteria.tolerance, crossing.triangle)) {
    ask.rule = SurfaceRule::kDeviation;
    return ask;
  }
  // The sine of the least angle is its side over twice the radius, and that the product of the sides over four areas.
  const double others_sq = u_sq * w_sq * third_sq / edge_sq;
  if (normal_sq < criteria.least_sine * criteria.least_sine * others_sq) {
    ask.rule = SurfaceRule::kShape;
  }
  return ask;
}

// Takes the planes of the triangles near a cell, and the sides of its nodes; false if there are more than `most`.
bool SpaceRules::TakePlanes(const Polytope<3>& cell, IndexNode from, size_t most) const {
  if (!scratch_->planes.Take(domain_.index(), BoxOfNodes(cell), from, most)) {
    return false;
  }
  for (const CellNode<3>& node : cell.nodes()) {
    scratch_->planes.Add(Sum(cell.site(), node.x));
  }
  return true;
}

// Finds the crossings of the edge of a cell between two nodes.
void SpaceRules::FindCrossings(const Polytope<3>& cell, size_t i, size_t j, IndexNode from, bool has_planes) const {
  const Point<3> a = Sum(cell.site(), cell.nodes()[i].x);
  const Point<3> b = Sum(cell.site(), cell.nodes()[j].x);
  if (has_planes) {
    scratch_->crossings.FindAmong(a, b, scratch_->planes.Between(i, j));
  } else {
    scratch_->crossings.Find(a, b, from);
  }
}

void SpaceRules::AssessFacets(VertexId v, const Polytope<3>& cell, double edge_limit_sq, IndexNode from,
                              bool has_planes, SpaceAssessment& result) const {
  const std::span<const CellNode<3>> nodes = cell.nodes();
  result.is_at_surface = !has_planes || !scratch_->planes.IsEmpty();
  for (size_t i = 0; i < nodes.size() && result.is_at_surface; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      const size_t j = nodes[i].neighbours[k];
      const Plane<3>& first = cell.plane(nodes[i].planes[(k + 1) % 3]);
      const Plane<3>& second = cell.plane(nodes[i].planes[(k + 2) % 3]);
      if (j <= i || first.kind != PlaneKind::kBisector || second.kind != PlaneKind::kBisector) {
        continue;
      }
      FindCrossings(cell, i, j, from, has_planes);
      if (scratch_->crossings.all().empty()) {
        continue;
      }
      const SurfaceAsk ask = AskOf({domain_.PlaceOf(v), domain_.PlaceOf(first.vertex), domain_.PlaceOf(second.vertex)},
                                   {cell.site(), first.normal, second.normal}, scratch_->crossings);
      if (scratch_->crossings.all().size() > 1) {
        // A vertex that cuts off a part of the edge may leave one crossing, and a facet of the boundary.
        result.own_boundary_edge_sq = std::min({result.own_boundary_edge_sq, 2 * first.offset, 2 * second.offset});
      }
      if (ask.rule == SurfaceRule::kNone) {
        continue;
      }
      if (ask.edge_sq > edge_limit_sq) {
        result.next_edge_sq = std::min(result.next_edge_sq, ask.edge_sq);
      } else if (IsBefore(ask, result.ask)) {
        result.ask = ask;
        result.is_segment_encroached = true;
      }
    }
  }
}

std::optional<Subsegment> SpaceRules::EncroachedBy(const Point<3>& p) const {
  std::optional<Subsegment> deepest;
  double least_sq = 0;
  const auto look_at = [&](const Subsegment& subsegment) {
    double share_sq = 0;
    if (IsInBallOf(p, subsegment, share_sq) && !domain_.IsFrozen(subsegment) &&
        (!deepest.has_value() || std::tie(share_sq, subsegment.curve, subsegment.from_arc) <
                                     std::tie(least_sq, deepest->curve, deepest->from_arc))) {
      deepest = subsegment;
      least_sq = share_sq;
    }
  };
  for (const VertexId u : scratch_->neighbours) {
    domain_.ForEachSubsegmentAt(domain_.PlaceOf(u), look_at);
  }
  domain_.ForEachNearStrand(p, look_at);
  return deepest;
}

// The neighbours of the trial cell, ascending, that are corners of facets whose p may be in that cell.
const std::vector<VertexId>& SpaceRules::OwnersInTrial() const {
  const Polytope<3>& trial = scratch_->trial.cell;
  const Box<3> box = BoxOfNodes(trial);
  const IndexNode from = domain_.index().Holding(box);
  const bool has_planes = TakePlanes(trial, from, NearPlanes::kMostForAll);
  if (!has_planes && !domain_.index().FindFewNear(box, kMostInTrial, scratch_->triangles, from)) {
    return scratch_->neighbours;
  }
  std::vector<VertexId>& owners = scratch_->owners;
  owners.clear();
  scratch_->in_trial.Take(trial);
  for (const uint32_t t : has_planes ? scratch_->planes.AmidAll() : std::span<const uint32_t>(scratch_->triangles)) {
    scratch_->in_trial.AppendOwnersOfThree(domain_.index().TriangleAt(t), owners);
  }
  std::sort(owners.begin(), owners.end());
  owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
  return owners;
}

std::optional<SurfaceAsk> SpaceRules::FacetEncroachedBy(const Point<3>& x, VertexId& near, bool& is_shielded) const {
  std::optional<SurfaceAsk> nearest;
  const std::vector<VertexId>& owners = OwnersInTrial();
  const auto is_owner = [&](VertexId u) { return std::binary_search(owners.begin(), owners.end(), u); };
  double least_sq = 0;
  for (const VertexId u : owners) {
    if (!domain_.PlaceOf(u).IsOnSurface()) {
      continue;
    }
    const Polytope<3>& cell = scratch_->whole.CellOf(u, structure_, scratch_->other);
    const Point<3> from_site = Difference<3>(x, cell.site());
    const double half_sq = 0.5 * NormSq<3>(from_site);
    const auto is_beyond = [&](const CellNode<3>& node) { return Dot<3>(node.x, from_site) > half_sq; };
    const IndexNode from = domain_.index().Holding(BoxOfNodes(cell));
    const std::span<const CellNode<3>> nodes = cell.nodes();
    std::optional<bool> has_planes;  // which are not needed where no edge is looked at
    for (size_t i = 0; i < nodes.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) {
        const size_t j = nodes[i].neighbours[k];
        const Plane<3>& first = cell.plane(nodes[i].planes[(k + 1) % 3]);
        const Plane<3>& second = cell.plane(nodes[i].planes[(k + 2) % 3]);
        // The lowest of the three looks at it: all are neighbours of a vertex at x if p is in its cell.
        if (j <= i || first.kind != PlaneKind::kBisector || second.kind != PlaneKind::kBisector || first.vertex < u ||
            second.vertex < u || !(is_beyond(nodes[i]) || is_beyond(nodes[j])) || !is_owner(first.vertex) ||
            !is_owner(second.vertex)) {
          continue;
        }
        if (!has_planes.has_value()) {
          has_planes = TakePlanes(cell, from, NearPlanes::kMostForFew);
        }
        FindCrossings(cell, i, j, from, *has_planes);
        if (!scratch_->crossings.IsBoundary()) {
          continue;
        }
        const Crossing& crossing = *scratch_->crossings.NearestTo(cell.site());
        const double radius_sq = DistanceSq<3>(crossing.at, cell.site());
        const double share_sq = DistanceSq<3>(crossing.at, x) / radius_sq;
        if (share_sq < 1 - kBallTolerance && domain_.creases().Shields(crossing.at)) {
          is_shielded = true;
        } else if (share_sq < 1 - kBallTolerance &&
                   (!nearest.has_value() || std::tie(share_sq, crossing.at) < std::tie(least_sq, nearest->at))) {
          nearest = SurfaceAsk{SurfaceRule::kNone, crossing.at, crossing.patch, radius_sq, radius_sq};
          least_sq = share_sq;
          near = u;
        }
      }
    }
  }
  return nearest;
}

std::optional<SpaceRequest> SpaceRules::RequestOnPatch(VertexId near, const Point<3>& p, uint32_t patch,
                                                       double radius_sq, double edge_limit_sq) const {
  if (domain_.creases().Shields(p)) {
    return std::nullopt;
  }
  if (domain_.curve_count() > 0 && rules_.IsLongEnough({p, radius_sq}) && domain_.MayBeInBall(p)) {
    FindTrialNeighbours(p, near);
    if (const std::optional<Subsegment> subsegment = EncroachedBy(p); subsegment.has_value()) {
      return RequestOnCurve(*subsegment, edge_limit_sq);
    }
  }
  return RequestOnSurface({SpacePlace::Kind::kPatch, patch, 0}, {p, radius_sq}, near, edge_limit_sq);
}

// Finds the neighbours that a vertex at `p` would have, ascending, into the scratch space.
void SpaceRules::FindTrialNeighbours(const Point<3>& p, VertexId near) const {
  Polytope<3>& cell = scratch_->trial.cell;
  structure_.TrialVoronoi(p, near, scratch_->trial);
  cell.Place();
  FindNeighbours(cell, scratch_->neighbours);
}

SpaceRules::Answer SpaceRules::NextRequest(VertexId v, const Polytope<3>& cell, const SpaceAssessment& found,
                                           double edge_limit_sq, StepRules<3>::CellOf cell_of) const {
  Answer answer;
  if (found.ask.rule != SurfaceRule::kNone) {
    domain_.NoteAsk({found.ask.at, NameOf(found.ask.rule)});
    answer.request = RequestOnPatch(v, found.ask.at, found.ask.patch, found.ask.radius_sq, edge_limit_sq);
    return answer;
  }
  const std::optional<InsertionRequest<3>> asked = rules_.NextRequest(v, cell, found, edge_limit_sq, cell_of);
  if (!asked.has_value()) {
    return answer;
  }
  const Point<3>& x = asked->point.position;
  domain_.NoteAsk({x, found.is_too_large ? "size of tetrahedra" : "shape of tetrahedra"});
  if (found.bad_node >= 0 && domain_.creases().Shields(x)) {
    answer.refused_node = NameOf(cell, cell.nodes()[found.bad_node]);
    return answer;
  }
  const double radius_sq = asked->point.empty_radius_sq;
  const double ahead_sq = kLookAhead * kLookAhead * radius_sq;
  const std::optional<SurfacePoint> surface = domain_.index().Nearest(x, ahead_sq);
  // A point on a vertex has no cell; the loop refuses it.
  if (rules_.IsLongEnough(asked->point) && surface.has_value() && surface->distance_sq < radius_sq) {
    FindTrialNeighbours(x, v);
    if (const std::optional<Subsegment> subsegment = EncroachedBy(x); subsegment.has_value()) {
      answer.request = RequestOnCurve(*subsegment, edge_limit_sq);
      return answer;
    }
    VertexId near = v;
    bool is_shielded = false;
    if (const std::optional<SurfaceAsk> facet = FacetEncroachedBy(x, near, is_shielded); facet.has_value()) {
      answer.request = RequestOnPatch(near, facet->at, facet->patch, facet->radius_sq, edge_limit_sq);
      return answer;
    }
    if (is_shielded && found.bad_node >= 0) {
      answer.refused_node = NameOf(cell, cell.nodes()[found.bad_node]);
      return answer;
    }
  }
  SpaceRequest& request = answer.request.emplace();
  request.insertion = asked->insertion;
  request.candidate = asked->candidate;
  request.point = asked->point;
  request.place = {SpacePlace::Kind::kSolid, domain_.index().SolidAt(x),
                   std::sqrt(surface.has_value() ? surface->distance_sq : ahead_sq)};
  return answer;
}

void SpaceRules::AppendNotices(VertexId v, const Polytope<3>& cell, const SpaceAssessment& found,
                               std::vector<NeighborNotice>& notices) const {
  rules_.AppendNotices(cell, rules_.FacesOf(v), found, notices);
  if (!found.is_at_surface) {
    return;
  }
  for (const CellNode<3>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      const Plane<3>& plane = cell.plane(index);
      if (plane.kind == PlaneKind::kBisector) {
        notices.push_back({plane.vertex, 2 * plane.offset, true});
      }
    }
  }
}

}  // namespace wellspace::core
