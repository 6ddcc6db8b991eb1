// The mesher of a domain in the plane: points, segments and faces.
#ifndef WELLSPACE_CORE_MESHERS_PLANE_MESHER_H_
#define WELLSPACE_CORE_MESHERS_PLANE_MESHER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/input/domain_cloud.h"
#include "core/meshers/feasibility.h"
#include "core/meshers/mesher.h"
#include "core/meshers/mesher_of.h"
#include "core/meshers/point_adder.h"
#include "core/meshers/point_placer.h"
#include "core/refine/plane/planar_domain.h"
#include "core/refine/plane/plane_domain.h"
#include "core/simplex/domain_simplices.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Mesher::Create for features. Points of the graph have the numbers in the mesh that they have there, among those that
// are meshed; vertices that are inserted or added have the same number inside as outside. Refines, and splits
// subsegments, until every one is an edge of the triangulation, with nothing in its diametral disc.
//
// Thread safety: as Mesher.
class PlaneMesher final : public MesherOf<PlaneDomain> {
  // A subsegment: the part of a segment between two vertices that follow each other on it.
  struct Subsegment {
    uint32_t segment;
    VertexId from;
    VertexId to;
  };

  // The results of the last refinement.
  struct MadeOfChains {
    PlanarDomain::Chains chains;
    DomainSimplices triangles;  // none once a mesh has taken them

    bool AreTrianglesTaken() const { return triangles.faces.empty(); }
  };

  absl::Status CheckInput(const Input& input) const override;
  uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const override;
  absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) override;
  PlaneDomain ToRefine() override { return PlaneDomain(*planar_); }
  AdderOptions Adding() override { return {.merge_distance = merge_distance_, .placer = &*placer_}; }
  uint64_t OtherBytes() const override;
  absl::Status CheckDemands(const MeshParameters& parameters) const override;
  absl::Status CheckFeasibleHere(const MeshParameters& parameters) const override;
  const PlanarDomain* planar() const override { return planar_.get(); }
  // Few leaves may all be outside of the domain: a glance would say too little. Without sizes it is meshed soon.
  std::optional<EstimateEffort> PredictionEffort(const MeshCriteria<2>& criteria) const override {
    return criteria.sizes.IsUnbounded() ? std::nullopt : std::optional(kLongGlance);
  }
  void ForgetMade() override { made_.reset(); }
  absl::StatusOr<bool> Conform(const MeshParameters& parameters, RunContext& context) override;
  void NoteAddedFrom(uint32_t first) override;
  absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) override;
  absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads, const RunContext& context) override;
  void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const override;

  absl::Status NumberPoints(const DomainCloud& made, std::span<const double> points, const RunContext& context);
  bool IsEncroached(const Subsegment& subsegment, Workspace<2>& workspace) const;
  absl::StatusOr<std::vector<Subsegment>> EncroachedSubsegments(const PlanarDomain::Chains& chains, int threads,
                                                                const RunContext& context) const;
  absl::Status Split(std::span<const Subsegment> subsegments, const MeshParameters& parameters,
                     const RunContext& context);
  // A vertex that is to be added on a segment.
  struct NewOnSegment {
    SegmentPoint place;
    Point<2> position;
    VertexId near;
  };
  absl::StatusOr<NewOnSegment> CheckOnSegment(const SegmentPoint& place, VertexId near, uint64_t before,
                                              const MeshParameters& parameters);
  void AddOnSegment(const NewOnSegment& added);
  absl::StatusOr<std::vector<Subsegment>> MakeTriangles(PlanarDomain::Chains chains, int threads, RunContext& context);

  LargestArea least_area_;  // of the largest areas in faces that are meshed
  std::unique_ptr<PlanarDomain> planar_;
  Workspace<2> workspace_;
  double merge_distance_ = 0;
  std::optional<PointPlacer> placer_;
  uint64_t dropped_points_ = 0;
  std::optional<MadeOfChains> made_;  // unless vertices have been added since
  double rho_ = 0;                    // of the last refinement
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_PLANE_MESHER_H_
