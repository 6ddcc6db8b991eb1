#include "core/features/segment_groups.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"
#include "core/features/closed_rings.h"
#include "core/features/odd_sets.h"

namespace wellspace::core {

absl::StatusOr<SegmentGroups> GroupsOfSegments(const Features& features, const RunContext& context) {
  SegmentGroups groups;
  if (features.faces != FaceRule::kUnion) {
    return groups;
  }
  groups.names.assign(features.groups.begin(), features.groups.end());
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(groups.names, std::less<uint32_t>(), context));
  groups.names.erase(std::unique(groups.names.begin(), groups.names.end()), groups.names.end());
  if (features.groups.empty()) {
    groups.names = {0};
  }
  groups.of_segment.resize(features.segment_count(), OddSets::kEmpty);
  for (size_t s = 0; s < groups.of_segment.size(); ++s) {
    if (s % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    const uint32_t name = features.groups.empty() ? 0 : features.groups[s];
    if (features.is_open.empty() || features.is_open[s] == 0) {
      groups.of_segment[s] = static_cast<uint32_t>(std::lower_bound(groups.names.begin(), groups.names.end(), name) -
                                                   groups.names.begin());
    }
  }
  return groups;
}

absl::Status CheckGroupsClosed(std::span<const uint32_t> point_of_input, const Features& features,
                               const SegmentGroups& groups, const RunContext& context) {
  // Segments by group: group g begins at first[g].
  std::vector<uint32_t> first(size_t{groups.count()} + 1);
  for (const uint32_t group : groups.of_segment) {
    if (group != OddSets::kEmpty) {
      ++first[group + 1];
    }
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<uint32_t> segments(first.back());
  std::vector<uint32_t> next(first.begin(), first.end() - 1);
  for (uint32_t s = 0; s < groups.of_segment.size(); ++s) {
    if (groups.of_segment[s] != OddSets::kEmpty) {
      segments[next[groups.of_segment[s]]++] = s;
    }
  }
  for (uint32_t g = 0; g < groups.count(); ++g) {
    const auto whose = [&] {
      return features.groups.empty() ? std::string("faces: the rings are")
                                     : absl::StrCat("faces: the rings of group ", groups.names[g], " are");
    };
    WELLSPACE_RETURN_IF_ERROR(
        CheckClosed(std::span<const uint32_t>(segments).subspan(first[g], first[g + 1] - first[g]), point_of_input,
                    features, whose, context));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
