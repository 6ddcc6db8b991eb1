#include "core/mesh/name_parts.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/simplex/part_numbers.h"

namespace wellspace::core {

void NameParts(const PartNames& names, Mesh& mesh) {
  std::map<std::string, std::string> of_markers;  // by default name
  for (const auto& [marker, name] : names.markers) {
    of_markers.emplace(MarkerName(marker), name);
  }
  for (BoundaryPart& part : mesh.boundary) {
    if (const auto found = of_markers.find(part.name); found != of_markers.end()) {
      part.name = found->second;
    }
  }
  for (Region& region : mesh.regions) {
    const bool is_numbered = region.name == absl::StrCat("region_", region.id);
    if (const auto found = names.regions.find(region.id);
        found != names.regions.end() && (is_numbered || mesh.regions.size() == 1)) {
      region.name = found->second;
    }
  }
}

}  // namespace wellspace::core
