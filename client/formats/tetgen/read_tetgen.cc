// TetGen's and Triangle's .node and .ele.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/mesh_writers.h"
#include "client/formats/names.h"
#include "client/formats/regions.h"
#include "client/formats/tetgen/tetgen.h"
#include "client/formats/tetgen/tetgen_lines.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

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

// "boundary: 1 xmin 2 xmax": the names of tags, as files of 0.1 have them.
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

// "regions: 1 domain, 2 region 7": the names of regions, as files of 0.1 have them.
void TakeRegionNames(std::string_view comment, RegionCollector& collector) {
  absl::string_view rest(comment.data(), comment.size());
  if (!absl::ConsumePrefix(&rest, kRegionsComment)) {
    return;
  }
  for (const absl::string_view name : absl::StrSplit(rest, ',')) {
    const std::pair<absl::string_view, absl::string_view> parts =
        absl::StrSplit(absl::StripLeadingAsciiWhitespace(name), absl::MaxSplits(' ', 1));
    int32_t id = 0;
    if (absl::SimpleAtoi(parts.first, &id)) {
      collector.Name(id, std::string(absl::StripAsciiWhitespace(parts.second)));
    }
  }
}

// A region as the first attribute of a simplex: a whole number of 32 bits, which may be written as 7.0 or 7e0.
bool ParseRegion(std::string_view field, int32_t& region) {
  double value = 0;
  if (!ParseFinite(field, value).ok() || std::abs(value) > std::numeric_limits<int32_t>::max() ||
      value != std::trunc(value)) {
    return false;
  }
  region = static_cast<int32_t>(value);
  return true;
}

// .edge or .face; facets without a marker, and those with 0, are no boundary.
absl::Status ReadFacets(LineReader& reader, uint64_t vertices, uint64_t index_base, Mesh& mesh) {
  std::string_view line;
  FacetSorter sorter;
  reader.OnComment([&sorter](std::string_view comment) { TakeNameLine(comment, &sorter, nullptr); });
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 2> header{};
  const std::array names = {"number of facets", "number of markers"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader, line, 1, names, header));
  TakeNames(reader.comment(), sorter);
  const auto [count, markers] = header;
  uint64_t facet_base = 0;
  std::vector<uint32_t> corners;
  for (uint64_t facet = 0; facet < count; ++facet) {
    if (!reader.NextContent(line)) {
      return CountError(reader, count, "facets", facet);
    }
    FieldSplitter fields(line, ' ');
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader, fields, facet, facet_base));
    corners.clear();
    for (int corner = 0; corner < mesh.dimension; ++corner) {
      WELLSPACE_RETURN_IF_ERROR(TakeNode(reader, fields, vertices, index_base, corners));
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
  RegionCollector regions;
  reader.OnComment([&regions](std::string_view comment) { TakeNameLine(comment, nullptr, &regions); });
  if (!reader.NextContent(line)) {
    return reader.EndError("expected a header, got an empty file");
  }
  std::array<uint64_t, 3> header{};
  const std::array names = {"number of simplices", "number of nodes of each", "number of attributes"};
  WELLSPACE_RETURN_IF_ERROR(ReadHeader(reader, line, 2, names, header));
  bool are_regions = true;  // the first attributes
  TakeRegionNames(reader.comment(), regions);
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
    WELLSPACE_RETURN_IF_ERROR(ReadIndex(reader, fields, simplex, element_base));
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
    int32_t region = 0;
    for (uint64_t attribute = 0; fields.Next(field); ++attribute) {
      are_regions = are_regions && (attribute != 0 || ParseRegion(field, region));
      if (attribute == attributes) {
        return reader.Error(
            absl::StrCat("expected ", corners, " nodes and ", attributes, " attributes, got also ", Quote(field)));
      }
    }
    regions.Add(region);
  }
  if (are_regions) {
    regions.MoveTo(mesh);
  } else {
    mesh.notes.push_back(absl::StrCat(reader.name(), ": the first attributes of the ", what,
                                      " are left out: not all are whole numbers of 32 bits, as regions are"));
  }
  if (attributes > 1 && count > 0) {
    mesh.notes.push_back(absl::StrCat(reader.name(), ": of the attributes of the ", what, " only the first is read"));
  }
  return ExpectEnd(reader, count, what);
}

}  // namespace

absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  NodeNumbers numbers;
  return ReadNode(reader, options, cloud, numbers);
}

absl::Status ReadNode(LineReader& reader, const CloudOptions& options, PointCloud& cloud, NodeNumbers& numbers) {
  NodeHeader header;
  WELLSPACE_RETURN_IF_ERROR(ReadNodeHeader(reader, header));
  if (options.dimension != 0 && static_cast<int>(header.dimension) != options.dimension) {
    return reader.Error(absl::StrCat("expected dimension ", options.dimension, ", got ", header.dimension,
                                     static_cast<int>(header.dimension) > options.dimension
                                         ? absl::StrCat(": ", DimensionError(options.dimension, header.dimension))
                                         : ""));
  }
  NodeExtras extras;
  WELLSPACE_RETURN_IF_ERROR(ReadNodePoints(reader, header, options.skip_invalid, cloud, extras));
  numbers = {.index_base = extras.index_base, .weights = std::move(extras.weights), .has_markers = header.markers > 0};
  return ExpectEnd(reader, header.count, "points");
}

absl::StatusOr<Mesh> ReadNodeAndEle(const std::string& path, const MeshNumbers& /*numbers*/) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile node_file, InputFile::Open(WithExtension(path, ".node")));
  WELLSPACE_ASSIGN_OR_RETURN(InputFile ele_file, InputFile::Open(WithExtension(path, ".ele")));
  PointCloud cloud;
  NodeNumbers numbers;
  LineReader nodes(std::move(node_file));
  WELLSPACE_RETURN_IF_ERROR(ReadNode(nodes, {}, cloud, numbers));
  Mesh mesh{.dimension = cloud.dimension,
            .points = std::move(cloud.points),
            .simplices = {},
            .weights = std::move(numbers.weights)};
  LineReader simplices(std::move(ele_file));
  WELLSPACE_RETURN_IF_ERROR(ReadEle(simplices, mesh.View().vertex_count(), numbers.index_base, mesh));
  // Without markers in .node, a file of facets that lies there may be another mesh's.
  if (absl::StatusOr<InputFile> facet_file = InputFile::Open(BoundaryFilesOf(path, mesh.dimension).front());
      numbers.has_markers && facet_file.ok()) {
    LineReader facets(*std::move(facet_file));
    WELLSPACE_RETURN_IF_ERROR(ReadFacets(facets, mesh.View().vertex_count(), numbers.index_base, mesh));
  } else if (numbers.has_markers && !absl::IsNotFound(facet_file.status())) {
    return facet_file.status();
  }
  return mesh;
}

}  // namespace wellspace::formats
