// BoxMesher's part of Mesher::Update.
#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/dimensions.h"
#include "core/base/status_macros.h"
#include "core/meshers/box_mesher.h"
#include "core/simplex/boundary_update.h"
#include "core/simplex/quality.h"
#include "core/simplex/simplices.h"

namespace wellspace::core {
namespace {

// Two ways to compute the quality of a simplex differ by less.
constexpr double kWorstTolerance = 1e-9;

}  // namespace

// Whether `mesh` has the inputs, origins and boundary that the last mesh had, as far as their counts tell.
template <int D>
bool BoxMesher<D>::HasLabels(const Mesh& mesh) const {
  const uint64_t facets = std::accumulate(mesh.boundary.begin(), mesh.boundary.end(), uint64_t{0},
                                          [](uint64_t sum, const BoundaryPart& part) { return sum + part.facets; });
  return mesh.vertex_tags.size() == mesh.vertex_count() && mesh.vertex_origins.size() == mesh.vertex_count() &&
         mesh.boundary.size() == 2 * D && facets == facet_simplices_.size() && mesh.facets.size() == facets * D &&
         mesh.input_vertex.size() == known_inputs_ && mesh.regions.size() == 1;
}

template <int D>
absl::StatusOr<std::optional<typename BoxMesher<D>::Changes>> BoxMesher<D>::FindChanges(const Mesh& mesh, int threads,
                                                                                        RunContext& context) {
  numbering_.Extend(structure_.vertex_count());
  Changes changes;
  WELLSPACE_ASSIGN_OR_RETURN(changes.points,
                             numbering_.PointsFrom(structure_, frame_, figures_.extracted_vertices, context));
  WELLSPACE_ASSIGN_OR_RETURN(std::optional<SimplexChanges> simplices, FindChangedSimplices(mesh, threads, context));
  if (!simplices.has_value()) {
    return std::nullopt;
  }
  changes.simplices = *std::move(simplices);
  changes.has_labels = HasLabels(mesh);
  return changes;
}

template <int D>
absl::StatusOr<std::optional<SimplexChanges>> BoxMesher<D>::FindChangedSimplices(const Mesh& mesh, int threads,
                                                                                 RunContext& context) {
  if (pumps_ || !mesh.weights.empty() || followed_ == Followed::kNot) {
    return std::nullopt;
  }
  // After an error, of memory that is not there, the rows are followed no more.
  const Followed followed = std::exchange(followed_, Followed::kNot);
  if constexpr (D == 3) {
    if (MakesByStage()) {
      if (followed != Followed::kByStage) {
        return std::nullopt;
      }
      WELLSPACE_ASSIGN_OR_RETURN(std::optional<SimplexChanges> changes,
                                 slivers_.Update(numbering_.output_index(), context));
      followed_ = Followed::kByStage;
      return changes;
    }
  }
  if (repairs_.has_moved()) {
    return std::nullopt;
  }
  WELLSPACE_ASSIGN_OR_RETURN(SimplexChanges changes, FindChangedStars(mesh, threads, context));
  followed_ = Followed::kByStars;
  return changes;
}

// The changes around the vertices that have been added: their stars are computed, and those of all their neighbours.
template <int D>
absl::StatusOr<SimplexChanges> BoxMesher<D>::FindChangedStars(const Mesh& mesh, int threads, RunContext& context) {
  context.EnterPhase(Phase::kSimplices);
  WELLSPACE_ASSIGN_OR_RETURN(
      const std::vector<VertexId> changed,
      ChangedVertices<D>(structure_, VertexId{static_cast<uint32_t>(mesh.vertex_count())}, context));
  WELLSPACE_ASSIGN_OR_RETURN(
      Simplices simplices, ComputeSimplicesAmong<D>(structure_, changed, numbering_.output_index(), threads, context));
  if (!star_rows_.has_value() || star_rows_->IsSparse()) {
    WELLSPACE_RETURN_IF_ERROR(context.AllowMemory(
        Base::memory_bytes() + StarRows<D>::BytesFor(mesh.simplex_count(), structure_.vertex_count())));
    StarRows<D> rows;
    WELLSPACE_RETURN_IF_ERROR(rows.Build(mesh.simplices, structure_.vertex_count(), context));
    star_rows_ = std::move(rows);
  }
  std::vector<uint32_t> numbers;
  std::vector<bool> has_changed(structure_.vertex_count(), false);
  for (const VertexId v : changed) {
    numbers.push_back(numbering_.OutputIndex(v));
    has_changed[numbers.back()] = true;
  }
  const std::vector<uint32_t> dropped = star_rows_->FindAmong(
      numbers, [&](uint32_t v) { return has_changed[v]; }, mesh.simplices);
  SimplexChanges changes;
  changes.worst = std::any_of(dropped.begin(), dropped.end(),
                              [&](uint32_t slot) { return MayBeWorst(mesh, star_rows_->RowOf(slot)); })
                      ? SimplexChanges::Worst::kUnknown
                      : SimplexChanges::Worst::kOfAdded;
  changes.max_radius_edge = simplices.max_radius_edge;
  changes.min_angle_deg = simplices.min_angle_deg;
  changes.edits = star_rows_->Replace(dropped, simplices.indices, structure_.vertex_count(), mesh.simplices);
  changes.added = std::move(simplices.indices);
  figures_.star_queries.Add(simplices.counters);
  return changes;
}

// Whether a simplex may be the worst of the mesh.
template <int D>
bool BoxMesher<D>::MayBeWorst(const Mesh& mesh, uint64_t row) const {
  Simplex<D> simplex;
  for (int k = 0; k <= D; ++k) {
    simplex[k] = structure_.point(numbering_.VertexOf(mesh.simplices[row * (D + 1) + k]));
  }
  return RadiusEdgeRatio<D>(simplex) >= mesh.statistics.max_radius_edge * (1 - kWorstTolerance) ||
         Angles<D>(simplex).min_deg <= mesh.statistics.min_angle_deg * (1 + kWorstTolerance);
}

template <int D>
void BoxMesher<D>::MovePoints(Mesh& mesh) {
  mesh.moved_vertices.clear();
  for (const VertexId v : repairs_.TakeMoved()) {
    const Point<D> p = frame_.Unscaled(structure_.point(v));
    const uint32_t number = numbering_.OutputIndex(v);
    std::copy(p.begin(), p.end(), mesh.points.begin() + static_cast<std::ptrdiff_t>(size_t{number} * D));
    mesh.moved_vertices.push_back(number);  // ascending: it is the same number
  }
}

template <int D>
void BoxMesher<D>::UpdateLabels(const SimplexChanges& changes, uint64_t old_vertices, Mesh& mesh) {
  BoxBoundary boundary{.facets = std::move(mesh.facets),
                       .parts = std::move(mesh.boundary),
                       .vertex_tags = std::move(mesh.vertex_tags),
                       .simplices = std::move(facet_simplices_)};
  UpdateBoxBoundary({mesh.domain_low, mesh.domain_high, mesh.points, mesh.simplices}, changes.edits, old_vertices,
                    mesh.moved_vertices, boundary);
  mesh.facets = std::move(boundary.facets);
  mesh.boundary = std::move(boundary.parts);
  mesh.vertex_tags = std::move(boundary.vertex_tags);
  facet_simplices_ = std::move(boundary.simplices);

  HugeVector<uint32_t>& origins = mesh.vertex_origins;
  origins.resize(structure_.vertex_count(), kSteinerOrigin);
  repairs_.ForEachAdded(static_cast<uint32_t>(old_vertices), [&](VertexId v) { origins[Index(v)] = kRepairOrigin; });
  for (size_t i = known_inputs_; i < mesh.input_vertex.size(); ++i) {
    if (uint32_t& origin = origins[mesh.input_vertex[i]]; origin >= kCornerOrigin) {  // else an earlier input is there
      origin = static_cast<uint32_t>(i);
    }
  }
  known_inputs_ = mesh.input_vertex.size();
}

#define WELLSPACE_INSTANTIATE(D)                                                                                     \
  template bool BoxMesher<D>::HasLabels(const Mesh&) const;                                                          \
  template absl::StatusOr<std::optional<typename BoxMesher<D>::Changes>> BoxMesher<D>::FindChanges(const Mesh&, int, \
                                                                                                   RunContext&);     \
  template absl::StatusOr<std::optional<SimplexChanges>> BoxMesher<D>::FindChangedSimplices(const Mesh&, int,        \
                                                                                            RunContext&);            \
  template absl::StatusOr<SimplexChanges> BoxMesher<D>::FindChangedStars(const Mesh&, int, RunContext&);             \
  template bool BoxMesher<D>::MayBeWorst(const Mesh&, uint64_t) const;                                               \
  template void BoxMesher<D>::MovePoints(Mesh&);                                                                     \
  template void BoxMesher<D>::UpdateLabels(const SimplexChanges&, uint64_t, Mesh&);
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
