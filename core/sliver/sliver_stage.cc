#include "core/sliver/sliver_stage.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/sort_few.h"
#include "core/base/status_macros.h"
#include "core/base/stopwatch.h"
#include "core/base/thread_team.h"
#include "core/refine/space/space_domain.h"
#include "core/simplex/quality.h"
#include "core/sliver/pump.h"
#include "core/sliver/surface_carrier.h"

namespace wellspace::core {
namespace {

// Where more than one in so many vertices is new, the triangulation is made anew.
constexpr uint32_t kFewNew = 8;
// Simplices or vertices between two looks at the context.
constexpr uint32_t kCheckInterval = 1 << 14;
// Where more changes are noted than one for so many simplices, the mesh is made anew. Some simplices change again and
// again.
constexpr uint32_t kFewChanged = 2;

// Appends simplex `s`, lowest output index first, the others ascending but for an exchange of the last two that keeps
// it positive.
template <int D>
void Emit(const Triangulation<D>& triangulation, SimplexId s, std::span<const uint32_t> output_index,
          HugeVector<uint32_t>& out) {
  std::array<uint32_t, D + 1> corners;
  for (int i = 0; i <= D; ++i) {
    corners[i] = output_index[Index(triangulation.item(s).vertices[i])];
  }
  if (SortFew(corners)) {
    std::swap(corners[D - 1], corners[D]);
  }
  out.insert(out.end(), corners.begin(), corners.end());
}

// Puts simplices, lowest vertex first, into ascending order: the numbers of a triangulation, which decide the order of
// repair, then depend on the simplices alone.
//
// Complexity: O(vertices + simplices) and sorting the simplices of each lowest vertex.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::Status SortSimplices(uint32_t vertex_count, HugeVector<uint32_t>& indices, ThreadTeam& team,
                           const RunContext& context) {
  using Row = std::array<uint32_t, D + 1>;
  const size_t count = indices.size() / (D + 1);
  HugeVector<size_t> next(size_t{vertex_count} + 1, 0);  // by lowest vertex
  for (size_t s = 0; s < count; ++s) {
    ++next[indices[s * (D + 1)] + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  HugeVector<Row> rows(count);
  for (size_t s = 0; s < count; ++s) {
    if (s % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const auto from = indices.begin() + static_cast<ptrdiff_t>(s * (D + 1));
    std::copy(from, from + D + 1, rows[next[*from]++].begin());
  }
  // next[v] is where those of v end.
  return team.TryForEach((vertex_count + kCheckInterval - 1) / kCheckInterval, [&](size_t block) {
    const size_t end = std::min<size_t>(vertex_count, (block + 1) * kCheckInterval);
    for (size_t v = block * kCheckInterval; v < end; ++v) {
      const auto first = rows.begin() + static_cast<ptrdiff_t>(v == 0 ? 0 : next[v - 1]);
      const auto last = rows.begin() + static_cast<ptrdiff_t>(next[v]);
      std::sort(first, last);
      auto to = indices.begin() + (first - rows.begin()) * (D + 1);
      for (auto row = first; row < last; ++row) {
        to = std::copy(row->begin(), row->end(), to);
      }
    }
    return context.Check();
  });
}

// Has structure and refinement follow the triangulation step by step, so that repair may end after any of them.
template <typename Domain>
class Follower final : public RepairObserver {
 public:
  Follower(Triangulation<3>& triangulation, QueryStructure<3>& structure, Refinement<Domain>& refinement,
           MovedVertices& moved)
      : triangulation_(triangulation), structure_(structure), refinement_(refinement), moved_(moved) {}

  void VertexMoved(VertexId v) override {
    structure_.MoveVertex(v, triangulation_.point(v));
    moved_.Note(v);
  }
  void VertexAdded(VertexId v, VertexId near) override { structure_.AddVertex(near, triangulation_.point(v)); }

  void StarChanged(VertexId v) override {
    double nearest_sq = std::numeric_limits<double>::infinity();
    if (structure_.faces(v) != 0) {
      triangulation_.Star(v, star_);
      for (const SimplexId s : star_) {
        for (const VertexId u : triangulation_.item(s).vertices) {
          if (u != v) {
            nearest_sq = std::min(nearest_sq, DistanceSq<3>(triangulation_.point(u), triangulation_.point(v)));
          }
        }
      }
    }
    refinement_.CellChanged(v, nearest_sq);
  }

  uint64_t MemoryBytes() const override { return structure_.MemoryBytes() + refinement_.MemoryBytes(); }

 private:
  Triangulation<3>& triangulation_;
  QueryStructure<3>& structure_;
  Refinement<Domain>& refinement_;
  MovedVertices& moved_;
  std::vector<SimplexId> star_;
};

}  // namespace

template <int D>
absl::StatusOr<Triangulation<D>> SliverStage<D>::Triangulate(const QueryStructure<D>& structure,
                                                             const StarLists<D>& stars, int threads,
                                                             RunContext& context) {
  context.EnterPhase(Phase::kSimplices);
  const double no_time = 0;
  const Stopwatch stopwatch(statistics_.star_seconds, no_time);
  // By the structure's own numbers, which do not depend on the order of the input.
  HugeVector<uint32_t> identity(structure.vertex_count());
  std::iota(identity.begin(), identity.end(), uint32_t{0});
  WELLSPACE_ASSIGN_OR_RETURN(Simplices simplices, ComputeSimplices<D>(structure, stars, identity, threads, context));
  statistics_.star_queries.Add(simplices.counters);
  if (!statistics_.min_angle_deg.has_value()) {
    statistics_.min_angle_deg = simplices.min_angle_deg;
  }
  WELLSPACE_RETURN_IF_ERROR(
      context.AllowMemory(structure.MemoryBytes() + stars.MemoryBytes() + simplices.indices.size() * sizeof(uint32_t) +
                          Triangulation<D>::BuildBytes(structure.vertex_count(), simplices.indices.size() / (D + 1))));
  // Sorting takes less than Build.
  ThreadTeam team(threads);
  WELLSPACE_RETURN_IF_ERROR(SortSimplices<D>(structure.vertex_count(), simplices.indices, team, context));
  HugeVector<Point<D>> points;
  points.reserve(structure.vertex_count());
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    if (v % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    points.push_back(structure.point(VertexId{v}));
  }
  Triangulation<D> triangulation;
  WELLSPACE_RETURN_IF_ERROR(
      triangulation.Build(structure.box(), std::move(points), simplices.indices, threads, context));
  return triangulation;
}

// Adds the structure's new vertices to the triangulation, or makes it.
template <int D>
absl::Status SliverStage<D>::FollowStructure(const QueryStructure<D>& structure, const StarLists<D>& stars, int threads,
                                             RunContext& context) {
  const uint32_t count = structure.vertex_count();
  if (triangulation_.has_value() && (count - triangulation_->vertex_count()) > count / kFewNew) {
    triangulation_.reset();
  }
  if (!triangulation_.has_value()) {
    cosines_ = {};
    WELLSPACE_ASSIGN_OR_RETURN(triangulation_, Triangulate(structure, stars, threads, context));
    return absl::OkStatus();
  }
  Workspace<D> workspace;
  Cavity cavity;
  std::vector<SimplexId> created;
  VertexId last{0};
  for (uint32_t i = triangulation_->vertex_count(); i < count; ++i) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    const Point<D>& p = structure.point(VertexId{i});
    const VertexId nearest = structure.NearestNeighbor(VertexId{i}, workspace).vertex;
    const VertexId start = Index(nearest) < i ? nearest : last;
    triangulation_->FindCavity(triangulation_->Locate(p, start), p, cavity);
    last = triangulation_->AddVertex();
    triangulation_->Insert(last, p, 0, cavity, created);
    cosines_.NoteCreated(created);
  }
  return absl::OkStatus();
}

template <int D>
template <typename Domain, VertexCarrier Carrier>
absl::Status SliverStage<D>::Repair(QueryStructure<3>& structure, Refinement<Domain>& refinement, Carrier& carrier,
                                    std::vector<bool>& is_fixed, const RepairCriteria& criteria, MovedVertices& moved,
                                    int threads, RunContext& context) requires(D == 3 && Domain::kDimension == 3) {
  const Stopwatch stopwatch(statistics_.seconds, statistics_.star_seconds);
  statistics_.slivers_wanted = true;
  WELLSPACE_RETURN_IF_ERROR(FollowStructure(structure, refinement.stars(), threads, context));
  context.EnterPhase(Phase::kSlivers);
  Follower<Domain> follower(*triangulation_, structure, refinement, moved);
  Repairer<Carrier> repairer(*triangulation_, carrier, is_fixed, criteria, cosines_, follower);
  const absl::Status status = repairer.Run(threads, context);
  if (!Carrier::kMeshesAll && statistics_.moves + statistics_.added == 0 && repairer.report().min_angle_deg) {
    statistics_.min_angle_deg = repairer.report().min_angle_deg;  // tetrahedra that are not meshed have other angles
  }
  statistics_.slivers += repairer.report().slivers;
  statistics_.slivers_left = repairer.report().slivers_left;
  statistics_.left_by = repairer.report().left_by;
  statistics_.flattest_left = repairer.report().flattest_left;
  statistics_.operations += repairer.report().operations;
  statistics_.measured += repairer.report().measured;
  statistics_.moves += repairer.report().moves;
  statistics_.added += repairer.report().added;
  return status;
}

template <int D>
absl::StatusOr<WeightedSimplices> SliverStage<D>::ToSimplices(const QueryStructure<D>& structure,
                                                              const StarLists<D>& stars,
                                                              std::span<const uint32_t> output_index, bool pump,
                                                              int threads, RunContext& context) {
  const Stopwatch stopwatch(statistics_.seconds, statistics_.star_seconds);
  WeightedSimplices out;
  statistics_.weighted = 0;
  statistics_.slivers_wanted = statistics_.slivers_wanted || pump;
  if (!pump) {
    context.EnterPhase(Phase::kSlivers);
  }
  std::optional<Triangulation<D>> pumped;
  if (pump) {
    // A later repair works without weights, on a triangulation made anew.
    if (triangulation_.has_value()) {
      pumped = std::exchange(triangulation_, std::nullopt);
    } else {
      WELLSPACE_ASSIGN_OR_RETURN(pumped, Triangulate(structure, stars, threads, context));
    }
    context.EnterPhase(Phase::kSlivers);
    WELLSPACE_ASSIGN_OR_RETURN(statistics_.weighted, PumpWeights<D>(*pumped, context));
    if (statistics_.weighted > 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
      out.weights.resize(pumped->vertex_count());
      for (uint32_t v = 0; v < pumped->vertex_count(); ++v) {
        out.weights[output_index[v]] = pumped->weight(VertexId{v});
      }
    }
  }
  const Triangulation<D>& triangulation = pumped.has_value() ? *pumped : *triangulation_;
  Simplices& simplices = out.simplices;
  simplices.indices.reserve(size_t{triangulation.simplex_limit()} * (D + 1));
  rows_.Clear();
  shapes_.Clear(D == 3 ? triangulation.simplex_limit() : 0);
  for (uint32_t i = 0; i < triangulation.simplex_limit(); ++i) {
    if (i % kCheckInterval == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const SimplexId s{i};
    rows_.Push(triangulation.IsIn(s));
    if (!triangulation.IsIn(s)) {
      continue;
    }
    Emit<D>(triangulation, s, output_index, simplices.indices);
    if constexpr (D == 3) {
      shapes_.Add(triangulation, s);
    } else {
      const Simplex<D> corners = triangulation.Corners(s);
      simplices.max_radius_edge = std::max(simplices.max_radius_edge, RadiusEdgeRatio<D>(corners));
      simplices.min_angle_deg = std::min(simplices.min_angle_deg, Angles<D>(corners).min_deg);
    }
  }
  statistics_.measured += rows_.rows();
  if constexpr (D == 3) {
    WELLSPACE_ASSIGN_OR_RETURN(const WorstShapes::Worst worst, shapes_.Find(triangulation, context));
    simplices.max_radius_edge = worst.max_radius_edge;
    simplices.min_angle_deg = worst.min_angle_deg;
  }
  if (triangulation_.has_value()) {
    triangulation_->journal().Begin(triangulation_->simplex_limit() / kFewChanged);
  }
  return out;
}

template <int D>
absl::StatusOr<std::optional<SimplexChanges>> SliverStage<D>::Update(std::span<const uint32_t> output_index,
                                                                     RunContext& context) requires(D == 3) {
  const Stopwatch stopwatch(statistics_.seconds, statistics_.star_seconds);
  context.EnterPhase(Phase::kSlivers);
  WELLSPACE_RETURN_IF_ERROR(context.Check());
  Triangulation<3>& triangulation = *triangulation_;
  if (!triangulation.journal().is_whole()) {
    return std::nullopt;
  }
  const std::vector<uint32_t> changed = triangulation.journal().Sorted();
  const auto is_in = [&](uint32_t i) { return triangulation.IsIn(SimplexId{i}); };
  SimplexChanges changes;
  for (const uint32_t i : changed) {
    if (is_in(i)) {
      Emit<3>(triangulation, SimplexId{i}, output_index, changes.added);
    }
  }
  changes.edits = rows_.Change(changed, is_in);
  statistics_.measured += shapes_.Update(triangulation, changed);
  WELLSPACE_ASSIGN_OR_RETURN(const WorstShapes::Worst worst, shapes_.Find(triangulation, context));
  changes.worst = SimplexChanges::Worst::kOfAll;
  changes.max_radius_edge = worst.max_radius_edge;
  changes.min_angle_deg = worst.min_angle_deg;
  triangulation.journal().Begin(triangulation.simplex_limit() / kFewChanged);
  return changes;
}

template class SliverStage<3>;
template class SliverStage<4>;
template class SliverStage<5>;
template class SliverStage<6>;
template absl::Status SliverStage<3>::Repair(QueryStructure<3>&, Refinement<SpaceDomain>&, SurfaceCarrier&,
                                             std::vector<bool>&, const RepairCriteria&, MovedVertices&, int,
                                             RunContext&);
template absl::Status SliverStage<3>::Repair(QueryStructure<3>&, BoxRefinement<3>&, BoxCarrier&, std::vector<bool>&,
                                             const RepairCriteria&, MovedVertices&, int, RunContext&);

}  // namespace wellspace::core
