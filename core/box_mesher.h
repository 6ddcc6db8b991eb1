// The mesher of the points in a box, in any dimension.
#ifndef WELLSPACE_CORE_BOX_MESHER_H_
#define WELLSPACE_CORE_BOX_MESHER_H_

#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/mesher.h"
#include "core/mesher_of.h"
#include "core/near_points.h"
#include "core/point_adder.h"
#include "core/refine/box_domain.h"
#include "core/sliver/sliver_stage.h"
#include "core/sorted_cloud.h"

namespace wellspace::core {

// Mesher::Create for points alone: merges points that are near each other, and repairs slivers.
//
// Thread safety: as Mesher.
template <int D>
class BoxMesher final : public MesherOf<BoxDomain<D>> {
  using Base = MesherOf<BoxDomain<D>>;
  using Base::domain_, Base::figures_, Base::meshed_box_, Base::numbering_, Base::refinement_, Base::samples_,
      Base::structure_;
  using typename Base::Made;

  uint64_t BuildingBytes(const MeshParameters& parameters, const Input& input) const override;
  absl::Status Build(const MeshParameters& parameters, const Input& input, RunContext& context) override;
  BoxDomain<D> ToRefine() override { return {}; }
  AdderOptions Adding() override { return {.merge_distance = merge_distance_, .is_given = &is_given_}; }
  uint64_t OtherBytes() const override;
  absl::Status CheckFeasibleHere(const MeshParameters& parameters) const override;
  void AddToEstimate(const MeshParameters& parameters, MeshEstimate& estimate) const override;
  absl::Status Improve(const MeshParameters& parameters, RunContext& context) override;
  bool MakesAnew(const Mesh& mesh) const override { return MakesByStage() || has_moved_ || !mesh.weights.empty(); }
  bool MakesByStage() const override;
  absl::StatusOr<Made> MakeSimplices(int threads, RunContext& context) override;
  absl::Status Describe(Mesh& mesh, std::span<const uint32_t> faces, int threads,
                        const RunContext& context) const override;
  void NoteMade(Mesh& mesh) override;
  void AddStatistics(const Mesh& mesh, MeshStatistics& statistics, QueryCounters& stars) const override;

  absl::StatusOr<MergedPoints> SetBox(const MeshParameters& parameters, std::span<const double> points,
                                      const RunContext& context);
  absl::StatusOr<SortedCloud<D>> SortAndBuild(const MeshParameters& parameters, std::span<const double> points,
                                              const MergedPoints& merged, const RunContext& context);
  static double MinDihedralOf(const MeshParameters& parameters);

  [[no_unique_address]] std::conditional_t<(D >= 3), SliverStage<D>, std::monostate> slivers_;
  bool pumps_ = false;
  bool has_moved_ = false;                              // a vertex, since the last mesh
  std::vector<bool> moved_;                             // by vertex, since the last mesh, of those that it had
  std::vector<bool> is_given_;                          // by vertex, the first: an input point, or a corner of the box
  std::vector<std::pair<uint32_t, uint32_t>> repairs_;  // vertices that one of them has added: first, and end
  double merge_distance_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BOX_MESHER_H_
