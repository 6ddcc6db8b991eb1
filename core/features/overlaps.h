// Segments that lie on each other: found by sorting, since there may be as many common parts as pairs.
#ifndef WELLSPACE_CORE_FEATURES_OVERLAPS_H_
#define WELLSPACE_CORE_FEATURES_OVERLAPS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/features/planar_graph.h"

namespace wellspace::core {

// Splits segments of `graph` that lie on a common line, and on each other, at each other's ends, and leaves one of each
// part; exact. Other points on them, and segments across, are left as they are. Segments run from their lower end to
// the higher one, and no two have both ends in common; they stay in the order of their sources, then along each.
//
// Complexity: O(m log m), however many segments lie on each other.
// Errors:     that of MarkersDifferError; CANCELLED, DEADLINE_EXCEEDED.
absl::Status UniteOverlaps(PlanarGraph& graph, const RunContext& context);

// The error for two segments that lie on each other from point `a` to point `b`, and have different markers.
//
// Errors:     INVALID_ARGUMENT always.
absl::Status MarkersDifferError(const PlanarGraph& graph, const GraphSegment& first, const GraphSegment& next,
                                uint32_t a, uint32_t b);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_OVERLAPS_H_
