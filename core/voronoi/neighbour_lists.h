// Who is whose neighbour, as cells have told that were computed anyway: what serves stars without a second scan.
#ifndef WELLSPACE_CORE_VORONOI_NEIGHBOUR_LISTS_H_
#define WELLSPACE_CORE_VORONOI_NEIGHBOUR_LISTS_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// For each vertex the neighbours that its cell in the box had when it was last looked at, of those that had been looked at before. Of two
// vertices that are neighbours the one that was looked at last lists the other: as long as vertices are only added, cells
// only shrink, so that they were neighbours then. Some that are listed are none any more. What is listed depends on the cells and on
// the order in which they were looked at, and not on how they were computed.
//
// Thread safety: thread-compatible.
class NeighbourLists {
 public:
  // Lists those of `neighbours` that have been looked at, in the place of what is listed for `v`; nothing if this IsFull().
  //
  // REQUIRES:   all neighbours of v are among them.
  // Complexity: O(neighbours), amortised.
  // Errors:     none.
  void Set(VertexId v, std::span<const VertexId> neighbours);

  // What is listed for `v`; nothing if it has not been looked at.
  std::span<const VertexId> Of(VertexId v) const {
    if (!Has(v)) {
      return {};
    }
    const size_t begin = begin_[Index(v)];
    return {ids_.data() + begin + 1, Index(ids_[begin])};
  }

  // Whether there has been more to list than can be numbered: 2^32 neighbours and vertices together.
  bool IsFull() const { return is_full_; }
  static absl::Status FullError() {
    return absl::ResourceExhaustedError("the mesh has more neighbours to list than can be numbered, 2^32");
  }

  // Forgets everything.
  void Clear();

  uint64_t MemoryBytes() const { return begin_.size() * sizeof(uint32_t) + ids_.size() * sizeof(VertexId); }

 private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

  bool Has(VertexId v) const { return Index(v) < begin_.size() && begin_[Index(v)] != kNone; }
  void DropUnused();

  std::vector<uint32_t> begin_;  // by vertex: in ids_, the number of its neighbours, followed by these
  std::vector<VertexId> ids_;
  size_t unused_ = 0;  // places in ids_
  bool is_full_ = false;
};

// The same from both sides: for each vertex all its neighbours, and some that no longer are.
//
// Thread safety: thread-compatible; const functions may run at once.
class NeighbourTable {
 public:
  // Valid until `lists` changes.
  //
  // REQUIRES:   all of the `vertex_count` vertices are listed.
  // Complexity: O(entries).
  // Errors:     RESOURCE_EXHAUSTED if the lists are full; CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<NeighbourTable> Of(const NeighbourLists& lists, uint32_t vertex_count,
                                           const RunContext& context);

  // Calls f(VertexId) for each neighbour of `v`, and some others; perhaps twice for one.
  //
  // REQUIRES:   v is one of the vertices.
  template <typename F>
  void ForEachAt(VertexId v, F f) const {
    for (const VertexId u : lists_->Of(v)) {
      f(u);
    }
    for (size_t i = begin_[Index(v)]; i < begin_[Index(v) + 1]; ++i) {
      f(listed_by_[i]);
    }
  }

  // For how many it calls f.
  size_t CountAt(VertexId v) const { return lists_->Of(v).size() + (begin_[Index(v) + 1] - begin_[Index(v)]); }

  // Together with the lists.
  uint64_t MemoryBytes() const {
    return lists_->MemoryBytes() + begin_.size() * sizeof(uint32_t) + listed_by_.size() * sizeof(VertexId);
  }

 private:
  explicit NeighbourTable(const NeighbourLists& lists) : lists_(&lists) {}

  const NeighbourLists* lists_;
  std::vector<uint32_t> begin_;  // by vertex, in listed_by_; one more
  std::vector<VertexId> listed_by_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_NEIGHBOUR_LISTS_H_
