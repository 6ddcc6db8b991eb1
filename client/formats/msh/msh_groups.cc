#include "client/formats/msh/msh_groups.h"

#include <set>
#include <span>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace wellspace::formats {
namespace {

// The regions that groups are made of: there is one even if nothing is told of regions.
std::vector<Region> RegionsOf(const MeshShape& shape) {
  return shape.regions.empty() ? std::vector<Region>{{.id = 1, .name = "domain"}} : shape.regions;
}

// A name as Gmsh reads it: from its quote to the next one, on a line of which it takes 127 bytes.
constexpr size_t kMaxMshNameBytes = 112;
std::string MshName(std::string_view name, NameChanges& changes) {
  std::string written(CutName(name, kMaxMshNameBytes));
  for (char& c : written) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f' || c == '"') {
      c = '_';
    }
  }
  changes.Add(name, written);
  return written;
}

// The numbers of entities that have these groups: those of the groups where these are positive, others are free ones.
std::map<int32_t, int32_t> Entities(std::span<const int32_t> groups) {
  std::set<int32_t> taken(groups.begin(), groups.end());
  std::map<int32_t, int32_t> entities;
  int32_t free = 1;
  for (const int32_t group : groups) {
    if (group > 0) {
      entities[group] = group;
      continue;
    }
    while (!taken.insert(free).second) {
      ++free;
    }
    entities[group] = free;
  }
  return entities;
}

std::vector<int32_t> NumbersOf(std::span<const BoundaryPart> parts) {
  std::vector<int32_t> numbers;
  for (const BoundaryPart& part : parts) {
    numbers.push_back(part.tag);
  }
  return numbers;
}

std::vector<int32_t> NumbersOf(std::span<const Region> regions) {
  std::vector<int32_t> numbers;
  for (const Region& region : regions) {
    numbers.push_back(region.id);
  }
  return numbers;
}

// Points, curves, surfaces and volumes of a mesh.
constexpr int kMostMshDimension = 3;

}  // namespace

MshGroups::MshGroups(const MeshShape& shape)
    : shape_(shape),
      regions_(RegionsOf(shape)),
      entities_(Entities(NumbersOf(std::span<const Region>(regions_)))),
      part_entities_(Entities(NumbersOf(std::span<const BoundaryPart>(shape.boundary)))) {}

std::string MshGroups::PhysicalNames() {
  if (!has_groups()) {
    return "";
  }
  std::string rows;
  uint64_t count = shape_.boundary.size();
  for (const BoundaryPart& part : shape_.boundary) {
    absl::StrAppend(&rows, shape_.dimension - 1, " ", part.tag, " \"", MshName(part.name, changes_), "\"\n");
  }
  for (const Region& region : regions_) {
    if (region.id != 0 || !region.name.empty()) {
      ++count;
      absl::StrAppend(&rows, shape_.dimension, " ", region.id, " \"", MshName(region.name, changes_), "\"\n");
    }
  }
  return absl::StrCat("$PhysicalNames\n", count, "\n", rows, "$EndPhysicalNames\n");
}

void MshGroups::AppendEntities(std::string& text) const {
  if (!has_groups()) {
    return;
  }
  text += "$Entities\n";
  for (int dimension = 0; dimension <= kMostMshDimension; ++dimension) {
    AppendBytes<uint64_t>(dimension == shape_.dimension       ? regions_.size()
                          : dimension == shape_.dimension - 1 ? shape_.boundary.size()
                                                              : 0,
                          text);
  }
  for (const BoundaryPart& part : shape_.boundary) {
    AppendBytes(part_entities_.at(part.tag), text);
    AppendBoxAndGroup(part.tag, text);
    AppendBytes<uint64_t>(0, text);
  }
  for (const Region& region : regions_) {
    AppendBytes(entities_.at(region.id), text);
    AppendBoxAndGroup(region.id, text);
    // All parts bound the only region. Which of them bound one of several is not known.
    AppendBytes<uint64_t>(shape_.has_simplex_regions ? 0 : shape_.boundary.size(), text);
    for (size_t i = 0; i < shape_.boundary.size() && !shape_.has_simplex_regions; ++i) {
      AppendBytes(part_entities_.at(shape_.boundary[i].tag), text);
    }
  }
  text += "\n$EndEntities\n";
}

void MshGroups::AppendBoxAndGroup(int32_t group, std::string& text) const {
  for (const std::vector<double>* corner : {&shape_.low, &shape_.high}) {
    for (size_t axis = 0; axis < kMostMshDimension; ++axis) {
      AppendBytes(axis < corner->size() ? (*corner)[axis] : 0.0, text);
    }
  }
  AppendBytes<uint64_t>(group == 0 ? 0 : 1, text);
  if (group != 0) {
    AppendBytes(group, text);
  }
}

std::vector<std::string> MshGroups::Notes() const {
  std::vector<std::string> notes;
  if (entities_.begin()->first < 0 || (!part_entities_.empty() && part_entities_.begin()->first < 0)) {
    notes.emplace_back("Gmsh takes the sign of a group's number for a direction, and shows -7 as 7");
  }
  notes.push_back(
      changes_.Note(absl::StrCat("Gmsh reads names of at most ", kMaxMshNameBytes, " bytes, without quotes")));
  return notes;
}

}  // namespace wellspace::formats
