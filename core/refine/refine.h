// Bottom-up refinement: Steiner points until every simplex is as the demands say.
#ifndef WELLSPACE_CORE_REFINE_REFINE_H_
#define WELLSPACE_CORE_REFINE_REFINE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/cache_lines.h"
#include "core/base/huge_pages.h"
#include "core/base/run_context.h"
#include "core/refine/assessment.h"
#include "core/refine/demands.h"
#include "core/refine/face_watchers.h"
#include "core/refine/schedule.h"
#include "core/refine/steiner_point.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

template <int D>
class ForeseenCells;
template <int D>
struct Look;
class ThreadTeam;

// Why a vertex was inserted.
enum class Reason {
  kRatio,         // a node broke rho
  kSize,          // a node was farther than the sizes allow
  kEncroachment,  // the cell touched a face of the box that its site does not lie on
};

// An insertion that has just happened.
struct Insertion {
  Reason reason = Reason::kRatio;
  VertexId near = kNoVertex;   // the vertex whose cell was looked at
  VertexId other = kNoVertex;  // for kRatio, the other end of the edge
  VertexId vertex = kNoVertex;
  double edge_sq = 0;        // the edge that asked for it; the distance between `near` and the face for an encroachment
  double edge_limit_sq = 0;  // all edges that ask for something are at least 1 / sqrt 2 times as long
  double empty_radius_sq = 0;  // no older vertex is nearer to it, up to rounding
};

// Called after each insertion with the structure as it is then; for tests.
template <int D>
using RefinementObserver = std::function<void(const QueryStructure<D>&, const Insertion&)>;

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
  // Errors:     RESOURCE_EXHAUSTED with the bound that was met, one of the context's memory too; CANCELLED, DEADLINE_EXCEEDED. All stays usable: a later
  //             run takes up the work where it was left.
  // Threads:    uses `threads`, at most as many as the machine has cores, for slabs (ADR 21) or to compute cells ahead.
  // Source:     [HT08] Figure 4; see docs/design/refine.md.
  absl::Status Run(const Demands<D>& demands, uint64_t max_vertices, int threads, RunContext& context,
                   const RefinementObserver<D>& observer = nullptr);

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
  const StarLists<D>& stars() const { return stars_; }

  // What all queries have cost.
  QueryCounters counters() const;

 private:
  // Which neighbours of a vertex have been looked at in view of it.
  enum class Announced : uint8_t {
    kToNone,      // it has just been added
    kWithinClip,  // those in its cell as it was clipped then
    kToAll,
  };

  // An insertion that a cell asks for, with the point before it was snapped to the boundary.
  struct Request {
    Insertion insertion;
    SteinerPoint<D> candidate;
    SteinerPoint<D> point;
  };

  // What is between two lines across an axis, and the vertices of a bucket in it. A packet of them is looked at as if nobody were looked
  // at elsewhere meanwhile.
  struct alignas(kCacheLines) Slab {
    enum class Kind : uint8_t {
      kInserted,  // a vertex, as the next of the requests says
      kLeft,      // for the slabs of another axis, or for Improve
      kWaits,     // in a bucket
      kDone,      // with the next of the stars
    };
    // What became of a vertex that was looked at, in order.
    struct Event {
      VertexId vertex = kNoVertex;
      Kind kind = Kind::kInserted;
      Announced announced = Announced::kToNone;
      int16_t bucket = 0;      // kWaits
      uint32_t star_size = 0;  // kDone
      double radius_sq = 0;    // kDone
    };

    bool HoldsBall(const Point<D>& centre, double radius_sq) const {
      const double depth = std::min(centre[axis] - low, high - centre[axis]);
      return depth > 0 && depth * depth > radius_sq;
    }

    int axis = 0;
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    HugeVector<VertexId> waiting;  // the last is the next

    // Of the packet. What is inserted is numbered from slab_first_new_ on, as if no other slab inserted any.
    size_t packet = 0;  // how many are looked at
    std::vector<Event> events;
    size_t replayed = 0;  // of events
    size_t end = 0;       // of those that may be replayed now
    std::vector<Request> requests;
    size_t added = 0;                // of requests
    std::vector<Point<D>> inserted;  // with room up to PaddedCount
    std::vector<Point<D>> below;     // where somebody comes to wait in a lower bucket
    Star<D> stars;
    size_t listed = 0;  // of stars
    Star<D> star;       // scratch
  };
  struct alignas(kCacheLines) OwnWorkspace : Workspace<D> {};

  absl::Status ScheduleAll(const Demands<D>& demands, ThreadTeam& team);
  double FirstEdgeSq(const Demands<D>& demands, const Point<D>& p, FaceMask faces, double nearest_sq,
                     double size_sq) const;
  double FirstEdgeSqOfNew(const Point<D>& p, FaceMask faces, double nearest_sq) const;
  absl::Status Loop(ThreadTeam& team);
  absl::Status Serve(VertexId v, int bucket);
  absl::Status Report(int bucket);
  absl::Status Improve(VertexId v, int bucket);
  std::optional<Request> NextRequest(VertexId v, const Polytope<D>& cell, const Assessment& found,
                                     double edge_limit_sq) const;
  Look<D> LookAt(VertexId v, int bucket, double clip);
  void Foresee(VertexId v, int bucket, double clip);
  void FindNext(int bucket, double clip);
  void BeginNext(int bucket, double clip);
  void AdmitWaiting();
  void ComputeCell(VertexId v, double clip, Workspace<D>& workspace);
  Assessment AssessCell(Polytope<D>& cell, FaceMask site_faces, double edge_limit_sq) const;
  absl::Status Insert(const Request& request, Polytope<D>& cell);
  VertexId Add(const Request& request);
  absl::Status TooManyVertices() const;
  bool IsLongEnough(const SteinerPoint<D>& point) const { return point.empty_radius_sq >= min_edge_ * min_edge_; }
  void Settle(VertexId v, const Assessment& found, double clip, int earliest, const Look<D>& look);
  int OwnBucket(const Assessment& found, int bucket) const;
  int NextBucket(const Assessment& found, double clip, int earliest) const;
  void ScheduleNew(VertexId near, VertexId x, double nearest_sq);
  void Remember(VertexId v, double radius_sq, std::span<const WatchedNode<D>> watched = {});
  std::span<const WatchedNode<D>> NodesToWatch(VertexId v, const Polytope<D>& cell, double edge_sq);
  void Announce(VertexId v, const Polytope<D>& cell, const Assessment& found);
  void Wake(VertexId u, double edge_sq);
  void ScheduleWoken();
  // Whether large buckets are served in slabs, and not with cells ahead: ADR 21.
  bool HasSlabs() const { return D == 2 && demands_->criterion == Criterion::kRadiusEdge; }
  bool TakesSlabs(int bucket) const;
  void MakeSlabs(int bucket);
  void LayLines(std::span<const VertexId> waiting, int axis, double reach);
  void DropSlabs();
  uint64_t SlabBytes() const;
  absl::Status ServeSlabs(ThreadTeam& team);
  void LookInto(Slab& slab, Workspace<D>& workspace) const;
  void LookAtIn(Slab& slab, VertexId v, Workspace<D>& workspace) const;
  bool ReplaySlabs(ThreadTeam& team);
  void Replay(Slab& slab, uint32_t shift);
  void ListStars(Slab& slab, uint32_t shift);
  void CheckOrder(VertexId v, const Polytope<D>& cell, int bucket);
  void CheckNeighbours(VertexId v, const Polytope<D>& cell, int bucket) const;
  void CheckWaits(VertexId v, VertexId u, int bucket) const;
  void CheckInsertion(const Request& request);

  QueryStructure<D>& structure_;
  const double min_edge_;
  Schedule schedule_;
  // R(v)^2 where v is done, else infinite; but where a node on one of v's faces is too far for its edge, minus the
  // squared length of that edge. Rounded up: a radius may be larger than it is, an edge shorter.
  HugeVector<float> radius_sq_;
  FaceWatchers<D> watchers_;  // those of whom an edge is remembered
  HugeVector<Announced> announced_;
  StarLists<D> stars_;                 // of vertices that are done, or have been
  std::optional<Demands<D>> demands_;  // of the last run, once all vertices have been scheduled for them
  Workspace<D> own_;                   // the cell that is improved
  Workspace<D> new_;                   // the cell of a vertex just added on a face

  // Those of slab_bucket_ who wait in slabs; none if nobody does. It is the highest bucket that has had slabs since nobody waited, -1 for none; slab_axes_: by bits, the axes across
  // which it has.
  std::vector<Slab> slabs_;
  int slab_bucket_ = -1;
  uint32_t slab_axes_ = 0;
  bool slabs_are_ahead_ = false;  // some of what packets have put down is still to be replayed
  uint32_t slab_first_new_ = 0;

  // Of the run.
  double off_center_factor_ = 0;
  double plain_ratio_ = 0;  // cells that keep it need nothing; 0: that does not tell
  double clip_factor_ = 0;
  uint64_t max_vertices_ = 0;
  uint64_t served_ = 0;                             // vertices, one after the other
  std::vector<OwnWorkspace> slab_workspaces_;       // by thread
  ForeseenCells<D>* foreseen_ = nullptr;            // null between runs
  std::vector<VertexId> next_;                      // whose cells are foreseen next
  std::vector<std::pair<VertexId, double>> woken_;  // scratch of Wake
  Star<D> star_;                                    // scratch of Settle
  std::vector<WatchedNode<D>> watched_;             // scratch of NodesToWatch
  RunContext* context_ = nullptr;
  const RefinementObserver<D>* observer_ = nullptr;

  // Of the checking build.
  uint64_t unchecked_ = 0;  // vertices taken from the schedule since all have been looked at
  Workspace<D> check_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_REFINE_H_
