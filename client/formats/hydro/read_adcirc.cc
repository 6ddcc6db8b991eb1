// ADCIRC's grids as meshes and as points.
#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/coordinate.h"
#include "client/formats/hydro/adcirc.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/names.h"
#include "client/formats/point_rows.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr std::string_view kOpenName = "open";
constexpr std::string_view kLandName = "land ";
constexpr std::string_view kIslandName = "island ";
constexpr std::string_view kTypeName = "type ";

bool IsIsland(int32_t type) { return type == 1 || type == 11 || type == 21; }

// Types with a second row of nodes beside the first.
bool IsBarrier(int32_t type) { return type == 4 || type == 5 || type == 24 || type == 25 || type == 64; }

class AdcircReader {
 public:
  AdcircReader(LineReader& reader, bool skips_invalid, AdcircGrid& grid)
      : reader_(reader), skips_invalid_(skips_invalid), grid_(grid) {}

  absl::Status Read(AdcircPart part) {
    std::string_view title;
    if (!reader_.Next(title)) {
      return reader_.EndError("expected a title, got an empty file");
    }
    uint64_t elements = 0;
    WELLSPACE_RETURN_IF_ERROR(NextLine("the numbers of elements and nodes"));
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("the number of elements", kMaxCount, elements));
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("the number of nodes", kMaxCount, nodes_));
    for (uint64_t node = 0; node < nodes_; ++node) {
      WELLSPACE_RETURN_IF_ERROR(ReadNode(node));
    }
    if (part == AdcircPart::kNodes) {
      return absl::OkStatus();
    }
    for (uint64_t element = 0; element < elements; ++element) {
      WELLSPACE_RETURN_IF_ERROR(ReadElement(element, part == AdcircPart::kAll));
    }
    for (const bool is_open : {true, false}) {
      WELLSPACE_RETURN_IF_ERROR(ReadBoundaries(is_open));
    }
    return reader_.status();
  }

 private:
  absl::Status NextLine(std::string_view what) {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.EndError(absl::StrCat("the file ends; expected ", std::string(what)));
    }
    rest_ = line;
    return absl::OkStatus();
  }

  // The next field of the line; empty at its end.
  std::string_view Field() {
    constexpr std::string_view kBlanks = " \t,";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
    const std::string_view field = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(field.size());
    return field;
  }

  absl::Status TakeWhole(const char* what, uint64_t limit, uint64_t& value) {
    const std::string_view field = Field();
    return ParseUnsigned(field, limit, value)
               ? absl::OkStatus()
               : reader_.Error(
                     absl::StrCat("expected ", what, ", a whole number of at most ", limit, ", got ", Quote(field)));
  }

  absl::Status TakeNode(uint32_t& node) {
    uint64_t number = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("a node from 1 on", nodes_, number));
    if (number == 0) {
      return reader_.Error("expected a node from 1 on, got 0");
    }
    node = static_cast<uint32_t>(number - 1);
    return absl::OkStatus();
  }

  // Nodes and elements are numbered from 1 on, in order.
  absl::Status TakeNumberOf(const char* what, uint64_t index) {
    uint64_t number = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeWhole(what, kMaxCount, number));
    return number == index + 1 ? absl::OkStatus()
                               : reader_.Error(absl::StrCat("expected ", what, " ", index + 1,
                                                            ", as they follow each other, got ", number));
  }

  absl::Status ReadNode(uint64_t node) {
    WELLSPACE_RETURN_IF_ERROR(NextLine("a node"));
    WELLSPACE_RETURN_IF_ERROR(TakeNumberOf("node", node));
    std::array<double, 3> values{};
    constexpr std::array kNames = {"x", "y", "depth"};
    for (size_t i = 0; i < values.size(); ++i) {
      if (absl::Status status = TakeCoordinate(Field(), skips_invalid_ || i == 2, values[i]); !status.ok()) {
        return reader_.Error(absl::StrCat(kNames[i], " of a node: ", status.message()));
      }
    }
    grid_.points.insert(grid_.points.end(), values.begin(), values.begin() + 2);
    grid_.depths.push_back(values[2]);
    return absl::OkStatus();
  }

  absl::Status ReadElement(uint64_t element, bool is_wanted) {
    WELLSPACE_RETURN_IF_ERROR(NextLine("an element"));
    if (!is_wanted) {
      return absl::OkStatus();
    }
    WELLSPACE_RETURN_IF_ERROR(TakeNumberOf("element", element));
    uint64_t corners = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("the number of nodes of an element", kMaxCount, corners));
    if (corners != 3) {
      return reader_.Error(absl::StrCat("expected triangles, of 3 nodes, got an element of ", corners));
    }
    for (int i = 0; i < 3; ++i) {
      WELLSPACE_RETURN_IF_ERROR(TakeNode(grid_.triangles.emplace_back()));
    }
    return absl::OkStatus();
  }

  // How many, the sum of their nodes, then the boundaries. The file may end before.
  absl::Status ReadBoundaries(bool is_open) {
    std::string_view line;
    if (!reader_.NextContent(line)) {
      return reader_.status();
    }
    rest_ = line;
    uint64_t count = 0;
    uint64_t sum = 0;
    WELLSPACE_RETURN_IF_ERROR(
        TakeWhole(is_open ? "the number of open boundaries" : "the number of land boundaries", kMaxCount, count));
    if (count == 0 && !reader_.NextContent(line)) {
      return reader_.status();
    }
    if (count > 0) {
      WELLSPACE_RETURN_IF_ERROR(NextLine("the number of nodes of all boundaries"));
    } else {
      rest_ = line;
    }
    // Programs count it in different ways, so that it says nothing.
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("the number of nodes of all boundaries", kMaxCount, sum));
    for (uint64_t i = 0; i < count; ++i) {
      WELLSPACE_RETURN_IF_ERROR(ReadBoundary(is_open));
    }
    return absl::OkStatus();
  }

  absl::Status ReadBoundary(bool is_open) {
    WELLSPACE_RETURN_IF_ERROR(NextLine("a boundary"));
    AdcircBoundary boundary{.is_open = is_open, .comment = ""};
    uint64_t count = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeWhole("the number of nodes of a boundary", kMaxCount, count));
    const std::string_view behind = rest_;
    const std::string_view field = Field();
    if (!absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &boundary.type)) {
      if (!is_open) {
        return reader_.Error(absl::StrCat("expected the type of a boundary, a whole number, got ", Quote(field)));
      }
      rest_ = behind;  // an open one may have none
    }
    boundary.comment = TrimBlanks(rest_);
    for (uint64_t i = 0; i < count; ++i) {
      WELLSPACE_RETURN_IF_ERROR(NextLine("a node of a boundary"));
      WELLSPACE_RETURN_IF_ERROR(TakeNode(boundary.nodes.emplace_back()));
      boundary.lines.push_back(reader_.line_number());
    }
    grid_.barriers += !is_open && IsBarrier(boundary.type) ? 1 : 0;
    grid_.boundaries.push_back(std::move(boundary));
    return absl::OkStatus();
  }

  LineReader& reader_;
  const bool skips_invalid_;
  AdcircGrid& grid_;
  std::string_view rest_;  // of the line
  uint64_t nodes_ = 0;
};

// "= part 7: deep sea", as we write it: the tag and, if there is one, the name.
bool TakePart(std::string_view comment, int32_t& tag, FacetSorter& parts) {
  constexpr std::string_view kStart = "= part ";
  if (comment.substr(0, kStart.size()) != kStart) {
    return false;
  }
  const std::string_view number = comment.substr(kStart.size());
  if (std::from_chars(number.data(), number.data() + number.size(), tag).ec != std::errc() || tag == 0) {
    return false;
  }
  TakeNameLine(comment.substr(2), &parts, nullptr);
  return true;
}

}  // namespace

absl::Status ReadAdcircGrid(LineReader& reader, AdcircPart part, bool skips_invalid, AdcircGrid& grid) {
  return AdcircReader(reader, skips_invalid, grid).Read(part);
}

std::vector<uint32_t> ClosedNodes(const AdcircBoundary& boundary) {
  std::vector<uint32_t> nodes = boundary.nodes;
  if (!boundary.is_open && IsIsland(boundary.type) && !nodes.empty() && nodes.back() != nodes.front()) {
    nodes.push_back(nodes.front());
  }
  return nodes;
}

std::string AdcircName(const AdcircBoundary& boundary) {
  if (boundary.is_open) {
    return std::string(kOpenName);
  }
  const bool is_land = boundary.type == 0 || boundary.type == 10 || boundary.type == 20;
  return absl::StrCat(std::string(is_land                   ? kLandName
                                  : IsIsland(boundary.type) ? kIslandName
                                                            : kTypeName),
                      boundary.type);
}

int32_t AdcircTypeOf(const std::string& name, int32_t other) {
  for (const std::string_view start : {kLandName, kIslandName, kTypeName}) {
    int32_t type = 0;
    if (name.compare(0, start.size(), start.data(), start.size()) == 0 &&
        absl::SimpleAtoi(name.substr(start.size()), &type)) {
      return type;
    }
  }
  return other;
}

absl::StatusOr<Mesh> ReadAdcirc(const std::string& path, const MeshNumbers& /*numbers*/) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  AdcircGrid grid;
  WELLSPACE_RETURN_IF_ERROR(ReadAdcircGrid(reader, AdcircPart::kAll, /*skips_invalid=*/false, grid));
  Mesh mesh{.dimension = 2, .points = std::move(grid.points), .simplices = std::move(grid.triangles)};
  FacetSorter parts;
  int32_t next_tag = 1;
  for (const AdcircBoundary& boundary : grid.boundaries) {
    int32_t tag = next_tag++;
    if (!TakePart(boundary.comment, tag, parts)) {
      parts.Name(tag, AdcircName(boundary));
    }
    const std::vector<uint32_t> nodes = ClosedNodes(boundary);
    for (size_t i = 1; i < nodes.size(); ++i) {
      parts.Add(std::span(nodes).subspan(i - 1, 2), tag);
    }
  }
  parts.MoveTo(mesh);
  if (grid.barriers > 0) {
    mesh.notes.push_back(absl::StrCat(reader.name(), ": of ", grid.barriers,
                                      grid.barriers == 1 ? " barrier" : " barriers",
                                      " only the front is read, without heights and the nodes behind"));
  }
  return mesh;
}

absl::Status ReadAdcircPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  AdcircGrid grid;
  WELLSPACE_RETURN_IF_ERROR(ReadAdcircGrid(reader, AdcircPart::kNodes, options.skip_invalid, grid));
  std::vector<std::vector<double>> columns = ColumnsOf(grid.points, 2);
  columns.push_back(std::move(grid.depths));
  return AddAllRows({"x", "y", kDepth}, columns, options, cloud);
}

}  // namespace wellspace::formats
