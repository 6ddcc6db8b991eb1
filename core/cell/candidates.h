// The vertices of a leaf that may cut a cell, from 4-D on: picked, sorted and dropped side by side, without branches
// that the data decide, since half of those would be mispredicted. In the plane and in space float_candidates.h does
// so.
#ifndef WELLSPACE_CORE_CELL_CANDIDATES_H_
#define WELLSPACE_CORE_CELL_CANDIDATES_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/simd/lanes.h"
#include "core/geometry/point.h"
#include "core/tree/leaf_tree.h"

namespace wellspace::core {

// Candidates of one cell, in columns: candidate j is entry j of each, for j < count.
//
// Thread safety: thread-compatible.
template <int D>
struct alignas(kLanes * sizeof(double)) Candidates {
  // Whole vectors are written, the last one perhaps from the last candidate on.
  static constexpr size_t kCapacity = PaddedCount(LeafTree<D>::kLeafCapacity) + kLanes;

  double w[D][kCapacity];       // the vector from the site
  double length_sq[kCapacity];  // |w|^2
  // By NodeColumns::BoundExcesses: at least the excess x . w - |w|^2 / 2 of every node x of the cell.
  double excess_bound[kCapacity];
  uint64_t slot[kCapacity];  // where in its leaf
  size_t count = 0;

  // Becomes those of `positions` within a squared distance of `site`, but not at it, in their order.
  //
  // REQUIRES:   at most LeafTree<D>::kLeafCapacity positions; they may be read up to PaddedCount of them.
  // Complexity: O(positions).
  // Errors:     none.
  void Pick(std::span<const Point<D>> positions, const Point<D>& site, double limit_sq,
            VectorUnit unit = BestVectorUnit());

  // Drops those from `begin` on whose `excess_bound` is negative: they cut nothing.
  //
  // Complexity: O(count - begin).
  // Errors:     none.
  void DropThoseThatMiss(size_t begin, VectorUnit unit = BestVectorUnit());

  // Puts those of `from` in order, the nearest first, but for squares that agree to one part in 2^13; `excess_bound`
  // is as good as unknown then.
  //
  // Complexity: O(count^2) up to 64, in vectors; else O(count log count).
  // Errors:     none.
  // Source:     rank sort.
  void Sort(const Candidates& from, VectorUnit unit = BestVectorUnit());
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_CANDIDATES_H_
