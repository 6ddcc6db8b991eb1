// The numbers and names of parts of a boundary and of regions in a mesh.
#ifndef WELLSPACE_CORE_SIMPLEX_PART_NUMBERS_H_
#define WELLSPACE_CORE_SIMPLEX_PART_NUMBERS_H_

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"

namespace wellspace::core {

// Gives numbers above 0: parts with one keep theirs, the others get the lowest that are left, in their order.
//
// Complexity: O(n log n).
inline std::map<int64_t, int32_t> NumberAboveZero(const std::set<int64_t>& values) {
  std::map<int64_t, int32_t> numbers;
  int32_t next = 1;
  for (const int64_t value : values) {
    if (value > 0 && value <= std::numeric_limits<int32_t>::max()) {
      numbers[value] = static_cast<int32_t>(value);
    }
  }
  for (const int64_t value : values) {
    if (!numbers.contains(value)) {
      while (values.contains(next)) {
        ++next;
      }
      numbers[value] = next++;
    }
  }
  return numbers;
}

// The name of the part with a marker: "marker_7", and "unmarked" for 0.
inline std::string MarkerName(int64_t marker) { return marker == 0 ? "unmarked" : absl::StrCat("marker_", marker); }

// The name of the region of a seed, or of a face or solid without one: "region_7", and "domain" for 0.
inline std::string RegionName(int64_t region) { return region == 0 ? "domain" : absl::StrCat("region_", region); }

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SIMPLEX_PART_NUMBERS_H_
