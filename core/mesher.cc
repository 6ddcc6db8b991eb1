#include "core/mesher.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/saturate.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/estimate/estimate.h"
#include "core/feasibility.h"
#include "core/input_cloud.h"
#include "core/mesh_parts.h"
#include "core/near_points.h"
#include "core/refine/refine.h"
#include "core/simplex/quality.h"
#include "core/simplex/simplices.h"
#include "core/simplex/validate.h"
#include "core/sliver/sliver_stage.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {
namespace {

// Leaves that the tree may have for each vertex of the budget; around isolated close pairs balance costs up to about
// two.
constexpr uint64_t kLeavesPerVertex = 8;

// Smaller clouds are refined in half a second, unless there are sizes: too soon for a prediction to be of use.
template <int D>
constexpr uint64_t kLeastPredicted = D == 2 ? 50'000 : (D == 3 ? 20'000 : 2'000);

// What building the tree takes for each point, but for the most uneven clouds: keys, the point twice, a place in a
// split leaf, indices.
template <int D>
constexpr uint64_t kTreeBytes =
    2 * sizeof(Point<D>) + sizeof(uint64_t) * D + 24 +
    LeafTree<D>::Buckets::BytesFor(LeafTree<D>::kLeafCapacity / LeafTree<D>::kChildren) * LeafTree<D>::kChildren
        / LeafTree<D>::kLeafCapacity;
constexpr uint64_t kFixedBytes = uint64_t{4} << 20;

template <int D>
Box<D> BoxOf(const std::vector<double>& low, const std::vector<double>& high) {
  Box<D> box;
  std::copy_n(low.begin(), D, box.low.begin());
  std::copy_n(high.begin(), D, box.high.begin());
  return box;
}

// Points that an error names.
constexpr size_t kNamedTooClose = 10;

// Refuses what is no whole number of points.
absl::Status CheckShape(std::span<const double> points, int dimension) {
  if (points.size() % dimension != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: ", points.size(), " coordinates are not a multiple of the dimension, ", dimension));
  }
  if (points.size() / dimension > kMaxVertices) {
    return absl::InvalidArgumentError(absl::StrCat("points: ", points.size() / dimension,
                                                   " are more than vertices can be numbered; at most ", kMaxVertices,
                                                   " are accepted"));
  }
  return absl::OkStatus();
}

template <int D>
class MesherIn final : public Mesher {
 public:
  absl::Status Initialize(const MeshParameters& parameters, std::span<const double> points, RunContext& context) {
    WELLSPACE_RETURN_IF_ERROR(CheckShape(points, D));
    context.EnterPhase(Phase::kTree);
    WELLSPACE_RETURN_IF_ERROR(context.ReserveMemory(
        kFixedBytes + points.size() / D * (kTreeBytes<D> + (parameters.merge_distance > 0 ? kMergeBytes<D> : 0))));
    Box<D> box;
    if (parameters.domain_low.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(points, parameters.margin, context));
    } else {
      box = BoxOf<D>(parameters.domain_low, parameters.domain_high);
    }
    WELLSPACE_ASSIGN_OR_RETURN(domain_, Domain<D>::Of(box));
    MergedPoints merged;
    merge_distance_ = parameters.merge_distance;
    if (merge_distance_ > 0) {
      // A point outside the box may become one inside: the box of a session is that of the points that stayed.
      Domain<D> wide = domain_;
      const double reach = std::min(merge_distance_, box.LongestSide());
      wide.box = {CubeAround<D>(box.low, reach).low, CubeAround<D>(box.high, reach).high};
      WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(wide, points, context));
      WELLSPACE_ASSIGN_OR_RETURN(merged, MergeNear<D>(domain_, points, merge_distance_, context));
      merged_points_ = merged.merged;
      if (parameters.domain_low.empty()) {
        WELLSPACE_ASSIGN_OR_RETURN(box, BoxAround<D>(merged.points, parameters.margin, context));
        WELLSPACE_ASSIGN_OR_RETURN(domain_, Domain<D>::Of(box));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(CheckShapeFeasible<D>(domain_, parameters, points.size() / D));
    const auto explain = [&](const absl::Status& found) {
      return !IsTooClose(found) ? found
                                : TooNearError<D>(domain_, merge_distance_ > 0 ? merged.points : points, merged.inputs,
                                                  !parameters.domain_low.empty(), parameters.margin, found, context);
    };
    absl::StatusOr<SortedCloud<D>> sorted = merge_distance_ > 0
                                                ? SortMerged<D>(domain_, merged, parameters.threads, context)
                                                : SortCloud<D>(domain_, points, parameters.threads, context);
    WELLSPACE_RETURN_IF_ERROR(explain(sorted.status()));
    SortedCloud<D> cloud = *std::move(sorted);
    const size_t distinct = cloud.points.size();
    const uint64_t max_vertices = VertexBudget(parameters);
    if (distinct + (size_t{1} << D) > max_vertices) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the ", distinct, " distinct points and the domain's corners are more than ",
                       "max_vertices = ", max_vertices, " vertices; raise max_vertices"));
    }
    WELLSPACE_RETURN_IF_ERROR(structure_.Initialize(
        cloud.grid, std::move(cloud.points), kLeavesPerVertex * max_vertices + (1u << D), parameters.threads, context));
    WELLSPACE_RETURN_IF_ERROR(
        explain(CheckSeparation<D>(domain_, structure_, 0, cloud.first_input, parameters.threads, context)));

    WELLSPACE_ASSIGN_OR_RETURN(PointNames names, NamePoints<D>(std::move(cloud), context));
    output_index_ = std::move(names.of_sorted);
    input_vertex_ = std::move(names.of_input);
    NoteInputZeros(points, merged);
    distinct_count_ = distinct;
    distinct_input_ = distinct;
    is_given_.assign(structure_.built_count(), true);
    refinement_.emplace(structure_, domain_.MinEdge());
    context.SetVertices(structure_.vertex_count());
    tree_seconds_ = absl::ToDoubleSeconds(context.TimeIn(Phase::kTree));
    return absl::OkStatus();
  }

  int dimension() const override { return D; }
  uint64_t vertex_count() const override { return structure_.vertex_count(); }
  uint64_t memory_bytes() const override {
    // With vertex_at_, whether it has been made or somebody is making it.
    return structure_.MemoryBytes() + refinement_->MemoryBytes() + SliverMemoryBytes() +
           (output_index_.size() + distinct_count_ + input_vertex_.size()) * sizeof(uint32_t) +
           negative_zeros_.size() * sizeof(size_t) + moved_.size() / 8;
  }

  absl::Status CheckFeasible(const MeshParameters& parameters) const override {
    WELLSPACE_RETURN_IF_ERROR(CheckParameters(parameters));
    return core::CheckFeasible<D>(domain_, parameters, distinct_input_);
  }

  absl::Status Refine(const MeshParameters& parameters, RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(CheckParameters(parameters));
    context.EnterPhase(Phase::kRefinement);
    is_refined_ = false;
    const MeshCriteria<D> demands = DemandsOf(parameters);
    absl::Status status = refinement_->Run(demands, VertexBudget(parameters), parameters.threads, context, nullptr,
                                           [&] { return PredictVertices(demands, context); });
    refinement_seconds_ += absl::ToDoubleSeconds(context.TimeIn(Phase::kRefinement));
    is_given_.resize(structure_.vertex_count(), false);
    if (status.ok()) {
      status = MendSlivers(parameters, context);
    }
    is_refined_ = status.ok();
    return status;
  }

  absl::StatusOr<std::vector<uint32_t>> AddPointsNear(std::span<const double> points, std::span<const uint32_t> near,
                                                      RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(CheckShape(points, D));
    if (!near.empty() && near.size() != points.size() / D) {
      return absl::InvalidArgumentError(
          absl::StrCat("near: it has ", near.size(), " vertices for ", points.size() / D, " points"));
    }
    WELLSPACE_RETURN_IF_ERROR(CheckVertices(near));
    const auto start = [&](size_t input) { return near.empty() ? kNoVertex : VertexOf(near[input]); };
    WELLSPACE_ASSIGN_OR_RETURN(Added added, MergeAdded(points, start, context));
    const std::span<const double> others = merge_distance_ > 0 ? added.others.points : points;
    absl::StatusOr<SortedCloud<D>> sorted = SortCloud<D>(domain_, others, 1, context, added.others.inputs);
    if (IsTooClose(sorted.status())) {
      return TooNearError<D>(domain_, others, added.others.inputs, true, 0, sorted.status(), context);
    }
    WELLSPACE_RETURN_IF_ERROR(sorted.status());
    SortedCloud<D> cloud = *std::move(sorted);
    const HugeVector<uint32_t> sorted_of = cloud.SortedOfInputs();
    for (uint32_t& input : cloud.first_input) {
      input = added.others.inputs.empty() ? input : added.others.inputs[input];
    }
    if (const absl::Status apart = CheckApart(cloud, context); !apart.ok()) {
      return IsTooClose(apart) ? TooNearError<D>(domain_, others, added.others.inputs, true, 0, apart, context) : apart;
    }
    WELLSPACE_ASSIGN_OR_RETURN(std::vector<VertexId> known, FindAll(cloud, start, context));
    if (structure_.vertex_count() + cloud.points.size() > kMaxVertices) {
      return absl::ResourceExhaustedError(absl::StrCat("points: ", cloud.points.size(), " beside ", vertex_count(),
                                                       " vertices are more than can be numbered, ", kMaxVertices));
    }
    for (size_t i = 0; i < cloud.points.size(); ++i) {
      if (known[i] == kNoVertex) {
        known[i] = Add(start(cloud.first_input[i]), cloud.points[i], points, cloud.first_input[i]);
      }
    }
    std::vector<uint32_t> vertices;
    for (size_t i = 0, other = 0; i < points.size() / D; ++i) {
      VertexId v = merge_distance_ > 0 ? added.vertex_of[i] : kNoVertex;
      if (v == kNoVertex) {
        v = known[sorted_of[merge_distance_ > 0 ? added.others.place_of[other] : other]];
        ++other;
      }
      is_given_[Index(v)] = true;
      vertices.push_back(OutputIndex(v));
    }
    merged_points_ += added.others.merged;
    input_vertex_.insert(input_vertex_.end(), vertices.begin(), vertices.end());
    context.SetVertices(structure_.vertex_count());
    return vertices;
  }

  absl::StatusOr<uint32_t> AddVertex(uint32_t near, std::span<const double> point) override {
    WELLSPACE_RETURN_IF_ERROR(CheckVertices({&near, 1}));
    if (point.size() != D) {
      return absl::InvalidArgumentError(
          absl::StrCat("point: it has ", point.size(), " coordinates; ", D, " are needed"));
    }
    if (structure_.vertex_count() >= kMaxVertices) {
      return absl::ResourceExhaustedError(absl::StrCat("no more than ", kMaxVertices, " vertices can be numbered"));
    }
    const RunContext context;
    WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(domain_, point, context));
    const VertexId start = VertexOf(near);
    VertexId v = FindMerged(domain_.Scaled(PointAt<D>(point, 0)), start, merged_points_);
    if (v == kNoVertex) {
      WELLSPACE_ASSIGN_OR_RETURN(const SortedCloud<D> cloud, SortCloud<D>(domain_, point, 1, context));
      WELLSPACE_ASSIGN_OR_RETURN(v, Find(cloud.points[0], 0, start));
      if (v == kNoVertex) {
        v = Add(start, cloud.points[0], point, 0);
      }
    }
    is_given_[Index(v)] = true;
    input_vertex_.push_back(OutputIndex(v));
    return OutputIndex(v);
  }

  absl::StatusOr<std::vector<double>> NearestNeighborDistances(std::span<const uint32_t> vertices) const override {
    WELLSPACE_RETURN_IF_ERROR(CheckVertices(vertices));
    std::vector<double> distances;
    distances.reserve(vertices.size());
    Workspace<D> workspace;
    for (const uint32_t vertex : vertices) {
      const double distance_sq = structure_.ApproximateNearestNeighbor(VertexOf(vertex), workspace).distance_sq;
      distances.push_back(std::sqrt(distance_sq) / domain_.scale);
    }
    return distances;
  }

  absl::StatusOr<std::vector<Cell>> ClippedCells(std::span<const uint32_t> vertices, double beta) const override {
    WELLSPACE_RETURN_IF_ERROR(CheckVertices(vertices));
    if (!(beta >= 1)) {
      return absl::InvalidArgumentError(absl::StrCat("beta: ", beta, " is not allowed; a number of at least 1 is"));
    }
    // Those of one leaf one after the other, since cells of vertices that are near each other take less time.
    std::vector<std::pair<NodeId, size_t>> order;
    order.reserve(vertices.size());
    for (size_t i = 0; i < vertices.size(); ++i) {
      order.emplace_back(structure_.tree().leaf_of(VertexOf(vertices[i])), i);
    }
    std::sort(order.begin(), order.end());
    std::vector<VertexId> sites;
    sites.reserve(vertices.size());
    for (const auto& [leaf, i] : order) {
      sites.push_back(VertexOf(vertices[i]));
    }
    std::vector<Cell> cells(vertices.size());
    auto next = order.begin();
    absl::Status status;
    Workspace<D> workspace;
    structure_.ClippedVoronoiOfEach(sites, beta, workspace, [&](VertexId, double radius) {
      const size_t i = (next++)->second;
      if (workspace.cell.IsTooLarge()) {
        status = absl::FailedPreconditionError(absl::StrCat("the cell of vertex ", vertices[i], " has more than ",
                                                            Polytope<D>::kMostNodes,
                                                            " nodes; refine first, or ask with a smaller beta"));
        return false;
      }
      cells[i] =
          DescribeCell<D>(vertices[i], radius, workspace.cell, domain_, [this](VertexId u) { return OutputIndex(u); });
      return true;
    });
    WELLSPACE_RETURN_IF_ERROR(status);
    return cells;
  }

  absl::StatusOr<Mesh> Extract(int threads, RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(CheckRefined(threads));
    ExtendOutputIndex();
    Mesh mesh;
    mesh.dimension = D;
    mesh.domain_low.assign(domain_.box.low.begin(), domain_.box.low.end());
    mesh.domain_high.assign(domain_.box.high.begin(), domain_.box.high.end());
    absl::StatusOr<HugeVector<double>> points;
    // By another thread, meanwhile.
    ThreadTeam team(threads);
    const absl::Cleanup end = [&team] { team.Drop(); };  // where something is refused
    team.BeginCall([&] {
      points = PointsFrom(0, context);
      mesh.input_vertex.assign(input_vertex_.begin(), input_vertex_.end());
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
    mesh.statistics.max_radius_edge = simplices.max_radius_edge;
    mesh.statistics.min_angle_deg = simplices.min_angle_deg;
    stars_.Add(simplices.counters);
    context.EnterPhase(Phase::kDone);
    if (!MakesWhole()) {
      simplices_seconds_ += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
    }
    mesh.moved_vertices = MovedVertices();
    has_moved_ = false;
    moved_.clear();
    FinishMesh(mesh);
    return mesh;
  }

  absl::Status Update(Mesh& mesh, int threads, RunContext& context) override {
    WELLSPACE_RETURN_IF_ERROR(CheckRefined(threads));
    if (mesh.dimension != D || mesh.vertex_count() != extracted_vertices_ ||
        mesh.simplex_count() != extracted_simplices_) {
      return absl::InvalidArgumentError(
          absl::StrCat("mesh: it has ", mesh.vertex_count(), " vertices and ", mesh.simplex_count(), " simplices in ",
                       mesh.dimension, "-D; the last that was extracted has ", extracted_vertices_, " and ",
                       extracted_simplices_, " in ", D, "-D, and only that can be updated"));
    }
    if (MakesWhole() || has_moved_ || !mesh.weights.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(mesh, Extract(threads, context));
      return absl::OkStatus();
    }
    context.EnterPhase(Phase::kSimplices);
    ExtendOutputIndex();
    WELLSPACE_ASSIGN_OR_RETURN(
        const std::vector<VertexId> changed,
        ChangedVertices<D>(structure_, VertexId{static_cast<uint32_t>(extracted_vertices_)}, context));
    WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices,
                               ComputeSimplicesAmong<D>(structure_, changed, output_index_, threads, context));
    WELLSPACE_ASSIGN_OR_RETURN(const HugeVector<double> added, PointsFrom(extracted_vertices_, context));
    mesh.points.insert(mesh.points.end(), added.begin(), added.end());
    std::vector<bool> has_changed(structure_.vertex_count(), false);
    for (const VertexId v : changed) {
      has_changed[OutputIndex(v)] = true;
    }
    const bool worst_has_gone = DropSimplicesAmong<D>(
        has_changed, [this](uint32_t v) -> const Point<D>& { return structure_.point(VertexOf(v)); }, mesh);
    mesh.simplices.insert(mesh.simplices.end(), simplices.indices.begin(), simplices.indices.end());
    mesh.input_vertex.assign(input_vertex_.begin(), input_vertex_.end());
    mesh.moved_vertices.clear();  // else the mesh is extracted anew
    if (worst_has_gone) {
      const QualityReport report = MeasureQuality({D, mesh.points, mesh.simplices});
      mesh.statistics.max_radius_edge = report.max_radius_edge;
      mesh.statistics.min_angle_deg = report.min_angle_deg;
    } else {
      mesh.statistics.max_radius_edge = std::max(mesh.statistics.max_radius_edge, simplices.max_radius_edge);
      mesh.statistics.min_angle_deg = std::min(mesh.statistics.min_angle_deg, simplices.min_angle_deg);
    }
    stars_.Add(simplices.counters);
    context.EnterPhase(Phase::kDone);
    simplices_seconds_ += absl::ToDoubleSeconds(context.TimeIn(Phase::kSimplices));
    FinishMesh(mesh);
    return absl::OkStatus();
  }

  absl::StatusOr<MeshEstimate> Estimate(const MeshParameters& parameters, const RunContext& context) const override {
    WELLSPACE_RETURN_IF_ERROR(CheckParameters(parameters));
    if (structure_.vertex_count() > structure_.built_count()) {
      return absl::FailedPreconditionError(
          "vertices have been inserted since the mesher was created; an estimate is made before that");
    }
    WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size, EstimateSize<D>(structure_, DemandsOf(parameters), context));
    MeshEstimate estimate;
    estimate.vertices = SaturatedCount(size.vertices);
    estimate.simplices = SaturatedCount(size.simplices);
    estimate.memory_bytes = SaturatedCount(size.bytes);
    estimate.bytes_per_vertex = size.bytes / size.vertices;
    if constexpr (D >= 3) {
      if (MinDihedralOf(parameters) > 0 || parameters.pump_weights) {
        const uint64_t bytes = SliverStage<D>::EstimateBytes(estimate.vertices, estimate.simplices);
        estimate.memory_bytes = SaturatedCount(static_cast<double>(estimate.memory_bytes) + static_cast<double>(bytes));
        estimate.bytes_per_vertex += static_cast<double>(bytes) / static_cast<double>(estimate.vertices);
      }
    }
    estimate.tree_leaves = structure_.tree().leaf_count();
    return estimate;
  }

 private:
  static absl::Status CheckParameters(const MeshParameters& parameters) {
    WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
    if (parameters.dimension != D) {
      return absl::InvalidArgumentError(
          absl::StrCat("dimension: ", parameters.dimension, " is not that of the mesh, ", D));
    }
    return absl::OkStatus();
  }

  MeshCriteria<D> DemandsOf(const MeshParameters& parameters) const { return DemandsIn<D>(domain_, parameters); }

  // How many vertices a first refinement will end with; 0 if the context knows, or it ends too soon to be worth an
  // estimate.
  absl::StatusOr<uint64_t> PredictVertices(const MeshCriteria<D>& demands, const RunContext& context) const {
    if (context.estimated_vertices() > 0 || structure_.vertex_count() > structure_.built_count() ||
        (demands.sizes.IsUnbounded() && structure_.vertex_count() < kLeastPredicted<D>)) {
      return 0;
    }
    WELLSPACE_ASSIGN_OR_RETURN(const SizeEstimate size, EstimateSize<D>(structure_, demands, context, kGlance));
    return SaturatedCount(size.vertices);
  }

  // Mends slivers if that is asked for; what is kept for that goes if it is not. Decides whether the mesh is pumped: a
  // mesh without slivers stays Delaunay.
  absl::Status MendSlivers(const MeshParameters& parameters, RunContext& context) {
    if constexpr (D == 3) {
      if (const double min_dihedral = MinDihedralOf(parameters); min_dihedral > 0) {
        const MendDemands demands{DemandsOf(parameters), min_dihedral, domain_.MinEdge(), VertexBudget(parameters)};
        const uint64_t moves = slivers_.statistics().moves;
        moved_.resize(extracted_vertices_, false);
        std::vector<bool> kept;
        if (parameters.keep_vertices) {
          kept = is_given_;
          std::fill_n(kept.begin(), extracted_vertices_, true);
        }
        const absl::Status status = slivers_.Mend(structure_, *refinement_, parameters.keep_vertices ? kept : is_given_,
                                                  demands, moved_, parameters.threads, context);
        is_given_.resize(structure_.vertex_count(), false);
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

  static double MinDihedralOf(const MeshParameters& parameters) {
    return parameters.min_dihedral.value_or(DefaultMinDihedral(D));
  }

  uint64_t SliverMemoryBytes() const {
    if constexpr (D >= 3) {
      return slivers_.MemoryBytes();
    }
    return 0;
  }

  // Whether the mesh is that of the sliver stage, and not made of stars.
  bool MakesWhole() const {
    if constexpr (D >= 3) {
      return pumps_ || slivers_.HasTriangulation();
    }
    return false;
  }

  absl::StatusOr<WeightedSimplices> MakeSimplices(int threads, RunContext& context) {
    if constexpr (D >= 3) {
      if (MakesWhole()) {
        return slivers_.ToSimplices(structure_, refinement_->stars(), output_index_, pumps_, threads, context);
      }
    }
    context.EnterPhase(Phase::kSimplices);
    WeightedSimplices made;
    WELLSPACE_ASSIGN_OR_RETURN(made.simplices,
                               ComputeSimplices<D>(structure_, refinement_->stars(), output_index_, threads, context));
    return made;
  }

  // Steiner vertices that have moved since the last mesh; ascending, as they have the same numbers outside as inside.
  HugeVector<uint32_t> MovedVertices() const {
    HugeVector<uint32_t> vertices;
    for (uint32_t v = 0; v < moved_.size(); ++v) {
      if (moved_[v]) {
        vertices.push_back(OutputIndex(VertexId{v}));
      }
    }
    return vertices;
  }

  // Refuses numbers that are no vertex.
  absl::Status CheckVertices(std::span<const uint32_t> vertices) const {
    for (size_t i = 0; i < vertices.size(); ++i) {
      if (vertices[i] >= structure_.vertex_count()) {
        return absl::OutOfRangeError(
            absl::StrCat("vertices[", i, "]: ", vertices[i], " is no vertex; there are ", structure_.vertex_count()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckRefined(int threads) const {
    if (!is_refined_) {
      return absl::FailedPreconditionError(
          "the mesh has not been refined since vertices were last added; refine it first");
    }
    return CheckThreads(threads);
  }

  // Vertices beyond the distinct input points have the same number outside as inside.
  uint32_t OutputIndex(VertexId v) const { return Index(v) < distinct_count_ ? output_index_[Index(v)] : Index(v); }
  VertexId VertexOf(uint32_t output_index) const {
    if (output_index >= distinct_count_) {
      return VertexId{output_index};
    }
    std::call_once(has_vertex_at_, [this] {
      vertex_at_.resize(distinct_count_);
      for (uint32_t i = 0; i < distinct_count_; ++i) {
        vertex_at_[output_index_[i]] = VertexId{i};
      }
    });
    return vertex_at_[output_index];
  }
  void ExtendOutputIndex() {
    const auto old = static_cast<std::ptrdiff_t>(output_index_.size());
    output_index_.resize(structure_.vertex_count());
    std::iota(output_index_.begin() + old, output_index_.end(), static_cast<uint32_t>(old));
  }

  // The nearest vertex, if points this near are merged: a Steiner vertex too, as it stands where the point is. Counts
  // it in `merged` unless it is at `p`.
  VertexId FindMerged(const Point<D>& p, VertexId near, uint64_t& merged) {
    if (merge_distance_ == 0) {
      return kNoVertex;
    }
    const auto [nearest, distance_sq] = structure_.NearestTo(p, near, workspace_);
    const double reach = merge_distance_ * domain_.scale;
    if (distance_sq > reach * reach) {
      return kNoVertex;
    }
    merged += distance_sq > 0 ? 1 : 0;
    return nearest;
  }

  // Points that are added, if near ones are merged: those that become vertices that there are, and what is left of the
  // others.
  struct Added {
    std::vector<VertexId> vertex_of;  // by input
    MergedPoints others;              // `inputs` are numbers among all, `place_of` is by those that are others
  };

  template <typename Start>
  absl::StatusOr<Added> MergeAdded(std::span<const double> points, Start start, const RunContext& context) {
    Added added;
    if (merge_distance_ == 0) {
      return added;
    }
    WELLSPACE_RETURN_IF_ERROR(CheckPoints<D>(domain_, points, context));
    uint64_t merged = 0;
    std::vector<double> others;
    std::vector<uint32_t> inputs;
    for (uint32_t i = 0; i < points.size() / D; ++i) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const Point<D> p = PointAt<D>(points, i);
      added.vertex_of.push_back(FindMerged(domain_.Scaled(p), start(i), merged));
      if (added.vertex_of.back() == kNoVertex) {
        others.insert(others.end(), p.begin(), p.end());
        inputs.push_back(i);
      }
    }
    WELLSPACE_ASSIGN_OR_RETURN(added.others, MergeNear<D>(domain_, others, merge_distance_, context));
    added.others.merged += merged;
    for (uint32_t& input : added.others.inputs) {
      input = inputs[input];
    }
    return added;
  }

  // Refuses points that are too near to each other.
  absl::Status CheckApart(const SortedCloud<D>& cloud, const RunContext& context) const {
    // The points among themselves, and beside the faces of the box.
    QueryStructure<D> apart;
    WELLSPACE_RETURN_IF_ERROR(apart.Initialize(cloud.grid, {}, kLeavesPerVertex * kDefaultMaxVertices, 1, context));
    const uint32_t corners = apart.vertex_count();
    for (const Point<D>& p : cloud.points) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      apart.AddVertex(kNoVertex, p);
    }
    return CheckSeparation<D>(domain_, apart, corners, cloud.first_input, 1, context);
  }

  // Find for each of a cloud; the error counts those that are too close, and names the first.
  template <typename Start>
  absl::StatusOr<std::vector<VertexId>> FindAll(const SortedCloud<D>& cloud, Start start, const RunContext& context) {
    std::vector<VertexId> found(cloud.points.size(), kNoVertex);
    std::vector<std::pair<uint32_t, absl::Status>> refused;
    for (size_t i = 0; i < cloud.points.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      const uint32_t input = cloud.first_input[i];
      const absl::StatusOr<VertexId> vertex = Find(cloud.points[i], input, start(input));
      if (vertex.ok()) {
        found[i] = *vertex;
      } else {
        refused.emplace_back(input, vertex.status());
      }
    }
    if (refused.empty()) {
      return found;
    }
    std::sort(refused.begin(), refused.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string text(refused.front().second.message());
    for (size_t i = 1; i < refused.size() && i < kNamedTooClose; ++i) {
      absl::StrAppend(&text, i == 1 ? "; so are " : ", ", "points[", refused[i].first, "]");
    }
    if (refused.size() > 1) {
      absl::StrAppend(&text, refused.size() > kNamedTooClose ? ", …: " : ": ", refused.size(), " points in all");
    }
    return absl::InvalidArgumentError(text);
  }

  // The vertex at `p`, which is input `index`; kNoVertex if there is none, and none too close.
  absl::StatusOr<VertexId> Find(const Point<D>& p, size_t index, VertexId near = kNoVertex) {
    const auto [nearest, distance_sq] = structure_.NearestTo(p, near, workspace_);
    if (distance_sq == 0) {
      return nearest;
    }
    if (distance_sq < domain_.MinSeparation() * domain_.MinSeparation()) {
      return TooCloseError<D>(domain_, p, index, std::sqrt(distance_sq), absl::StrCat("vertex ", OutputIndex(nearest)));
    }
    return kNoVertex;
  }

  // Adds a vertex at `p`, which is input `index` of `points`.
  VertexId Add(VertexId near, const Point<D>& p, std::span<const double> points, size_t index) {
    const VertexId v = structure_.AddVertex(near, p);
    is_given_.resize(structure_.vertex_count(), true);
    refinement_->VertexAdded(v);
    is_refined_ = false;
    ++distinct_input_;
    NoteNegativeZeros(points, index, OutputIndex(v));
    return v;
  }

  // The computation has no negative zeros, the mesh those of its points.
  void NoteNegativeZeros(std::span<const double> points, size_t index, uint32_t vertex) {
    for (int k = 0; k < D; ++k) {
      const double x = points[index * D + k];
      if (x == 0 && std::signbit(x)) {
        negative_zeros_.push_back(size_t{vertex} * D + k);
      }
    }
  }

  // Those of the points that became vertices: the first of equals, or what merging has left.
  void NoteInputZeros(std::span<const double> points, const MergedPoints& merged) {
    for (const uint32_t input : merged.inputs) {
      NoteNegativeZeros(points, input, input_vertex_[input]);
    }
    for (uint32_t i = 0, named = 0; merge_distance_ == 0 && i < input_vertex_.size(); ++i) {
      if (input_vertex_[i] == named) {  // and no duplicate of an earlier one
        NoteNegativeZeros(points, i, named++);
      }
    }
  }

  // The coordinates of the vertices from number `first` on, by output index: all, or none of the input points.
  absl::StatusOr<HugeVector<double>> PointsFrom(uint64_t first, const RunContext& context) const {
    const uint32_t count = structure_.vertex_count();
    const auto place_of = [&](uint32_t v) { return (OutputIndex(VertexId{v}) - first) * D; };
    HugeVector<double> out((count - first) * D);
    for (auto i = static_cast<uint32_t>(first); i < count; ++i) {
      if (i % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      if (count - i > kAhead) {
        __builtin_prefetch(&out[place_of(i + kAhead)], 1);
      }
      const Point<D> p = domain_.Unscaled(structure_.point(VertexId{i}));
      std::copy(p.begin(), p.end(), &out[place_of(i)]);
    }
    for (const size_t at : negative_zeros_) {
      if (at >= first * D) {
        out[at - first * D] = -0.0;
      }
    }
    return out;
  }

  // Notes an extracted mesh, and sets its statistics but for those of its simplices' shapes.
  void FinishMesh(Mesh& mesh) {
    extracted_vertices_ = structure_.vertex_count();
    extracted_simplices_ = mesh.simplex_count();
    MeshStatistics& statistics = mesh.statistics;
    statistics.input_points = input_vertex_.size();
    statistics.duplicates = input_vertex_.size() - distinct_input_ - merged_points_;
    statistics.merged_points = merged_points_;
    statistics.vertices = mesh.vertex_count();
    statistics.simplices = mesh.simplex_count();
    statistics.tree_seconds = tree_seconds_;
    statistics.refinement_seconds = refinement_seconds_;
    statistics.simplices_seconds = simplices_seconds_;
    statistics.tree_leaves = structure_.tree().leaf_count();
    QueryCounters stars = stars_;
    if constexpr (D >= 3) {
      stars.Add(slivers_.statistics().star_queries);
      SetSliverFigures(slivers_.statistics(), statistics);
      for (LeftSliver& sliver : statistics.flattest_left) {
        for (uint32_t& v : sliver.vertices) {
          v = OutputIndex(VertexId{v});
        }
      }
    }
    SetQueryFigures(refinement_->counters(), stars, statistics);
    SetTotals(statistics);
  }

  Domain<D> domain_;
  QueryStructure<D> structure_;
  std::optional<Refinement<D>> refinement_;
  bool is_refined_ = false;
  [[no_unique_address]] std::conditional_t<(D >= 3), SliverStage<D>, std::monostate> slivers_;
  bool pumps_ = false;
  bool has_moved_ = false;      // a vertex, since the last mesh
  std::vector<bool> moved_;     // by vertex, since the last mesh, of those that it had
  std::vector<bool> is_given_;  // by vertex: an input point, or a corner of the box

  uint64_t distinct_count_ = 0;        // the former
  HugeVector<uint32_t> output_index_;  // by vertex; of the first distinct_count_ at least
  // By output index, of the first distinct_count_; once one is asked for.
  mutable HugeVector<VertexId> vertex_at_;
  mutable std::once_flag has_vertex_at_;
  HugeVector<uint32_t> input_vertex_;  // by point given
  uint64_t distinct_input_ = 0;        // different vertices among them
  double merge_distance_ = 0;
  uint64_t merged_points_ = 0;          // became a vertex with other coordinates
  std::vector<size_t> negative_zeros_;  // places in Mesh::points

  uint64_t extracted_vertices_ = 0;  // of the last mesh made
  uint64_t extracted_simplices_ = 0;
  QueryCounters stars_;
  double tree_seconds_ = 0;
  double refinement_seconds_ = 0;
  double simplices_seconds_ = 0;
  Workspace<D> workspace_;
};

template <int D>
absl::StatusOr<std::unique_ptr<Mesher>> CreateIn(const MeshParameters& parameters, std::span<const double> points,
                                                 RunContext& context) {
  auto mesher = std::make_unique<MesherIn<D>>();
  WELLSPACE_RETURN_IF_ERROR(mesher->Initialize(parameters, points, context));
  return mesher;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Mesher>> Mesher::Create(const MeshParameters& parameters, std::span<const double> points,
                                                       RunContext& context) {
  WELLSPACE_RETURN_IF_ERROR(ValidateParameters(parameters));
  switch (parameters.dimension) {
#define WELLSPACE_CASE(D) \
  case D:                 \
    return CreateIn<D>(parameters, points, context);
    WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_CASE)
#undef WELLSPACE_CASE
    default:
      return absl::InternalError("ValidateParameters lets no other dimension pass");
  }
}

}  // namespace wellspace::core
