// The points of a domain as a mesh has them where near ones are one, for the checks of a domain; without the mesher's
// code.
#ifndef WELLSPACE_CORE_VALIDATE_MERGED_DOMAIN_H_
#define WELLSPACE_CORE_VALIDATE_MERGED_DOMAIN_H_

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"

namespace wellspace::core {

// Where each of `points` is in a mesh with the vertices `vertices`. With a merge distance above 0 a point no farther
// than that from one before it, in the order of coordinates, which has stayed, is at the nearest such. After that a
// corner of a ring that is no vertex, and less than `tolerance` from a corner that is one, is there.
//
// Shapes:     points and vertices: rows of 2; the result has the shape of `points`.
// REQUIRES:   ends of segments are points; tolerance > 0.
// Complexity: O((n + v) log (n + v)) expected.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<double>> PlacesInMesh(std::span<const double> points, const Features& features,
                                                 std::span<const double> vertices, double merge_distance,
                                                 double tolerance, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_MERGED_DOMAIN_H_
