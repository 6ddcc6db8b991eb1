#include "core/meshers/mesher_of.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/base/stopwatch.h"
#include "core/base/thread_team.h"
#include "core/estimate/estimate.h"
#include "core/input/separation.h"
#include "core/mesh/name_parts.h"
#include "core/meshers/mesh_estimate.h"
#include "core/meshers/mesher_checks.h"
#include "core/meshers/vertex_queries.h"
#include "core/refine/box_domain.h"
#include "core/refine/plane/plane_domain.h"
#include "core/refine/space/space_domain.h"
#include "core/simplex/quality.h"
#include "core/validate/validate.h"

namespace wellspace::core {
namespace {

// Smaller clouds are refined in half a second, unless there are sizes: too soon for a prediction to be of use.
template <int D>
constexpr uint64_t kLeastPredicted = D == 2 ? 50'000 : (D == 3 ? 20'000 : 2'000);

const PartNames* NamesOf(const Input& input) {
  return input.features.has_value()  ? input.features->names
         : input.surface.has_value() ? input.surface->names
                                     : nullptr;
}

// The changes of an array of `rows` as the runs that make the array after them.
MovedRows RunsOf(const SimplexChanges& changes, uint64_t rows) {
  MovedRows moved{.added = changes.added};
  uint64_t begin = 0;
  for (const RowEdit& edit : changes.edits) {
    moved.runs.push_back({.begin = begin, .kept = edit.at - begin, .added = edit.added});
    begin = edit.at + edit.dropped;
  }
  moved.runs.push_back({.begin = begin, .kept = rows - begin, .added = 0});
  return moved;
}

}  // namespace

template <typename Domain>
absl::Status MesherOf<Domain>::Initialize(const MeshParameters& parameters, const Input& input, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckShape(input.points, D));
  WELLSPACE_RETURN_IF_ERROR(CheckInput(input));
  if (const PartNames* const names = NamesOf(input); names != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(CheckPartNames(*names));
    names_ = *names;
  }
  context.EnterPhase(Phase::kTree);
  WELLSPACE_RETURN_IF_ERROR(ReserveForBuilding<D>(parameters, input.points.size() / D, kTreeBytes<D>,
                                                  BuildingBytes(parameters, input), context));
  WELLSPACE_RETURN_IF_ERROR(Build(parameters, input, context));
  refinement_.emplace(structure_, frame_.MinEdge(), ToRefine());
  adder_.emplace(
      frame_, structure_, [this](VertexId v) { refinement_->VertexAdded(v); }, numbering_, Adding());
  context.SetVertices(structure_.vertex_count());
  figures_.tree_seconds = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
  return absl::OkStatus();
}

template <typename Domain>
absl::Status MesherOf<Domain>::BuildTree(const MeshParameters& parameters, const char* what, SortedCloud<D>& cloud,
                                         std::vector<SegmentLists::Ends> segments, const RunContext& context) {
  const uint64_t max_vertices = VertexBudget(parameters);
  const uint64_t corners = segments.empty() ? uint64_t{1} << D : 0;
  if (cloud.points.size() + corners > max_vertices) {
    return absl::ResourceExhaustedError(absl::StrCat("the ", cloud.points.size(), " ", what, " are more than ",
                                                     "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
  }
  WELLSPACE_RETURN_IF_ERROR(structure_.Initialize(cloud.grid, std::move(cloud.points),
                                                  kLeavesPerVertex * max_vertices + (uint64_t{1} << D),
                                                  parameters.threads, context, std::move(segments)));
  return CheckSeparation<D>(frame_, structure_, 0, cloud.first_input, parameters.threads, context);
}

template <typename Domain>
uint64_t MesherOf<Domain>::memory_bytes() const {
  return structure_.MemoryBytes() + refinement_->MemoryBytes() + numbering_.MemoryBytes() + samples_.MemoryBytes() +
         OtherBytes();
}

template <typename Domain>
absl::Status MesherOf<Domain>::CheckFeasible(const MeshParameters& parameters) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(parameters, D));
  return CheckFeasibleHere(parameters);
}

template <typename Domain>
absl::Status MesherOf<Domain>::Refine(const MeshParameters& given, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(given, D));
  WELLSPACE_RETURN_IF_ERROR(CheckDemands(given));
  context.EnterPhase(Phase::kRefinement);
  MeshParameters parameters;
  {
    const Stopwatch stopwatch(figures_.refinement_seconds, figures_.simplices_seconds);
    WELLSPACE_ASSIGN_OR_RETURN(parameters, WithSizesOfDomain(given, context));
    WELLSPACE_RETURN_IF_ERROR(AllowSamples<D>(parameters, samples_, memory_bytes(), context));
    WELLSPACE_RETURN_IF_ERROR(samples_.Take(frame_, parameters, context));
    is_refined_ = false;
    ForgetMade();
    TakeDemands(parameters);
    const MeshCriteria<D> criteria = CriteriaOf(parameters);
    for (bool conforms = false; !conforms;) {
      WELLSPACE_RETURN_IF_ERROR(
          Explain(refinement_->Run(criteria, VertexBudget(parameters), parameters.threads, context, nullptr,
                                   [&] { return PredictVertices(criteria, context); })));
      WELLSPACE_ASSIGN_OR_RETURN(conforms, Conform(parameters, context));
    }
  }
  WELLSPACE_RETURN_IF_ERROR(Improve(parameters, context));
  is_refined_ = true;
  return absl::OkStatus();
}

template <typename Domain>
std::optional<EstimateEffort> MesherOf<Domain>::PredictionEffort(const MeshCriteria<D>& criteria) const {
  const bool is_short = criteria.sizes.IsUnbounded() && structure_.vertex_count() < kLeastPredicted<D>;
  return is_short ? std::nullopt : std::optional(kGlance);
}

// How many vertices a first refinement will end with; 0 if the context knows, or nothing is to be predicted.
template <typename Domain>
absl::StatusOr<uint64_t> MesherOf<Domain>::PredictVertices(const MeshCriteria<D>& criteria,
                                                           const RunContext& context) const {
  const std::optional<EstimateEffort> effort = PredictionEffort(criteria);
  if (!effort.has_value() || context.estimated_vertices() > 0 || structure_.vertex_count() > structure_.built_count()) {
    return 0;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size,
                             EstimateSize<D>(structure_, criteria, context, *effort, planar()));
  return SaturatedCount(size.vertices);
}

template <typename Domain>
absl::StatusOr<std::vector<uint32_t>> MesherOf<Domain>::AddPointsNear(std::span<const double> points,
                                                                      std::span<const uint32_t> near,
                                                                      RunContext& context) {
  if (!points.empty()) {
    WELLSPACE_RETURN_IF_ERROR(CheckAdding());
  }
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<std::vector<uint32_t>> vertices = adder_->AddPoints(points, near, context);
  NoteAdded(count);
  if (vertices.ok()) {
    context.SetVertices(structure_.vertex_count());
  }
  return vertices;
}

template <typename Domain>
absl::StatusOr<uint32_t> MesherOf<Domain>::AddVertex(uint32_t near, std::span<const double> point) {
  WELLSPACE_RETURN_IF_ERROR(CheckAdding());
  const uint32_t count = structure_.vertex_count();
  absl::StatusOr<uint32_t> vertex = adder_->AddVertex(near, point);
  NoteAdded(count);
  return vertex;
}

// Notes the vertices that have been added since there were so many.
template <typename Domain>
void MesherOf<Domain>::NoteAdded(uint32_t count_before) {
  if (structure_.vertex_count() > count_before) {
    is_refined_ = false;
    ForgetMade();
    NoteAddedFrom(count_before);
  }
}

template <typename Domain>
absl::StatusOr<std::vector<double>> MesherOf<Domain>::NearestNeighborDistances(
    std::span<const uint32_t> vertices) const {
  return VertexQueries<D>(frame_, structure_, numbering_).NearestNeighborDistances(vertices);
}

template <typename Domain>
absl::StatusOr<std::vector<Cell>> MesherOf<Domain>::ClippedCells(std::span<const uint32_t> vertices,
                                                                 double beta) const {
  return VertexQueries<D>(frame_, structure_, numbering_).ClippedCells(vertices, beta);
}

template <typename Domain>
absl::StatusOr<Mesh> MesherOf<Domain>::Extract(int threads, RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(is_refined_, threads));
  if (!MakesByStage()) {
    context.EnterPhase(Phase::kSimplices);
  }
  ExtendNumbers();
  Mesh mesh;
  mesh.dimension = D;
  mesh.domain_low.assign(meshed_box_.low.begin(), meshed_box_.low.end());
  mesh.domain_high.assign(meshed_box_.high.begin(), meshed_box_.high.end());
  absl::StatusOr<HugeVector<double>> points;
  // By another thread, meanwhile.
  ThreadTeam team(threads);
  const absl::Cleanup end = [&team] { team.Drop(); };  // where something is refused
  team.BeginCall([&] {
    points = numbering_.PointsFrom(structure_, frame_, 0, context);
    mesh.input_vertex = numbering_.input_vertex();
  });
  WELLSPACE_ASSIGN_OR_RETURN(Made made, MakeSimplices(threads, context));
  team.End();
  WELLSPACE_ASSIGN_OR_RETURN(mesh.points, std::move(points));
  mesh.simplices = std::move(made.simplices.indices);
  mesh.weights = std::move(made.weights);
  for (double& weight : mesh.weights) {
    weight /= frame_.scale * frame_.scale;
  }
  mesh.statistics.max_radius_edge = made.simplices.max_radius_edge;
  mesh.statistics.min_angle_deg = made.simplices.min_angle_deg;
  WELLSPACE_RETURN_IF_ERROR(Describe(mesh, made.faces, threads, context));
  NameParts(names_, mesh);
  figures_.star_queries.Add(made.simplices.counters);
  context.EnterPhase(Phase::kDone);
  if (!MakesByStage()) {
    figures_.simplices_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  }
  NoteMade(mesh);
  Finish(mesh);
  return mesh;
}

template <typename Domain>
absl::Status MesherOf<Domain>::Update(Mesh& mesh, int threads, RunContext& context,
                                      std::optional<MovedRows>* simplices) {
  WELLSPACE_RETURN_IF_ERROR(CheckRefined(is_refined_, threads));
  WELLSPACE_RETURN_IF_ERROR(CheckLastMesh(mesh, D, figures_.extracted_vertices, figures_.extracted_simplices));
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<Changes> changes, FindChanges(mesh, threads, context));
  if (simplices != nullptr) {
    simplices->reset();
  }
  if (!changes.has_value()) {
    WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
    return absl::OkStatus();
  }
  if (simplices != nullptr) {
    *simplices = RunsOf(changes->simplices, mesh.simplex_count());
  }
  // From here on nothing fails.
  const uint64_t old_vertices = mesh.vertex_count();
  SpliceRows<uint32_t>(D + 1, changes->simplices.edits, changes->simplices.added, mesh.simplices);
  mesh.points.insert(mesh.points.end(), changes->points.begin(), changes->points.end());
  MovePoints(mesh);
  const HugeVector<uint32_t>& inputs = numbering_.input_vertex();
  if (changes->has_labels) {
    const auto known_inputs = static_cast<std::ptrdiff_t>(mesh.input_vertex.size());
    mesh.input_vertex.insert(mesh.input_vertex.end(), inputs.begin() + known_inputs, inputs.end());
    UpdateLabels(changes->simplices, old_vertices, mesh);
  } else {
    mesh.input_vertex = inputs;
    if (const absl::Status described = Describe(mesh, {}, threads, RunContext()); !described.ok()) {
      std::abort();  // that context cannot have been cancelled
    }
  }
  NameParts(names_, mesh);
  UpdateQuality(changes->simplices, mesh);
  context.EnterPhase(Phase::kDone);
  if (!MakesByStage()) {
    figures_.simplices_seconds += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
  }
  Finish(mesh);
  return absl::OkStatus();
}

// Sets the worst shape of the simplices, some of which have been added.
template <typename Domain>
void MesherOf<Domain>::UpdateQuality(const SimplexChanges& changes, Mesh& mesh) const {
  MeshStatistics& statistics = mesh.statistics;
  if (changes.worst == SimplexChanges::Worst::kUnknown) {
    const QualityReport report = MeasureQuality({D, mesh.points, mesh.simplices});
    statistics.max_radius_edge = report.max_radius_edge;
    statistics.min_angle_deg = report.min_angle_deg;
  } else if (changes.worst == SimplexChanges::Worst::kOfAll) {
    statistics.max_radius_edge = changes.max_radius_edge;
    statistics.min_angle_deg = changes.min_angle_deg;
  } else {
    statistics.max_radius_edge = std::max(statistics.max_radius_edge, changes.max_radius_edge);
    statistics.min_angle_deg = std::min(statistics.min_angle_deg, changes.min_angle_deg);
  }
}

// Notes an extracted mesh, and sets its statistics but for those of its simplices' shapes.
template <typename Domain>
void MesherOf<Domain>::Finish(Mesh& mesh) {
  figures_.NoteMesh(mesh);
  MeshStatistics& statistics = mesh.statistics;
  statistics.input_points = numbering_.input_vertex().size();
  statistics.vertices = mesh.vertex_count();
  statistics.simplices = mesh.simplex_count();
  figures_.SetSeconds(statistics);
  statistics.tree_leaves = structure_.tree().leaf_count();
  QueryCounters stars = figures_.star_queries;
  AddStatistics(mesh, statistics, stars);
  SetQueryFigures(refinement_->counters(), stars, statistics);
  SetTotals(statistics);
}

template <typename Domain>
absl::StatusOr<MeshEstimate> MesherOf<Domain>::EstimateOfTree(const MeshCriteria<D>& criteria, bool is_to_reserve,
                                                              const RunContext& context) const {
  // Few leaves of another domain may all be outside of it.
  if (!is_to_reserve || Domain::kHasFeatures) {
    return EstimateMeshOf<D>(structure_, criteria, context, {}, planar());
  }
  if (const std::optional<SizeEstimate> typical = TypicalSize<D>(structure_, criteria);
      typical.has_value() && structure_.vertex_count() == structure_.built_count()) {
    return MeshEstimateOf<D>(structure_, *typical);
  }
  return EstimateMeshOf<D>(structure_, criteria, context, kForReservation);
}

template <typename Domain>
absl::StatusOr<MeshEstimate> MesherOf<Domain>::EstimateFor(const MeshParameters& given, bool is_to_reserve,
                                                           const RunContext& context) const {
  WELLSPACE_RETURN_IF_ERROR(CheckParametersIn(given, D));
  WELLSPACE_ASSIGN_OR_RETURN(const MeshParameters parameters, WithSizesOfDomain(given, context));
  WELLSPACE_RETURN_IF_ERROR(AllowSamples<D>(parameters, samples_, memory_bytes(), context));
  const MeshCriteria<D> criteria = CriteriaOf(parameters);
  WELLSPACE_ASSIGN_OR_RETURN(MeshEstimate estimate, EstimateOfTree(criteria, is_to_reserve, context));
  estimate.memory_bytes += std::max(samples_.MemoryBytes(), ScaledSamples<D>::BytesFor(parameters));
  WELLSPACE_RETURN_IF_ERROR(AddToEstimate(parameters, criteria, context, estimate));
  return estimate;
}

#define WELLSPACE_INSTANTIATE(D) template class MesherOf<BoxDomain<D>>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE
template class MesherOf<PlaneDomain>;
template class MesherOf<SpaceDomain>;

}  // namespace wellspace::core
