// The steps of one vertex, replayed from the record of a thread. Made by Refinement::RefineNextOf for a vertex
// whose record is still valid; no cell is computed.
#ifndef WELLSPACE_CORE_REFINE_SPECULATION_RECORDED_STEPS_H_
#define WELLSPACE_CORE_REFINE_SPECULATION_RECORDED_STEPS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/ids.h"
#include "core/refine/assessment.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/refine/speculation/batch.h"
#include "core/refine/star_writer.h"

namespace wellspace::core {

// The functions are those of CellSteps. Provisional numbers become those of the structure as steps are replayed, which
// can be done once.
//
// Thread safety: thread-compatible.
template <typename Domain>
class RecordedSteps {
  static constexpr int D = Domain::kDimension;

 public:
  // The steps of the next vertex of `batch`.
  //
  // REQUIRES:   its record is still valid; the batch outlives this.
  explicit RecordedSteps(Batch<Domain>& batch)
      : batch_(batch),
        record_(batch.records.by_vertex[batch.refined]),
        end_(batch.records.EndOf(batch.refined)),
        step_(record_.begin.steps),
        request_(record_.begin.requests),
        reassessed_(record_.begin.reassessed),
        notices_end_(record_.begin.notices) {}

  const Assessment* Assess() {
    const RecordedStep& step = batch_.records.steps[step_];
    notices_ = std::span(batch_.records.notices).subspan(notices_end_, step.notices);
    notices_end_ += step.notices;
    for (NeighborNotice& notice : notices_) {
      batch_.Renumber(notice.vertex);
    }
    return &step.found;
  }

  std::span<const NeighborNotice> Notices() const { return notices_; }

  const typename Domain::Request* NextRequest() {
    RecordedStep& step = batch_.records.steps[step_];
    if (step.is_reassessed) {
      step.found = batch_.records.reassessed[reassessed_++];
    }
    if (!step.asks) {
      return nullptr;
    }
    typename Domain::Request& request = batch_.records.requests[request_];
    batch_.Renumber(request.insertion.other);
    return &request;
  }

  void Inserted(VertexId x) {
    batch_.numbers[request_] = x;
    ++request_;
    ++step_;
  }

  std::span<const WatchedNode<D>> NodesToWatch() const {
    return std::span(batch_.records.watched).subspan(record_.begin.watched, end_.watched - record_.begin.watched);
  }

  typename StarWriter<D>::Simplices FindStar(StarWriter<D>& /*stars*/) {
    for (uint32_t i = record_.new_simplices; i < end_.simplices; ++i) {
      for (VertexId& u : batch_.records.simplices[i]) {
        batch_.Renumber(u);
      }
    }
    return std::span(batch_.records.simplices)
        .subspan(record_.begin.simplices, end_.simplices - record_.begin.simplices);
  }

 private:
  Batch<Domain>& batch_;
  const typename BatchRecords<Domain>::Record& record_;
  const typename BatchRecords<Domain>::Ends end_;
  size_t step_;     // of the batch's
  size_t request_;  // likewise, the next
  size_t reassessed_;
  std::span<NeighborNotice> notices_;
  size_t notices_end_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPECULATION_RECORDED_STEPS_H_
