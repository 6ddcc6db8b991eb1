// The steps of one vertex in a domain of the plane, computed from its cell, as CellSteps are in the box. Made by
// Refinement::RefineByCell for the loop, and by Rounds::Record to be recorded.
#ifndef WELLSPACE_CORE_REFINE_PLANE_PLANE_STEPS_H_
#define WELLSPACE_CORE_REFINE_PLANE_PLANE_STEPS_H_

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/cell/star.h"
#include "core/refine/assessment.h"
#include "core/refine/cell_steps.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/plane/node_view.h"
#include "core/refine/plane/plane_rules.h"
#include "core/refine/star_writer.h"

namespace wellspace::core {

// As CellSteps, whose functions it has; segments take the place of faces of the box. Two things differ:
// - A node or a segment may be passed over by the rules. Then the cell is assessed again, without it, before the next
//   request is looked for; earlier findings no longer hold (Reassessed).
// - All neighbours get a notice, and no nodes are watched.
//
// Thread safety: as CellSteps.
template <typename Cells>
class PlaneSteps {
 public:
  // REQUIRES:   all references outlive this.
  PlaneSteps(const PlaneRules& rules, VertexId v, double edge_limit_sq, Cells& cells, StepWorkspace<2>& workspace)
      : rules_(rules), cells_(cells), workspace_(workspace), v_(v), edge_limit_sq_(edge_limit_sq) {
    cells_.ComputeOwn(v, rules.step_rules().ClipAround(v, edge_limit_sq), workspace.own);
  }

  Polytope<2>& cell() { return workspace_.own.cell; }

  const Assessment* Assess() {
    if (cell().IsTooLarge()) {
      return nullptr;
    }
    found_ = rules_.AssessCell(v_, cell(), workspace_.own.segments, edge_limit_sq_, passed_over_);
    return &found_;
  }

  // All neighbours: a node that asked for nothing, since a segment was in its way, may be one of a triangle now.
  std::span<const NeighborNotice> Notices() {
    workspace_.notices.clear();
    AppendNotices(workspace_.notices);
    return workspace_.notices;
  }
  void AppendNotices(std::vector<NeighborNotice>& notices) {
    cell().ForEachEdge([&](const Plane<2>& plane) {
      if (plane.kind == PlaneKind::kBisector) {
        notices.push_back({plane.vertex, 2 * plane.offset, true});
      }
    });
  }

  const PlaneRequest* NextRequest() {
    const auto cell_of = [this](VertexId u, const Box<2>& clip) {
      return cells_.ComputeOther(u, clip, workspace_.other);
    };
    is_reassessed_ = false;
    while (true) {
      PlaneRules::Answer answer =
          rules_.NextRequest(v_, cell(), workspace_.own.segments, found_, edge_limit_sq_, cell_of, workspace_.other);
      request_ = answer.request;
      if (answer.refused_node.has_value()) {
        passed_over_.nodes.push_back(*answer.refused_node);
      } else if (answer.passed_segment.has_value()) {
        passed_over_.segments.push_back(*answer.passed_segment);
      } else {
        return request_.has_value() ? &*request_ : nullptr;
      }
      Assess();
      is_reassessed_ = true;
    }
  }

  void Inserted(VertexId x) { cell().CutBeforePlace(x, request_->point.position); }

  std::span<const WatchedNode<2>> NodesToWatch() { return {}; }
  void AppendNodesToWatch(std::vector<WatchedNode<2>>& /*watched*/) {}

  // As CellSteps: all triangles in faces that are meshed, and those of others within the clip.
  typename StarWriter<2>::Simplices FindStar(StarWriter<2>& stars) {
    if (!stars.NeedsStars()) {
      return {};
    }
    Star<2>& star = stars.Room();
    FindStar(star);
    return star;
  }
  void FindStar(Star<2>& star) { cell().FindStar(star); }

  const Assessment* Reassessed() const { return is_reassessed_ ? &found_ : nullptr; }

 private:
  const PlaneRules& rules_;
  Cells& cells_;
  StepWorkspace<2>& workspace_;
  const VertexId v_;
  const double edge_limit_sq_;
  PlaneAssessment found_;
  PassedOver passed_over_;      // in all steps of the vertex
  bool is_reassessed_ = false;  // while the last request was looked for
  std::optional<PlaneRequest> request_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_PLANE_PLANE_STEPS_H_
