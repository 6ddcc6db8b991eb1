// Small patches of a surface join their neighbours. Private to FindCurves.
#ifndef WELLSPACE_CORE_FEATURES_PATCH_MERGING_H_
#define WELLSPACE_CORE_FEATURES_PATCH_MERGING_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"

namespace wellspace::core {

// The length of a weak crease between two patches.
struct CommonCrease {
  uint32_t one = 0;  // patches, the lower first
  uint32_t other = 0;
  double length = 0;
};

// Joins patches whose area is below `least_area` with the neighbour with which they have the longest crease in common,
// of equal ones the lower; the smallest patch first, and again while it is small. Returns which patch each has become.
//
// REQUIRES:   areas: by patch; creases: any order, a pair of patches may come several times.
// Complexity: O(k log k), k creases, times the logarithm of the patches: the patch with fewer neighbours gives them
// away.
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<std::vector<uint32_t>> MergePatches(std::span<const double> areas, std::span<const CommonCrease> creases,
                                                   double least_area, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PATCH_MERGING_H_
