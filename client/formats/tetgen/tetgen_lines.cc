#include "client/formats/tetgen/tetgen_lines.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/tetgen/tetgen.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The columns behind the coordinates of a point. Attributes and markers may be missing, as they may for TetGen, but
// there must not be more than announced.
absl::Status ReadExtras(LineReader& reader, const NodeHeader& header, uint64_t point, FieldSplitter& fields,
                        NodeExtras& extras) {
  int32_t marker = 0;
  std::string_view field;
  for (uint64_t extra = 0; fields.Next(field); ++extra) {
    if (header.has_weights && extra == 0) {
      double value = 0;
      if (absl::Status status = ParseFinite(field, value); !status.ok()) {
        return reader.Error(absl::StrCat("weight: ", status.message()));
      }
      extras.weights.push_back(value);
    }
    if (extra == header.attributes + header.markers) {
      return reader.Error(absl::StrCat("expected ", header.dimension, " coordinates and ", extra,
                                       " attributes and markers, as the header says, got also ", Quote(field)));
    }
    if (extras.takes_markers && extra == header.attributes) {
      if (absl::Status status = ReadMarker(field, marker); !status.ok()) {
        return reader.Error(absl::StrCat("marker: ", status.message()));
      }
    }
  }
  if (header.has_weights && extras.weights.size() != point + 1) {
    return reader.Error("expected a weight after the coordinates, as the header says, got none");
  }
  if (extras.takes_markers && header.markers > 0) {
    extras.markers.push_back(marker);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadHeader(LineReader& reader, std::string_view line, size_t required, std::span<const char* const> names,
                        std::span<uint64_t> values) {
  FieldSplitter fields(line, ' ');
  std::string_view field;
  size_t count = 0;
  while (fields.Next(field)) {
    if (count == names.size()) {
      return reader.Error(absl::StrCat("expected at most ", names.size(), " number", names.size() == 1 ? "" : "s",
                                       " in the header, got also ", Quote(field)));
    }
    if (!ParseUnsigned(field, kMaxCount, values[count])) {
      return reader.Error(
          absl::StrCat("expected the ", names[count], ", a whole number below 2^32, got ", Quote(field)));
    }
    ++count;
  }
  if (count < required) {
    return reader.Error(absl::StrCat("expected the ", names[count], " in the header, got only ", count, " number",
                                     count == 1 ? "" : "s"));
  }
  return absl::OkStatus();
}

absl::Status ReadIndex(LineReader& reader, FieldSplitter& fields, uint64_t position, uint64_t& index_base) {
  std::string_view field;
  fields.Next(field);
  uint64_t index = 0;
  const bool is_number = ParseUnsigned(field, std::numeric_limits<uint64_t>::max(), index);
  if (position == 0) {
    if (!is_number || index > 1) {
      return reader.Error(absl::StrCat("expected index 0 or 1, got ", Quote(field)));
    }
    index_base = index;
  } else if (!is_number || index != position + index_base) {
    return reader.Error(absl::StrCat("expected index ", position + index_base, ", got ", Quote(field)));
  }
  return absl::OkStatus();
}

absl::Status ReadMarker(std::string_view text, int32_t& marker) {
  const char* end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, marker);
  if (result.ec != std::errc() || result.ptr != end) {
    return absl::InvalidArgumentError(
        absl::StrCat("expected a whole number from -2^31 to below 2^31, got ", Quote(text)));
  }
  return absl::OkStatus();
}

absl::Status CountError(LineReader& reader, uint64_t count, const char* what, uint64_t got) {
  if (!reader.status().ok()) {
    return reader.status();
  }
  return reader.Error(absl::StrCat("expected ", count, " ", what, ", as the header says, got ", got));
}

absl::Status ExpectEnd(LineReader& reader, uint64_t count, const char* what) {
  std::string_view line;
  if (reader.NextContent(line)) {
    return reader.Error(absl::StrCat("expected the end of the file after ", count, " ", what,
                                     ", as the header says, got ", Quote(line)));
  }
  return reader.status();
}

absl::Status ExpectNoMore(LineReader& reader, FieldSplitter& fields, std::string_view expected) {
  std::string_view field;
  return fields.Next(field)
             ? reader.Error(absl::StrCat("expected ", std::string(expected), ", got also ", Quote(field)))
             : absl::OkStatus();
}

absl::Status ReadNodeHeader(LineReader& reader, NodeHeader& header) {
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 4> values{};
  constexpr std::array kNames = {"number of points", "dimension", "number of attributes", "number of markers"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader, line, 2, kNames, values));
  header = {.count = values[0],
            .dimension = values[1],
            .attributes = values[2],
            .markers = values[3],
            .has_weights = values[2] == 1 && reader.comment() == kWeightsComment};
  if (header.dimension < kMinDimension || header.dimension > kMaxDimension) {
    return reader.Error(
        absl::StrCat("expected a dimension from ", kMinDimension, " to ", kMaxDimension, ", got ", header.dimension));
  }
  return absl::OkStatus();
}

absl::Status ReadNodePoints(LineReader& reader, const NodeHeader& header, bool skip_invalid, PointCloud& cloud,
                            NodeExtras& extras) {
  cloud.dimension = static_cast<int>(header.dimension);
  cloud.points.reserve(std::min(header.count, kMaxReserved) * header.dimension);
  for (uint64_t point = 0; point < header.count; ++point) {
    std::string_view line;
    if (!reader.NextContent(line)) {
      return CountError(reader, header.count, "points", point);
    }
    FieldSplitter fields(line, ' ');
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader, fields, point, extras.index_base));
    std::string_view field;
    std::array<double, kMaxDimension> coordinates;
    bool is_invalid = false;
    for (uint64_t axis = 0; axis < header.dimension; ++axis) {
      if (!fields.Next(field)) {
        return reader.Error(absl::StrCat("expected ", header.dimension, " coordinates, got ", axis));
      }
      const absl::Status status = extras.may_skip ? TakeCoordinate(field, skip_invalid, coordinates[axis], is_invalid)
                                                  : TakeFinite(field, coordinates[axis]);
      if (!status.ok()) {
        return reader.Error(absl::StrCat("coordinate ", axis + 1, ": ", status.message()));
      }
    }
    WELLSPACE_RETURN_IF_ERROR(ReadExtras(reader, header, point, fields, extras));
    AddPoint({coordinates.data(), header.dimension}, is_invalid, reader.line_number(), cloud);
  }
  return absl::OkStatus();
}

}  // namespace wellspace::formats
