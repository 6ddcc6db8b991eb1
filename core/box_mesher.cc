#include "core/box_mesher.h"

#include <algorithm>

#include "core/base/dimensions.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/domain.h"
#include "core/feasibility.h"
#include "core/mesh_statistics.h"
#include "core/separation.h"
#include "core/simplex/boundary.h"
#include "core/simplex/simplices.h"

namespace wellspace::core {
namespace {

template <int D>
Box<D> BoxOf(const std::vector<double>& low, const std::vector<double>& high) {
  Box<D> box;
  std::copy_n(low.begin(), D, box.low.begin());
  std::copy_n(high.begin(), D, box.high.begin());
  return box;
}

}  // namespace

template <int D>
uint64_t BoxMesher<D>::BuildingBytes(const MeshParameters& parameters, const Input& input) const {
  return parameters.merge_distance > 0 ? input.points.size() / D * kMergeBytes<D> : 0;
}

template <int D>
absl::Status BoxMesher<D>::Build(const MeshParameters& parameters, const Input& input, RunContext& context) {
  const std::span<const double> points = input.points;
  merge_distance_ = parameters.merge_distance;
  WELLSPACE_ASSIGN_OR_RETURN(const MergedPoints merged, SetBox(parameters, points, context));
  meshed_box_ = domain_.box;
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(domain_, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(domain_, parameters, points.size() / D));
  absl::StatusOr<SortedCloud<D>> cloud = SortAndBuild(parameters, points, merged, context);
  if (IsTooClose(cloud.status())) {
    return TooClosePairsError<D>(domain_, merge_distance_ > 0 ? merged.points : points, merged.inputs,
                                 !parameters.domain_low.empty(), parameters.margin, cloud.status(), context);
  }
  WELLSPACE_RETURN_IF_ERROR(cloud.status());
  WELLSPACE_ASSIGN_OR_RETURN(PointNames names, NamePoints<D>(*std::move(cloud), context));
  numbering_.Begin(std::move(names), points, merged.inputs);
  numbering_.CountMerged(merged.merged);
  is_given_.assign(structure_.built_count(), true);
  return absl::OkStatus();
}

// Sets the box, and merges the points that are near each other if that is asked for.
template <int D>
absl::StatusOr<MergedPoints> BoxMesher<D>::SetBox(const MeshParameters& parameters, std::span<const double> points,
                                                  const RunContext& context) {
  const bool is_given = !parameters.domain_low.empty();
  Box<D> box;
  if (is_given) {
    box = BoxOf<D>(parameters.domain_low, parameters.domain_high);
  } else {
    WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(points, parameters.margin, context));
  }
  WELLSPACE_ASSIGN_OR_RETURN(domain_, Domain<D>::Of(box));
  MergedPoints merged;
  if (merge_distance_ == 0) {
    return merged;
  }
  // A point outside the box may become one inside: the box of a session is that of the points that stayed.
  Domain<D> wide = domain_;
  const double reach = std::min(merge_distance_, box.LongestSide());
  wide.box = {CubeAround<D>(box.low, reach).low, CubeAround<D>(box.high, reach).high};
  WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(wide, points, context));
  WELLSPACE_ASSIGN_OR_RETURN(merged, MergeNear<D>(domain_, points, merge_distance_, context));
  if (!is_given) {
    WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(merged.points, parameters.margin, context));
    WELLSPACE_ASSIGN_OR_RETURN(domain_, Domain<D>::Of(box));
  }
  return merged;
}

// Sorts the points, of which `merged` has what merging has left, and builds the tree. Returns the cloud without its
// points, which the structure has then.
template <int D>
absl::StatusOr<SortedCloud<D>> BoxMesher<D>::SortAndBuild(const MeshParameters& parameters,
                                                          std::span<const double> points, const MergedPoints& merged,
                                                          const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<D> cloud, merge_distance_ > 0
                                                       ? SortMerged<D>(domain_, merged, parameters.threads, context)
                                                       : SortCloud<D>(domain_, points, parameters.threads, context));
  WELLSPACE_RETURN_IF_ERROR(
      Base::BuildTree(parameters, "distinct points and the domain's corners", cloud, {}, context));
  return cloud;
}

template <int D>
uint64_t BoxMesher<D>::OtherBytes() const {
  uint64_t bytes = moved_.size() / 8;
  if constexpr (D >= 3) {
    bytes += slivers_.MemoryBytes();
  }
  return bytes;
}

template <int D>
absl::Status BoxMesher<D>::CheckFeasibleHere(const MeshParameters& parameters) const {
  return CheckFeasible<D>(domain_, parameters, samples_, numbering_.distinct_inputs());
}

template <int D>
void BoxMesher<D>::AddToEstimate(const MeshParameters& parameters, MeshEstimate& estimate) const {
  if constexpr (D >= 3) {
    if (MinDihedralOf(parameters) > 0 || parameters.pump_weights) {
      const uint64_t bytes = SliverStage<D>::EstimateBytes(estimate.vertices, estimate.simplices);
      estimate.memory_bytes = SaturatedCount(static_cast<double>(estimate.memory_bytes) + static_cast<double>(bytes));
      estimate.bytes_per_vertex += static_cast<double>(bytes) / static_cast<double>(estimate.vertices);
    }
  }
}

// Repairs slivers if that is asked for; what is kept for that goes if it is not. Decides whether the mesh is pumped:
// a mesh without slivers stays Delaunay.
template <int D>
absl::Status BoxMesher<D>::Improve(const MeshParameters& parameters, RunContext& context) {
  if constexpr (D == 3) {
    if (const double min_dihedral = MinDihedralOf(parameters); min_dihedral > 0) {
      const RepairCriteria criteria{Base::CriteriaOf(parameters), min_dihedral, domain_.MinEdge(),
                                    VertexBudget(parameters)};
      is_given_.resize(structure_.vertex_count(), false);
      const uint64_t moves = slivers_.statistics().moves;
      const uint32_t refined = structure_.vertex_count();
      moved_.resize(figures_.extracted_vertices, false);
      std::vector<bool> kept;
      if (parameters.keep_vertices) {
        kept = is_given_;
        std::fill_n(kept.begin(), figures_.extracted_vertices, true);
      }
      const absl::Status status = slivers_.Repair(structure_, *refinement_, parameters.keep_vertices ? kept : is_given_,
                                                  criteria, moved_, parameters.threads, context);
      is_given_.resize(structure_.vertex_count(), false);
      repairs_.emplace_back(refined, structure_.vertex_count());
      has_moved_ = has_moved_ || slivers_.statistics().moves > moves;
      context.SetVertices(structure_.vertex_count());
      pumps_ = parameters.pump_weights && slivers_.statistics().slivers_left > 0;
      return status;
    }
  }
  if constexpr (D >= 3) {
    slivers_.Forget();
  }
  pumps_ = parameters.pump_weights;
  return absl::OkStatus();
}

template <int D>
double BoxMesher<D>::MinDihedralOf(const MeshParameters& parameters) {
  return parameters.min_dihedral.value_or(DefaultMinDihedral(D));
}

// Whether the mesh is that of the sliver stage, and not made of stars.
template <int D>
bool BoxMesher<D>::MakesByStage() const {
  if constexpr (D >= 3) {
    return pumps_ || slivers_.HasTriangulation();
  }
  return false;
}

template <int D>
absl::StatusOr<typename BoxMesher<D>::Made> BoxMesher<D>::MakeSimplices(int threads, RunContext& context) {
  if constexpr (D >= 3) {
    if (MakesByStage()) {
      WELLSPACE_ASSIGN_OR_RETURN(
          WeightedSimplices weighted,
          slivers_.ToSimplices(structure_, refinement_->stars(), numbering_.output_index(), pumps_, threads, context));
      return Made{std::move(weighted.simplices), std::move(weighted.weights)};
    }
  }
  WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices, ComputeSimplices<D>(structure_, refinement_->stars(),
                                                                      numbering_.output_index(), threads, context));
  return Made{std::move(simplices)};
}

template <int D>
absl::Status BoxMesher<D>::Describe(Mesh& mesh, std::span<const uint32_t> /*faces*/, int threads,
                                    const RunContext& context) const {
  WELLSPACE_ASSIGN_OR_RETURN(
      BoxBoundary boundary,
      FindBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, threads, context));
  mesh.vertex_tags = std::move(boundary.vertex_tags);
  mesh.facets = std::move(boundary.facets);
  mesh.boundary = std::move(boundary.parts);
  mesh.regions = {WholeBox()};
  mesh.vertex_origins.assign(structure_.vertex_count(), kSteinerOrigin);
  const auto origins = mesh.vertex_origins.begin();
  std::fill(origins, origins + structure_.built_count(), kCornerOrigin);
  for (const auto& [first, end] : repairs_) {
    std::fill(origins + first, origins + end, kRepairOrigin);
  }
  const auto& input_vertex = numbering_.input_vertex();
  for (size_t i = input_vertex.size(); i > 0; --i) {
    origins[input_vertex[i - 1]] = static_cast<uint32_t>(i - 1);
  }
  return absl::OkStatus();
}

template <int D>
void BoxMesher<D>::NoteMade(Mesh& mesh) {
  for (uint32_t v = 0; v < moved_.size(); ++v) {
    if (moved_[v]) {
      mesh.moved_vertices.push_back(numbering_.OutputIndex(VertexId{v}));  // ascending: it is the same number
    }
  }
  has_moved_ = false;
  moved_.clear();
}

template <int D>
void BoxMesher<D>::AddStatistics(const Mesh& /*mesh*/, MeshStatistics& statistics, QueryCounters& stars) const {
  statistics.merged_points = numbering_.merged_inputs();
  statistics.duplicates = statistics.input_points - numbering_.distinct_inputs() - statistics.merged_points;
  if constexpr (D >= 3) {
    stars.Add(slivers_.statistics().star_queries);
    SetSliverFigures(slivers_.statistics(), statistics);
    for (LeftSliver& sliver : statistics.flattest_left) {
      for (uint32_t& v : sliver.vertices) {
        v = numbering_.OutputIndex(VertexId{v});
      }
    }
  }
}

#define WELLSPACE_INSTANTIATE(D) template class BoxMesher<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
