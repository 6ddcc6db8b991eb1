#include "core/refine/refine.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "core/base/dimensions.h"
#include "core/base/huge_pages.h"
#include "core/base/status_macros.h"
#include "core/base/thread_team.h"
#include "core/refine/checks.h"

namespace wellspace::core {
namespace {

// Room is made for at most so many times the vertices that there are, whatever is predicted.
constexpr uint64_t kMostReserved = 8;

// Vertices looked at between two reports of progress.
constexpr uint64_t kReportInterval = 256;

}  // namespace

template <int D>
Refinement<D>::Refinement(QueryStructure<D>& structure, double min_edge)
    : structure_(structure), min_edge_(min_edge), pending_(structure, min_edge) {}

template <int D>
absl::Status Refinement<D>::Run(const Demands<D>& demands, uint64_t max_vertices, int threads, RunContext& context,
                                const RefinementObserver<D>& observer, const VertexPredictor& predict) {
  ThreadTeam team(threads);
  rules_.emplace(structure_, demands);
  max_vertices_ = max_vertices;
  context_ = &context;
  observer_ = &observer;
  distrusted_size_ = 0;
  if (!pending_.HasBegunFor(demands)) {
    pending_.End();
    WELLSPACE_RETURN_IF_ERROR(ScheduleAll(demands, predict, team));
  } else {
    WELLSPACE_RETURN_IF_ERROR(Predict(predict));
  }
  team_ = &team;
  const absl::Cleanup end = [this] {
    if (is_ahead_ || stars_.IsWriting()) {  // something has been thrown
      team_->Drop();
      is_ahead_ = false;
      stars_.EndWriting();
    }
    team_ = nullptr;
  };
  const absl::Status status = Loop();
  AwaitOthers();
  stars_.WriteLast();
  packets_before_ = {};
  for (const OwnWorkspace& workspace : round_workspaces_) {
    own_.counters.Add(workspace.counters);
    own_.counters.Add(workspace.other.counters);
  }
  round_workspaces_.clear();
  return status;
}

// Improves the vertices that wait: in rounds where a bucket holds many.
template <int D>
absl::Status Refinement<D>::Loop() {
  WELLSPACE_RETURN_IF_ERROR(ServeRounds());  // those of a run that was stopped
  for (int lowest = pending_.schedule().Lowest(); lowest >= 0; lowest = pending_.schedule().Lowest()) {
    VertexId v{};
    int bucket = 0;
    if (BeginRounds(lowest)) {
      WELLSPACE_RETURN_IF_ERROR(ServeRounds());
    } else {
      AwaitOthers();  // they may still list stars, which Serve does, too
      if (pending_.schedule().Pop(v, bucket)) {
        WELLSPACE_RETURN_IF_ERROR(Serve(v, bucket));
      }
    }
  }
  if constexpr (kChecks) {
    Require(pending_.schedule().size() == 0, pending_.schedule().size(), " vertices wait still");
  }
  return absl::OkStatus();
}

// Improves `v`, which was taken from `bucket`.
template <int D>
absl::Status Refinement<D>::Serve(VertexId v, int bucket) {
  absl::Status status = context_->Check();
  if (status.ok()) {
    status = Improve(v, bucket);
  }
  if (!status.ok()) {
    pending_.schedule().AddToBucket(v, bucket);
    return status;
  }
  return CountServed(bucket);
}

// Tells now and then how far the run is.
template <int D>
absl::Status Refinement<D>::CountServed(int bucket) {
  return ++served_ % kReportInterval == 0 ? Report(bucket) : absl::OkStatus();
}

template <int D>
absl::Status Refinement<D>::Report(int bucket) {
  WELLSPACE_RETURN_IF_ERROR(context_->AllowMemory(structure_.MemoryBytes() + MemoryBytes()));
  context_->SetBucket(bucket);
  context_->SetPhaseFraction(1 - static_cast<double>(pending_.schedule().size()) / structure_.vertex_count());
  return absl::OkStatus();
}

template <int D>
void Refinement<D>::VertexAdded(VertexId x) {
  if (!pending_.HasBegun()) {
    return;  // the first run looks at all
  }
  const Neighbor nearest = structure_.ApproximateNearestNeighbor(x, own_);
  AddPending(nearest.vertex, x, nearest.distance_sq);
}

template <int D>
uint64_t Refinement<D>::MemoryBytes() const {
  return pending_.MemoryBytes() + stars_.MemoryBytes() + (is_ahead_ ? bytes_ahead_ : RoundBytes()) +
         (own_.seen.size() + other_.seen.size()) * sizeof(uint32_t);
}

template <int D>
void Refinement<D>::CellChanged(VertexId v, double nearest_sq) {
  stars_.GiveUp();
  pending_.CellChanged(v, nearest_sq);
}

template <int D>
QueryCounters Refinement<D>::counters() const {
  QueryCounters counters = own_.counters;
  counters.Add(other_.counters);
  return counters;
}

// Tells the context how many vertices are predicted.
template <int D>
absl::Status Refinement<D>::Predict(const VertexPredictor& predict) {
  if (predict == nullptr) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t vertices, predict());
  if (vertices > 0) {
    context_->SetEstimatedVertices(vertices);
  }
  return absl::OkStatus();
}

// Schedules all vertices, while another thread predicts how many there will be.
template <int D>
absl::Status Refinement<D>::ScheduleAll(const Demands<D>& demands, const VertexPredictor& predict, ThreadTeam& team) {
  DropRounds();
  structure_.AdmitWaiting();  // where something was thrown
  absl::Status predicted;
  const absl::Cleanup end = [&team] { team.Drop(); };  // of what is begun, where something is thrown
  team.BeginCall([&] { predicted = Predict(predict); });
  const HugeVector<int16_t> first_buckets = pending_.FirstBuckets(demands, *context_, team);
  team.End();
  WELLSPACE_RETURN_IF_ERROR(predicted);
  WELLSPACE_RETURN_IF_ERROR(context_->Check());
  stars_.Clear();
  Reserve(static_cast<uint32_t>(
      std::min({context_->estimated_vertices(), max_vertices_, kMostReserved * structure_.vertex_count()})));
  pending_.Begin(demands, first_buckets);
  return absl::OkStatus();
}

// Makes room for so many vertices, and some more, so that arrays need not be moved as they grow; what is not used takes no memory.
template <int D>
void Refinement<D>::Reserve(uint32_t vertices) {
  vertices += std::min(vertices / 8, std::numeric_limits<uint32_t>::max() - vertices);
  structure_.Reserve(vertices);
  stars_.Reserve(vertices);
  pending_.Reserve(vertices);
}

// Makes the new vertex `x`, which is near `near` and whose nearest neighbour is as near as it says, pending. Its neighbours are not
// notified here, but when its cell is first looked at.
template <int D>
void Refinement<D>::AddPending(VertexId near, VertexId x, double nearest_sq) {
  pending_.Add(near, x, nearest_sq, [&](double radius) {
    ComputeCell(x, CubeAround<D>(structure_.point(x), radius), other_);
    other_.cell.Place();
    if (!other_.cell.IsTooLarge()) {
      const FaceMask faces = structure_.faces(x);
      const Assessment found = Assess<D>(other_.cell, faces, rules_->criteria(), nearest_sq);
      pending_.Notify(x, found, Notices(other_.cell, faces, found));
    }
  });
}

// Inserts Steiner points until nothing that bucket `bucket` may ask for is wrong with the cell of `v`.
template <int D>
absl::Status Refinement<D>::Improve(VertexId v, int bucket) {
  const double edge_limit_sq = EdgeLimitSq(bucket);
  Polytope<D>& cell = own_.cell;
  ComputeCell(v, ClipAround(v, bucket), own_);
  if constexpr (kChecks) {
    cell.Place();
    CheckOrder(v, cell, bucket);
  }
  while (true) {
    if (cell.IsTooLarge()) {
      return absl::ResourceExhaustedError(absl::StrCat("the cell of a vertex has more than ", Polytope<D>::kMostNodes,
                                                       " nodes; lower rho = ", rules_->criteria().rho));
    }
    const Assessment found = rules_->AssessCell(cell, structure_.faces(v), edge_limit_sq);
    if (pending_.IsNew(v)) {
      pending_.Notify(v, found, Notices(cell, structure_.faces(v), found));
    }
    if (pending_.HasShorterThan(bucket)) {
      pending_.Postpone(v, found, bucket);
      return absl::OkStatus();
    }
    const std::optional<Request> request = rules_->NextRequest(
        v, cell, found, edge_limit_sq, [this](VertexId u, const Box<D>& clip) -> const Polytope<D>* {
          ComputeCell(u, clip, other_);
          other_.cell.Place();
          return other_.cell.IsTooLarge() ? nullptr : &other_.cell;
        });
    if (!request.has_value()) {
      watched_.clear();
      rules_->AppendNodesToWatch(v, cell, found, watched_);
      Star<D>& star = stars_.Room();
      if (found.IsGood() && stars_.NeedsStars()) {
        cell.FindStar(star);
      }
      Settle(v, found, bucket, Notices(cell, structure_.faces(v), found), watched_, star);
      return absl::OkStatus();
    }
    // In 5-D and 6-D a cell may ask for a dozen points, which take milliseconds each.
    WELLSPACE_RETURN_IF_ERROR(context_->Check());
    WELLSPACE_ASSIGN_OR_RETURN(const VertexId x, Insert(*request));
    cell.CutBeforePlace(x, request->point.position);
  }
}

// Computes the cell of `v`, not yet placed, clipped by `clip`.
template <int D>
void Refinement<D>::ComputeCell(VertexId v, const Box<D>& clip, Workspace<D>& workspace) {
  structure_.UnplacedClippedVoronoi(v, clip, workspace);
  structure_.CutByWaiting(v, workspace.cell);
  if (workspace.cell.IsTooLarge() && structure_.waiting_count() > 0) {
    AdmitWaiting();  // with the nearest first it may not be
    structure_.UnplacedClippedVoronoi(v, clip, workspace);
  }
}

// Declares a vertex from `bucket` that needs nothing now done, or puts it where it will be looked at again. Of its cell: the neighbours that it may
// have to notify, the nodes to watch, and the star, if it is good.
template <int D>
void Refinement<D>::Settle(VertexId v, const Assessment& found, int bucket, std::span<const NeighborNotice> notices,
                           std::span<const WatchedNode<D>> watched, std::span<const std::array<VertexId, D>> star) {
  pending_.Remember(v, found, watched);
  if (!found.IsGood()) {
    pending_.ScheduleLater(v, found, bucket, rules_->ClipRadius(EdgeLimitSq(bucket)));
    return;
  }
  stars_.Write(v, star, structure_.vertex_count());
  if (pending_.HasToNotify(v)) {
    pending_.Notify(v, found, notices);
  }
}

template <int D>
absl::StatusOr<VertexId> Refinement<D>::Insert(const Request& request) {
  const SteinerPoint<D>& point = request.point;
  if (structure_.vertex_count() >= max_vertices_) {
    return absl::ResourceExhaustedError(absl::StrCat("the mesh needs more than max_vertices = ", max_vertices_,
                                                     " vertices; raise max_vertices or rho"));
  }
  if (!IsLongEnough(point)) {
    return absl::ResourceExhaustedError(absl::StrCat("refinement came to an edge of length ",
                                                     std::sqrt(std::max(0.0, point.empty_radius_sq)),
                                                     ", below the smallest that double arithmetic serves here, ",
                                                     min_edge_, "; raise rho = ", rules_->criteria().rho));
  }
  return Add(request);
}

// Adds the vertex that is asked for, and has it wait.
template <int D>
VertexId Refinement<D>::Add(const Request& request) {
  if constexpr (kChecks) {
    AdmitWaiting();
    CheckInsertion(request);
  }
  Insertion insertion = request.insertion;
  insertion.vertex = structure_.AddWaiting(insertion.near, request.point.position);
  if (!is_ahead_ || *observer_ || structure_.waiting_count() == QueryStructure<D>::kMostWaiting) {
    AdmitWaiting();
  }
  if (is_foreseen_) {
    inserted_.push_back(request.point.position);
  }
  context_->SetVertices(structure_.vertex_count());
  AddPending(insertion.near, insertion.vertex, request.point.empty_radius_sq);
  if (*observer_) {
    (*observer_)(structure_, insertion);
  }
  return insertion.vertex;
}

template <int D>
std::span<const NeighborNotice> Refinement<D>::Notices(const Polytope<D>& cell, FaceMask site_faces,
                                                       const Assessment& found) {
  notices_.clear();
  rules_->AppendNotices(cell, site_faces, found, notices_);
  return notices_;
}

#define WELLSPACE_INSTANTIATE(D) template class Refinement<D>;
WELLSPACE_FOR_EACH_DIMENSION(WELLSPACE_INSTANTIATE)
#undef WELLSPACE_INSTANTIATE

}  // namespace wellspace::core
