#include "core/sliver/surface_carrier.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/geometry/triangle.h"
#include "core/simplex/solid_labels.h"

namespace wellspace::core {
namespace {

// The clear distance around a vertex in a solid is looked for up to so many times the distance to a
// neighbour: farther than its cell reaches, mostly.
constexpr double kLookAhead = 2;

// The tetrahedron of `s` with a vertex at `p` in the place of the one in `slot`.
Simplex<3> CornersWith(const Triangulation<3>& triangulation, const Cavity::Facet& facet, const Point<3>& p) {
  Simplex<3> corners = triangulation.Corners(facet.simplex);
  corners[facet.slot] = p;
  return corners;
}

// The vertices of a facet.
std::array<VertexId, 3> VerticesOf(const Triangulation<3>& triangulation, SimplexId s, int slot) {
  std::array<VertexId, 3> vertices;
  for (int i = 0, to = 0; i < 4; ++i) {
    if (i != slot) {
      vertices[to++] = triangulation.item(s).vertices[i];
    }
  }
  return vertices;
}

}  // namespace

bool SurfaceCarrier::MayMove(VertexId v) const {
  const SpacePlace& place = domain_.PlaceOf(v);
  // The first vertex of a loop without corners is where the loop begins and ends.
  return place.kind != SpacePlace::Kind::kCorner && !(place.kind == SpacePlace::Kind::kCurve && place.along == 0) &&
         !domain_.IsFixed(place);
}

SurfaceCarrier::Track SurfaceCarrier::TrackOf(const Triangulation<3>& triangulation, VertexId v) const {
  Track track{domain_.PlaceOf(v), triangulation.faces(v), triangulation.point(v)};
  if (track.place.kind == SpacePlace::Kind::kCurve) {
    track.arcs = {track.place.along, track.place.along};
    domain_.ForEachSubsegmentAt(track.place, [&](const Subsegment& subsegment) {
      track.arcs = {std::min(track.arcs[0], subsegment.from_arc), std::max(track.arcs[1], subsegment.to_arc)};
    });
  }
  return track;
}

std::optional<Point<3>> SurfaceCarrier::Bring(const Triangulation<3>& triangulation, const Track& track,
                                              const Point<3>& p) const {
  switch (track.place.kind) {
    case SpacePlace::Kind::kCorner:
    case SpacePlace::Kind::kCollar:
      return std::nullopt;
    case SpacePlace::Kind::kCurve: {
      const double arc = ArcNear(track, p);
      if (!(arc > track.arcs[0] && arc < track.arcs[1])) {
        return std::nullopt;
      }
      return box_.Bring(triangulation, track.faces, domain_.PointAt(track.place.number, arc));
    }
    case SpacePlace::Kind::kPatch: {
      const std::optional<Point<3>> nearest = domain_.NearestOnPatch(track.place.number, p, Distance<3>(p, track.from));
      return nearest.has_value() ? box_.Bring(triangulation, track.faces, *nearest) : std::nullopt;
    }
    case SpacePlace::Kind::kSolid:
      break;
  }
  const std::optional<Point<3>> brought = box_.Bring(triangulation, track.faces, p);
  const bool stays = brought.has_value() && domain_.index().SolidAt(*brought) == track.place.number;
  return stays ? brought : std::nullopt;
}

bool SurfaceCarrier::IsMeshed(const Simplex<3>& corners) const {
  return domain_.IsMeshed(domain_.index().SolidAt(LabelledPoint(corners))) && !domain_.IsAtAcuteCrease(corners);
}

bool SurfaceCarrier::Accepts(const Triangulation<3>& triangulation, const RepairStep& step) {
  if (domain_.creases().Shields(step.to)) {
    return false;
  }
  ListVertices(triangulation, step);
  if (!KeepsBalls(triangulation, step) || !KeepsOwnSubsegments(triangulation, step)) {
    return false;
  }
  ListFacets(triangulation, step);
  ListFilling(triangulation, step);
  return std::all_of(facets_.begin(), facets_.end(),
                     [&](const Facet& facet) { return Keeps(triangulation, step, facet); });
}

// Lists the vertices that the vertex of the step would have as neighbours.
void SurfaceCarrier::ListVertices(const Triangulation<3>& triangulation, const RepairStep& step) {
  vertices_.clear();
  for (const auto& [s, slot] : step.cavity.boundary) {
    const std::array<VertexId, 3> vertices = VerticesOf(triangulation, s, slot);
    vertices_.insert(vertices_.end(), vertices.begin(), vertices.end());
  }
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
}

// Lists the facets of the tetrahedra at the vertex of the step.
void SurfaceCarrier::ListFacets(const Triangulation<3>& triangulation, const RepairStep& step) {
  facets_.clear();
  sides_.clear();
  for (const Cavity::Facet& facet : step.cavity.boundary) {
    const Point<3> centre = LabelledPoint(CornersWith(triangulation, facet, step.to));
    const std::array<VertexId, 3> vertices = VerticesOf(triangulation, facet.simplex, facet.slot);
    const SimplexId beyond = triangulation.item(facet.simplex).neighbours[facet.slot];
    if (beyond != kNoSimplex) {
      facets_.push_back({vertices, {centre, LabelledPoint(triangulation.Corners(beyond))}});
    }
    for (int i = 0; i < 3; ++i) {
      std::array<VertexId, 2> edge = {vertices[i], vertices[(i + 1) % 3]};
      if (edge[1] < edge[0]) {
        std::swap(edge[0], edge[1]);
      }
      sides_.push_back({edge, centre});
    }
  }
  std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) { return a.edge < b.edge; });
  for (size_t i = 0; i + 1 < sides_.size(); ++i) {
    if (sides_[i].edge == sides_[i + 1].edge) {  // else the facet is on a face of the box
      facets_.push_back(
          {{sides_[i].edge[0], sides_[i].edge[1], step.vertex}, {sides_[i].centre, sides_[i + 1].centre}});
    }
  }
}

// Lists the facets of the rest of the filling, but for those that are on the boundary of the cavity.
void SurfaceCarrier::ListFilling(const Triangulation<3>& triangulation, const RepairStep& step) {
  for (const SimplexId s : step.hole) {
    if (triangulation.IsInCavity(s)) {
      continue;
    }
    for (int i = 0; i < 4; ++i) {
      const SimplexId beyond = triangulation.item(s).neighbours[i];
      if (beyond == kNoSimplex || triangulation.IsInCavity(beyond)) {
        continue;
      }
      facets_.push_back({VerticesOf(triangulation, s, i),
                         {LabelledPoint(triangulation.Corners(s)), LabelledPoint(triangulation.Corners(beyond))}});
    }
  }
}

// Whether the facet asks for no insertion.
bool SurfaceCarrier::Keeps(const Triangulation<3>& triangulation, const RepairStep& step, const Facet& facet) {
  Box<3> box{facet.centres[0], facet.centres[0]};
  box.Include({facet.centres[1], facet.centres[1]});
  crossings_.Find(facet.centres[0], facet.centres[1], domain_.index().Holding(box));
  if (crossings_.all().empty()) {
    return true;
  }
  std::array<std::pair<Point<3>, SpacePlace>, 3> corners;
  for (int i = 0; i < 3; ++i) {
    const VertexId u = facet.vertices[i];
    const bool is_new = u == step.vertex;
    const bool has_place = Index(u) < domain_.vertex_count();
    corners[i] = {is_new ? step.to : triangulation.point(u), has_place ? domain_.PlaceOf(u) : SpacePlace{}};
  }
  const auto& [site, u, w] = corners;
  const SpaceRules::FacetCorners relative{site.first, Difference<3>(u.first, site.first),
                                          Difference<3>(w.first, site.first)};
  // Where facets that are shielded ask for nothing, they still have to be of one patch.
  const bool is_of_patches =
      domain_.creases().IsEmpty() ||
      std::all_of(crossings_.all().begin(), crossings_.all().end(), [&](const Crossing& crossing) {
        return !domain_.creases().Shields(crossing.at) ||
               std::all_of(corners.begin(), corners.end(),
                           [&](const auto& corner) { return domain_.IsOnPatch(corner.second, crossing.patch); });
      });
  return is_of_patches &&
         rules_.AskOf({site.second, u.second, w.second}, relative, crossings_).rule == SurfaceRule::kNone;
}

// Whether the vertex of the step is in no diametral ball of a subsegment of others. If it were, the subsegment would be
// an edge of the cavity: the middle of a subsegment lies between the circumcentres around it.
bool SurfaceCarrier::KeepsBalls(const Triangulation<3>& triangulation, const RepairStep& step) const {
  bool keeps = true;
  const auto look_at_subsegment = [&](const Subsegment& s) {
    if (s.from != step.vertex && s.to != step.vertex &&
        SpaceRules::ShareInBall(step.to, triangulation.point(s.from), triangulation.point(s.to)) <
            1 - SpaceRules::kBallTolerance) {
      keeps = false;
    }
  };
  const auto look_at = [&](VertexId u) {
    if (u != step.vertex && domain_.PlaceOf(u).IsOnCurve()) {
      domain_.ForEachSubsegmentAt(domain_.PlaceOf(u), look_at_subsegment);
    }
  };
  domain_.ForEachNearStrand(step.to, look_at_subsegment);
  for (const SimplexId s : step.cavity.simplices) {
    const auto& vertices = triangulation.item(s).vertices;
    std::for_each(vertices.begin(), vertices.end(), look_at);
  }
  return keeps;
}

// Whether the subsegments of a vertex on a curve are fine enough, and have no vertex in their diametral balls.
bool SurfaceCarrier::KeepsOwnSubsegments(const Triangulation<3>& triangulation, const RepairStep& step) const {
  if (Index(step.vertex) >= domain_.vertex_count() || domain_.PlaceOf(step.vertex).kind != SpacePlace::Kind::kCurve) {
    return true;
  }
  const Track track = TrackOf(triangulation, step.vertex);
  const double arc = ArcNear(track, step.to);
  bool keeps = true;
  domain_.ForEachSubsegmentAt(track.place, [&](Subsegment s) {
    const bool ends_here = s.to == step.vertex;
    const VertexId other = ends_here ? s.from : s.to;
    (ends_here ? s.to_arc : s.from_arc) = arc;
    const Point<3>& end = triangulation.point(other);
    const auto is_outside = [&](VertexId u) {
      return u == other ||
             !(SpaceRules::ShareInBall(triangulation.point(u), end, step.to) < 1 - SpaceRules::kBallTolerance);
    };
    keeps = keeps && std::binary_search(vertices_.begin(), vertices_.end(), other) &&
            !rules_.IsTooCoarse(s, end, step.to) && std::all_of(vertices_.begin(), vertices_.end(), is_outside);
  });
  return keeps;
}

void SurfaceCarrier::Moved(const Triangulation<3>& triangulation, VertexId v, VertexId near) {
  const SpacePlace& place = domain_.PlaceOf(v);
  if (place.kind == SpacePlace::Kind::kCurve) {
    domain_.MoveAlong(v, ArcNear(TrackOf(triangulation, v), triangulation.point(v)));
  } else if (place.kind == SpacePlace::Kind::kSolid) {
    domain_.MoveInSolid(v, ClearAround(triangulation, v, near));
  }
}

void SurfaceCarrier::Added(const Triangulation<3>& triangulation, VertexId v, VertexId near) {
  domain_.MakeRoom(1);
  domain_.AddVertex(
      {SpacePlace::Kind::kSolid, domain_.index().SolidAt(triangulation.point(v)), ClearAround(triangulation, v, near)});
}

// A distance within which nothing of the surface is; `near` is a neighbour.
double SurfaceCarrier::ClearAround(const Triangulation<3>& triangulation, VertexId v, VertexId near) const {
  const Point<3>& p = triangulation.point(v);
  const double within_sq = kLookAhead * kLookAhead * DistanceSq<3>(p, triangulation.point(near));
  const std::optional<SurfacePoint> nearest = domain_.index().Nearest(p, within_sq);
  return std::sqrt(nearest.has_value() ? nearest->distance_sq : within_sq);
}

}  // namespace wellspace::core
