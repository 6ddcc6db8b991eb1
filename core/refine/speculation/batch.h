// Vertices that are refined one after the other, and the use made of the steps recorded for them: ADR 23.
#ifndef WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_
#define WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/cache_lines.h"
#include "core/cell/star.h"
#include "core/geometry/point.h"
#include "core/refine/speculation/batch_records.h"

namespace wellspace::core {

// The life of a batch, which Rounds calls for unless it says otherwise:
//   1. It gets the next vertices of its strip (TakeNext).
//   2. Prepare; then other threads record vertex after vertex: BatchRecords::Begin, the columns, AppendStar, SetKnown.
//   3. BeginReplay notes the vertices that have been inserted since step 2 as conflicts.
//   4. Refinement::RefineBatch takes its vertices in order. If a record IsStillValid it is replayed, else the steps are
//      computed; inserted vertices are compared to the expected ones (NoteInserted).
// A batch that was not speculated on skips steps 2 and 3, and has no record that is valid.
//
// A record is still valid if no vertex conflicts with it. Vertices conflict that could cut the cells it was computed
// from and were inserted but not expected, or expected but not inserted.
//
// Thread safety: thread-compatible. All but the records is written by the thread that refines alone.
template <typename Domain>
struct alignas(kCacheLines) Batch {
  static constexpr int D = Domain::kDimension;

  bool IsRefined() const { return refined == vertices.size(); }
  // The first vertex that has not been refined.
  VertexId next() const { return vertices[refined]; }

  // Whether the whole strip has been refined.
  bool IsLast() const { return IsRefined() && strip_begin == strip_end; }

  // Forgets the records; `vertices_now` are in the structure, and so many have been inserted in these rounds.
  void Prepare(uint32_t vertices_now, size_t inserted_now) {
    records.Clear(vertices.size(), vertices_now);
    conflicts.clear();
    first_unknown = inserted_now;
  }

  // Begins to replay the records, if there are any; `points` have been inserted since.
  void BeginReplay(std::span<const Point<D>> points) {
    numbers.assign(records.inserted.size(), kNoVertex);
    NoteConflicts(points);
  }

  // Whether the record of vertex `at`, at `site`, is still valid: its steps are those that would be computed now.
  //
  // Complexity: O(conflicts).
  bool IsStillValid(size_t at, const Point<D>& site) const {
    return records.IsKnown(at) && std::none_of(conflicts.begin(), conflicts.end(), [&](const Point<D>& p) {
             return DistanceSq<D>(p, site) <= records.by_vertex[at].reach_sq;
           });
  }

  // Notes points that were inserted and not expected, or expected and not inserted.
  void NoteConflicts(std::span<const Point<D>> points) {
    if (records.is_speculated) {
      std::copy_if(points.begin(), points.end(), std::back_inserter(conflicts),
                   [this](const Point<D>& p) { return records.reach.Contains(p); });
    }
  }

  // Compares the points inserted for the next vertex, numbered from `first` on, to the expected ones. A point that
  // was expected conflicts with no record, even if the record of this vertex was not valid.
  void NoteInserted(std::span<const Point<D>> points, VertexId first) {
    const std::span<const Point<D>> expected = records.ExpectedOf(refined);
    const auto [expected_end, points_end] =
        std::mismatch(expected.begin(), expected.end(), points.begin(), points.end());
    for (auto p = points.begin(); p != points_end; ++p) {
      const auto i = static_cast<uint32_t>(p - points.begin());
      numbers[records.by_vertex[refined].begin.requests + i] = VertexId{Index(first) + i};
    }
    NoteConflicts({expected_end, expected.end()});
    NoteConflicts({points_end, points.end()});
  }

  // Gives `u` the number that it has got in the structure, if its number is provisional.
  void Renumber(VertexId& u) const {
    if (u != kNoVertex && u >= records.inserted.first()) {
      u = numbers[Index(u) - Index(records.inserted.first())];
    }
  }

  // Roughly.
  uint64_t MemoryBytes() const { return records.MemoryBytes() + written.capacity() * sizeof(written[0]); }

  // The vertices. First the part of the strip that comes after this batch, its last vertex first: places among the
  // detached vertices.
  size_t strip_begin = 0;
  size_t strip_end = 0;
  std::vector<VertexId> vertices;
  size_t refined = 0;  // the number of vertices that are refined, the first ones

  BatchRecords<Domain> records;
  Star<D> written;           // simplices of the batch before, which may still be read
  size_t first_unknown = 0;  // of the insertions in these rounds, the first that the records were made without

  // The outcome of the requests.
  std::vector<VertexId> numbers;    // by request, in the structure; kNoVertex if it has not been inserted
  std::vector<Point<D>> conflicts;  // the points within reach
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPECULATION_BATCH_H_
