// The worst shapes of a triangulation's tetrahedra, kept while these change.
#ifndef WELLSPACE_CORE_SLIVER_WORST_SHAPES_H_
#define WELLSPACE_CORE_SLIVER_WORST_SHAPES_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/sliver/triangulation.h"

namespace wellspace::core {

// The largest measures of each block of 32 numbers of simplices, and of each 64 blocks, by MeasureTetrahedron; of those
// that come near the largest of all the shapes are computed exactly.
//
// Thread safety: thread-compatible.
class WorstShapes {
 public:
  struct Worst {
    double max_radius_edge = 0;
    double min_angle_deg = std::numeric_limits<double>::infinity();
  };

  // Begins anew, for numbers of simplices below `limit`, of which none is in.
  void Clear(uint32_t limit);
  // Adds simplex `s`.
  void Add(const Triangulation<3>& triangulation, SimplexId s);

  // Looks again at the blocks of `changed`, ascending. Returns how many simplices are measured.
  //
  // Complexity: O(32 changed).
  uint64_t Update(const Triangulation<3>& triangulation, std::span<const uint32_t> changed);

  // The worst of all simplices, to the bit what RadiusEdgeRatio and Angles have for them.
  //
  // Complexity: O(limit / 2048), and expected O(1) blocks; all where simplices are congruent.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<Worst> Find(const Triangulation<3>& triangulation, const RunContext& context) const;

  uint64_t MemoryBytes() const { return blocks_.size() * sizeof(Measures) + groups_.size() * sizeof(Measures); }

 private:
  static constexpr uint32_t kBlock = 32;  // numbers of simplices
  static constexpr uint32_t kGroup = 64;  // blocks

  // Infinite where one is not a number; below every other where there is no simplex.
  struct Measures {
    double cosine = -2;
    double ratio_sq = -1;

    void Add(const Measures& other);
  };

  static Measures MeasuresOf(const Simplex<3>& corners);
  void SumUp(size_t group);

  HugeVector<Measures> blocks_;
  std::vector<Measures> groups_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_WORST_SHAPES_H_
