// Changes of an array of rows, at the cost of the rows that change and of moving those between. A mesh that is brought
// up to date is changed so.
#ifndef WELLSPACE_CORE_SIMPLEX_ROW_EDITS_H_
#define WELLSPACE_CORE_SIMPLEX_ROW_EDITS_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/memory/huge_pages.h"

namespace wellspace::core {

// At row `at` of the array before, `dropped` rows give way to `added` new ones.
struct RowEdit {
  uint64_t at = 0;
  uint64_t dropped = 0;
  uint64_t added = 0;

  bool operator==(const RowEdit&) const = default;
};

// The changes of the simplices of a mesh.
struct SimplexChanges {
  std::vector<RowEdit> edits;  // ascending
  HugeVector<uint32_t> added;  // rows of dimension + 1 indices of vertices: those of all edits
  // What the shapes below are the worst of. kOfAdded: of those that are added, and the worst of the mesh before stays.
  enum class Worst { kOfAll, kOfAdded, kUnknown };
  Worst worst = Worst::kUnknown;
  double max_radius_edge = 0;
  double min_angle_deg = std::numeric_limits<double>::infinity();
};

// Appends an edit, or joins it to the last, if no row stays between the two.
//
// REQUIRES:   `edit` after the last.
inline void AppendEdit(const RowEdit& edit, std::vector<RowEdit>& edits) {
  if (!edits.empty() && edits.back().at + edits.back().dropped == edit.at) {
    edits.back().dropped += edit.dropped;
    edits.back().added += edit.added;
  } else {
    edits.push_back(edit);
  }
}

// Changes `rows`, of `width` numbers each: kept ones stay in their order.
//
// Shapes:     edits: ascending, apart from each other; added: the new rows of all, one behind the other.
// Complexity: O(edits + added), and a move of the rows behind the first edit whose row number changes.
// Errors:     none.
template <typename T>
void SpliceRows(size_t width, std::span<const RowEdit> edits, std::span<const T> added, HugeVector<T>& rows) {
  // Kept rows `from` to `from` + `count`, which come to `to`.
  struct Move {
    size_t from;
    size_t to;
    size_t count;
  };
  const size_t before = rows.size() / width;
  std::vector<Move> moves;
  size_t from = 0;
  size_t to = 0;
  for (const RowEdit& edit : edits) {
    moves.push_back({from, to, edit.at - from});
    to += edit.at - from + edit.added;
    from = edit.at + edit.dropped;
  }
  moves.push_back({from, to, before - from});
  const size_t after = to + before - from;
  rows.resize(std::max(before, after) * width);
  const auto row = [&](size_t i) { return rows.begin() + static_cast<std::ptrdiff_t>(i * width); };
  // Those that go forward leave room for those before them, and so do those that go back for those behind.
  for (const Move& move : moves) {
    if (move.to < move.from) {
      std::copy(row(move.from), row(move.from + move.count), row(move.to));
    }
  }
  for (auto move = moves.rbegin(); move != moves.rend(); ++move) {
    if (move->to > move->from) {
      std::copy_backward(row(move->from), row(move->from + move->count), row(move->to + move->count));
    }
  }
  auto source = added.begin();
  for (size_t k = 0; k < edits.size(); ++k) {
    const auto end = source + static_cast<std::ptrdiff_t>(edits[k].added * width);
    std::copy(source, end, row(moves[k].to + moves[k].count));
    source = end;
  }
  rows.resize(after * width);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_ROW_EDITS_H_
