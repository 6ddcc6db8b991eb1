// A domain in space while it is refined: its surface, and where each vertex is on it. MakeSpaceCloud makes it of a
// prepared surface. The refinement and SpaceMesher add each vertex here that is added to the QueryStructure.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPATIAL_DOMAIN_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPATIAL_DOMAIN_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/features/surface_curves.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/point.h"
#include "core/refine/space/acute_creases.h"
#include "core/refine/space/space_place.h"
#include "core/refine/space/subsegment_balls.h"
#include "core/tree/morton.h"
#include "core/tree/surface_index.h"

namespace wellspace::core {

// How a solid is treated: whether it is meshed, its region, and the largest volume of a tetrahedron in it.
struct SolidRole {
  bool is_meshed = false;
  int32_t region = 0;
  double max_volume = std::numeric_limits<double>::infinity();
};

// How well facets and curves are to meet the surface. Lengths are on the scale of the computation.
struct SurfaceCriteria {
  double tolerance = 0;
  double least_sine = 0;  // of an angle of a facet
  double facet_radius = std::numeric_limits<double>::infinity();
  double facet_share = 1;  // of the bound that sizes are for tetrahedra
  double min_size = 0;
  double outside_rho = 4;

  bool operator==(const SurfaceCriteria&) const = default;
};

// The part of a curve between two vertices that follow each other on it.
struct Subsegment {
  uint32_t curve = 0;
  double from_arc = 0;
  double to_arc = 0;
  VertexId from = kNoVertex;
  VertexId to = kNoVertex;
};

// Curves, corners and patches are those of SurfaceCurves; corners are numbered in their order there. That a vertex is
// on one of them is never computed. Strands of acute creases are split as curves are, and have the numbers after those.
//
// Thread safety: thread-compatible; const functions may run at once.
// Invariants: (1) surface and roles stay as they were made; (2) the vertices on a curve are in order along it.
class SpatialDomain {
 public:
  // REQUIRES:   solids, curves and roles are those of the complex.
  SpatialDomain(SurfaceComplex complex, Solids solids, SurfaceCurves curves);
  SpatialDomain(const SpatialDomain&) = delete;
  SpatialDomain& operator=(const SpatialDomain&) = delete;

  // Builds the index, which everything else asks, on the grid of the structure.
  //
  // Errors:     as SurfaceIndex::Build.
  absl::Status BuildIndex(const MortonGrid<3>& grid, const RunContext& context);

  const SurfaceComplex& complex() const { return complex_; }
  const SurfaceCurves& curves() const { return curves_; }
  const Solids& solids() const { return solids_; }
  const SurfaceIndex& index() const { return index_; }

  // By solid.
  std::vector<SolidRole>& roles() { return roles_; }
  const std::vector<SolidRole>& roles() const { return roles_; }
  bool IsMeshed(uint32_t solid) const { return roles_[solid].is_meshed; }
  // Whether a solid that is meshed is around a place.
  bool IsMeshedAt(const SpacePlace& place) const;

  // Patches.

  // The patches at a curve, or at a strand.
  std::span<const uint32_t> PatchesAtCurve(uint32_t curve) const { return RowOf(patches_at_curve_, curve); }
  std::span<const uint32_t> PatchesAtCorner(uint32_t corner) const { return RowOf(patches_at_corner_, corner); }
  // The patches that a place is on, ascending.
  //
  // REQUIRES:   the place outlives the result.
  std::span<const uint32_t> PatchesAt(const SpacePlace& place) const;
  bool IsOnPatch(const SpacePlace& place, uint32_t patch) const;
  bool IsOnPatch(VertexId v, uint32_t patch) const { return IsOnPatch(PlaceOf(v), patch); }
  // Whether a patch is bounded by a curve.
  bool HasCurves(uint32_t patch) const { return has_curves_[patch]; }
  // The point of a patch that is nearest to `p`, if one is no farther than `within`, and maybe if it is less than twice
  // as far. Of equally near ones that of the lowest triangle.
  //
  // Complexity: that of SurfaceIndex::NearestOf.
  std::optional<Point<3>> NearestOnPatch(uint32_t patch, const Point<3>& p, double within) const;

  // Curves.

  uint32_t curve_count() const { return static_cast<uint32_t>(curves_.curve_count()); }
  bool IsLoop(uint32_t curve) const { return curves_.PointsOf(curve).front() == curves_.PointsOf(curve).back(); }
  double LengthOf(uint32_t curve) const { return arcs_[curves_.first_point[curve + 1] - 1]; }
  // The lengths of arc of the points of a curve.
  std::span<const double> ArcsOf(uint32_t curve) const {
    return std::span(arcs_).subspan(curves_.first_point[curve], curves_.PointsOf(curve).size());
  }
  // The edge of the complex between two of its points.
  uint32_t EdgeOf(uint32_t a, uint32_t b) const;
  // The point at a length of arc from the first point of a curve, or at a parameter of a strand; on it up to rounding.
  //
  // Complexity: O(log points); of a strand that of NearestOnPatch.
  Point<3> PointAt(uint32_t curve, double arc) const;
  // How far the part of a curve between two lengths of arc is from the segment that joins its ends.
  //
  // Complexity: O(points between).
  double DeviationOf(uint32_t curve, double from_arc, double to_arc) const;
  // The length of arc, between two others, at the point of that part of a curve that is nearest to `p`; rounded.
  //
  // Complexity: O(points between).
  double ArcNear(uint32_t curve, double from_arc, double to_arc, const Point<3>& p) const;
  // The curves that begin or end in a corner, each once; at a loop twice.
  struct CurveEnd {
    uint32_t curve = 0;
    bool is_last = false;
  };
  std::span<const CurveEnd> EndsAt(uint32_t corner) const {
    return {ends_at_.data() + first_end_[corner], first_end_[corner + 1] - first_end_[corner]};
  }
  // The length of arc at which a curve, seen from one of its ends, first is so far from that; of the other end if it
  // never is.
  //
  // Complexity: O(points nearer than that).
  double ArcAtDistance(const CurveEnd& end, double radius) const;

  // Acute creases.

  // Takes the acute creases: before there are vertices. Those at the ends of strands have to be told then.
  void TakeCreases(AcuteCreases creases);
  void SetEndOfStrand(uint32_t strand, int end, VertexId v) { chains_[curve_count() + strand].emplace(end, v); }
  const AcuteCreases& creases() const { return creases_; }
  bool IsStrand(uint32_t curve) const { return curve >= curve_count(); }
  uint32_t NumberOfStrand(uint32_t strand) const { return curve_count() + strand; }
  // The vertex at a length of arc of a curve.
  //
  // REQUIRES:   there is one.
  VertexId VertexOnCurve(uint32_t curve, double arc) const { return chains_[curve].find(arc)->second; }
  bool HasVertexAt(uint32_t curve, double arc) const { return chains_[curve].contains(arc); }
  // Whether a tetrahedron has its corners in tubes and balls of acute creases, where all vertices stay. A function of
  // the set of its corners.
  bool IsAtAcuteCrease(const Simplex<3>& corners) const;
  // Whether a subsegment is never split.
  bool IsFrozen(const Subsegment& subsegment) const;
  // Whether a vertex at `place` stays there, to protect an acute crease.
  bool IsFixed(const SpacePlace& place) const;

  // Vertices.

  // Adds the vertex after the last. Where it splits a strand, the others of its group are to be split as well.
  void AddVertex(const SpacePlace& place);
  void MakeRoom(size_t vertices);
  // Moves a vertex along its curve.
  //
  // REQUIRES:   `along` lies between the lengths of arc of its neighbours there; it is not the first of a loop.
  // Complexity: O(log vertices of the curve).
  void MoveAlong(VertexId v, double along);
  // Notes that a vertex in a solid is elsewhere in it: nothing of the surface is nearer than `clear`.
  void MoveInSolid(VertexId v, double clear) { places_[Index(v)].along = clear; }
  // Has a vertex in a solid be in another one, beyond a facet that is near the surface.
  void MoveIntoSolid(VertexId v, uint32_t solid) { places_[Index(v)].number = solid; }
  uint32_t vertex_count() const { return static_cast<uint32_t>(places_.size()); }
  const SpacePlace& PlaceOf(VertexId v) const { return places_[Index(v)]; }

  // Subsegments.

  // The subsegment that begins at `from_arc`, where a vertex is.
  Subsegment SubsegmentAt(uint32_t curve, double from_arc) const;
  // Calls f(subsegment) for those that end at a vertex at `place`.
  template <typename F>
  void ForEachSubsegmentAt(const SpacePlace& place, F f) const;
  // Calls f(subsegment) for those of all curves.
  template <typename F>
  void ForEachSubsegment(F f) const {
    ForEachSubsegmentOf(0, curve_count(), f);
  }
  // Whether `p` may be in the diametral ball of a subsegment, or a strand's; false only where it is surely in none.
  //
  // Complexity: O(log subsegments) for most points.
  bool MayBeInBall(const Point<3>& p) const {
    bool may_be = balls_.MayHold(p);
    ForEachNearStrand(p, [&](const Subsegment& /*subsegment*/) { may_be = true; });
    return may_be;
  }
  // Calls f(subsegment) for those of strands that may have `p` in their diametral balls.
  template <typename F>
  void ForEachNearStrand(const Point<3>& p, F f) const {
    creases_.ForEachStrandNear(
        p, [&](uint32_t strand) { ForEachSubsegmentOf(NumberOfStrand(strand), NumberOfStrand(strand) + 1, f); });
  }

  // Subsegments and vertices on curves that have to be looked at before anything else is inserted.

  struct Pending {
    uint32_t curve = 0;
    double from_arc = 0;
    VertexId vertex = kNoVertex;  // if there is one, it may be too near to subsegments
    bool is_split = false;        // a strand is to have a vertex at that parameter, as another of its group has
  };
  bool HasPending() const { return !pending_.empty(); }
  const Pending& LastPending() const { return pending_.back(); }
  void AddPending(const Pending& pending) { pending_.push_back(pending); }
  void DropLastPending() { pending_.pop_back(); }
  // Makes all subsegments pending.
  void MakeAllPending();
  // The subsegment of a strand in which that parameter is.
  Subsegment SubsegmentAround(uint32_t curve, double arc) const;

  // The last request, for errors: its place, and its rule.
  struct LastAsk {
    Point<3> at{};
    const char* rule = "";  // "size of facets", and such
  };
  void NoteAsk(const LastAsk& ask) { last_ask_ = ask; }
  const LastAsk& last_ask() const { return last_ask_; }

  SurfaceCriteria& criteria() { return criteria_; }
  const SurfaceCriteria& criteria() const { return criteria_; }

  uint64_t MemoryBytes() const;

 private:
  struct Rows {
    std::vector<uint32_t> first;
    std::vector<uint32_t> of;
  };
  static std::span<const uint32_t> RowOf(const Rows& rows, uint32_t i) {
    return {rows.of.data() + rows.first[i], rows.first[i + 1] - rows.first[i]};
  }
  void FindPatches();
  void FindEnds();
  Point<3> PointOnStrand(const Strand& strand, double share) const;
  template <typename F>
  void ForEachSubsegmentOf(uint32_t first, uint32_t end, F f) const;
  void AddBallOf(const Subsegment& subsegment);

  SurfaceComplex complex_;
  Solids solids_;
  SurfaceCurves curves_;
  SurfaceIndex index_;
  std::vector<SolidRole> roles_;
  std::vector<double> arcs_;  // by point of curves: from the first point of the curve
  Rows patches_at_curve_;
  Rows patches_at_corner_;
  std::vector<bool> has_curves_;  // by patch
  std::vector<std::array<uint32_t, 2>> solids_at_patch_;
  std::vector<uint32_t> first_end_;  // by corner, and one more
  std::vector<CurveEnd> ends_at_;
  SurfaceCriteria criteria_;
  AcuteCreases creases_;

  HugeVector<SpacePlace> places_;  // by vertex
  std::vector<std::map<double, VertexId>>
      chains_;             // by curve and strand: the vertices by arc; of a loop the first one at both ends
  SubsegmentBalls balls_;  // of curves; known from MakeAllPending on, until a vertex is moved along its curve
  std::vector<Pending> pending_;
  LastAsk last_ask_;
};

template <typename F>
void SpatialDomain::ForEachSubsegmentAt(const SpacePlace& place, F f) const {
  const auto before = [&](uint32_t curve, double arc) {
    const auto at = chains_[curve].find(arc);
    if (at != chains_[curve].begin()) {
      f(SubsegmentAt(curve, std::prev(at)->first));
    }
  };
  if (place.kind == SpacePlace::Kind::kCurve) {
    before(place.number, place.along);
    f(SubsegmentAt(place.number, place.along));
    if (place.along == 0) {  // of a loop without corners
      before(place.number, LengthOf(place.number));
    }
  } else if (place.kind == SpacePlace::Kind::kCorner) {
    for (const CurveEnd& end : EndsAt(place.number)) {
      if (end.is_last) {
        before(end.curve, LengthOf(end.curve));
      } else {
        f(SubsegmentAt(end.curve, 0));
      }
    }
  }
}

template <typename F>
void SpatialDomain::ForEachSubsegmentOf(uint32_t first, uint32_t end, F f) const {
  for (uint32_t curve = first; curve < end; ++curve) {
    for (auto at = chains_[curve].begin(), next = at; at != chains_[curve].end() && ++next != chains_[curve].end();
         at = next) {
      f(Subsegment{curve, at->first, next->first, at->second, next->second});
    }
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPATIAL_DOMAIN_H_
