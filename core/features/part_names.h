// Names that the input gives to parts of a boundary and to regions, in the place of the default ones.
#ifndef WELLSPACE_CORE_FEATURES_PART_NAMES_H_
#define WELLSPACE_CORE_FEATURES_PART_NAMES_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace wellspace::core {

struct PartNames {
  std::map<int32_t, std::string> markers;  // by marker: of parts of the boundary
  std::map<int32_t, std::string> regions;  // by region of seeds

  bool IsEmpty() const { return markers.empty() && regions.empty(); }
  bool operator==(const PartNames&) const = default;
};

inline constexpr size_t kMostPartNames = 1000;   // in each of the two
inline constexpr size_t kLongestPartName = 255;  // bytes

// Whether formats and other parts leave the name to the input: it has 1 to kLongestPartName bytes, none of them a
// control character, and it is no default name, such as "marker_7", "region_7", "unmarked" or "domain".
bool IsPartName(const std::string& name);

// Whether the name has digits alone behind its prefix, "marker_" or "region_".
bool IsNumberedName(std::string_view prefix, std::string_view name);

// Errors:     INVALID_ARGUMENT, naming the number, as in "names.markers[7]": a name that is none by IsPartName, or that
//             another number of the same table has; more than kMostPartNames.
absl::Status CheckPartNames(const PartNames& names);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_FEATURES_PART_NAMES_H_
