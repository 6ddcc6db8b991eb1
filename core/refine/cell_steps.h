// The steps of one vertex in the box, computed from its cell. Made by Refinement::RefineByCell for the loop, and by
// Rounds::Record to be recorded; in a domain of the plane PlaneSteps takes its place.
#ifndef WELLSPACE_CORE_REFINE_CELL_STEPS_H_
#define WELLSPACE_CORE_REFINE_CELL_STEPS_H_

#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/cache_lines.h"
#include "core/cell/polytope.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/refine/assessment.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/star_writer.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The scratch space of steps, owned by the caller and reused.
template <int D>
struct alignas(kCacheLines) StepWorkspace {
  Workspace<D> own;    // its cell is that of the vertex
  Workspace<D> other;  // its cell is that of another vertex, where one is needed meanwhile
  std::vector<NeighborNotice> notices;
  std::vector<WatchedNode<D>> watched;
};

// A step has the findings about the cell of a vertex between two insertions for it: its faults, which neighbours have
// to know, and what is to be inserted next. Figure 4 of [HT08] is a loop over steps (Refinement::RefineVertex), which
// are computed here, or replayed where they have been recorded (RecordedSteps): both classes have the same functions.
// They are called in the order Assess, NextRequest, Inserted; then Assess again. The others tell of the step that was
// assessed.
//
// `Cells` computes cells of the vertices that there are: ComputeOwn(v, clip, workspace) that of v in workspace.cell,
// not placed; ComputeOther(u, clip, workspace) returns that of u, placed, or null if it cannot be known.
//
// Thread safety: thread-compatible; as far as that of Cells allows, steps with different workspaces may be computed at
// once.
template <int D, typename Cells>
class CellSteps {
 public:
  // The steps of `v` in the bucket that ends at `edge_limit_sq`, by the rules of the box, as those of BoxDomain are.
  //
  // REQUIRES:   all references outlive this.
  template <typename Rules>
  CellSteps(const Rules& rules, VertexId v, double edge_limit_sq, Cells& cells, StepWorkspace<D>& workspace)
      : rules_(rules.step_rules()),
        cells_(cells),
        workspace_(workspace),
        v_(v),
        faces_(rules_.FacesOf(v)),
        edge_limit_sq_(edge_limit_sq) {
    cells_.ComputeOwn(v, rules_.ClipAround(v, edge_limit_sq), workspace.own);
  }

  Polytope<D>& cell() { return workspace_.own.cell; }

  // The faults of the cell; null if it has too many nodes to tell.
  const Assessment* Assess() {
    if (cell().IsTooLarge()) {
      return nullptr;
    }
    found_ = rules_.AssessCell(cell(), faces_, edge_limit_sq_);
    return &found_;
  }

  // The neighbours that may have to know of the vertex. They are looked for only now. Valid until the next call.
  std::span<const NeighborNotice> Notices() {
    workspace_.notices.clear();
    AppendNotices(workspace_.notices);
    return workspace_.notices;
  }
  void AppendNotices(std::vector<NeighborNotice>& notices) { rules_.AppendNotices(cell(), faces_, found_, notices); }

  // The next insertion; null if none, and this is the last step. Valid until the next call.
  const InsertionRequest<D>* NextRequest() {
    request_ = rules_.NextRequest(v_, cell(), found_, edge_limit_sq_, [this](VertexId u, const Box<D>& clip) {
      return cells_.ComputeOther(u, clip, workspace_.other);
    });
    return request_.has_value() ? &*request_ : nullptr;
  }

  // Goes on to the next step: the request has been inserted as `x`.
  void Inserted(VertexId x) { cell().CutBeforePlace(x, request_->point.position); }

  // The nodes on faces of the vertex that it has to watch, of the last step. Valid until the next call.
  std::span<const WatchedNode<D>> NodesToWatch() {
    workspace_.watched.clear();
    AppendNodesToWatch(workspace_.watched);
    return workspace_.watched;
  }
  void AppendNodesToWatch(std::vector<WatchedNode<D>>& watched) {
    rules_.AppendNodesToWatch(v_, cell(), found_, watched);
  }

  // The simplices at the vertex, if the last step found its cell good, kept for as long as `stars` needs them.
  typename StarWriter<D>::Simplices FindStar(StarWriter<D>& stars) {
    if (!stars.NeedsStars()) {
      return {};
    }
    Star<D>& star = stars.Room();
    FindStar(star);
    return star;
  }
  void FindStar(Star<D>& star) { cell().FindStar(star); }

  // The assessment that has replaced that of Assess while the last request was looked for; null: none has.
  const Assessment* Reassessed() const { return nullptr; }

 private:
  const StepRules<D>& rules_;
  Cells& cells_;
  StepWorkspace<D>& workspace_;
  const VertexId v_;
  const FaceMask faces_;
  const double edge_limit_sq_;
  Assessment found_;
  std::optional<InsertionRequest<D>> request_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_CELL_STEPS_H_
