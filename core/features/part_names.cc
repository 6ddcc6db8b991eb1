#include "core/features/part_names.h"

#include <algorithm>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace wellspace::core {
namespace {

absl::Status CheckTable(const std::map<int32_t, std::string>& table, const std::string& field) {
  if (table.size() > kMostPartNames) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ": there are ", table.size(), " names; at most ", kMostPartNames, " are allowed"));
  }
  std::map<std::string_view, int32_t> number_of;
  for (const auto& [number, name] : table) {
    const std::string place = absl::StrCat(field, "[", number, "]");
    if (!IsPartName(name)) {
      return absl::InvalidArgumentError(absl::StrCat(
          place, ": expected a name of 1 to ", kLongestPartName, " bytes without control characters, and none that ",
          "parts have by default, such as marker_7, region_7, unmarked and domain"));
    }
    if (const auto [first, is_new] = number_of.emplace(name, number); !is_new) {
      return absl::InvalidArgumentError(
          absl::StrCat(place, ": it has the name of ", first->second, ", \"", name, "\"; expected a name of its own"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool IsNumberedName(std::string_view prefix, std::string_view name) {
  const std::string_view rest = name.substr(std::min(prefix.size(), name.size()));
  return name.substr(0, prefix.size()) == prefix && !rest.empty() &&
         rest.find_first_not_of("-0123456789") == std::string_view::npos;
}

bool IsPartName(const std::string& name) {
  const auto is_control = [](char c) { return (c >= 0 && c < ' ') || c == 0x7f; };
  // Those of Latin-1, from U+0080 to U+009F.
  const auto is_control_pair = [](char first, char second) {
    return first == '\xc2' && static_cast<unsigned char>(second) >= 0x80 && static_cast<unsigned char>(second) < 0xa0;
  };
  return !name.empty() && name.size() <= kLongestPartName && std::none_of(name.begin(), name.end(), is_control) &&
         std::adjacent_find(name.begin(), name.end(), is_control_pair) == name.end() && name != "unmarked" &&
         name != "domain" && !IsNumberedName("marker_", name) && !IsNumberedName("region_", name);
}

absl::Status CheckPartNames(const PartNames& names) {
  WELLSPACE_RETURN_IF_ERROR(CheckTable(names.markers, "names.markers"));
  return CheckTable(names.regions, "names.regions");
}

}  // namespace wellspace::core
