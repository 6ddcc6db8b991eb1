// The mesher of the points in a box, in any dimension.
#ifndef WELLSPACE_CORE_BOX_MESHER_H_
#define WELLSPACE_CORE_BOX_MESHER_H_

#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/domain.h"
#include "core/mesher.h"
#include "core/mesher_figures.h"
#include "core/near_points.h"
#include "core/point_adder.h"
#include "core/refine/criteria.h"
#include "core/refine/refine.h"
#include "core/scaled_samples.h"
#include "core/sliver/sliver_stage.h"
#include "core/sorted_cloud.h"
#include "core/vertex_numbering.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Mesher::Create for points alone.
//
// Thread safety: as Mesher.
template <int D>
class BoxMesher final : public Mesher {
 public:
  // What Mesher::Create does, for parameters that are valid and of this dimension.
  absl::Status Initialize(const MeshParameters& parameters, std::span<const double> points, RunContext& context);
  int dimension() const override { return D; }
  uint64_t vertex_count() const override { return structure_.vertex_count(); }
  uint64_t memory_bytes() const override;
  absl::Status CheckFeasible(const MeshParameters& parameters) const override;
  absl::Status Refine(const MeshParameters& parameters, RunContext& context) override;
  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t> near,
                                                      RunContext& context) override;
  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) override;
  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override;
  absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const override;
  absl::StatusOr<Mesh> Extract(int threads, RunContext& context) override;
  absl::Status Update(Mesh& mesh, int threads, RunContext& context) override;
  absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const override;

 private:
  absl::StatusOr<MergedPoints> SetDomain(const MeshParameters& parameters, std::span<const double> points,
                                         const RunContext& context);
  absl::StatusOr<SortedCloud<D>> BuildTree(const MeshParameters& parameters, std::span<const double> points,
                                           const MergedPoints& merged, const RunContext& context);
  MeshCriteria<D> CriteriaOf(const MeshParameters& parameters) const {
    return CriteriaIn<D>(domain_, parameters, samples_);
  }
  absl::StatusOr<uint64_t> PredictVertices(const MeshCriteria<D>& criteria, const RunContext& context) const;
  absl::Status RepairSlivers(const MeshParameters& parameters, RunContext& context);
  static double MinDihedralOf(const MeshParameters& parameters);
  uint64_t SliverMemoryBytes() const;
  bool MakesWhole() const;
  absl::StatusOr<WeightedSimplices> MakeSimplices(int threads, RunContext& context);
  HugeVector<uint32_t> MovedVertices() const;
  absl::Status DescribeBoundary(Mesh& mesh, int threads, const RunContext& context) const;
  void FinishMesh(Mesh& mesh);

  Domain<D> domain_;
  ScaledSamples<D> samples_;  // of the last parameters
  QueryStructure<D> structure_;
  std::optional<BoxRefinement<D>> refinement_;
  bool is_refined_ = false;
  [[no_unique_address]] std::conditional_t<(D >= 3), SliverStage<D>, std::monostate> slivers_;
  bool pumps_ = false;
  bool has_moved_ = false;                              // a vertex, since the last mesh
  std::vector<bool> moved_;                             // by vertex, since the last mesh, of those that it had
  std::vector<bool> is_given_;                          // by vertex: an input point, or a corner of the box
  std::vector<std::pair<uint32_t, uint32_t>> repairs_;  // vertices that one of them has added: first, and end
  VertexNumbering<D> numbering_;
  double merge_distance_ = 0;
  std::optional<PointAdder<D>> adder_;
  MesherFigures figures_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BOX_MESHER_H_
