// The simplices at each vertex, as cells have told that were computed anyway: a mesh without a second scan. Refinement
// writes them by its StarWriter, ComputeSimplices reads them.
#ifndef WELLSPACE_CORE_VORONOI_STAR_LISTS_H_
#define WELLSPACE_CORE_VORONOI_STAR_LISTS_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/memory/prefetch.h"
#include "core/base/run_context.h"
#include "core/cell/star.h"

namespace wellspace::core {

// A vertex whose list is stale, and the neighbour that makes it so: that was added after the vertex was last looked at.
using StalePair = std::pair<VertexId, VertexId>;

// For each vertex, of the star that it had when it was last looked at, the simplices whose vertices had all been looked
// at before. As vertices are only added, a simplex of the end has been one since the last of its vertices came:
// so the vertex that was looked at last lists it. Its other entries are spoiled by a vertex that came later, which is
// a neighbour in the end, and so has been one since it came: when that is looked at, the list is noted as stale. The
// lists depend on the stars and on the order in which they were looked at, and, but for the order within a list,
// not on how they were computed.
//
// Thread safety: thread-compatible; const functions may run at once.
template <int D>
class StarLists {
 public:
  // Lists the simplices of `star` whose vertices have been looked at, in the place of the list of `v`; nothing
  // unless this IsComplete(). `vertex_count`: of all vertices that there are now.
  //
  // REQUIRES:   all simplices of v are in star; v and its neighbours are below vertex_count; vertices are numbered as
  //             they are added.
  // Complexity: O(star), amortised.
  // Errors:     none; more than 2^32 simplices cannot be numbered, and are as GiveUp().
  void Set(VertexId v, std::span<const std::array<VertexId, D>> star, uint32_t vertex_count);

  // Makes room for the stars of `vertices` vertices.
  void Reserve(uint32_t vertices) {
    entries_.reserve(vertices);
    added_.reserve(vertices);
    listed_.reserve(size_t{kListedAtAVertex} * vertices);
  }

  // Forgets everything, and lists nothing until Clear(): where vertices move, or go, stars grow.
  void GiveUp();
  // Whether the stars of all vertices that were looked at are listed.
  bool IsComplete() const { return is_complete_; }

  // Forgets everything.
  void Clear() { *this = StarLists(); }

  // The simplices listed for `v`; none if it has not been looked at. Valid until the next Set.
  std::span<const std::array<VertexId, D>> Of(VertexId v) const {
    if (Index(v) >= entries_.size() || !Has(v)) {
      return {};
    }
    const Entry& entry = entries_[Index(v)];
    return {listed_.data() + entry.begin, entry.count};
  }

  // Asks the memory for the list of `v`, which is found in two steps (PrefetchAhead).
  void Prefetch(VertexId v, int step) const {
    if (step == 0 && Index(v) < entries_.size()) {
      PrefetchLine(&entries_[Index(v)]);
    } else if (step == 1) {
      PrefetchLine(Of(v).data());
    }
  }

  // Whether `u` was last looked at before `v` was, if anything is listed for v.
  //
  // REQUIRES:   both have been looked at, and are not the same.
  bool WasLookedAtBefore(VertexId u, VertexId v) const { return entries_[Index(u)].begin <= entries_[Index(v)].begin; }

  // Whether `u` was added after `v` was last looked at, if anything is listed for v.
  //
  // REQUIRES:   v has been looked at.
  bool CameAfter(VertexId u, VertexId v) const { return AddedAt(u) > entries_[Index(v)].begin; }

  // All pairs of a vertex that lists something and a neighbour that came after its last look, when that was looked at;
  // and others, some of them twice.
  std::span<const StalePair> stale() const { return stale_; }

  uint64_t MemoryBytes() const {
    return entries_.size() * sizeof(Entry) + added_.size() * sizeof(uint32_t) +
           listed_.size() * sizeof(std::array<VertexId, D>) + stale_.size() * sizeof(StalePair);
  }

 private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  // Simplices that are listed for each vertex of a mesh, at most, or about so many.
  static constexpr uint32_t kListedAtAVertex = D == 2 ? 4 : D == 3 ? 14 : 0;

  struct Entry {
    uint32_t begin = kNone;  // in listed_; kNone before the first look
    uint32_t count = 0;
  };

  bool Has(VertexId v) const { return entries_[Index(v)].begin != kNone; }
  uint32_t AddedAt(VertexId v) const {
    // No branch, since it could not be predicted.
    const uint32_t is_new = Index(v) >= first_count_ ? 1 : 0;
    return added_[(Index(v) - first_count_ + 1) & -is_new];
  }
  void DropUnused();
  void NoteStale(VertexId v, std::span<const VertexId> neighbours);

  HugeVector<Entry> entries_;  // by vertex
  // In the order of the looks, which is thus that of the places where lists begin.
  HugeVector<std::array<VertexId, D>> listed_;
  size_t unused_ = 0;         // of listed_
  uint32_t first_count_ = 0;  // vertices at the first look
  // First 0, for vertices below first_count_; then of each vertex from there on the size of listed_ at the next look
  // after it was added: lists that were made before begin below, unless they are empty.
  HugeVector<uint32_t> added_;
  HugeVector<StalePair> stale_;       // in the order of the looks, but for those before the last DropUnused
  std::vector<VertexId> neighbours_;  // scratch of Set
  bool is_complete_ = true;
};

// The lists that are stale in the end: the neighbours of a vertex that came after it was last looked at. Its list may
// be spoiled by these, and by no other vertex.
//
// Thread safety: thread-compatible; const functions may run at once.
class StaleStars {
 public:
  // REQUIRES:   all of the `vertex_count` vertices have been looked at.
  // Complexity: O(vertices / 64), and sorting the pairs.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  template <int D>
  static absl::StatusOr<StaleStars> Of(const StarLists<D>& lists, uint32_t vertex_count, const RunContext& context);

  // The pairs of `v`, each v and a neighbour that came later.
  //
  // Complexity: O(1) if there are none, else O(log of all).
  std::span<const StalePair> At(VertexId v) const;

  uint64_t MemoryBytes() const { return is_at_.size() / 8 + stale_.size() * sizeof(StalePair); }

 private:
  std::vector<bool> is_at_;       // by vertex: whether its list is stale
  std::vector<StalePair> stale_;  // ascending, each once
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_STAR_LISTS_H_
