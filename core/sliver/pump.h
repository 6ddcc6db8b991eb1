// Weight pumping: weights of vertices under which the regular triangulation has better simplices than Delaunay's.
#ifndef WELLSPACE_CORE_SLIVER_PUMP_H_
#define WELLSPACE_CORE_SLIVER_PUMP_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/sliver/triangulation.h"

namespace wellspace::core {

// A weight is at most this times the squared distance to the nearest other vertex: [HT08]'s omega^2, omega < 1/2, so
// that no vertex loses its cell.
inline constexpr double kMostWeight = 0.24;

// Gives each vertex, one after the other, the weight in [0, kMostWeight NN^2] for which the simplex with the smallest
// angle of its star is best; the others' weights stay. The triangulation of the weights takes the place of the one
// before. Where that leaves slivers in 3-D, vertices near each other are weighed together.
//
// REQUIRES:   a Delaunay triangulation, no weights.
// Guarantees: (1) the result is exactly the regular triangulation of its weights; (2) a weight changes only its
//             vertex's star, and the smallest angle of that only for the better, or of all the stars around two;
//             (3) weights have at most 24 bits; (4) points on a face of the box are triangulated as the face alone
//             would be.
// Returns:    the number of vertices with a weight.
// Complexity: O(1) for each vertex of a well-spaced mesh.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
// Source:     [HT08] §2; Cheng, Dey, Edelsbrunner, Facello and Teng 2000; Cheng and Dey 2003. The star is followed
//             from event to event, not sampled: docs/design/sliver.md.
template <int D>
absl::StatusOr<uint64_t> PumpWeights(Triangulation<D>& triangulation, RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_PUMP_H_
