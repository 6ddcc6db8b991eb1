// The steps of one vertex in a domain in space, computed from its cell, like CellSteps in the box.
#ifndef WELLSPACE_CORE_REFINE_SPACE_SPACE_STEPS_H_
#define WELLSPACE_CORE_REFINE_SPACE_SPACE_STEPS_H_

#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/cell/star.h"
#include "core/refine/assessment.h"
#include "core/refine/cell_steps.h"
#include "core/refine/face_watchers.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/space/space_place.h"
#include "core/refine/space/space_rules.h"
#include "core/refine/star_writer.h"

namespace wellspace::core {

// As CellSteps, whose functions it has. While subsegments are pending, each step of whatever vertex splits one of them:
// they come before all buckets. A node may be passed over by the rules, as in PlaneSteps.
//
// Thread safety: thread-compatible.
template <typename Cells>
class SpaceSteps {
 public:
  // REQUIRES:   all references outlive this.
  SpaceSteps(const SpaceRules& rules, VertexId v, double edge_limit_sq, Cells& cells, StepWorkspace<3>& workspace)
      : rules_(rules), cells_(cells), workspace_(workspace), v_(v), edge_limit_sq_(edge_limit_sq) {
    cells_.ComputeOwn(v, rules.step_rules().ClipAround(v, edge_limit_sq), workspace.own);
  }

  Polytope<3>& cell() { return workspace_.own.cell; }

  const Assessment* Assess() {
    if (cell().IsTooLarge()) {
      return nullptr;
    }
    request_ = rules_.NextCurveRequest(edge_limit_sq_);
    if (request_.has_value() && is_assessed_) {
      return &found_;  // which is for the notices; while curves are split, cells may be large
    }
    is_assessed_ = true;
    found_ = rules_.AssessCell(v_, cell(), edge_limit_sq_, !request_.has_value(), passed_over_);
    found_.is_segment_encroached = found_.is_segment_encroached || request_.has_value();
    return &found_;
  }

  std::span<const NeighborNotice> Notices() {
    workspace_.notices.clear();
    AppendNotices(workspace_.notices);
    return workspace_.notices;
  }
  void AppendNotices(std::vector<NeighborNotice>& notices) { rules_.AppendNotices(v_, cell(), found_, notices); }

  const SpaceRequest* NextRequest() {
    while (!request_.has_value()) {
      SpaceRules::Answer answer = rules_.NextRequest(
          v_, cell(), found_, edge_limit_sq_,
          [this](VertexId u, const Box<3>& clip) { return cells_.ComputeOther(u, clip, workspace_.other); });
      request_ = answer.request;
      if (!answer.refused_node.has_value()) {
        break;
      }
      passed_over_.push_back(*answer.refused_node);
      found_ = rules_.AssessCell(v_, cell(), edge_limit_sq_, true, passed_over_);
    }
    return request_.has_value() ? &*request_ : nullptr;
  }

  void Inserted(VertexId x) { cell().CutBeforePlace(x, request_->point.position); }

  std::span<const WatchedNode<3>> NodesToWatch() {
    workspace_.watched.clear();
    AppendNodesToWatch(workspace_.watched);
    return workspace_.watched;
  }
  void AppendNodesToWatch(std::vector<WatchedNode<3>>& watched) {
    rules_.step_rules().AppendNodesToWatch(v_, cell(), found_, watched);
  }

  typename StarWriter<3>::Simplices FindStar(StarWriter<3>& stars) {
    if (!stars.NeedsStars()) {
      return {};
    }
    Star<3>& star = stars.Room();
    FindStar(star);
    return star;
  }
  void FindStar(Star<3>& star) { cell().FindStar(star); }

  const Assessment* Reassessed() const { return nullptr; }

 private:
  const SpaceRules& rules_;
  Cells& cells_;
  StepWorkspace<3>& workspace_;
  const VertexId v_;
  const double edge_limit_sq_;
  SpaceAssessment found_;
  bool is_assessed_ = false;                  // at least once
  std::vector<TetrahedronName> passed_over_;  // in all steps of the vertex
  std::optional<SpaceRequest> request_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_SPACE_STEPS_H_
