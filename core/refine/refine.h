// Bottom-up refinement: Steiner points until every simplex is as the demands say.
#ifndef WELLSPACE_CORE_REFINE_REFINE_H_
#define WELLSPACE_CORE_REFINE_REFINE_H_

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/cache_lines.h"
#include "core/base/huge_pages.h"
#include "core/base/run_context.h"
#include "core/refine/assessment.h"
#include "core/refine/demands.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/packet.h"
#include "core/refine/pending_vertices.h"
#include "core/refine/speculation/star_writer.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

class ThreadTeam;

// Called after each insertion with the structure as it is then; for tests.
template <int D>
using RefinementObserver = std::function<void(const QueryStructure<D>&, const Insertion&)>;

// Predicts with how many vertices the refinement will end; 0 if that is not worth the time. Called at most once in a run,
// maybe by another thread, while vertices are only read.
using VertexPredictor = std::function<absl::StatusOr<uint64_t>()>;

// The refinement of one structure, which may be run again: after an error, after vertices were added, for other demands.
// Built with WELLSPACE_CHECKS it asserts at each insertion what docs/design/guarantees.md promises of it, as far as that
// can be seen nearby, and aborts with the figures.
//
// Thread safety: thread-compatible.
// Invariants: every vertex either waits, or its cell is as the demands of the last run say, for as long as no vertex is
// added that it has not been told of.
template <int D>
class Refinement {
 public:
  // No vertex is added nearer than `min_edge` to another.
  Refinement(QueryStructure<D>& structure, double min_edge);

  // Adds vertices until (1) no Delaunay simplex of the box breaks the demands, and (2) no Voronoi cell touches a face of
  // the box that its vertex does not lie on, so that the Delaunay triangulation decomposes exactly the box. Ties are
  // perturbed, as they are for the simplices.
  //
  // REQUIRES:   rho at least MinimumRho(D).
  // Guarantees: (1) bottom-up, [HT08] Definition 1: the vertex whose cell is looked at has an edge shorter, up to the
  //             ratio of a bucket, than all that wait; (2) deterministic: the same to
  //             the bit for any number of threads, and however often it was stopped.
  // Complexity: O(m) queries for m vertices in the end; when run again for the same demands, in proportion to what was
  //             added since and to what that makes necessary.
  // Errors:     RESOURCE_EXHAUSTED with the bound that was met, one of the context's memory too; CANCELLED,
  //             DEADLINE_EXCEEDED; those of `predict`. All stays usable: a later run takes up the work where it was left.
  // Threads:    uses `threads`, at most as many as the machine has cores, to foresee what becomes of vertices (ADR 23).
  // Source:     [HT08] Figure 4; see docs/design/refine.md.
  absl::Status Run(const Demands<D>& demands, uint64_t max_vertices, int threads, RunContext& context,
                   const RefinementObserver<D>& observer = nullptr, const VertexPredictor& predict = nullptr);

  // Tells of the vertex `x`, which somebody else has added to the structure since the last run.
  //
  // Complexity: O(1) in a refined structure.
  void VertexAdded(VertexId x);

  // What the refinement takes in memory beside the structure.
  uint64_t MemoryBytes() const;

  // Tells that the cell of `v`, which may be new, has changed, but is as the demands of the last run say; if v is on a face
  // of the box, `nearest_sq` is at most the squared distance to its nearest neighbour. What is remembered of the cell is forgotten: an insertion
  // nearby has v looked at again in any case that could matter. Simplices are no longer listed.
  //
  // REQUIRES:   the last run was for the end; every vertex whose neighbours have changed is told of.
  // Complexity: O(1), but for the first after a run for other demands.
  void CellChanged(VertexId v, double nearest_sq);

  // The simplices at all vertices, when the last run was for the end, unless cells have changed otherwise since the first run for these
  // demands.
  const StarLists<D>& stars() const { return stars_.lists(); }

  // What all queries have cost.
  QueryCounters counters() const;

 private:
  using Request = InsertionRequest<D>;

  struct alignas(kCacheLines) OwnWorkspace : Workspace<D> {
    Workspace<D> other;
  };

  absl::Status ScheduleAll(const Demands<D>& demands, const VertexPredictor& predict, ThreadTeam& team);
  absl::Status Predict(const VertexPredictor& predict);
  void Reserve(uint32_t vertices);
  absl::Status Loop();
  absl::Status Serve(VertexId v, int bucket);
  absl::Status CountServed(int bucket);
  absl::Status Report(int bucket);
  absl::Status Improve(VertexId v, int bucket);
  Box<D> ClipAround(VertexId v, int bucket) const { return rules_->ClipAround(v, EdgeLimitSq(bucket)); }
  double EdgeLimitSq(int bucket) const { return pending_.schedule().UpperLengthSq(bucket); }
  void ComputeCell(VertexId v, const Box<D>& clip, Workspace<D>& workspace);
  absl::StatusOr<VertexId> Insert(const Request& request);
  VertexId Add(const Request& request);
  bool IsLongEnough(const SteinerPoint<D>& point) const { return point.empty_radius_sq >= min_edge_ * min_edge_; }
  void Settle(VertexId v, const Assessment& found, int bucket, std::span<const NeighborNotice> notices,
              std::span<const WatchedNode<D>> watched, std::span<const std::array<VertexId, D>> star);
  void AddPending(VertexId near, VertexId x, double nearest_sq);
  std::span<const NeighborNotice> Notices(const Polytope<D>& cell, FaceMask site_faces, const Assessment& found);
  bool BeginRounds(int bucket);
  void TakeNext(Packet<D>& packet);
  void DropRounds();
  uint64_t RoundBytes() const;
  // The packets whose turn it is.
  std::span<Packet<D>> HalfOf(size_t turn) {
    return std::span(packets_).subspan(turn * packets_.size() / 2, packets_.size() / 2);
  }
  absl::Status ServeRounds();
  absl::Status ServeRound();
  void LookAhead();
  void AwaitOthers();
  void AdmitWaiting();
  void EndRound();
  void PrefetchServed(VertexId v) const;
  void Foresee(Packet<D>& packet, size_t part, size_t parts, OwnWorkspace& workspace) const;
  void ForeseeOne(Packet<D>& packet, size_t at, OwnWorkspace& workspace) const;
  absl::Status ServePacket(Packet<D>& packet);
  absl::Status ServeNext(Packet<D>& packet);
  absl::Status Retrace(Packet<D>& packet, size_t at);
  void CheckOrder(VertexId v, const Polytope<D>& cell, int bucket);
  void CheckWaits(VertexId v, VertexId u, int bucket) const;
  void CheckInsertion(const Request& request);

  QueryStructure<D>& structure_;
  const double min_edge_;
  PendingVertices<D> pending_;
  std::optional<StepRules<D>> rules_;  // of the last run
  StarWriter<D> stars_;                // of vertices that are done, or have been
  Workspace<D> own_;                   // the cell that is improved
  Workspace<D> other_;                 // that of another vertex meanwhile

  // Those of a bucket who are served in rounds, but for those who have moved on.
  int round_bucket_ = -1;
  HugeVector<VertexId> detached_;          // the last of each stretch is the next
  std::vector<Packet<D>> packets_;         // by stretch, the next of each; none if nobody is served so
  std::vector<Packet<D>> packets_before_;  // those of the bucket before, whose stars may be listed still
  size_t turn_ = 0;                        // whether the packets of the first half are next, or those of the second
  std::vector<Point<D>> inserted_;         // in these rounds, where they are foreseen, from inserted_before_ on
  size_t inserted_before_ = 0;
  size_t foreseen_count_ = 0;   // of those in the bucket who have been served, how many had been foreseen
  size_t held_count_ = 0;       // of how many of these that held
  size_t distrusted_size_ = 0;  // of the last bucket where it held of too few; 0 if none

  // Of the run.
  uint64_t max_vertices_ = 0;
  uint64_t served_ = 0;                         // vertices
  ThreadTeam* team_ = nullptr;                  // null between runs
  std::vector<OwnWorkspace> round_workspaces_;  // by thread
  bool is_ahead_ = false;                       // other threads may be at work: vertices that are added wait
  uint64_t bytes_ahead_ = 0;                    // of what others write, before
  bool is_foreseen_ = false;                    // the round: insertions are noted
  std::vector<WatchedNode<D>> watched_;         // scratch of Improve
  std::vector<NeighborNotice> notices_;         // scratch of Notices
  RunContext* context_ = nullptr;
  const RefinementObserver<D>* observer_ = nullptr;

  // Of the checking build.
  uint64_t unchecked_ = 0;  // vertices taken from the schedule since all have been looked at
  Workspace<D> check_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_REFINE_H_
