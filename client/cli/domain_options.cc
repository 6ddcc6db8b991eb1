#include "client/cli/domain_options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/remote_command.h"
#include "client/formats/io/number.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kBox[] = "box";
constexpr char kHoles[] = "holes";
constexpr char kEvenOdd[] = "even-odd";
constexpr char kUnion[] = "union";

client::FaceRule RuleOf(const std::string& name, formats::PlanarDomain::FaceRule of_file) {
  using FileRule = formats::PlanarDomain::FaceRule;
  if (name.empty()) {
    switch (of_file) {
      case FileRule::kBox:
        return client::FaceRule::kBox;
      case FileRule::kHoles:
        return client::FaceRule::kHoles;
      case FileRule::kEvenOdd:
        return client::FaceRule::kEvenOdd;
      case FileRule::kUnion:
        return client::FaceRule::kUnion;
    }
  }
  return name == kHoles     ? client::FaceRule::kHoles
         : name == kEvenOdd ? client::FaceRule::kEvenOdd
         : name == kUnion   ? client::FaceRule::kUnion
                            : client::FaceRule::kBox;
}

bool IsRegionNumber(double attribute) {
  return attribute == std::floor(attribute) && std::abs(attribute) <= std::numeric_limits<int32_t>::max();
}

// The regions of attributes: whole numbers of 32 bits are their own; others get the lowest numbers above 0 that are
// left, in their order, which a note tells.
std::map<double, int32_t> NumberAttributes(const formats::PlanarDomain& domain, std::vector<std::string>& notes) {
  std::map<double, int32_t> numbers;
  std::set<double> others;
  for (const formats::PlanarDomain::Seed& seed : domain.seeds) {
    if (seed.is_hole) {
      continue;
    }
    if (IsRegionNumber(seed.attribute)) {
      numbers[seed.attribute] = static_cast<int32_t>(seed.attribute);
    } else {
      others.insert(seed.attribute);
    }
  }
  constexpr size_t kNamed = 10;
  std::string named;
  int32_t next = 1;
  size_t count = 0;
  for (const double attribute : others) {
    while (numbers.contains(next)) {
      ++next;
    }
    numbers[attribute] = next;
    if (count++ < kNamed) {
      absl::StrAppend(&named, count == 1 ? "" : ", ");
      formats::AppendNumber(attribute, named);
      absl::StrAppend(&named, " region ", next);
    }
  }
  if (count > 0) {
    notes.push_back(absl::StrCat(domain.name, ": attributes that are no whole numbers of 32 bits become regions by ",
                                 "numbers of their own: ", named, count > kNamed ? ", ..." : ""));
  }
  return numbers;
}

// What the file says of faces and segments, for the server.
client::Features FeaturesOf(const formats::PlanarDomain& domain, const std::string& faces,
                            std::vector<std::string>& notes) {
  client::Features features;
  features.ends = domain.segments;
  features.markers = domain.markers;
  features.is_open = domain.is_line;
  features.faces = RuleOf(faces, domain.faces);
  if (features.faces == client::FaceRule::kUnion) {
    features.groups = domain.groups;
  }
  const std::map<double, int32_t> regions = NumberAttributes(domain, notes);
  for (const formats::PlanarDomain::Seed& seed : domain.seeds) {
    features.seeds.push_back({.x = seed.x,
                              .y = seed.y,
                              .is_hole = seed.is_hole,
                              .region = seed.is_hole ? 0 : regions.at(seed.attribute),
                              .max_area = seed.max_area > 0 ? std::optional(seed.max_area) : std::nullopt,
                              .first_segment = seed.first_segment,
                              .segment_count = seed.segment_count});
  }
  return features;
}

}  // namespace

void DomainOptions::AddReadingTo(CLI::App& command, const std::string& what) {
  command.add_flag("--segments", has_segments_,
                   absl::StrCat(what,
                                " is a domain in 2-D: lines of .obj, polylines of .csv, or boundaries of .14 become "
                                "edges of the mesh. Files of .poly, .geojson, .geojsonl, .wkt and .shp always have "
                                "segments"));
  command
      .add_option("--faces", faces_,
                  "Which faces, into which segments cut the plane, are meshed: box, all in the box; holes, all bounded "
                  "ones but holes; even-odd, those that an odd number of rings surrounds; union, those inside of any "
                  "feature, even-odd within each; default: holes for .poly, union for polygons of .geojson, box for "
                  "lines")
      ->check(CLI::IsMember({kBox, kHoles, kEvenOdd, kUnion}));
  command
      .add_option("--region-property", reading_.region_property,
                  "Of .geojson: the property, a whole number, that is the region of the triangles in a polygon")
      ->type_name("NAME");
  command
      .add_option("--id-column", reading_.id_column,
                  "Of polylines in a table: the column, a name or a number from 1, that tells them apart")
      ->type_name("COLUMN");
  command
      .add_option("--marker-property", reading_.marker_property,
                  "Of .geojson: the property, a whole number, that marks the boundary of a feature")
      ->type_name("NAME");
}

void DomainOptions::AddTo(CLI::App& command) {
  AddReadingTo(command, "IN");
  command.add_flag("--split-crossings", splits_crossings_,
                   "Make vertices of the crossings of segments, and lead segments through points that are too near to "
                   "them; default: both are errors");
  AddSnapTo(command,
            "Lead segments through points that are too near to them; with a length, or a share of the longest side of "
            "the points' bounding box, as --snap 0.01%, through all that are nearer than that. Crossings stay errors "
            "but with --split-crossings");
}

void DomainOptions::AddSnapTo(CLI::App& command, const std::string& description) {
  AddLength(command, kSnapOption, snap_, description)->type_name("[LENGTH]");
}

bool DomainOptions::IsDomain(const std::string& path, const std::string& format) const {
  return has_segments_ || (format.empty() ? formats::IsDomainPath(path) : formats::IsDomainFormat(format));
}

absl::Status DomainOptions::CheckCloud(const std::string& cloud) const {
  const char* const option = !faces_.empty()                     ? "--faces"
                             : splits_crossings_                 ? "--split-crossings"
                             : snap_.has_value()                 ? kSnapOption
                             : !reading_.region_property.empty() ? "--region-property"
                             : !reading_.marker_property.empty() ? "--marker-property"
                                                                 : nullptr;
  return option == nullptr ? absl::OkStatus()
                           : absl::InvalidArgumentError(absl::StrCat(
                                 option, ": ", cloud,
                                 " has points alone; give a domain, such as a .poly or .geojson, or --segments"));
}

absl::StatusOr<formats::PointCloud> DomainOptions::Read(const std::string& path, const formats::CloudOptions& options) {
  reading_.format = options.format;
  reading_.columns = options.columns;
  WELLSPACE_ASSIGN_OR_RETURN(formats::PlanarDomain domain, formats::ReadPlanarDomain(path, reading_));
  client::Features features = FeaturesOf(domain, faces_, domain.notes);
  features.crossings = splits_crossings_   ? client::CrossingRule::kSplit
                       : snap_.has_value() ? client::CrossingRule::kSnap
                                           : client::CrossingRule::kRefuse;
  if (snap_.has_value() && snap_->value > 0) {
    features.snap_distance = snap_->Of(domain.points, 2);
  }
  features_ = std::make_shared<const client::Features>(std::move(features));
  formats::PointCloud cloud;
  cloud.name = domain.name;
  cloud.dimension = 2;
  cloud.points = domain.points;
  cloud.notes = domain.notes;
  domain_ = std::move(domain);
  return cloud;
}

absl::Status DomainOptions::WithOrigins(const absl::Status& status, const Before& before) const {
  const formats::PlanarDomain& domain = *domain_;
  absl::Status told = WithPlaces(status, "points[", before.points, domain.point_count(),
                                 [&](uint64_t i) { return domain.PointOrigin(i); });
  told = WithPlaces(told, "segments[", before.features.segments, domain.segment_count(),
                    [&](uint64_t i) { return domain.SegmentOrigin(i); });
  return WithPlaces(told, "seeds[", before.features.seeds, domain.seeds.size(),
                    [&](uint64_t i) { return domain.SeedOrigin(i); });
}

std::vector<std::string> DomainOptions::NotesOf(const std::optional<client::DomainStatistics>& statistics) const {
  if (!statistics.has_value() || statistics->unused_seeds == 0 ||
      statistics->first_unused_seed >= domain_->seeds.size()) {
    return {};
  }
  const formats::PlanarDomain::Seed& seed = domain_->seeds[statistics->first_unused_seed];
  const uint64_t others = statistics->unused_seeds - 1;
  return {absl::StrCat(domain_->SeedOrigin(statistics->first_unused_seed), ": the ", seed.is_hole ? "hole" : "region",
                       " at (", seed.x, ", ", seed.y, ") lies outside of what is meshed, and means nothing",
                       others == 0 ? ""
                                   : absl::StrCat("; and so ", others == 1 ? "does " : "do ", others,
                                                  others == 1 ? " other" : " others"))};
}

}  // namespace wellspace::cli
