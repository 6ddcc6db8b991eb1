// Triangle's .poly.
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/coordinate.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/tetgen/poly_points.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class PolyReader {
 public:
  PolyReader(InputFile& file, const std::string& path, PlanarDomain& domain)
      : reader_(std::move(file)), path_(path), domain_(domain) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadPoints());
    for (auto read : {&PolyReader::ReadSegments, &PolyReader::ReadHoles, &PolyReader::ReadRegions}) {
      std::string_view line;
      if (!reader_.NextContent(line)) {
        return reader_.Finish();  // every later part may be missing
      }
      WELLSPACE_RETURN_IF_ERROR((this->*read)(line));
    }
    WELLSPACE_RETURN_IF_ERROR(ExpectEnd(reader_, regions_, "regions"));
    return reader_.Finish();
  }

 private:
  absl::Status ReadPoints();
  absl::Status ReadSegments(std::string_view line);
  absl::Status ReadEnd(FieldSplitter& fields, uint32_t& end);
  absl::Status ReadHoles(std::string_view line);
  absl::Status ReadRegions(std::string_view line);
  absl::Status ReadSeed(FieldSplitter& fields, PlanarDomain::Seed& seed);
  // An error where the fields of the line go on.
  absl::Status ExpectNoMore(FieldSplitter& fields, std::string_view expected);

  LineReader reader_;
  const std::string& path_;
  PlanarDomain& domain_;
  uint64_t index_base_ = 0;  // of the points
  uint64_t regions_ = 0;
};

absl::Status PolyReader::ExpectNoMore(FieldSplitter& fields, std::string_view expected) {
  std::string_view field;
  return fields.Next(field)
             ? reader_.Error(absl::StrCat("expected ", std::string(expected), ", got also ", Quote(field)))
             : absl::OkStatus();
}

absl::Status PolyReader::ReadPoints() {
  PointCloud cloud;
  NodeExtras extras = {.takes_markers = true, .may_skip = false};
  WELLSPACE_RETURN_IF_ERROR(
      ReadPolyPoints(reader_, path_, 2, "since the domain is one in the plane", cloud, extras, domain_.points_name));
  domain_.points = std::move(cloud.points);
  domain_.point_lines = std::move(cloud.lines);
  domain_.point_markers = std::move(extras.markers);
  index_base_ = extras.index_base;
  return absl::OkStatus();
}

absl::Status PolyReader::ReadEnd(FieldSplitter& fields, uint32_t& end) {
  std::string_view field;
  if (!fields.Next(field)) {
    return reader_.Error("expected an index and two points, got fewer numbers");
  }
  return ReadPolyPoint(reader_, field, index_base_, domain_.point_count(), "segment", end);
}

absl::Status PolyReader::ReadSegments(std::string_view line) {
  std::array<uint64_t, 2> header{};
  constexpr std::array kNames = {"number of segments", "number of markers"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, header));
  const auto [count, markers] = header;
  if (markers > 1) {
    return reader_.Error(absl::StrCat("expected 0 or 1 markers of each segment, got ", markers));
  }
  domain_.segments.reserve(2 * std::min(count, kMaxReserved));
  domain_.markers.reserve(std::min(count, kMaxReserved));
  uint64_t base = 0;
  for (uint64_t segment = 0; segment < count; ++segment) {
    if (!reader_.NextContent(line)) {
      return CountError(reader_, count, "segments", segment);
    }
    FieldSplitter fields(line, ' ');
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, segment, base));
    std::array<uint32_t, 2> ends{};
    for (uint32_t& end : ends) {
      WELLSPACE_RETURN_IF_ERROR(ReadEnd(fields, end));
    }
    int32_t marker = 0;  // may be missing, as it may for Triangle
    if (std::string_view field; markers == 1 && fields.Next(field)) {
      if (absl::Status status = ReadMarker(field, marker); !status.ok()) {
        return reader_.Error(absl::StrCat("marker: ", status.message()));
      }
    }
    const char* what = markers == 1 ? "an index, two points and a marker"
                                    : "an index and two points, and no marker, as the header says";
    WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(fields, what));
    domain_.segments.insert(domain_.segments.end(), ends.begin(), ends.end());
    domain_.markers.push_back(marker);
    domain_.segment_lines.Add(reader_.line_number());
  }
  return absl::OkStatus();
}

absl::Status PolyReader::ReadSeed(FieldSplitter& fields, PlanarDomain::Seed& seed) {
  for (auto [coordinate, name] : {std::pair{&seed.x, "x"}, std::pair{&seed.y, "y"}}) {
    std::string_view field;
    if (!fields.Next(field)) {
      return reader_.Error(absl::StrCat("expected an index, x and y, got no ", name));
    }
    if (absl::Status status = TakeFinite(field, *coordinate); !status.ok()) {
      return reader_.Error(absl::StrCat(name, ": ", status.message()));
    }
  }
  return absl::OkStatus();
}

absl::Status PolyReader::ReadHoles(std::string_view line) {
  std::array<uint64_t, 1> count{};
  constexpr std::array kNames = {"number of holes"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, count));
  uint64_t base = 0;
  for (uint64_t hole = 0; hole < count[0]; ++hole) {
    if (!reader_.NextContent(line)) {
      return CountError(reader_, count[0], "holes", hole);
    }
    FieldSplitter fields(line, ' ');
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, hole, base));
    PlanarDomain::Seed seed = {.is_hole = true};
    WELLSPACE_RETURN_IF_ERROR(ReadSeed(fields, seed));
    WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(fields, "an index, x and y of a hole"));
    domain_.seeds.push_back(seed);
    domain_.seed_lines.Add(reader_.line_number());
  }
  return absl::OkStatus();
}

absl::Status PolyReader::ReadRegions(std::string_view line) {
  constexpr std::array kNames = {"number of regions"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader_, line, 1, kNames, {&regions_, 1}));
  uint64_t base = 0;
  uint64_t with_one_number = 0;
  for (uint64_t region = 0; region < regions_; ++region) {
    if (!reader_.NextContent(line)) {
      return CountError(reader_, regions_, "regions", region);
    }
    FieldSplitter fields(line, ' ');
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader_, fields, region, base));
    PlanarDomain::Seed seed;
    WELLSPACE_RETURN_IF_ERROR(ReadSeed(fields, seed));
    std::string_view field;
    if (!fields.Next(field)) {
      return reader_.Error("expected an index, x, y, an attribute and perhaps a largest area, got no attribute");
    }
    if (absl::Status status = TakeFinite(field, seed.attribute); !status.ok()) {
      return reader_.Error(absl::StrCat("attribute: ", status.message()));
    }
    if (!fields.Next(field)) {
      seed.max_area = seed.attribute;  // as Triangle has it
      ++with_one_number;
    } else if (absl::Status status = TakeFinite(field, seed.max_area); !status.ok()) {
      return reader_.Error(absl::StrCat("largest area: ", status.message()));
    }
    seed.max_area = std::max(seed.max_area, 0.0);  // a negative one is none, as for Triangle
    WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(fields, "an index, x, y, an attribute and a largest area"));
    domain_.seeds.push_back(seed);
    domain_.seed_lines.Add(reader_.line_number());
  }
  if (with_one_number > 0) {
    domain_.notes.push_back(
        absl::StrCat(domain_.name, ": of ", with_one_number, with_one_number == 1 ? " region" : " regions",
                     " the only number is both the attribute and the largest area of a triangle, as Triangle has it"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadPoly(InputFile& file, const std::string& path, PlanarDomain& domain) {
  domain.faces = PlanarDomain::FaceRule::kHoles;
  return PolyReader(file, path, domain).Read();
}

}  // namespace wellspace::formats
