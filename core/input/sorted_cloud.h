// The points of a cloud in the order of the query structure, without duplicates; and their numbers in the mesh.
#ifndef WELLSPACE_CORE_INPUT_SORTED_CLOUD_H_
#define WELLSPACE_CORE_INPUT_SORTED_CLOUD_H_

#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/input/frame.h"
#include "core/tree/morton.h"

namespace wellspace::core {

// Where points are read in another order than they lie in, they are asked for so many before they are needed.
inline constexpr uint32_t kPointsAhead = 28;

// A cloud without its duplicates, in the order that the query structure wants.
template <int D>
struct SortedCloud {
  struct Duplicate {
    uint32_t input = 0;
    uint32_t sorted = 0;  // the point that it became
  };

  // By input: its sorted point.
  //
  // Complexity: O(n).
  HugeVector<uint32_t> SortedOfInputs() const;

  MortonGrid<D> grid;                // for so many inputs
  HugeVector<Point<D>> points;       // distinct, in Morton order, scaled
  HugeVector<uint32_t> first_input;  // by sorted point: the first input equal to it
  HugeVector<Duplicate> duplicates;  // the other inputs, those that were merged with a point included
};

// Sorts the points of a cloud. `inputs` has the numbers by which errors name them; empty: 0, 1, ….
//
// Errors:     INVALID_ARGUMENT, naming the point: not finite, outside the domain, too small for its scale, too close to
//             a face of the box that it does not lie on, or, in one cube of the Morton grid, to another one; CANCELLED,
//             DEADLINE_EXCEEDED.
// Complexity: O(n log n); O(n) for all but the most uneven clouds.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
template <int D>
absl::StatusOr<SortedCloud<D>> SortCloud(const Frame<D>& frame, std::span<const double> points, int threads,
                                         const RunContext& context, std::span<const uint32_t> inputs = {});

// The numbers that the points of a sorted cloud have in the mesh: in the order in which inputs first become them.
struct PointNames {
  HugeVector<uint32_t> of_sorted;  // by sorted point
  HugeVector<uint32_t> of_input;   // by input
};

// Numbers the points of `cloud`.
//
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Complexity: O(n).
template <int D>
absl::StatusOr<PointNames> NamePoints(SortedCloud<D> cloud, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_SORTED_CLOUD_H_
