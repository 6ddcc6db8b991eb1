// The search for the polygon around a place, for the checks of a domain.
#ifndef WELLSPACE_CORE_VALIDATE_POLYGON_SEARCH_H_
#define WELLSPACE_CORE_VALIDATE_POLYGON_SEARCH_H_

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"
#include "core/geometry/point.h"

namespace wellspace::core {

inline constexpr uint32_t kInNoPolygon = std::numeric_limits<uint32_t>::max();

// For each place the seed whose polygon surrounds it an odd number of times; of several that of the least area. A ring
// to the left of a place is counted, segment by segment.
//
// REQUIRES:   seeds have segments that are there; no place is on one.
// Complexity: O(m log q), and for each polygon the places in its box that no smaller one has.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<uint32_t>> FindPolygonsAround(std::span<const Point<2>> places,
                                                         std::span<const double> points, const Features& features,
                                                         const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_POLYGON_SEARCH_H_
