// The steps that a thread has recorded for the vertices of a batch: ADR 23.
#ifndef WELLSPACE_CORE_REFINE_SPECULATION_BATCH_RECORDS_H_
#define WELLSPACE_CORE_REFINE_SPECULATION_BATCH_RECORDS_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/voronoi/extra_vertices.h"

namespace wellspace::core {

// The findings of a cell between two insertions for it.
struct RecordedStep {
  Assessment found;
  uint32_t notices = 0;        // their number, the next of the batch's
  bool asks = false;           // for the next of the batch's requests; if not, it is the last step of its vertex
  bool is_reassessed = false;  // the findings have become the next of the batch's while a request was looked for
};

// Steps in columns, vertex after vertex, recorded as if no vertices were refined meanwhile but those of the batch. New
// vertices have provisional numbers: from the vertices of the structure on, as many as there were then.
//
// Thread safety: thread-compatible. From Rounds::Prepare until `is_speculated` it belongs to the threads that record,
// which write nothing else of a batch; before and after that to the thread that refines.
template <typename Domain>
struct BatchRecords {
  static constexpr int D = Domain::kDimension;
  using Request = typename Domain::Request;

  // How long the columns are.
  struct Ends {
    uint32_t steps = 0;
    uint32_t requests = 0;
    uint32_t reassessed = 0;
    uint32_t notices = 0;
    uint32_t watched = 0;
    uint32_t simplices = 0;
  };
  // The record of one vertex.
  struct Record {
    bool is_wanted = false;      // the vertex was pending
    bool has_to_notify = false;  // some of its neighbours have not been told that it was added
    bool is_known = false;       // all its steps are recorded: they do not end with an error
    double reach_sq = 0;         // the squared distance beyond which no vertex cuts a cell that was computed for it
    uint32_t new_simplices = 0;  // from there on to the end simplices have vertices with provisional numbers
    Ends begin;
  };

  Ends ends() const {
    const auto size = [](const auto& column) { return static_cast<uint32_t>(column.size()); };
    return {size(steps), size(requests), size(reassessed), size(notices), size(watched), size(simplices)};
  }

  void CutTo(const Ends& ends) {
    steps.resize(ends.steps);
    requests.resize(ends.requests);
    inserted.CutTo(ends.requests);
    reassessed.resize(ends.reassessed);
    notices.resize(ends.notices);
    watched.resize(ends.watched);
    simplices.resize(ends.simplices);
  }

  // Forgets all records, and has room for `vertices` of them; `vertices_now` are in the structure.
  void Clear(size_t vertices, uint32_t vertices_now) {
    CutTo({});
    inserted.Clear(VertexId{vertices_now});
    by_vertex.assign(vertices, {});
    reach.low.fill(std::numeric_limits<double>::infinity());
    reach.high.fill(-std::numeric_limits<double>::infinity());
    is_speculated = false;
    parts_done = 0;
  }

  // Begins the record of vertex `at`.
  void Begin(size_t at) {
    by_vertex[at].begin = ends();
    by_vertex[at].new_simplices = by_vertex[at].begin.simplices;
  }

  // Records the simplices of `star`, that of vertex `at`.
  void AppendStar(size_t at) {
    const auto new_begin = std::partition(star.begin(), star.end(), [this](const std::array<VertexId, D>& simplex) {
      return std::all_of(simplex.begin(), simplex.end(), [this](VertexId u) { return u < inserted.first(); });
    });
    by_vertex[at].new_simplices = static_cast<uint32_t>(simplices.size() + (new_begin - star.begin()));
    simplices.insert(simplices.end(), star.begin(), star.end());
  }

  // Ends the record of vertex `at`, at `site`: all its steps are there.
  void SetKnown(size_t at, const Point<D>& site) {
    by_vertex[at].is_known = true;
    const double radius = 1.001 * std::sqrt(by_vertex[at].reach_sq);  // more than rounding
    reach.Include(CubeAround<D>(site, radius));
  }

  // Whether there is a record of vertex `at` with all its steps.
  bool IsKnown(size_t at) const { return is_speculated && by_vertex[at].is_known; }

  // Where the record of vertex `at` ends, once all are made.
  Ends EndOf(size_t at) const { return at + 1 < by_vertex.size() ? by_vertex[at + 1].begin : ends(); }

  // The requests in the record of vertex `at`.
  std::span<const Request> RequestsOf(size_t at) const {
    const uint32_t begin = by_vertex[at].begin.requests;
    return std::span(requests).subspan(begin, EndOf(at).requests - begin);
  }

  // The vertices expected to be inserted for vertex `at`.
  std::span<const Point<D>> ExpectedOf(size_t at) const {
    if (!IsKnown(at)) {
      return {};
    }
    const uint32_t begin = by_vertex[at].begin.requests;
    return inserted.positions().subspan(begin, EndOf(at).requests - begin);
  }

  // Roughly.
  uint64_t MemoryBytes() const {
    return steps.capacity() * sizeof(steps[0]) + requests.capacity() * sizeof(requests[0]) +
           reassessed.capacity() * sizeof(reassessed[0]) + notices.capacity() * sizeof(notices[0]) +
           watched.capacity() * sizeof(watched[0]) + simplices.capacity() * sizeof(simplices[0]);
  }

  // Whether the records are complete. Rounds::RecordPart stores true with release, once the last part is done;
  // Rounds::NextBatch loads it with acquire while others may record. All else that reads or writes it runs when they do
  // not, or after that load.
  bool is_speculated = false;
  // The number of parts that are recorded. Rounds::RecordPart loads it with acquire, to wait for the part before its
  // own, and stores it with release once its own is done.
  size_t parts_done = 0;

  std::vector<Record> by_vertex;
  std::vector<RecordedStep> steps;
  std::vector<Request> requests;
  ExtraVertices<D> inserted;  // by request
  std::vector<Assessment> reassessed;
  std::vector<NeighborNotice> notices;
  std::vector<WatchedNode<D>> watched;
  Star<D> simplices;  // of the stars of good cells
  Box<D> reach;       // holds the ball that each record reaches
  Star<D> star;       // scratch
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPECULATION_BATCH_RECORDS_H_
