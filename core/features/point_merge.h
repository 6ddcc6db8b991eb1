// The merging of given points that are one: equal points, and twins.
#ifndef WELLSPACE_CORE_FEATURES_POINT_MERGE_H_
#define WELLSPACE_CORE_FEATURES_POINT_MERGE_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"

namespace wellspace::core {

// Invariants: (1) place_of[inputs[k]] == k; (2) places are in the order in which given points first become them.
struct PointMerge {
  std::vector<uint32_t> place_of;  // by given point: the point that it has become, a place in `inputs`
  std::vector<uint32_t> inputs;    // the given points that stay, with the bits they had
  uint64_t equal = 0;              // others, which are equal to the point that they have become
  uint64_t merged = 0;             // others, which have other coordinates
};

// The outcome where every given point i becomes `becomes`[i], which becomes itself.
//
// Complexity: O(n).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<PointMerge> PointMergeOf(std::span<const double> points, std::span<const uint32_t> becomes,
                                        const RunContext& context);

// Merges points that are equal, and twins: corners of rings, nearer to each other than `separation`. Corners are taken
// in the order of their coordinates, the first coordinate first. One that is so near to a corner that stays becomes the
// nearest such, of several equally near the first in that order; any other stays. A point that no ring segment ends at
// is no twin: it stays, and is told of later.
//
// Shapes:     points: n x 2, row-major.
// REQUIRES:   points are finite; separation >= 0.
// Guarantees: (1) corners that stay are at least `separation` from each other; (2) which coordinates stay does not
//             depend on the order of points and segments.
// Complexity: O((n + m) log n).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<PointMerge> MergeTwins(std::span<const double> points, const Features& features, double separation,
                                      const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_POINT_MERGE_H_
