// Where the simplices of a mesh are, by their lowest vertex: for meshes that are changed around new vertices.
#ifndef WELLSPACE_CORE_SIMPLEX_STAR_ROWS_H_
#define WELLSPACE_CORE_SIMPLEX_STAR_ROWS_H_

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/simplex/row_edits.h"
#include "core/simplex/slot_rows.h"

namespace wellspace::core {

// The rows of a mesh whose simplices go in any place and come behind the last. Each simplex has a slot, the next one
// when it comes; the slots of one lowest vertex are a list.
//
// Thread safety: thread-compatible.
template <int D>
class StarRows {
 public:
  // Lists the rows of `simplices`.
  //
  // Complexity: O(simplices + vertices).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::Status Build(std::span<const uint32_t> simplices, uint64_t vertices, const RunContext& context);

  // The slots of the rows whose vertices are all among `vertices`, ascending; is_among(vertex) says the same.
  //
  // Shapes:     simplices: the rows that are listed.
  // Complexity: O(simplices whose lowest vertex is among them).
  // Errors:     none.
  template <typename IsAmong>
  std::vector<uint32_t> FindAmong(std::span<const uint32_t> vertices, IsAmong is_among,
                                  std::span<const uint32_t> simplices) const {
    std::vector<uint32_t> found;
    for (const uint32_t lowest : vertices) {
      for (uint32_t slot = lowest < first_.size() ? first_[lowest] : kNone; slot != kNone; slot = next_[slot]) {
        const auto row = simplices.subspan(rows_.RowOf(slot) * (D + 1), D + 1);
        if (std::all_of(row.begin(), row.end(), is_among)) {
          found.push_back(slot);
        }
      }
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  uint64_t RowOf(uint32_t slot) const { return rows_.RowOf(slot); }

  // Takes the simplices in `dropped`, ascending slots, out, and those of `added` in. Returns the edits of the rows.
  //
  // Shapes:     simplices: the rows that were listed; added: rows.
  // Complexity: O(dropped + added + slots of the vertices of those dropped), and a step for each 512 slots.
  std::vector<RowEdit> Replace(std::span<const uint32_t> dropped, std::span<const uint32_t> added, uint64_t vertices,
                               std::span<const uint32_t> simplices);

  // Whether so many slots are free that it should be built anew.
  bool IsSparse() const { return rows_.slots() > 2 * rows_.rows() + kLeastSparse; }

  uint64_t MemoryBytes() const { return (first_.size() + next_.size()) * sizeof(uint32_t) + rows_.MemoryBytes(); }
  static uint64_t BytesFor(uint64_t simplices, uint64_t vertices) {
    return (vertices + simplices) * sizeof(uint32_t) + simplices / 8;
  }

 private:
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  static constexpr uint64_t kLeastSparse = 1 << 16;

  void Push(uint32_t lowest);

  SlotRows rows_;
  HugeVector<uint32_t> first_;  // by vertex: the last slot of those that have it as their lowest
  HugeVector<uint32_t> next_;   // by slot: the one before in its list
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_STAR_ROWS_H_
