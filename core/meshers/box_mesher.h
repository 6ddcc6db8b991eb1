// The mesher of the points in a box, in any dimension.
#ifndef WELLSPACE_CORE_MESHERS_BOX_MESHER_H_
#define WELLSPACE_CORE_MESHERS_BOX_MESHER_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/periodic_box.h"
#include "core/input/near_points.h"
#include "core/input/sorted_cloud.h"
#include "core/meshers/mesher.h"
#include "core/meshers/mesher_of.h"
#include "core/meshers/point_adder.h"
#include "core/meshers/repair_log.h"
#include "core/refine/box_domain.h"
#include "core/simplex/row_edits.h"
#include "core/simplex/star_rows.h"
#include "core/sliver/sliver_stage.h"

namespace wellspace::core {

// Mesher::Create for points alone: merges points that are near each other, and repairs slivers.
//
// Thread safety: as Mesher.
template <int D>
class BoxMesher final : public MesherOf<BoxDomain<D>> {
  using Base = MesherOf<BoxDomain<D>>;
  using Base::frame_, Base::figures_, Base::meshed_box_, Base::numbering_, Base::refinement_, Base::samples_,
      Base::structure_;
  using typename Base::Changes;
  using typename Base::Made;

  uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const override;
  absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) override;
  BoxDomain<D> ToRefine() override;
  AdderOptions Adding() override {
    return {.merge_distance = merge_distance_, .is_given = &repairs_.is_given(), .periodic_axes = periodic_axes_};
  }
  uint64_t OtherBytes() const override;
  absl::Status CheckDemands(const MeshParameters& parameters) const override;
  absl::Status CheckFeasibleHere(const MeshParameters& parameters) const override;
  absl::Status AddToEstimate(const MeshParameters& parameters, const MeshCriteria<D>& criteria,
                             const RunContext& context, MeshEstimate& estimate) const override;
  absl::Status Improve(const MeshParameters& parameters, RunContext& context) override;
  bool MakesByStage() const override;
  absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) override;
  absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads, const RunContext& context) override;
  absl::StatusOr<std::optional<Changes>> FindChanges(const Mesh& mesh, int threads, RunContext& context) override;
  void NoteMade(Mesh& mesh) override;
  void MovePoints(Mesh& mesh) override;
  void UpdateLabels(const SimplexChanges& changes, uint64_t old_vertices, Mesh& mesh) override;
  void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const override;

  absl::StatusOr<MergedPoints> SetBox(const MeshParameters& parameters, std::span<const double> points,
                                      const RunContext& context);
  absl::StatusOr<SortedCloud<D>> SortAndBuild(const MeshParameters& parameters, std::span<const double> points,
                                              const MergedPoints& merged, const RunContext& context);
  PeriodicBox<D> PeriodicIn(const Box<D>& box) const { return PeriodicBox<D>(box, periodic_axes_); }
  static double MinDihedralOf(const MeshParameters& parameters);
  bool HasLabels(const Mesh& mesh) const;
  absl::StatusOr<std::optional<SimplexChanges>> FindChangedSimplices(const Mesh& mesh, int threads,
                                                                     RunContext& context);
  absl::StatusOr<SimplexChanges> FindChangedStars(const Mesh& mesh, int threads, RunContext& context);
  bool MayBeWorst(const Mesh& mesh, uint64_t row) const;

  // How the last mesh can be brought up to date: not at all, by the changes of the sliver stage that has made it, or by
  // stars around new vertices.
  enum class Followed { kNot, kByStage, kByStars };

  [[no_unique_address]] std::conditional_t<(D >= 3), SliverStage<D>, std::monostate> slivers_;
  bool pumps_ = false;
  RepairLog repairs_;
  Followed followed_ = Followed::kNot;
  HugeVector<uint32_t> facet_simplices_;  // of the last mesh: the row of each facet's simplex
  std::optional<StarRows<D>> star_rows_;  // of the last mesh, once it has been changed around new vertices
  size_t known_inputs_ = 0;               // of the last mesh
  double merge_distance_ = 0;
  std::vector<int> periodic_axes_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_BOX_MESHER_H_
