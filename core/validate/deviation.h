// The distance of some triangles in space from others.
#ifndef WELLSPACE_CORE_VALIDATE_DEVIATION_H_
#define WELLSPACE_CORE_VALIDATE_DEVIATION_H_

#include <span>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle.h"
#include "core/validate/triangle_tree.h"
#include "core/validate/validate_fidelity.h"

namespace wellspace::core {

// Measures how far `triangles` are from those of `others`: at corners and middles, and at middles of quarters where the
// distance may be larger than the largest found, the worst first. It goes on until no distance can be more than 2 %, or
// `resolution`, above that one, or until some thousand quarters have been looked at, or 32 for each triangle.
//
// A quarter is no farther away than its middle is, and its radius more; nor than the farthest of its corners is from
// any one triangle: the distance to a convex set is a convex function.
//
// REQUIRES:   neither is empty; resolution > 0.
// Complexity: O((n + q) log m) for most, q quarters.
// Errors:     RESOURCE_EXHAUSTED of the context's memory; CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<Deviation> MeasureDeviation(std::span<const Triangle> triangles, const TriangleTree& others,
                                           double resolution, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_DEVIATION_H_
