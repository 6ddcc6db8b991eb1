// Simplices one after the other, in the form of the output, with the worst of their shapes: the result of each block of
// vertices.
#ifndef WELLSPACE_CORE_SIMPLEX_SIMPLEX_LIST_H_
#define WELLSPACE_CORE_SIMPLEX_SIMPLEX_LIST_H_

#include <array>
#include <cstdint>
#include <limits>

#include "core/base/memory/huge_pages.h"
#include "core/geometry/exact_measure.h"

namespace wellspace::core {

// Thread safety: thread-compatible. Reused from block to block.
// Invariants: (1) max_radius_edge and min_angle_deg are the largest RadiusEdgeRatio and the smallest Angles of the
// simplices, to the bit, whatever their order; simplices before Clear() count, too.
template <int D>
class SimplexList {
 public:
  // Appends a simplex: the lowest index first, the others ascending but for an exchange of the last two that makes it
  // positive.
  //
  // REQUIRES:   `points` not in one hyperplane, `indices` distinct.
  // Complexity: O(1); without the quotients and arc tangents of quality.h for a simplex that is clearly not the worst.
  // Errors:     none.
  void Add(const Simplex<D>& points, const std::array<uint32_t, D + 1>& indices);

  size_t size() const { return indices_.size() / (D + 1); }
  const HugeVector<uint32_t>& indices() const { return indices_; }
  double max_radius_edge() const { return max_radius_edge_; }
  double min_angle_deg() const { return min_angle_deg_; }
  uint64_t MemoryBytes() const { return indices_.capacity() * sizeof(uint32_t); }
  // Forgets the simplices, but not their shapes.
  void Clear() { indices_.clear(); }

 private:
  // The facts about a simplex that doubles tell.
  struct Glance {
    Sign orientation = Sign::kZero;  // kZero where they do not tell
    bool is_clearly_better = false;
  };

  Glance LookAt(const Simplex<D>& points) const;
  void Measure(const Simplex<D>& points, const std::array<uint32_t, D + 1>& indices);

  HugeVector<uint32_t> indices_;
  double max_radius_edge_ = 0;
  double min_angle_deg_ = std::numeric_limits<double>::infinity();
  double better_ratio_sq_ = 0;  // a ratio whose square is below this is clearly smaller than the largest
  double better_cot_sq_ = 0;    // an angle whose squared cotangent is below this is clearly larger than the smallest
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_SIMPLEX_LIST_H_
