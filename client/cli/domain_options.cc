#include "client/cli/domain_options.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/remote_command.h"
#include "core/base/status_macros.h"

namespace wellspace::cli {
namespace {

constexpr char kBox[] = "box";
constexpr char kHoles[] = "holes";
constexpr char kEvenOdd[] = "even-odd";

client::FaceRule RuleOf(const std::string& name, formats::PlanarDomain::FaceRule of_file) {
  using FileRule = formats::PlanarDomain::FaceRule;
  if (name == kHoles || (name.empty() && of_file == FileRule::kHoles)) {
    return client::FaceRule::kHoles;
  }
  return name == kEvenOdd || (name.empty() && of_file == FileRule::kEvenOdd) ? client::FaceRule::kEvenOdd
                                                                             : client::FaceRule::kBox;
}

// What the file says of faces and segments, for the server.
absl::StatusOr<client::Features> FeaturesOf(const formats::PlanarDomain& domain, const std::string& faces,
                                            client::CrossingRule crossings) {
  client::Features features;
  features.ends = domain.segments;
  features.markers = domain.markers;
  features.is_open = domain.is_line;
  features.faces = RuleOf(faces, domain.faces);
  features.crossings = crossings;
  for (size_t i = 0; i < domain.seeds.size(); ++i) {
    const formats::PlanarDomain::Seed& seed = domain.seeds[i];
    const bool is_region =
        seed.attribute == std::floor(seed.attribute) && std::abs(seed.attribute) <= std::numeric_limits<int32_t>::max();
    if (!seed.is_hole && !is_region) {
      return absl::InvalidArgumentError(absl::StrCat(domain.SeedOrigin(i), ": the attribute ", seed.attribute,
                                                     " is no region; expected a whole number of 32 bits"));
    }
    features.seeds.push_back({.x = seed.x,
                              .y = seed.y,
                              .is_hole = seed.is_hole,
                              .region = seed.is_hole ? 0 : static_cast<int32_t>(seed.attribute),
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
                  "ones but holes; even-odd, those that an odd number of rings surrounds; default: holes for .poly, "
                  "even-odd for polygons of .geojson, box for lines")
      ->check(CLI::IsMember({kBox, kHoles, kEvenOdd}));
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
  command.add_flag("--snap", snaps_,
                   "Lead segments through points that are too near to them, and leave crossings an error");
}

bool DomainOptions::IsDomain(const std::string& path, const std::string& format) const {
  return has_segments_ || (format.empty() ? formats::IsDomainPath(path) : formats::IsDomainFormat(format));
}

absl::Status DomainOptions::CheckCloud(const std::string& cloud) const {
  const char* const option = !faces_.empty()                     ? "--faces"
                             : splits_crossings_                 ? "--split-crossings"
                             : snaps_                            ? "--snap"
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
  const client::CrossingRule rule = splits_crossings_ ? client::CrossingRule::kSplit
                                    : snaps_          ? client::CrossingRule::kSnap
                                                      : client::CrossingRule::kRefuse;
  WELLSPACE_ASSIGN_OR_RETURN(client::Features features, FeaturesOf(domain, faces_, rule));
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

}  // namespace wellspace::cli
