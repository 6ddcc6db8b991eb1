// The rules of refinement in a domain in space: the faults of a cell, and the insertions for it. SpaceSteps asks
// them in each step of a vertex.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPACE_RULES_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPACE_RULES_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/space/crossing.h"
#include "core/refine/space/space_place.h"
#include "core/refine/space/spatial_domain.h"
#include "core/refine/space/tetrahedron_name.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Why a point of the surface is inserted, the first that applies.
enum class SurfaceRule : uint8_t {
  kNone,
  kPatch,      // S1: the facet meets a patch that one of its corners is not on
  kSize,       // S2: it is too large
  kDeviation,  // S3: it is too far from the surface
  kShape,      // S4: it has too small an angle
};

// The point of the surface that a cell asks for.
struct SurfaceAsk {
  SurfaceRule rule = SurfaceRule::kNone;
  Point<3> at{};
  uint32_t patch = 0;
  double radius_sq = 0;  // the squared distance to the nearest vertices, of which the site is one
  double edge_sq = 0;    // that asks for it
};

struct SpaceAssessment : Assessment {
  SurfaceAsk ask;              // there if is_segment_encroached
  bool is_at_surface = false;  // the cell may meet it
};

// A facet of the mesh is dual to an edge of cells; where that edge crosses the surface, the point p is as far from the
// three corners of the facet, and no vertex is nearer. A cell asks for one insertion at a time. The first of these that
// applies decides:
//   1. A subsegment is too long, too far from its curve, or has a vertex in its diametral ball: it is split
//      (NextCurveRequest). No other rule inserts a vertex into such a ball, so that curves are settled once and for all
//      before anything else.
//      Strands of acute creases are subsegments too, and those of a group are split together.
//   2. A facet breaks one of SurfaceRule: p is inserted, unless it is in the diametral ball of a subsegment, which is
//      split then.
//   3. A node breaks a bound, of rho, of a size or of a volume, or the cell touches a face of the box: the point that
//      the rules of the box ask for. If that is in the diametral ball of a subsegment, or nearer to the p of a facet of
//      the boundary than the facet's corners are, that is split, or that p inserted.
//   4. Nothing.
// No vertex goes where acute creases shield it: facets that ask for one there do not count, and a node that does is
// passed over.
//
// For the criteria of one run. The results of the functions depend on cells and on the places of vertices alone.
//
// Thread safety: thread-compatible; not even const functions may run at once: they share scratch space.
class SpaceRules {
 public:
  // REQUIRES:   all references outlive this.
  SpaceRules(const QueryStructure<3>& structure, SpatialDomain& domain, const StepRules<3>& rules);

  // A point is in a ball only if it is nearer to its centre by more than this, relatively: vertices on the sphere, as
  // feet of right angles are, would else be in it by rounding.
  static constexpr double kBallTolerance = 1e-9;

  // The corners of a facet: one of them, and from there to the others.
  struct FacetCorners {
    Point<3> site{};
    Point<3> u{};
    Point<3> w{};
  };

  const StepRules<3>& step_rules() const { return rules_; }
  double NearestFeatureSq(VertexId /*v*/, double limit_sq, Workspace<3>& /*workspace*/) const { return limit_sq; }

  // The next split of a subsegment, near which cells are looked at; none if all subsegments are as they are to be.
  //
  // Complexity: O(1) queries for each subsegment that is pending.
  std::optional<SpaceRequest> NextCurveRequest(double edge_limit_sq) const;

  // The faults of the cell of `v`, whose nodes are placed unless it is plainly good. `asks_surface`: whether the
  // facets are looked at. Nodes that are passed over ask for nothing.
  //
  // Complexity: O(nodes (log triangles + triangles nearby)).
  SpaceAssessment AssessCell(VertexId v, Polytope<3>& cell, double edge_limit_sq, bool asks_surface,
                             std::span<const TetrahedronName> passed_over) const;

  // The insertion that `cell`, that of `v`, asks for by its assessment, or the node that is to be passed over, after
  // which the cell has to be assessed again; none of both if nothing is asked for.
  //
  // Complexity: a few queries, and cells.
  struct Answer {
    std::optional<SpaceRequest> request;
    std::optional<TetrahedronName> refused_node;
  };
  Answer NextRequest(VertexId v, const Polytope<3>& cell, const SpaceAssessment& found, double edge_limit_sq,
                     StepRules<3>::CellOf cell_of) const;

  // The insertion of `p`, a point of `patch` whose nearest vertex is `near`, or the split of the subsegment in whose
  // diametral ball p is; none where p is shielded.
  //
  // Complexity: that of a cell.
  std::optional<SpaceRequest> RequestOnPatch(VertexId near, const Point<3>& p, uint32_t patch, double radius_sq,
                                             double edge_limit_sq) const;
  // The split of a subsegment at that share of its arc.
  SpaceRequest RequestOnCurve(const Subsegment& subsegment, double edge_limit_sq, double share = 0.5) const;

  // The point that a facet asks for whose corners are at `places`, in their order, and whose dual edge has `crossings`.
  //
  // Complexity: O(crossings + triangles nearby).
  SurfaceAsk AskOf(const std::array<SpacePlace, 3>& places, const FacetCorners& corners,
                   const EdgeCrossings& crossings) const;

  // The squared distance of `p` from the centre of the ball over the diameter from `a` to `b`, by the radius, squared;
  // in the ball it is below 1 - kBallTolerance.
  static double ShareInBall(const Point<3>& p, const Point<3>& a, const Point<3>& b);

  // Whether a subsegment from `a` to `b` is too long, or too far from its curve.
  //
  // Complexity: O(points of the curve between).
  bool IsTooCoarse(const Subsegment& subsegment, const Point<3>& a, const Point<3>& b) const;

  // The neighbours that may have to be looked at again after v has been added.
  void AppendNotices(VertexId v, const Polytope<3>& cell, const SpaceAssessment& found,
                     std::vector<NeighborNotice>& notices) const;

 private:
  struct Scratch;
  // The largest distance of a facet's p from its corners.
  double FacetRadiusSqAt(const Point<3>& p) const;
  bool IsBad(const Subsegment& subsegment) const;
  bool IsInBallOf(const Point<3>& p, const Subsegment& subsegment, double& share_sq) const;
  void AssessVolume(VertexId v, const Polytope<3>& cell, double edge_limit_sq, std::span<const uint32_t> solids,
                    uint32_t solid, std::span<const TetrahedronName> passed_over, SpaceAssessment& result) const;
  void AssessFacets(VertexId v, const Polytope<3>& cell, double edge_limit_sq, IndexNode from, bool has_planes,
                    SpaceAssessment& result) const;
  void FindSolids(const Polytope<3>& cell, IndexNode from, bool has_planes) const;
  bool TakePlanes(const Polytope<3>& cell, IndexNode from, size_t most) const;
  void FindCrossings(const Polytope<3>& cell, size_t i, size_t j, IndexNode from, bool has_planes) const;
  bool IsFarFromSurface(const FacetCorners& corners, double most_sq, uint32_t near) const;
  void FindTrialNeighbours(const Point<3>& p, VertexId near) const;
  const std::vector<VertexId>& OwnersInTrial() const;
  // The subsegment in whose diametral ball `p` is deepest, by the cell that p would have, which is in the scratch
  // space.
  std::optional<Subsegment> EncroachedBy(const Point<3>& p) const;
  // The p of a facet of the boundary that is nearer to `x` than to the corners of the facet, by the same cell;
  // `is_shielded`: it is so for a facet whose p is shielded.
  std::optional<SurfaceAsk> FacetEncroachedBy(const Point<3>& x, VertexId& near, bool& is_shielded) const;

  const QueryStructure<3>& structure_;
  SpatialDomain& domain_;
  const StepRules<3>& rules_;
  const bool has_sizes_;
  const bool has_volumes_;
  std::shared_ptr<Scratch> scratch_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPACE_RULES_H_
