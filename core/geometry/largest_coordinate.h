// The largest coordinate of points, by which rounding is measured.
#ifndef WELLSPACE_CORE_GEOMETRY_LARGEST_COORDINATE_H_
#define WELLSPACE_CORE_GEOMETRY_LARGEST_COORDINATE_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "absl/status/statusor.h"
#include "core/base/check_at.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

// The largest of all coordinates, without signs; 0 of no points.
//
// Complexity: O(n).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
inline absl::StatusOr<double> LargestCoordinate(std::span<const double> points, const RunContext& context) {
  double largest = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    WELLSPACE_RETURN_IF_ERROR(CheckAt(i, context));
    largest = std::max(largest, std::abs(points[i]));
  }
  return largest;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_LARGEST_COORDINATE_H_
