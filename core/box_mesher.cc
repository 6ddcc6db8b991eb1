#include "core/box_mesher.h"

#include <algorithm>
#include <cstdlib>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/estimate/estimate.h"
#include "core/feasibility.h"
#include "core/mesh_estimate.h"
#include "core/mesh_parts.h"
#include "core/mesher_checks.h"
#include "core/separation.h"
#include "core/simplex/boundary.h"
#include "core/simplex/quality.h"
#include "core/simplex/simplices.h"
#include "core/validate/validate.h"
#include "core/vertex_queries.h"

namespace wellspace::core {
namespace {

// Smaller clouds are refined in half a second, unless there are sizes: too soon for a prediction to be of use.
template <int D>
constexpr uint64_t kLeastPredicted = D == 2 ? 50'000 : (D == 3 ? 20'000 : 2'000);

template <int D>
Box<D> BoxOf(const std::vector<double>& low, const std::vector<double>& high) {
  Box<D> box;
  std::copy_n(low.begin(), D, box.low.begin());
  std::copy_n(high.begin(), D, box.high.begin());
  return box;
}

}  // namespace

template <int D>
absl::Status BoxMesher<D>::Initialize(const MeshParameters& parameters, std::span<const double> points,
                                      RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(points, D));
  context.EnterPhase(Phase::kTree);
  WELLSPACE_RETURN_IF_ERROR(ReserveForBuilding<D>(
      parameters, points.size() / D, kTreeBytes<D> + (parameters.merge_distance > 0 ? kMergeBytes<D> : 0), 0, context));
  merge_distance_ = parameters.merge_distance;
  WELLSPACE_ASSIGN_OR_RETURN(const MergedPoints merged, SetDomain(parameters, points, context));
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(domain_, domain_.box, parameters, context));
  WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(domain_, parameters, points.size() / D));
  absl::StatusOr<SortedCloud<D>> cloud = BuildTree(parameters, points, merged, context);
  if (IsTooClose(cloud.status())) {
    return TooClosePairsError<D>(domain_, merge_distance_ > 0 ? merged.points : points, merged.inputs,
                                 !parameters.domain_low.empty(), parameters.margin, cloud.status(), context);
  }
  WELLSPACE_RETURN_IF_ERROR(cloud.status());
  WELLSPACE_ASSIGN_OR_RETURN(PointNames names, NamePoints<D>(*std::move(cloud), context));
  numbering_.Begin(std::move(names), points, merged.inputs);
  numbering_.CountMerged(merged.merged);
  is_given_.assign(structure_.built_count(), true);
  refinement_.emplace(structure_, domain_.MinEdge());
  adder_.emplace(
      domain_, merge_distance_, structure_, [this](VertexId v) { refinement_->VertexAdded(v); }, numbering_,
      &is_given_);
  context.SetVertices(structure_.vertex_count());
  figures_.tree_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
  return absl::OkStatus();
}

template <int D>
uint64_t BoxMesher<D>::memory_bytes() const {
  return structure_.MemoryBytes() + refinement_->MemoryBytes() + SliverMemoryBytes() + numbering_.MemoryBytes() +
         moved_.size() / 8 + samples_.MemoryBytes();
}

template <int D>
absl::Status BoxMesher<D>::CheckFeasible(const MeshParameters& parameters) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, D));
  return core::CheckFeasible<D>(domain_, parameters, samples_, numbering_.distinct_inputs());
}

template <int D>
absl::Status BoxMesher<D>::Refine(const MeshParameters& parameters, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, D));
  context.EnterPhase(Phase::kRefinement);
  WELLSPACE_RETURN_IF_ERROR(AllowSamples<D>(parameters, samples_, memory_bytes(), context));
  WELLSPACE_RETURN_IF_ERROR(samples_.Take(domain_, domain_.box, parameters, context));
  is_refined_ = false;
  const MeshCriteria<D> criteria = CriteriaOf(parameters);
  absl::Status status = refinement_->Run(criteria, VertexBudget(parameters), parameters.threads, context, nullptr,
                                         [&] { return PredictVertices(criteria, context); });
  figures_.refinement_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kRefinement));
  is_given_.resize(structure_.vertex_count(), false);
  if (status.ok()) {
    status = RepairSlivers(parameters, context);
  }
  is_refined_ = status.ok();
  return status;
}

template <int D>
absl::StatusOr<std::vector<uint32_t>> BoxMesher<D>::AddPointsNear(std::span<const double> points,
                                                                  std::span<const uint32_t> near, RunContext& context) {
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<std::vector<uint32_t>> vertices = adder_->AddPoints(points, near, context);
  is_refined_ = is_refined_ && structure_.vertex_count() == count;
  if (vertices.ok()) {
    context.SetVertices(structure_.vertex_count());
  }
  return vertices;
}

template <int D>
absl::StatusOr<uint32_t> BoxMesher<D>::AddVertex(uint32_t near, std::span<const double> point) {
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<uint32_t> vertex = adder_->AddVertex(near, point);
  is_refined_ = is_refined_ && structure_.vertex_count() == count;
  return vertex;
}

template <int D>
absl::StatusOr<std::vector<double>> BoxMesher<D>::NearestNeighborDistances(std::span<const uint32_t> vertices) const {
  return VertexQueries<D>(domain_, structure_, numbering_).NearestNeighborDistances(vertices);
}

template <int D>
absl::StatusOr<std::vector<Cell>> BoxMesher<D>::ClippedCells(std::span<const uint32_t> vertices, double beta) const {
  return VertexQueries<D>(domain_, structure_, numbering_).ClippedCells(vertices, beta);
}

template <int D>
absl::StatusOr<Mesh> BoxMesher<D>::Extract(int threads, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(is_refined_, threads));
  numbering_.Extend(structure_.vertex_count());
  Mesh mesh;
  mesh.dimension = D;
  mesh.domain_low.assign(domain_.box.low.begin(), domain_.box.low.end());
  mesh.domain_high.assign(domain_.box.high.begin(), domain_.box.high.end());
  absl::StatusOr<HugeVector<double>> points;
  // By another thread, meanwhile.
  ThreadTeam team(threads);
  const absl::Cleanup end = [&team] { team.Drop(); };  // where something is refused
  team.BeginCall([&] {
    points = numbering_.PointsFrom(structure_, domain_, 0, context);
    mesh.input_vertex = numbering_.input_vertex();
  });
  WELLSPACE_ASSIGN_OR_RETURN(WeightedSimplices weighted, MakeSimplices(threads, context));
  team.End();
  WELLSPACE_ASSIGN_OR_RETURN(mesh.points, std::move(points));
  Simplices& simplices = weighted.simplices;
  mesh.simplices = std::move(simplices.indices);
  mesh.weights = std::move(weighted.weights);
  for (double& weight : mesh.weights) {
    weight /= domain_.scale * domain_.scale;
  }
  WELLSPACE_RETURN_IF_ERROR(DescribeBoundary(mesh, threads, context));
  mesh.statistics.max_radius_edge = simplices.max_radius_edge;
  mesh.statistics.min_angle_deg = simplices.min_angle_deg;
  figures_.star_queries.Add(simplices.counters);
  context.EnterPhase(Phase::kDone);
  if (!MakesWhole()) {
    figures_.simplices_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  }
  mesh.moved_vertices = MovedVertices();
  has_moved_ = false;
  moved_.clear();
  FinishMesh(mesh);
  return mesh;
}

template <int D>
absl::Status BoxMesher<D>::Update(Mesh& mesh, int threads, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(is_refined_, threads));
  WELLSPACE_RETURN_IF_ERROR(CheckLastMesh(mesh, D, figures_.extracted_vertices, figures_.extracted_simplices));
  if (MakesWhole() || has_moved_ || !mesh.weights.empty()) {
    WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
    return absl::OkStatus();
  }
  context.EnterPhase(Phase::kSimplices);
  numbering_.Extend(structure_.vertex_count());
  WELLSPACE_ASSIGN_OR_RETURN(
      const std::vector<VertexId> changed,
      ChangedVertices<D>(structure_, VertexId{static_cast<uint32_t>(figures_.extracted_vertices)}, context));
  WELLSPACE_ASSIGN_OR_RETURN(
      Simplices simplices, ComputeSimplicesAmong<D>(structure_, changed, numbering_.output_index(), threads, context));
  WELLSPACE_ASSIGN_OR_RETURN(const HugeVector<double> added,
                             numbering_.PointsFrom(structure_, domain_, figures_.extracted_vertices, context));
  mesh.points.insert(mesh.points.end(), added.begin(), added.end());
  std::vector<bool> has_changed(structure_.vertex_count(), false);
  for (const VertexId v : changed) {
    has_changed[numbering_.OutputIndex(v)] = true;
  }
  const bool worst_has_gone = DropSimplicesAmong<D>(
      has_changed, [this](uint32_t v) -> const Point<D>& { return structure_.point(numbering_.VertexOf(v)); }, mesh);
  mesh.simplices.insert(mesh.simplices.end(), simplices.indices.begin(), simplices.indices.end());
  mesh.input_vertex = numbering_.input_vertex();
  mesh.moved_vertices.clear();  // else the mesh is extracted anew
  if (const absl::Status described = DescribeBoundary(mesh, threads, RunContext()); !described.ok()) {
    std::abort();  // that context cannot have been cancelled
  }
  if (worst_has_gone) {
    const QualityReport report = MeasureQuality({D, mesh.points, mesh.simplices});
    mesh.statistics.max_radius_edge = report.max_radius_edge;
    mesh.statistics.min_angle_deg = report.min_angle_deg;
  } else {
    mesh.statistics.max_radius_edge = std::max(mesh.statistics.max_radius_edge, simplices.max_radius_edge);
    mesh.statistics.min_angle_deg = std::min(mesh.statistics.min_angle_deg, simplices.min_angle_deg);
  }
  figures_.star_queries.Add(simplices.counters);
  context.EnterPhase(Phase::kDone);
  figures_.simplices_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  FinishMesh(mesh);
  return absl::OkStatus();
}

template <int D>
absl::StatusOr<MeshEstimate> BoxMesher<D>::Estimate(const MeshParameters& parameters, const RunContext& context) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, D));
  WELLSPACE_ASSIGN_OR_RETURN(MeshEstimate estimate, EstimateMeshOf<D>(structure_, CriteriaOf(parameters), context));
  estimate.memory_bytes += samples_.MemoryBytes();
  if constexpr (D >= 3) {
    if (MinDihedralOf(parameters) > 0 || parameters.pump_weights) {
      const uint64_t bytes = SliverStage<D>::EstimateBytes(estimate.vertices, estimate.simplices);
      estimate.memory_bytes = SaturatedCount(static_cast<double>(estimate.memory_bytes) + static_cast<double>(bytes));
      estimate.bytes_per_vertex += static_cast<double>(bytes) / static_cast<double>(estimate.vertices);
    }
  }
  return estimate;
}

// Sets the domain, and merges the points that are near each other if that is asked for.
template <int D>
absl::StatusOr<MergedPoints> BoxMesher<D>::SetDomain(const MeshParameters& parameters, std::span<const double> points,
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
absl::StatusOr<SortedCloud<D>> BoxMesher<D>::BuildTree(const MeshParameters& parameters, std::span<const double> points,
                                                       const MergedPoints& merged, const RunContext& context) {
  WELLSPACE_ASSIGN_OR_RETURN(SortedCloud<D> cloud, merge_distance_ > 0
                                                       ? SortMerged<D>(domain_, merged, parameters.threads, context)
                                                       : SortCloud<D>(domain_, points, parameters.threads, context));
  const size_t distinct = cloud.points.size();
  const uint64_t max_vertices = VertexBudget(parameters);
  if (distinct + (size_t{1} << D) > max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("the ", distinct,
                                                     " distinct points and the domain's corners are more than ",
                                                     "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
  }
  WELLSPACE_RETURN_IF_ERROR(structure_.Initialize(
      cloud.grid, std::move(cloud.points), kLeavesPerVertex * max_vertices + (1u << D), parameters.threads, context));
  WELLSPACE_RETURN_IF_ERROR(CheckSeparation<D>(domain_, structure_, 0, cloud.first_input, parameters.threads, context));
  return cloud;
}

// How many vertices a first refinement will end with; 0 if the context knows, or it ends too soon to be worth an
// estimate.
template <int D>
absl::StatusOr<uint64_t> BoxMesher<D>::PredictVertices(const MeshCriteria<D>& criteria,
                                                       const RunContext& context) const {
  if (context.estimated_vertices() > 0 || structure_.vertex_count() > structure_.built_count() ||
      (criteria.sizes.IsUnbounded() && structure_.vertex_count() < kLeastPredicted<D>)) {
    return 0;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size, EstimateSize<D>(structure_, criteria, context, kGlance));
  return SaturatedCount(size.vertices);
}

// Repairs slivers if that is asked for; what is kept for that goes if it is not. Decides whether the mesh is pumped:
// a mesh without slivers stays Delaunay.
template <int D>
absl::Status BoxMesher<D>::RepairSlivers(const MeshParameters& parameters, RunContext& context) {
  if constexpr (D == 3) {
    if (const double min_dihedral = MinDihedralOf(parameters); min_dihedral > 0) {
      const RepairCriteria criteria{CriteriaOf(parameters), min_dihedral, domain_.MinEdge(), VertexBudget(parameters)};
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

template <int D>
uint64_t BoxMesher<D>::SliverMemoryBytes() const {
  if constexpr (D >= 3) {
    return slivers_.MemoryBytes();
  }
  return 0;
}

// Whether the mesh is that of the sliver stage, and not made of stars.
template <int D>
bool BoxMesher<D>::MakesWhole() const {
  if constexpr (D >= 3) {
    return pumps_ || slivers_.HasTriangulation();
  }
  return false;
}

template <int D>
absl::StatusOr<WeightedSimplices> BoxMesher<D>::MakeSimplices(int threads, RunContext& context) {
  if constexpr (D >= 3) {
    if (MakesWhole()) {
      return slivers_.ToSimplices(structure_, refinement_->stars(), numbering_.output_index(), pumps_, threads,
                                  context);
    }
  }
  context.EnterPhase(Phase::kSimplices);
  WeightedSimplices made;
  WELLSPACE_ASSIGN_OR_RETURN(made.simplices, ComputeSimplices<D>(structure_, refinement_->stars(),
                                                                 numbering_.output_index(), threads, context));
  return made;
}

// Steiner vertices that have moved since the last mesh; ascending, as they have the same numbers outside as inside.
template <int D>
HugeVector<uint32_t> BoxMesher<D>::MovedVertices() const {
  HugeVector<uint32_t> vertices;
  for (uint32_t v = 0; v < moved_.size(); ++v) {
    if (moved_[v]) {
      vertices.push_back(numbering_.OutputIndex(VertexId{v}));
    }
  }
  return vertices;
}

// Sets what is said of the boundary, of regions and of origins.
template <int D>
absl::Status BoxMesher<D>::DescribeBoundary(Mesh& mesh, int threads, const RunContext& context) const {
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

// Notes an extracted mesh, and sets its statistics but for those of its simplices' shapes.
template <int D>
void BoxMesher<D>::FinishMesh(Mesh& mesh) {
  figures_.NoteMesh(mesh);
  MeshStatistics& statistics = mesh.statistics;
  statistics.input_points = numbering_.input_vertex().size();
  statistics.merged_points = numbering_.merged_inputs();
  statistics.duplicates = statistics.input_points - numbering_.distinct_inputs() - statistics.merged_points;
  statistics.vertices = mesh.vertex_count();
  statistics.simplices = mesh.simplex_count();
  figures_.SetSeconds(statistics);
  statistics.tree_leaves = structure_.tree().leaf_count();
  QueryCounters stars = figures_.star_queries;
  if constexpr (D >= 3) {
    stars.Add(slivers_.statistics().star_queries);
    SetSliverFigures(slivers_.statistics(), statistics);
    for (LeftSliver& sliver : statistics.flattest_left) {
      for (uint32_t& v : sliver.vertices) {
        v = numbering_.OutputIndex(VertexId{v});
      }
    }
  }
  SetQueryFigures(refinement_->counters(), stars, statistics);
  SetTotals(statistics);
}

#define WELLSPACE_INSTANTIATE(D) template class BoxMesher<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
