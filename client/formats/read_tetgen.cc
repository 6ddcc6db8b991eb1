// TetGen's and Triangle's .node and .ele.
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/number.h"

namespace wellspace::formats {
namespace {

// What a header says is not believed: more is reserved only as more lines arrive.
constexpr uint64_t kMaxReserved = 1 << 16;

constexpr uint64_t kMaxHeaderValue = std::numeric_limits<uint32_t>::max();

// The unsigned numbers of a header line; those that are missing stay 0.
template <size_t N>
absl::Status ReadHeader(LineReader& reader, std::string_view line, size_t required,
                        const std::array<const char*, N>& names, std::array<uint64_t, N>& values) {
  FieldSplitter fields(line, ' ');
  std::string_view field;
  size_t count = 0;
  while (fields.Next(field)) {
    if (count == N) {
      return reader.Error(absl::StrCat("expected at most ", N, " numbers in the header, got also ", Quote(field)));
    }
    if (!ParseUnsigned(field, kMaxHeaderValue, values[count])) {
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

// Reads the index at the start of a line. That of the first line, 0 or 1, is the base of the others.
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

// A node at the start of `fields`, as an index from 0 on.
absl::Status TakeNode(LineReader& reader, FieldSplitter& fields, uint64_t vertices, uint64_t index_base,
                      std::vector<uint32_t>& corners) {
  std::string_view field;
  fields.Next(field);
  uint64_t node = 0;
  if (!ParseUnsigned(field, std::numeric_limits<uint32_t>::max(), node) || node < index_base ||
      node - index_base >= vertices) {
    return reader.Error(
        absl::StrCat("expected a node from ", index_base, " to below ", vertices + index_base, ", got ", Quote(field)));
  }
  corners.push_back(static_cast<uint32_t>(node - index_base));
  return absl::OkStatus();
}

// "boundary: 1 xmin 2 xmax": the names of tags.
void TakeNames(std::string_view comment, FacetSorter& sorter) {
  FieldSplitter fields(comment, ' ');
  std::string_view tag;
  std::string_view name;
  if (!fields.Next(tag) || tag != kBoundaryComment) {
    return;
  }
  int32_t number = 0;
  while (fields.Next(tag) && fields.Next(name) &&
         absl::SimpleAtoi(absl::string_view(tag.data(), tag.size()), &number)) {
    sorter.Name(number, std::string(name));
  }
}

// .edge or .face; facets without a marker, and those with 0, are no boundary.
absl::Status ReadFacets(LineReader& reader, uint64_t vertices, uint64_t index_base, Mesh& mesh) {
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 2> header{};
  const std::array names = {"number of facets", "number of markers"};
  if (absl::Status status = ReadHeader<2>(reader, line, 1, names, header); !status.ok()) {
    return status;
  }
  FacetSorter sorter;
  TakeNames(reader.comment(), sorter);
  const auto [count, markers] = header;
  uint64_t facet_base = 0;
  std::vector<uint32_t> corners;
  for (uint64_t facet = 0; facet < count; ++facet) {
    if (!reader.NextContent(line)) {
      return CountError(reader, count, "facets", facet);
    }
    FieldSplitter fields(line, ' ');
    if (absl::Status status = ReadIndex(reader, fields, facet, facet_base); !status.ok()) {
      return status;
    }
    corners.clear();
    for (int corner = 0; corner < mesh.dimension; ++corner) {
      if (absl::Status status = TakeNode(reader, fields, vertices, index_base, corners); !status.ok()) {
        return status;
      }
    }
    std::string_view field;
    int32_t tag = 0;
    if (markers > 0 && fields.Next(field) && !absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &tag)) {
      return reader.Error(absl::StrCat("expected a marker, a whole number, got ", Quote(field)));
    }
    sorter.Add(corners, tag);
  }
  sorter.MoveTo(mesh);
  return ExpectEnd(reader, count, "facets");
}

absl::Status ReadEle(LineReader& reader, uint64_t vertices, uint64_t index_base, Mesh& mesh) {
  const uint64_t corners = mesh.dimension + 1;
  const char* what = SimplexName(mesh.dimension);
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 3> header{};
  const std::array names = {"number of simplices", "number of nodes of each", "number of attributes"};
  if (absl::Status status = ReadHeader<3>(reader, line, 2, names, header); !status.ok()) {
    return status;
  }
  const auto [count, nodes, attributes] = header;
  if (nodes != corners) {
    return reader.Error(absl::StrCat("expected ", corners, " nodes for each of the ", what, ", got ", nodes));
  }
  mesh.simplices.reserve(std::min(count, kMaxReserved) * corners);
  uint64_t element_base = 0;
  for (uint64_t simplex = 0; simplex < count; ++simplex) {
    if (!reader.NextContent(line)) {
      return CountError(reader, count, what, simplex);
    }
    FieldSplitter fields(line, ' ');
    if (absl::Status status = ReadIndex(reader, fields, simplex, element_base); !status.ok()) {
      return status;
    }
    std::string_view field;
    for (uint64_t corner = 0; corner < corners; ++corner) {
      if (!fields.Next(field)) {
        return reader.Error(absl::StrCat("expected ", corners, " nodes, got ", corner));
      }
      uint64_t node = 0;
      if (!ParseUnsigned(field, std::numeric_limits<uint32_t>::max(), node) || node < index_base ||
          node - index_base >= vertices) {
        return reader.Error(absl::StrCat("expected a node from ", index_base, " to below ", vertices + index_base,
                                         ", got ", Quote(field)));
      }
      mesh.simplices.push_back(static_cast<uint32_t>(node - index_base));
    }
    for (uint64_t attribute = 0; fields.Next(field); ++attribute) {
      if (attribute == attributes) {
        return reader.Error(
            absl::StrCat("expected ", corners, " nodes and ", attributes, " attributes, got also ", Quote(field)));
      }
    }
  }
  return ExpectEnd(reader, count, what);
}

}  // namespace

absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  NodeExtras extras;
  return ReadNode(reader, options, cloud, extras);
}

absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud, NodeExtras& extras) {
  auto& [index_base, weights, has_markers] = extras;
  std::string_view line;
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 4> header{};
  const std::array names = {"number of points", "dimension", "number of attributes", "number of markers"};
  if (absl::Status status = ReadHeader<4>(reader, line, 2, names, header); !status.ok()) {
    return status;
  }
  const auto [count, columns, attributes, markers] = header;
  if (columns < kMinDimension || columns > kMaxDimension) {
    return reader.Error(
        absl::StrCat("expected a dimension from ", kMinDimension, " to ", kMaxDimension, ", got ", columns));
  }
  if (options.dimension != 0 && static_cast<int>(columns) != options.dimension) {
    return reader.Error(absl::StrCat("expected dimension ", options.dimension, ", got ", columns,
                                     static_cast<int>(columns) > options.dimension
                                         ? absl::StrCat(": ", DimensionError(options.dimension, columns))
                                         : ""));
  }
  const bool has_weights = attributes == 1 && reader.comment() == kWeightsComment;
  has_markers = markers > 0;
  cloud.dimension = static_cast<int>(columns);
  cloud.points.reserve(std::min(count, kMaxReserved) * columns);
  for (uint64_t point = 0; point < count; ++point) {
    if (!reader.NextContent(line)) {
      return CountError(reader, count, "points", point);
    }
    FieldSplitter fields(line, ' ');
    if (absl::Status status = ReadIndex(reader, fields, point, index_base); !status.ok()) {
      return status;
    }
    std::string_view field;
    std::array<double, kMaxDimension> coordinates;
    bool is_invalid = false;
    for (uint64_t axis = 0; axis < columns; ++axis) {
      if (!fields.Next(field)) {
        return reader.Error(absl::StrCat("expected ", columns, " coordinates, got ", axis));
      }
      if (absl::Status status = TakeCoordinate(field, options.skip_invalid, coordinates[axis], is_invalid);
          !status.ok()) {
        return reader.Error(absl::StrCat("coordinate ", axis + 1, ": ", status.message()));
      }
    }
    // Attributes and markers may be missing, as they may for TetGen, but there must not be more than announced.
    for (uint64_t extra = 0; fields.Next(field); ++extra) {
      if (has_weights && extra == 0) {
        double value = 0;
        if (absl::Status status = ParseFinite(field, value); !status.ok()) {
          return reader.Error(absl::StrCat("weight: ", status.message()));
        }
        weights.push_back(value);
      }
      if (extra == attributes + markers) {
        return reader.Error(absl::StrCat("expected ", columns, " coordinates and ", extra,
                                         " attributes and markers, as the header says, got also ", Quote(field)));
      }
    }
    if (has_weights && weights.size() != point + 1) {
      return reader.Error("expected a weight after the coordinates, as the header says, got none");
    }
    AddPoint({coordinates.data(), columns}, is_invalid, reader.line_number(), cloud);
  }
  return ExpectEnd(reader, count, "points");
}

absl::StatusOr<Mesh> ReadNodeAndEle(const std::string& path) {
  absl::StatusOr<InputFile> node_file = InputFile::Open(WithExtension(path, ".node"));
  if (!node_file.ok()) {
    return node_file.status();
  }
  absl::StatusOr<InputFile> ele_file = InputFile::Open(WithExtension(path, ".ele"));
  if (!ele_file.ok()) {
    return ele_file.status();
  }
  PointCloud cloud;
  NodeExtras extras;
  LineReader nodes(*std::move(node_file));
  if (absl::Status status = ReadNode(nodes, {}, cloud, extras); !status.ok()) {
    return status;
  }
  Mesh mesh{.dimension = cloud.dimension,
            .points = std::move(cloud.points),
            .simplices = {},
            .weights = std::move(extras.weights)};
  LineReader simplices(*std::move(ele_file));
  if (absl::Status status = ReadEle(simplices, mesh.View().vertex_count(), extras.index_base, mesh); !status.ok()) {
    return status;
  }
  // Without markers in .node, a file of facets that lies there may be another mesh's.
  if (absl::StatusOr<InputFile> facet_file = InputFile::Open(BoundaryFilesOf(path, mesh.dimension).front());
      extras.has_markers && facet_file.ok()) {
    LineReader facets(*std::move(facet_file));
    if (absl::Status status = ReadFacets(facets, mesh.View().vertex_count(), extras.index_base, mesh); !status.ok()) {
      return status;
    }
  } else if (extras.has_markers && !absl::IsNotFound(facet_file.status())) {
    return facet_file.status();
  }
  return mesh;
}

}  // namespace wellspace::formats
