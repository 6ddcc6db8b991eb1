// Groups of segments, of which FaceRule::kUnion takes the union: each of them may be a feature of a map.
#ifndef WELLSPACE_CORE_FEATURES_SEGMENT_GROUPS_H_
#define WELLSPACE_CORE_FEATURES_SEGMENT_GROUPS_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/features/features.h"

namespace wellspace::core {

struct SegmentGroups {
  std::vector<uint32_t>
      of_segment;               // from 0 on, OddSets::kEmpty of those that are part of no ring; empty: no rule asks
  std::vector<uint32_t> names;  // by group: the number that it was given

  uint32_t count() const { return static_cast<uint32_t>(names.size()); }
};

// The groups of segments, numbered in the order of the numbers that they are given; none but under FaceRule::kUnion.
//
// REQUIRES:   features.groups has one for each segment, or none.
// Complexity: O(m log m).
// Errors:     CANCELLED, DEADLINE_EXCEEDED.
absl::StatusOr<SegmentGroups> GroupsOfSegments(const Features& features, const RunContext& context);

// Whether the rings of each group are closed. Points that are equal have one number in `point_of_input`.
//
// REQUIRES:   all ends are there.
// Complexity: O(m log m).
// Errors:     INVALID_ARGUMENT, naming the group, a segment and a point. CANCELLED, DEADLINE_EXCEEDED.
absl::Status CheckGroupsClosed(std::span<const uint32_t> point_of_input, const Features& features,
                               const SegmentGroups& groups, const RunContext& context);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_SEGMENT_GROUPS_H_
