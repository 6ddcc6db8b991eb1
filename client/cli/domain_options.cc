#include "client/cli/domain_options.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/face_rules.h"
#include "client/cli/part_name_options.h"
#include "client/cli/remote_command.h"
#include "client/error_details.h"
#include "client/files/domain_features.h"
#include "client/files/region_numbers.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

// Errors of the core name rules; users of the tool know them as options.
absl::Status WithOptions(const absl::Status& status) {
  std::string message(status.message());
  for (const auto& [rule, option] : {std::pair("the rule of crossings \"split\"", "--split-crossings"),
                                     std::pair("the rule of crossings \"snap\"", kSnapOption)}) {
    if (const size_t at = message.find(rule); at != std::string::npos) {
      message.replace(at, std::string_view(rule).size(), option);
    }
  }
  return client::WithMessage(status, message);
}

// The rule of --faces; none: that of the file.
std::optional<client::FaceRule> RuleOf(const std::string& name) {
  return name.empty() ? std::nullopt : std::optional(FaceRuleOf(name));
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
      ->check(CLI::IsMember(FaceRuleNames()));
  command
      .add_option(
          "--region-property", reading_.region_property,
          "Of .geojson: the property, a whole number or a name, that is the region of the triangles in a polygon")
      ->type_name("NAME");
  command
      .add_option("--id-column", reading_.id_column,
                  "Of polylines in a table: the column, a name or a number from 1, that tells them apart")
      ->type_name("COLUMN");
  command
      .add_option("--marker-property", reading_.marker_property,
                  "Of .geojson: the property, a whole number or a name, that marks the boundary of a feature")
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
  return CheckOther(
      absl::StrCat(cloud, " has points alone; give a domain, such as a .poly or .geojson, or --segments"));
}

absl::Status DomainOptions::CheckOther(const std::string& what) const {
  const char* const option = !faces_.empty()                     ? "--faces"
                             : splits_crossings_                 ? "--split-crossings"
                             : snap_.has_value()                 ? kSnapOption
                             : !reading_.region_property.empty() ? "--region-property"
                             : !reading_.marker_property.empty() ? "--marker-property"
                                                                 : nullptr;
  return option == nullptr ? absl::OkStatus() : absl::InvalidArgumentError(absl::StrCat(option, ": ", what));
}

absl::StatusOr<formats::PointCloud> DomainOptions::Read(const std::string& path, const formats::CloudOptions& options) {
  reading_.format = options.format;
  reading_.columns = options.columns;
  WELLSPACE_ASSIGN_OR_RETURN(formats::PlanarDomain domain, formats::ReadPlanarDomain(path, reading_));
  client::Features features = client::FeaturesOf(domain, RuleOf(faces_), domain.notes);
  features.crossings = splits_crossings_   ? client::CrossingRule::kSplit
                       : snap_.has_value() ? client::CrossingRule::kSnap
                                           : client::CrossingRule::kRefuse;
  if (snap_.has_value() && snap_->value > 0) {
    features.snap_distance = snap_->Of(domain.points, 2);
  }
  AddPartNames(domain.marker_names, features.names.markers);
  AddPartNames(domain.region_names, features.names.regions);
  features.names = Joined(std::move(features.names), names_);
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
  absl::Status told = WithPlaces(WithOptions(status), "points[", before.points, domain.point_count(),
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
  return {client::UnusedSeedNote(domain_->SeedOrigin(statistics->first_unused_seed), seed.is_hole,
                                 absl::StrCat(seed.x, ", ", seed.y), statistics->unused_seeds)};
}

}  // namespace wellspace::cli
