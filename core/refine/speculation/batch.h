// Vertices that are refined one after the other, and the steps that a thread has recorded for them: ADR 23.
#ifndef WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_
#define WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/cache_lines.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/refine/face_watchers.h"
#include "core/refine/insertion.h"
#include "core/refine/neighbor_notice.h"
#include "core/voronoi/extra_vertices.h"

namespace wellspace::core {

// What is found of a cell between two insertions for it.
struct RecordedStep {
  Assessment found;
  uint32_t notices = 0;        // so many, the next of the batch's
  bool asks = false;           // for the next of the batch's requests; if not, it is the last step of its vertex
  bool is_reassessed = false;  // what is found has become the next of the batch's while a request was looked for
};

// Steps are recorded as if no vertices were refined meanwhile but those of the batch. They are in columns, vertex after
// vertex. What would be inserted has provisional numbers: from the vertices of the structure on, as many as
// there were then.
//
// The life of a batch, which Rounds calls for unless it says otherwise:
//   1. It gets the next vertices of its strip (TakeNext).
//   2. Prepare; then other threads record vertex after vertex: BeginRecord, the columns, AppendStar, SetKnown.
//   3. BeginBatch notes as conflicts what has been inserted since step 2.
//   4. Refinement::RefineBatch takes its vertices in order. If a record IsStillValid it is replayed, else the steps are
//      computed; what has been inserted then is compared to what was expected (NoteInserted).
// A batch that was not speculated on skips steps 2 and 3, and has no record that is valid.
//
// A record is still valid if no vertex conflicts with it. Vertices conflict that could cut the cells it was computed
// from and were inserted but not expected, or expected but not inserted.
//
// Thread safety: thread-compatible.
template <int D>
struct alignas(kCacheLines) Batch {
  // How long the columns are.
  struct Ends {
    uint32_t steps = 0;
    uint32_t requests = 0;
    uint32_t reassessed = 0;
    uint32_t notices = 0;
    uint32_t watched = 0;
    uint32_t simplices = 0;
  };
  // What is recorded of one vertex.
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

  bool IsRefined() const { return refined == vertices.size(); }
  // The first vertex that has not been refined.
  VertexId next() const { return vertices[refined]; }

  // Whether the whole strip has been refined.
  bool IsLast() const { return IsRefined() && strip_begin == strip_end; }

  // Forgets what was recorded; `vertices_now` are in the structure, and so many have been inserted in these rounds.
  void Prepare(uint32_t vertices_now, size_t inserted_now) {
    CutTo({});
    inserted.Clear(VertexId{vertices_now});
    records.assign(vertices.size(), {});
    reach.low.fill(std::numeric_limits<double>::infinity());
    reach.high.fill(-std::numeric_limits<double>::infinity());
    conflicts.clear();
    is_speculated = false;
    parts_done = 0;
    first_unknown = inserted_now;
  }

  // Begins the record of vertex `at`.
  void BeginRecord(size_t at) {
    records[at].begin = ends();
    records[at].new_simplices = records[at].begin.simplices;
  }

  // Records the simplices of `star`, that of vertex `at`.
  void AppendStar(size_t at) {
    const auto new_begin = std::partition(star.begin(), star.end(), [this](const std::array<VertexId, D>& simplex) {
      return std::all_of(simplex.begin(), simplex.end(), [this](VertexId u) { return u < inserted.first(); });
    });
    records[at].new_simplices = static_cast<uint32_t>(simplices.size() + (new_begin - star.begin()));
    simplices.insert(simplices.end(), star.begin(), star.end());
  }

  // Ends the record of vertex `at`, at `site`: all its steps are there.
  void SetKnown(size_t at, const Point<D>& site) {
    records[at].is_known = true;
    const double radius = 1.001 * std::sqrt(records[at].reach_sq);  // more than what is rounded
    reach.Include(CubeAround<D>(site, radius));
  }

  // Whether the record of vertex `at`, at `site`, is still valid: its steps are those that would be computed now.
  //
  // Complexity: O(conflicts).
  bool IsStillValid(size_t at, const Point<D>& site) const {
    return is_speculated && records[at].is_known &&
           std::none_of(conflicts.begin(), conflicts.end(),
                        [&](const Point<D>& p) { return DistanceSq<D>(p, site) <= records[at].reach_sq; });
  }

  // Where the record of vertex `at` ends, once all are made.
  Ends EndOf(size_t at) const { return at + 1 < records.size() ? records[at + 1].begin : ends(); }

  // What the record of vertex `at` asks for.
  std::span<const InsertionRequest<D>> RequestsOf(size_t at) const {
    const uint32_t begin = records[at].begin.requests;
    return std::span(requests).subspan(begin, EndOf(at).requests - begin);
  }

  // What is expected to be inserted for vertex `at`.
  std::span<const Point<D>> ExpectedOf(size_t at) const {
    if (!is_speculated || !records[at].is_known) {
      return {};
    }
    const uint32_t begin = records[at].begin.requests;
    return inserted.positions().subspan(begin, EndOf(at).requests - begin);
  }

  // Notes points that were inserted and not expected, or expected and not inserted.
  void NoteConflicts(std::span<const Point<D>> points) {
    if (is_speculated) {
      std::copy_if(points.begin(), points.end(), std::back_inserter(conflicts),
                   [this](const Point<D>& p) { return reach.Contains(p); });
    }
  }

  // Compares what has been inserted for the next vertex, numbered from `first` on, to what was expected. A point that
  // was expected conflicts with no record, even if the record of this vertex was not valid.
  void NoteInserted(std::span<const Point<D>> points, VertexId first) {
    const std::span<const Point<D>> expected = ExpectedOf(refined);
    const auto [expected_end, points_end] =
        std::mismatch(expected.begin(), expected.end(), points.begin(), points.end());
    for (auto p = points.begin(); p != points_end; ++p) {
      const auto i = static_cast<uint32_t>(p - points.begin());
      numbers[records[refined].begin.requests + i] = VertexId{Index(first) + i};
    }
    NoteConflicts({expected_end, expected.end()});
    NoteConflicts({points_end, points.end()});
  }

  // Gives `u` the number that it has got in the structure, if its number is provisional.
  void Renumber(VertexId& u) const {
    if (u != kNoVertex && u >= inserted.first()) {
      u = numbers[Index(u) - Index(inserted.first())];
    }
  }

  // Roughly.
  uint64_t MemoryBytes() const {
    return steps.capacity() * sizeof(steps[0]) + requests.capacity() * sizeof(requests[0]) +
           reassessed.capacity() * sizeof(reassessed[0]) + notices.capacity() * sizeof(notices[0]) +
           watched.capacity() * sizeof(watched[0]) + (simplices.capacity() + written.capacity()) * sizeof(simplices[0]);
  }

  // The vertices. First the part of the strip that comes after this batch, its last vertex first: places among the
  // detached vertices.
  size_t strip_begin = 0;
  size_t strip_end = 0;
  std::vector<VertexId> vertices;
  size_t refined = 0;  // so many of the vertices, the first

  // The records, in columns.
  bool is_speculated = false;   // the records are complete
  size_t parts_done = 0;        // of the parts that records are made in
  size_t first_unknown = 0;     // of what is inserted in these rounds, the first that the records were made without
  std::vector<Record> records;  // by vertex
  std::vector<RecordedStep> steps;
  std::vector<InsertionRequest<D>> requests;
  ExtraVertices<D> inserted;  // by request
  std::vector<Assessment> reassessed;
  std::vector<NeighborNotice> notices;
  std::vector<WatchedNode<D>> watched;
  Star<D> simplices;  // of the stars of good cells
  Star<D> written;    // simplices of the batch before, which may still be read
  Box<D> reach;       // holds the ball that each record reaches
  Star<D> star;       // scratch

  // What has become of the requests.
  std::vector<VertexId> numbers;    // by request, in the structure; kNoVertex if it has not been inserted
  std::vector<Point<D>> conflicts;  // the points within reach
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_
