// The carrier of a mesh in space: vertices of the surface stay on it, and facets on it keep their rules.
#ifndef WELLSPACE_CORE_SLIVER_SURFACE_CARRIER_H_
#define WELLSPACE_CORE_SLIVER_SURFACE_CARRIER_H_

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/point.h"
#include "core/refine/space/crossing.h"
#include "core/refine/space/space_place.h"
#include "core/refine/space/space_rules.h"
#include "core/refine/space/spatial_domain.h"
#include "core/sliver/triangulation.h"
#include "core/sliver/vertex_carrier.h"

namespace wellspace::core {

// A corner stays, and so do vertices that protect acute creases; a vertex on a curve moves along it, between neighbours
// there; one on a patch moves to the nearest point of that patch; one in a solid stays in it, and on its faces of the
// box. The functions are those of VertexCarrier.
//
// A tetrahedron lies in the solid of its circumcentre (LabelledPoint), asked for whenever it matters: labels are kept
// nowhere. A step is accepted if (1) of all facets that it makes, or that get another tetrahedron on a side, none asks
// for an insertion by SpaceRules; (2) the vertex is in no diametral ball of a subsegment, and no vertex is in those of
// its own; (3) its subsegments are fine enough.
//
// Thread safety: as VertexCarrier.
class SurfaceCarrier {
 public:
  struct Track {
    SpacePlace place;
    FaceMask faces = 0;
    Point<3> from{};
    std::array<double, 2> arcs{};  // of the neighbours on a curve
  };
  static constexpr bool kMeshesAll = false;

  // `rules`: those of the criteria that repair keeps to.
  //
  // REQUIRES:   `domain` has the places of all vertices of the triangulation; it and `rules` outlive this.
  SurfaceCarrier(SpatialDomain& domain, const SpaceRules& rules)
      : domain_(domain), rules_(rules), crossings_(domain.index(), domain.curves().patch_of) {}

  bool MayMove(VertexId v) const;
  Track TrackOf(const Triangulation<3>& triangulation, VertexId v) const;
  std::optional<Point<3>> Bring(const Triangulation<3>& triangulation, const Track& track, const Point<3>& p) const;
  bool MayHold(const Triangulation<3>& triangulation, const Point<3>& p) const {
    return box_.MayHold(triangulation, p);
  }
  bool IsMeshed(const Simplex<3>& corners) const;
  double OutsideRho(const Simplex<3>& corners) const {
    return domain_.IsAtAcuteCrease(corners) ? rules_.step_rules().criteria().rho : domain_.criteria().outside_rho;
  }
  bool Accepts(const Triangulation<3>& triangulation, const RepairStep& step);
  void Moved(const Triangulation<3>& triangulation, VertexId v, VertexId near);
  void Added(const Triangulation<3>& triangulation, VertexId v, VertexId near);
  uint64_t MemoryBytes() const { return domain_.MemoryBytes(); }

 private:
  // A facet that a step makes, or that gets another tetrahedron on a side.
  struct Facet {
    std::array<VertexId, 3> vertices{};
    std::array<Point<3>, 2> centres{};  // of the tetrahedra on its sides
  };
  // A tetrahedron that a step makes of a facet, seen from one of the edges of that.
  struct Side {
    std::array<VertexId, 2> edge{};
    Point<3> centre{};
  };

  double ArcNear(const Track& track, const Point<3>& p) const {
    return domain_.ArcNear(track.place.number, track.arcs[0], track.arcs[1], p);
  }
  double ClearAround(const Triangulation<3>& triangulation, VertexId v, VertexId near) const;
  void ListFacets(const Triangulation<3>& triangulation, const RepairStep& step);
  void ListFilling(const Triangulation<3>& triangulation, const RepairStep& step);
  void ListVertices(const Triangulation<3>& triangulation, const RepairStep& step);
  bool Keeps(const Triangulation<3>& triangulation, const RepairStep& step, const Facet& facet);
  bool KeepsBalls(const Triangulation<3>& triangulation, const RepairStep& step) const;
  bool KeepsOwnSubsegments(const Triangulation<3>& triangulation, const RepairStep& step) const;

  SpatialDomain& domain_;
  const SpaceRules& rules_;
  BoxCarrier box_;

  // Scratch of Accepts.
  EdgeCrossings crossings_;
  std::vector<Facet> facets_;
  std::vector<Side> sides_;
  std::vector<VertexId> vertices_;  // of the cavity, ascending, without that of the step
};
static_assert(VertexCarrier<SurfaceCarrier>);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_SURFACE_CARRIER_H_
