#include "core/features/closed_rings.h"

#include <cstddef>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/cancellable_sort.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

absl::Status CheckClosed(std::span<const uint32_t> segments, std::span<const uint32_t> point_of_input,
                         const Features& features, absl::FunctionRef<std::string()> whose, const RunContext& context) {
  struct End {
    uint32_t point;
    uint32_t segment;
  };
  std::vector<End> ends;
  ends.reserve(2 * segments.size());
  for (const uint32_t s : segments) {
    ends.push_back({point_of_input[features.ends[2 * size_t{s}]], s});
    ends.push_back({point_of_input[features.ends[2 * size_t{s} + 1]], s});
  }
  WELLSPACE_RETURN_IF_ERROR(CancellableSort(
      ends, [](const End& a, const End& b) { return std::tie(a.point, a.segment) < std::tie(b.point, b.segment); },
      context));
  for (size_t begin = 0, end = 0; begin < ends.size(); begin = end) {
    while (end < ends.size() && ends[end].point == ends[begin].point) {
      ++end;
    }
    if ((end - begin) % 2 != 0) {
      const size_t s = ends[begin].segment;
      const uint32_t first = features.ends[2 * s];
      const uint32_t at = point_of_input[first] == ends[begin].point ? first : features.ends[2 * s + 1];
      return absl::InvalidArgumentError(absl::StrCat(whose(), " not closed: at points[", at, "], an end of segments[",
                                                     s, "], ", end - begin,
                                                     " of its segments end; expected an even number at each point"));
    }
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core
