// Triangle's .poly.
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/domain/domain_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/tetgen/poly_points.h"
#include "client/formats/tetgen/poly_seeds.h"
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
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.Finish();  // every later part may be missing
    }
    WELLSPACE_RETURN_IF_ERROR(ReadSegments(line));
    return ReadSeeds();
  }

 private:
  absl::Status ReadPoints();
  absl::Status ReadSegments(std::string_view line);
  absl::Status ReadEnd(FieldSplitter& fields, uint32_t& end);
  absl::Status ReadSeeds();

  LineReader reader_;
  const std::string& path_;
  PlanarDomain& domain_;
  uint64_t index_base_ = 0;  // of the points
};

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
    WELLSPACE_RETURN_IF_ERROR(ExpectNoMore(reader_, fields, what));
    domain_.segments.insert(domain_.segments.end(), ends.begin(), ends.end());
    domain_.markers.push_back(marker);
    domain_.segment_lines.Add(reader_.line_number());
  }
  return absl::OkStatus();
}

absl::Status PolyReader::ReadSeeds() {
  uint64_t with_one_number = 0;
  WELLSPACE_RETURN_IF_ERROR(ReadPolySeeds(reader_, 2, [&](const PolySeed& row) {
    PlanarDomain::Seed seed = {.x = row.at[0], .y = row.at[1], .is_hole = row.is_hole};
    if (!row.is_hole) {
      seed.attribute = row.attribute;
      seed.max_area = row.largest.value_or(std::max(row.attribute, 0.0));  // as Triangle has it
      with_one_number += row.largest.has_value() ? 0 : 1;
    }
    domain_.seeds.push_back(seed);
    domain_.seed_lines.Add(reader_.line_number());
  }));
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
