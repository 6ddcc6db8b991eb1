// Points of the input that are near each other: merged where that is asked for, told of where they are too close.
#ifndef WELLSPACE_CORE_INPUT_NEAR_POINTS_H_
#define WELLSPACE_CORE_INPUT_NEAR_POINTS_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/input/frame.h"
#include "core/input/sorted_cloud.h"

namespace wellspace::core {

// The result of merging the points of a cloud.
struct MergedPoints {
  std::vector<double> points;     // those that stay, with the bits they had, in the order of the input
  std::vector<uint32_t> inputs;   // by point that stays: its number in the input
  HugeVector<uint32_t> place_of;  // by input: the point that it is now, a place in `inputs`
  uint64_t merged = 0;            // inputs that are another point now, with other coordinates
};

// Merges the points of a cloud that are near each other. Points are taken in the order of their coordinates, the first
// coordinate first, equal ones in that of the input. One that is no farther than `distance` from a point that stays
// becomes the nearest such; of several equally near, the first in that order. Any other stays.
//
// Guarantees: (1) points that stay are farther than `distance` from each other, so a chain of near points is thinned,
//             not drawn together; (2) each other point is at most `distance` from the point that it becomes; (3) which
//             coordinates stay depends on those of the points alone, not on their order; (4) merging the result changes
//             nothing.
// REQUIRES:   points of `frame`, or at most its longest side away, that its scale keeps exactly; distance >= 0.
// Complexity: O(n log n), times 2^D; more only for clouds that are refused afterwards.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::StatusOr<MergedPoints> MergeNear(const Frame<D>& frame, std::span<const double> points, double distance,
                                       const RunContext& context);

// SortCloud for the points that merging has left. The numbers of points are those of the input; those that were merged
// are duplicates.
//
// Complexity: that of SortCloud.
// Errors:     as SortCloud.
template <int D>
absl::StatusOr<SortedCloud<D>> SortMerged(const Frame<D>& frame, const MergedPoints& merged, int threads,
                                          const RunContext& context);

// Memory of merging for each point, beside a tree. Unit: bytes.
template <int D>
inline constexpr uint64_t kMergeBytes = 3 * sizeof(Point<D>) + sizeof(int64_t) * D + 48;

// Says which points of a cloud are too close to each other for `frame`: how many pairs, and the first of them. Where
// few points far away make the domain so large that others are too close, the far ones are blamed. `inputs` has the
// numbers of the points, and is empty if they are 0, 1, …. `is_domain_given`: not by the points.
//
// Complexity: O(n log n), times 2^D.
// Errors:     INVALID_ARGUMENT always, `found` if no pair is too close; CANCELLED, DEADLINE_EXCEEDED.
template <int D>
absl::Status TooClosePairsError(const Frame<D>& frame, std::span<const double> points, std::span<const uint32_t> inputs,
                                bool is_domain_given, double margin, const absl::Status& found,
                                const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_INPUT_NEAR_POINTS_H_
