// The points that a mesh is made of: checked, put on the scale of the computation, sorted, without duplicates.
#ifndef WELLSPACE_CORE_INPUT_CLOUD_H_
#define WELLSPACE_CORE_INPUT_CLOUD_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// Where points are read in another order than they lie in, they are asked for so many before they are needed.
inline constexpr uint32_t kAhead = 28;

// The box that is meshed, and the power of two that brings it to a scale on which no product of lengths overflows.
template <int D>
struct Domain {
  Box<D> box;         // as given
  Box<D> scaled_box;  // of the computation
  double scale = 1;
  double grid_step = 0;  // of every MortonGrid of the box, scaled

  // Vertices nearer than this, scaled, are refused as input: coordinates of Steiner points around them would be too
  // coarse to keep rho.
  double MinSeparation() const { return 64 * grid_step; }

  // The refinement gives up on shorter edges.
  double MinEdge() const { return 4 * grid_step; }

  // No negative zero: equal points have equal bits.
  Point<D> Scaled(const Point<D>& p) const {
    Point<D> scaled;
    for (int i = 0; i < D; ++i) {
      scaled[i] = p[i] * scale + 0.0;
    }
    return scaled;
  }
  Point<D> Unscaled(const Point<D>& p) const {
    Point<D> unscaled;
    for (int i = 0; i < D; ++i) {
      unscaled[i] = p[i] / scale;
    }
    return unscaled;
  }

  // Errors:     INVALID_ARGUMENT for a box that doubles cannot serve.
  static absl::StatusOr<Domain> Of(const Box<D>& box);
};

// Leaves that the tree may have for each vertex of the budget; around isolated close pairs balance costs up to about
// two.
inline constexpr uint64_t kLeavesPerVertex = 8;

// Refuses what is no whole number of points, or more of them than vertices can be numbered.
//
// Errors:     INVALID_ARGUMENT with the figures.
absl::Status CheckShape(std::span<const double> points, int dimension);

// The bounding box of `points`, grown on every side by `margin` times its longest side.
//
// Errors:     INVALID_ARGUMENT when there are none, or one is not finite; CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::StatusOr<Box<D>> BoxAround(std::span<const double> points, double margin, const RunContext& context);

// Refuses points that `domain` cannot have.
//
// Errors:     INVALID_ARGUMENT, naming the point: not finite, outside the domain, too small for its scale; CANCELLED,
//             DEADLINE_EXCEEDED.
template <int D>
absl::Status CheckPoints(const Domain<D>& domain, std::span<const double> points, const RunContext& context);

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

// Errors:     INVALID_ARGUMENT, naming the point: not finite, outside the domain, too small for its scale, too close to
//             a face of the box that it does not lie on, or, in one cube of the Morton grid, to another one; CANCELLED,
//             DEADLINE_EXCEEDED.
// Complexity: O(n log n); O(n) for all but the most uneven clouds.
// Threads:    uses `threads`, at most as many as the machine has cores; the result does not depend on them.
//
// `inputs` has the numbers by which errors name the points; empty: 0, 1, ….
template <int D>
absl::StatusOr<SortedCloud<D>> SortCloud(const Domain<D>& domain, std::span<const double> points, int threads,
                                         const RunContext& context, std::span<const uint32_t> inputs = {});

// The numbers that the points of a sorted cloud have in the mesh: in the order in which inputs first become them.
struct PointNames {
  HugeVector<uint32_t> of_sorted;  // by sorted point
  HugeVector<uint32_t> of_input;   // by input
};

// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Complexity: O(n).
template <int D>
absl::StatusOr<PointNames> NamePoints(SortedCloud<D> cloud, const RunContext& context);

// The error for point `index`, which is `p`, and only `distance` from what `other` names; both scaled.
template <int D>
absl::Status TooCloseError(const Domain<D>& domain, const Point<D>& p, size_t index, double distance,
                           std::string_view other);

// Whether an error is a TooCloseError, and the cloud may have more such points.
bool IsTooClose(const absl::Status& status);

// Refuses points nearer to each other, or to a corner of the box, than the arithmetic serves. The vertices of
// `structure` are a sorted cloud's, from number `first` on, whose `first_input` is given, and the corners. A point on a
// corner is no error.
//
// Errors:     INVALID_ARGUMENT, naming the point; CANCELLED, DEADLINE_EXCEEDED.
// Complexity: O(n) queries.
// Threads:    uses `threads`, at most as many as the machine has cores.
template <int D>
absl::Status CheckSeparation(const Domain<D>& domain, const QueryStructure<D>& structure, uint32_t first,
                             std::span<const uint32_t> first_input, int threads, const RunContext& context);

// CheckSeparation for a cloud that is in no structure: the points among themselves, and beside the corners and faces of
// the box.
template <int D>
absl::Status CheckApart(const Domain<D>& domain, const SortedCloud<D>& cloud, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_CLOUD_H_
