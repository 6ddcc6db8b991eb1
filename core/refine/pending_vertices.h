// The schedule of the vertices that have to be looked at, and the memos of the cells of the others.
#ifndef WELLSPACE_CORE_REFINE_PENDING_VERTICES_H_
#define WELLSPACE_CORE_REFINE_PENDING_VERTICES_H_

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/memory/prefetch.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/cell_memo.h"
#include "core/refine/criteria.h"
#include "core/refine/face_watchers.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/schedule.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

class ThreadTeam;

// How far a vertex is from the nearest feature that it is not on, squared, if that is less than a limit; else that.
template <int D>
using FeatureDistance = std::function<double(VertexId, double limit_sq, Workspace<D>&)>;

// A vertex is pending while it is in a bucket of the schedule; it is done when its cell needs nothing. Vertices come
// from three places, and each has its function here:
// - input: Begin schedules all there are;
// - an insertion, by the refinement or from outside: Add schedules the new vertex, but notifies none of its neighbours
//   except the watchers of faces. Notify does that when the cell of the new vertex is first looked at: [HT08] line 14;
// - the repair of slivers moves and adds vertices, and keeps the criteria: CellChanged.
//
// Thread safety: thread-compatible; const functions may run at once.
// Invariants: (1) every vertex is pending, or the memo of its cell is right, as long as Add is told of every
//             vertex that is added.
template <int D>
class PendingVertices {
 public:
  // REQUIRES:   `structure` outlives this. Edges shorter than `min_edge` are as long as that to the schedule.
  PendingVertices(const QueryStructure<D>& structure, double min_edge) : structure_(structure), schedule_(min_edge) {}

  // By vertex, the bucket that it has to be looked at in first; by `feature_sq`, too, if there is one.
  //
  // Complexity: O(1) each when bottom-up.
  // Errors:     none; wrong once the context is cancelled.
  // Threads:    uses those of the team.
  // Source:     [HT08] Figure 4, lines 2 to 4.
  HugeVector<int16_t> FirstBuckets(const MeshCriteria<D>& criteria, const RunContext& context, ThreadTeam& team,
                                   const FeatureDistance<D>& feature_sq = nullptr) const;

  // Makes room for so many vertices.
  void Reserve(uint32_t vertices);

  // Forgets the memos of cells, and schedules all vertices for these criteria.
  void Begin(const MeshCriteria<D>& criteria, std::span<const int16_t> first_buckets);
  // Forgets the criteria: all vertices have to be scheduled again.
  void End() { criteria_.reset(); }

  bool HasBegun() const { return criteria_.has_value(); }
  bool HasBegunFor(const MeshCriteria<D>& criteria) const { return criteria_ == criteria; }

  Schedule& schedule() { return schedule_; }
  const Schedule& schedule() const { return schedule_; }

  // Schedules the new vertex `x`, which is near `near` and whose nearest neighbour is as near as it says. At once it
  // schedules the vertices on a face of x that watch a node there which x cuts off: their edges may be shorter than any
  // of x. Where the nodes of some watchers are not known, it calls notify_within(radius), which has to Notify the
  // neighbours of x by the cell that is clipped so.
  //
  // REQUIRES:   HasBegun().
  template <typename NotifyWithin>
  void Add(VertexId near, VertexId x, double nearest_sq, NotifyWithin notify_within);

  // Whether the neighbours of `v`, which has been added, have been told nothing of it yet.
  bool IsNew(VertexId v) const { return notified_[Index(v)] == Notified::kNone; }
  // Whether some of them have not been told.
  bool HasToNotify(VertexId v) const { return notified_[Index(v)] != Notified::kAll; }

  // Schedules those neighbours of `v` that it may have spoiled by being added: of all, or, once some have been
  // notified, of the vertices that are not pending. A simplex that breaks rho has v for a corner; its shortest edge is
  // one of v's, and then v sees to it, or has belonged to a cell that kept rho, and still does. Two cases are left:
  // - well-spaced: v may be the nearest neighbour now, so that other nodes are too far;
  // - a node on one of the neighbour's own faces was too far and asked for nothing: it may have become a circumcentre
  //   if this cell touches the face beside it.
  // An inner cell under radius-edge has neither, and no notices.
  //
  // Complexity: O(notices log notices).
  // Source:     [HT08] Figure 4, line 14; docs/design/refine.md.
  void Notify(VertexId v, const Assessment& found, std::span<const NeighborNotice> notices);

  // Whether a vertex may be pending for a shorter edge than those of `bucket`, which then comes first.
  bool HasShorterThan(int bucket) const { return schedule_.HasBelow(bucket); }

  // Schedules `v`, which was taken from `bucket`, to be looked at anew for the faults in `found`.
  void Postpone(VertexId v, const Assessment& found, int bucket);

  // Writes `found` into the memo of the cell of `v`; the nodes that are too far for the edge of a face, if there is one
  // such, are `watched`, or are not known.
  void Remember(VertexId v, const Assessment& found, std::span<const WatchedNode<D>> watched);

  // Schedules `v`, which was taken from `bucket` and needs nothing there, but is not done: by the shortest edge that
  // has a bad node, or that may have one beyond the clip, of that radius.
  void ScheduleLater(VertexId v, const Assessment& found, int bucket, double clip_radius);

  // Forgets the cell of `v`, which may be new: it has changed, but keeps the criteria. If v is on a face of the box,
  // `nearest_sq` is at most the squared distance to its nearest neighbour.
  //
  // REQUIRES:   HasBegun(); every vertex whose neighbours have changed is told of.
  void CellChanged(VertexId v, double nearest_sq);

  // Asks the memory for the entries of `v`.
  void Prefetch(VertexId v) const {
    schedule_.Prefetch(v);
    PrefetchLine(&memos_[Index(v)]);
    PrefetchLine(&notified_[Index(v)]);
  }

  uint64_t MemoryBytes() const {
    return schedule_.MemoryBytes() + watchers_.MemoryBytes() + memos_.size() * sizeof(CellMemo) +
           notified_.size() * sizeof(Notified);
  }

 private:
  // The clip by which a new vertex notifies its neighbours at once, relative to its empty radius: no farther out than
  // the region that bottom-up work has graded.
  static constexpr double kAround = 1.5;

  // The neighbours of a vertex that have been told that it was added.
  enum class Notified : uint8_t {
    kNone,        // it has just been added
    kWithinClip,  // the neighbours in its cell as it was clipped then
    kAll,
  };

  double FirstEdgeSq(const MeshCriteria<D>& criteria, const Point<D>& p, FaceMask faces, double nearest_sq,
                     double size_sq) const;
  double EdgeSqOf(double bound_sq) const { return bound_sq / (criteria_->rho * criteria_->rho); }
  void SetMemo(VertexId v, CellMemo memo, std::span<const WatchedNode<D>> watched = {});
  void Collect(VertexId u, double edge_sq);
  void ScheduleCollected();

  const QueryStructure<D>& structure_;
  std::optional<MeshCriteria<D>> criteria_;  // that all vertices have been scheduled for; none before, and after End
  Schedule schedule_;
  HugeVector<CellMemo> memos_;     // by vertex
  FaceWatchers<D> watchers_;       // the vertices of whose faces an edge is remembered
  HugeVector<Notified> notified_;  // by vertex
  std::vector<std::pair<VertexId, double>>
      collected_;  // vertices to be scheduled, each with a squared edge; else empty
};

template <int D>
template <typename NotifyWithin>
void PendingVertices<D>::Add(VertexId near, VertexId x, double nearest_sq, NotifyWithin notify_within) {
  memos_.resize(structure_.vertex_count());
  notified_.resize(structure_.vertex_count(), Notified::kNone);
  schedule_.PutBeside(near, x);
  const Point<D>& p = structure_.point(x);
  const double around = kAround * std::sqrt(nearest_sq);
  if (structure_.faces(x) != 0) {
    watchers_.ForEachCutOff(p, structure_.faces(x),
                            [&](VertexId u) { Collect(u, DistanceSq<D>(p, structure_.point(u))); });
    ScheduleCollected();
    if (watchers_.SomeWatchAll()) {
      notify_within(around);
    }
  }
  schedule_.Add(x,
                FirstEdgeSq(*criteria_, p, structure_.faces(x), nearest_sq, criteria_->sizes.LeastAroundSq(p, around)));
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PENDING_VERTICES_H_
