#include "client/cli/part_name_options.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/printable.h"
#include "core/base/status_macros.h"
#include "core/features/part_names.h"

namespace wellspace::cli {
namespace {

using Table = std::map<int32_t, std::string>;

constexpr char kOfMarkers[] = "--names";
constexpr char kOfRegions[] = "--region-names";

void AddTable(CLI::App& command, const char* option, Table& table, const std::string& description) {
  const auto parse = [&table, option](const std::vector<std::string>& texts) {
    table.clear();
    for (const std::string& text : texts) {
      const size_t equals = text.find('=');
      int32_t number = 0;
      if (equals == std::string::npos || !absl::SimpleAtoi(text.substr(0, equals), &number)) {
        throw CLI::ValidationError(option, absl::StrCat("expected NUMBER=NAME, as in 5=inlet, got ", text));
      }
      if (!table.emplace(number, text.substr(equals + 1)).second) {
        throw CLI::ValidationError(option, absl::StrCat(number, " has a name already; give one for each number"));
      }
    }
  };
  command.add_option_function<std::vector<std::string>>(option, parse, description)
      ->allow_extra_args(false)
      ->type_name("NUMBER=NAME");
}

absl::Status CheckTable(const char* option, const core::PartNames& names) {
  for (const Table* const table : {&names.markers, &names.regions}) {
    for (const auto& [number, name] : *table) {
      if (const std::string shown = client::Printable(name); shown != name) {
        return absl::InvalidArgumentError(absl::StrCat(
            option, ": expected a name in UTF-8 without control characters for ", number, ", got ", shown));
      }
    }
  }
  const absl::Status status = core::CheckPartNames(names);
  return status.ok() ? status : absl::InvalidArgumentError(absl::StrCat(option, ": ", status.message()));
}

void Join(const Table& given, Table& names) {
  for (const auto& [number, name] : given) {
    std::erase_if(names, [&](const auto& row) { return row.second == name; });
    names[number] = name;
  }
}

}  // namespace

void PartNameOptions::AddTo(CLI::App& command) {
  AddTable(command, kOfMarkers, names_.markers,
           "Names of parts of the boundary, by the markers of segments or triangles, in every format of meshes: "
           "5=inlet; may be repeated");
  AddTable(command, kOfRegions, names_.regions, "The same of regions, by their numbers: 7=steel");
}

const char* PartNameOptions::given() const {
  return !names_.markers.empty() ? kOfMarkers : !names_.regions.empty() ? kOfRegions : nullptr;
}

absl::Status PartNameOptions::Check() const {
  WELLSPACE_RETURN_IF_ERROR(CheckTable(kOfMarkers, {.markers = names_.markers, .regions = {}}));
  return CheckTable(kOfRegions, {.markers = {}, .regions = names_.regions});
}

void AddPartNames(const std::map<int32_t, std::string>& of_file, std::map<int32_t, std::string>& names) {
  std::copy_if(of_file.begin(), of_file.end(), std::inserter(names, names.end()), [](const auto& row) {
    return core::IsPartName(row.second) && client::Printable(row.second) == row.second;
  });
}

client::PartNames Joined(client::PartNames of_file, const client::PartNames& given) {
  Join(given.markers, of_file.markers);
  Join(given.regions, of_file.regions);
  return of_file;
}

}  // namespace wellspace::cli
