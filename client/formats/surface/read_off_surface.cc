// Geomview's OFF: vertices and faces, whose colour may be a marker.
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/io/number.h"
#include "client/formats/off_lines.h"
#include "client/formats/surface/surface_builder.h"
#include "client/formats/surface/surface_readers.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Reads the corners of a face, and its marker if a single whole number is behind them.
absl::Status ReadFace(LineReader& reader, std::string_view line, uint64_t points, std::vector<uint32_t>& corners,
                      int32_t& marker) {
  FieldSplitter fields(line, ' ');
  std::string_view field;
  uint64_t count = 0;
  if (!fields.Next(field) || !ParseUnsigned(field, kMaxCount, count)) {
    return reader.Error(absl::StrCat("expected the number of a face's corners, got ", Quote(field)));
  }
  corners.clear();
  for (uint64_t corner = 0; corner < count; ++corner) {
    uint64_t point = 0;
    if (!fields.Next(field)) {
      return reader.Error(absl::StrCat("expected ", count, " corners, got ", corner));
    }
    if (!ParseUnsigned(field, kMaxCount, point) || point >= points) {
      return reader.Error(
          points == 0 ? absl::StrCat("expected no face, since there are no vertices, got one with ", Quote(field))
                      : absl::StrCat("expected a vertex from 0 to ", points - 1, ", got ", Quote(field)));
    }
    corners.push_back(static_cast<uint32_t>(point));
  }
  marker = 0;
  if (fields.Next(field)) {
    const bool is_marker = ReadMarker(field, marker).ok();
    std::string_view more;
    marker = is_marker && !fields.Next(more) ? marker : 0;
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadOffSurface(InputFile& file, Surface& surface) {
  LineReader reader(std::move(file));
  OffHeader header;
  WELLSPACE_RETURN_IF_ERROR(ReadOffHeader(reader, header));
  if (header.coordinates != 3) {
    return reader.Error(absl::StrCat("expected 3 coordinates, those of a surface, got ", header.coordinates));
  }
  PointCloud cloud;
  cloud.dimension = 3;
  for (uint64_t vertex = 0; vertex < header.vertices; ++vertex) {
    WELLSPACE_RETURN_IF_ERROR(ReadOffVertex(reader, header, vertex, InvalidValue::kRefuse, cloud));
  }
  surface.points = std::move(cloud.points);
  SurfaceBuilder builder(surface);
  std::vector<uint32_t> corners;
  for (uint64_t face = 0; face < header.faces; ++face) {
    std::string_view line;
    if (!reader.NextContent(line)) {
      return reader.EndError(absl::StrCat("expected ", header.faces, " faces, as the header says, got ", face));
    }
    int32_t marker = 0;
    WELLSPACE_RETURN_IF_ERROR(ReadFace(reader, line, surface.point_count(), corners, marker));
    if (absl::Status status = builder.AddPolygon(corners, marker, reader.line_number()); !status.ok()) {
      return reader.Error(std::string(status.message()));
    }
  }
  return reader.Finish();
}

}  // namespace wellspace::formats
