// Every reader of planar domains, on any text.
//
// Input: a character that chooses among kChoices, '0' the first, '1' the second and so on; for one with a .node file
// beside it that file, after a length of two bytes, low one first; the file.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/domain/read_planar_domain.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/scratch_folder.h"
#include "tests/support/planar_domain_text.h"

namespace wellspace::fuzz {
namespace {

using formats::DomainOptions;
using formats::PlanarDomain;

struct Choice {
  const char* format;
  bool has_node = false;
  bool has_properties = false;
  bool has_columns = false;
};
constexpr std::array kChoices = {
    Choice{"poly"},
    Choice{"poly", true},
    Choice{"geojson"},
    Choice{"geojson", false, true},
    Choice{"obj"},
    Choice{"csv"},
    Choice{"csv", false, false, true},
    // From '7' on.
    Choice{"geojsonl", false, true},
    Choice{"wkt"},
    Choice{"shp"},
    Choice{"adcirc"},
};

bool AreSameBits(const std::vector<double>& a, const std::vector<double>& b) {
  bool are_same = a.size() == b.size();
  for (size_t i = 0; are_same && i < a.size(); ++i) {
    are_same = std::bit_cast<uint64_t>(a[i]) == std::bit_cast<uint64_t>(b[i]);
  }
  return are_same;
}

// An origin names the file and a line of it, or a path.
void RequireOrigin(const std::string& origin) {
  RequireClearMessage(origin);
  const size_t name = origin.find("domain.");
  Require(name != std::string::npos && origin.find(':', name) != std::string::npos, "an origin has a line:", origin);
}

void RequireDomain(const PlanarDomain& domain) {
  Require(domain.point_count() > 0 && domain.points.size() % 2 == 0, "points have two coordinates");
  for (const double x : domain.points) {
    Require(std::isfinite(x), "coordinates are finite");
  }
  Require(domain.segments.size() % 2 == 0, "segments have two ends");
  for (const uint32_t end : domain.segments) {
    Require(end < domain.point_count(), "the ends of segments are points");
  }
  Require(domain.markers.size() == domain.segment_count(), "every segment has a marker");
  Require(domain.point_markers.empty() || domain.point_markers.size() == domain.point_count(),
          "every point has a marker, or none");
  Require(domain.is_line.empty() || domain.is_line.size() == domain.segment_count(),
          "every segment is of a line or not");
  Require(domain.groups.empty() || domain.groups.size() == domain.segment_count(),
          "every segment has a group, or none");
  bool has_region = false;
  for (const PlanarDomain::Seed& seed : domain.seeds) {
    Require(std::isfinite(seed.x) && std::isfinite(seed.y) && std::isfinite(seed.attribute), "seeds are finite");
    Require(seed.max_area >= 0 && std::isfinite(seed.max_area), "areas are finite, and not negative");
    Require(seed.first_segment <= domain.segment_count() &&
                seed.segment_count <= domain.segment_count() - seed.first_segment,
            "polygons have segments that are there");
    Require(!seed.is_hole || !has_region, "holes come before regions");
    has_region |= !seed.is_hole;
  }
  for (uint64_t i = 0; i < domain.point_count(); ++i) {
    RequireOrigin(domain.PointOrigin(i));
  }
  for (uint64_t i = 0; i < domain.segment_count(); ++i) {
    RequireOrigin(domain.SegmentOrigin(i));
  }
  for (uint64_t i = 0; i < domain.seeds.size(); ++i) {
    RequireOrigin(domain.SeedOrigin(i));
  }
  for (const std::string& note : domain.notes) {
    RequireClearMessage(note);
  }
}

void RequireSameFromPoly(const PlanarDomain& domain) {
  const std::string text = test::NodeText(domain, 1) + test::PolyTailText(domain, 1);
  const auto again = formats::ReadPlanarDomain(ScratchFolder::Get().Write("again.poly", text));
  Require(again.ok(), "a domain can be written and read again:", again.status().ToString());
  Require(AreSameBits(again->points, domain.points) && again->point_markers == domain.point_markers,
          "points read back to the bit");
  Require(again->segments == domain.segments && again->markers == domain.markers, "segments read back");
  // There is no place for polygons.
  const bool has_polygons = std::any_of(domain.seeds.begin(), domain.seeds.end(),
                                        [](const PlanarDomain::Seed& seed) { return seed.segment_count > 0; });
  Require(has_polygons || again->seeds == domain.seeds, "seeds read back");
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace wellspace;
  fuzz::ByteReader bytes(data, size);
  const fuzz::Choice& choice = fuzz::kChoices[static_cast<uint8_t>(bytes.Next() - '0') % fuzz::kChoices.size()];
  const formats::DomainOptions options = {
      .format = choice.format,
      .region_property = choice.has_properties ? "a" : "",
      .marker_property = choice.has_properties ? "b" : "",
      .columns = choice.has_columns ? std::vector<std::string>{"1", "2"} : std::vector<std::string>{},
      .id_column = choice.has_columns ? "3" : ""};
  const fuzz::ScratchFolder& folder = fuzz::ScratchFolder::Get();
  folder.Write("domain.node", choice.has_node ? bytes.TakeBlock() : "");
  const std::string path = folder.Write("domain.any", bytes.TakeText());
  const auto domain = formats::ReadPlanarDomain(path, options);
  if (!domain.ok()) {
    fuzz::Require(domain.status().code() == absl::StatusCode::kInvalidArgument,
                  "a bad file is an INVALID_ARGUMENT:", domain.status().ToString());
    fuzz::RequireClearMessage({domain.status().message().data(), domain.status().message().size()});
    return 0;
  }
  fuzz::RequireDomain(*domain);
  fuzz::RequireSameFromPoly(*domain);
  return 0;
}
