// The mesher of a domain in space: points, and the triangles that bound the domain.
#ifndef WELLSPACE_CORE_MESHERS_SPACE_MESHER_H_
#define WELLSPACE_CORE_MESHERS_SPACE_MESHER_H_

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/input/space_cloud.h"
#include "core/meshers/mesher.h"
#include "core/meshers/mesher_of.h"
#include "core/meshers/repair_log.h"
#include "core/meshers/surface_deviation.h"
#include "core/refine/space/space_domain.h"
#include "core/refine/space/spatial_domain.h"
#include "core/simplex/simplices.h"
#include "core/simplex/solid_boundary.h"
#include "core/sliver/sliver_stage.h"

namespace wellspace::core {

// Mesher::Create for a surface. The box around it is refined as that of a cloud, with another rho outside; of its
// tetrahedra those in solids that are meshed are handed out, and the vertices that may be theirs. Vertices that are not
// handed out have numbers after those that are. Refines, and adds vertices to the surface, until every subsegment is an
// edge, and facets meet in pairs wherever no curve is.
//
// Thread safety: as Mesher.
class SpaceMesher final : public MesherOf<SpaceDomain> {
  // The results of the last refinement.
  struct MadeOfSolids {
    Simplices simplices;          // in solids that are meshed; none once a mesh has taken them
    HugeVector<uint32_t> solids;  // of each
    SolidBoundary boundary;
    HugeVector<uint32_t> ridges;
    uint64_t lost_ridges = 0;
    double deviation_of_facets = 0;
    double deviation_of_surface = 0;
  };

  // A point of the surface that is to be a vertex, where facets are missing.
  struct Missing {
    Point<3> at{};
    uint32_t patch = 0;
    double distance = 0;  // from all facets, where that is why
  };

  absl::Status CheckInput(const Input& input) const override;
  uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const override;
  absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) override;
  SpaceDomain ToRefine() override { return SpaceDomain(*spatial_); }
  AdderOptions Adding() override { return {}; }
  absl::Status CheckAdding() const override;
  uint64_t OtherBytes() const override;
  absl::Status CheckDemands(const MeshParameters& parameters) const override;
  absl::Status CheckFeasibleHere(const MeshParameters& parameters) const override;
  absl::StatusOr<MeshParameters> WithSizesOfDomain(const MeshParameters& parameters,
                                                   const RunContext& context) const override;
  absl::Status AddToEstimate(const MeshParameters& parameters, const MeshCriteria<3>& criteria,
                             const RunContext& context, MeshEstimate& estimate) const override;
  void TakeDemands(const MeshParameters& parameters) override;
  absl::Status Explain(absl::Status status) const override;
  // Few leaves may all be outside of the domain.
  std::optional<EstimateEffort> PredictionEffort(const MeshCriteria<3>& /*criteria*/) const override {
    return std::nullopt;
  }
  void ForgetMade() override { made_.reset(); }
  absl::StatusOr<bool> Conform(const MeshParameters& parameters, RunContext& context) override;
  absl::Status Improve(const MeshParameters& parameters, RunContext& context) override;
  void ExtendNumbers() override;
  absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) override;
  absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads, const RunContext& context) override;
  void NoteMade(Mesh& mesh) override;
  void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const override;

  absl::Status CheckVolumeFeasible(const MeshParameters& parameters) const;
  absl::Status CheckAreaFeasible(const MeshParameters& parameters) const;
  absl::Status DescribeSimplices(Mesh& mesh, std::span<const uint32_t> faces, std::span<const int32_t> regions,
                                 const std::map<int32_t, size_t>& places, const RunContext& context) const;
  absl::Status CheckAcuteCreases(std::span<const Subsegment> lost, std::span<const Missing> far) const;
  absl::Status CheckCreases(const MeshParameters& parameters) const;
  absl::Status CheckAllMeshed(const RunContext& context) const;
  absl::Status FitToSurface(const MeshParameters& parameters, const SizeField<3>& sizes, const RunContext& context,
                            MeshEstimate& estimate) const;
  absl::Status MakeTetrahedra(int threads, RunContext& context);
  absl::StatusOr<bool> MatchPlaces(Simplices& simplices, std::span<const uint32_t> solids, const RunContext& context);
  absl::StatusOr<Simplices> AllSimplices(int threads, RunContext& context);
  absl::StatusOr<std::vector<Subsegment>> FindRidges(RunContext& context);
  absl::StatusOr<std::vector<Missing>> FindMissing(const RunContext& context) const;
  absl::Status FindUnpaired(std::vector<Missing>& missing, const RunContext& context) const;
  absl::Status MeasureFacets(const RunContext& context);
  absl::StatusOr<std::vector<FarSample>> MeasureSurface(double limit, const RunContext& context);
  absl::StatusOr<std::vector<Missing>> FindFar(const RunContext& context);
  absl::Status FindLostPatches(std::vector<Missing>& missing, const RunContext& context) const;
  absl::StatusOr<uint64_t> Insert(std::span<const Subsegment> lost, std::span<const Missing> missing,
                                  const MeshParameters& parameters, const RunContext& context);
  absl::StatusOr<std::vector<double>> ScaledPoints(const RunContext& context) const;
  bool Add(const SpaceRequest& request);
  std::vector<int32_t> Regions() const;

  std::unique_ptr<SpatialDomain> spatial_;
  SpaceFigures figures_of_input_;
  MeshParameters first_parameters_;  // of the first refinement, by which acute creases have their vertices
  double default_tolerance_ = 0;     // not scaled
  bool keeps_points_ = false;        // given points on the surface are vertices
  uint32_t meshed_count_ = 0;        // vertices that are handed out
  Workspace<3> workspace_;
  std::optional<MadeOfSolids> made_;  // unless the domain has been refined since
  double rho_ = 0;                    // of the last refinement
  bool has_own_sizes_ = false;        // whether it had samples beside those that are given
  SliverStage<3> slivers_;
  RepairLog repairs_;
  bool is_repaired_ = false;  // whether the triangulation of slivers_ is that of the last refinement
  uint32_t last_count_ = 0;   // of vertices in the structure, when the last mesh was made
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_SPACE_MESHER_H_
