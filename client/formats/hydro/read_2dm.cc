// SMS's .2dm as a mesh and as points. Cards come in any order.
#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
#include "client/formats/regions.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class Reader2dm {
 public:
  Reader2dm(LineReader& reader, bool skips_invalid) : reader_(reader), skips_invalid_(skips_invalid) {
    reader_.OnComment([this](std::string_view comment) { TakeNameLine(comment, &parts_, &regions_); });
  }
  ~Reader2dm() { reader_.OnComment(nullptr); }
  Reader2dm(const Reader2dm&) = delete;
  Reader2dm& operator=(const Reader2dm&) = delete;

  absl::StatusOr<Mesh> ReadMesh() {
    WELLSPACE_RETURN_IF_ERROR(ReadCards(/*has_elements=*/true));
    WELLSPACE_RETURN_IF_ERROR(NumberNodes());
    Mesh mesh{.dimension = 2, .points = std::move(points_), .simplices = {}};
    for (size_t i = 0; i < corners_.size(); ++i) {
      WELLSPACE_RETURN_IF_ERROR(IndexOf(corners_[i], element_lines_.LineOf(i / 3), mesh.simplices.emplace_back()));
    }
    std::vector<uint32_t> nodes;
    for (const String& string : strings_) {
      nodes.clear();
      for (const uint64_t node : string.nodes) {
        WELLSPACE_RETURN_IF_ERROR(IndexOf(node, string.line, nodes.emplace_back()));
      }
      for (size_t i = 1; i < nodes.size(); ++i) {
        parts_.Add(std::span(nodes).subspan(i - 1, 2), string.tag);
      }
    }
    parts_.MoveTo(mesh);
    regions_.MoveTo(mesh);
    return mesh;
  }

  absl::Status ReadPoints(const CloudOptions& options, PointCloud& cloud) {
    WELLSPACE_RETURN_IF_ERROR(ReadCards(/*has_elements=*/false));
    std::vector<std::vector<double>> columns = ColumnsOf(points_, 2);
    columns.push_back(std::move(elevations_));
    return AddAllRows({"x", "y", kElevation}, columns, options, cloud);
  }

 private:
  struct String {
    uint64_t line = 0;
    int32_t tag = 0;
    std::vector<uint64_t> nodes{};  // numbers
  };

  absl::Status ReadCards(bool has_elements) {
    std::string_view line;
    if (!reader_.NextContent(line) || line.substr(0, line.find_first_of(" \t")) != "MESH2D") {
      return reader_.EndError("expected \"MESH2D\" at the start of the file");
    }
    while (reader_.NextContent(line)) {
      FieldSplitter fields(line, ' ');
      std::string_view card;
      fields.Next(card);
      absl::Status status;
      if (card == "ND") {
        status = TakeNode(fields);
      } else if (card == "E3T" && has_elements) {
        status = TakeTriangle(fields);
      } else if (has_elements && card.size() == 3 && card[0] == 'E' && card[1] >= '2' && card[1] <= '9') {
        status = reader_.Error(absl::StrCat("expected E3T and no other elements, got ", Quote(card)));
      } else if (card == "NS" && has_elements) {
        status = TakeString(fields);
      }
      if (!status.ok()) {
        return status;
      }
    }
    return reader_.Finish();
  }

  absl::Status TakeNumber(FieldSplitter& fields, const char* what, uint64_t& number) {
    std::string_view field;
    fields.Next(field);
    return ParseUnsigned(field, std::numeric_limits<int64_t>::max(), number)
               ? absl::OkStatus()
               : reader_.Error(absl::StrCat("expected ", what, ", a whole number, got ", Quote(field)));
  }

  absl::Status TakeNode(FieldSplitter& fields) {
    WELLSPACE_RETURN_IF_ERROR(TakeNumber(fields, "the number of a node", numbers_.emplace_back()));
    constexpr std::array kNames = {"x", "y", "z"};
    for (size_t i = 0; i < kNames.size(); ++i) {
      std::string_view field;
      fields.Next(field);
      double value = 0;
      if (absl::Status status = TakeCoordinate(field, skips_invalid_ || i == 2, value); !status.ok()) {
        return reader_.Error(absl::StrCat(kNames[i], " of a node: ", status.message()));
      }
      (i < 2 ? points_ : elevations_).push_back(value);
    }
    return absl::OkStatus();
  }

  absl::Status TakeTriangle(FieldSplitter& fields) {
    uint64_t number = 0;
    WELLSPACE_RETURN_IF_ERROR(TakeNumber(fields, "the number of an element", number));
    for (int i = 0; i < 3; ++i) {
      WELLSPACE_RETURN_IF_ERROR(TakeNumber(fields, "the number of a node", corners_.emplace_back()));
    }
    std::string_view field;
    int32_t region = 0;
    if (fields.Next(field) && !absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &region)) {
      return reader_.Error(absl::StrCat("expected the material of an element, a whole number, got ", Quote(field)));
    }
    regions_.Add(region);
    element_lines_.Add(reader_.line_number());
    return absl::OkStatus();
  }

  // The last node is negative; then a number or a name may follow. A string goes on in cards that follow.
  absl::Status TakeString(FieldSplitter& fields) {
    if (!is_string_open_) {
      strings_.push_back({.line = reader_.line_number(), .tag = ++last_tag_});
    }
    is_string_open_ = true;
    std::string_view field;
    while (is_string_open_ && fields.Next(field)) {
      is_string_open_ = field[0] != '-';
      uint64_t node = 0;
      if (!ParseUnsigned(field.substr(is_string_open_ ? 0 : 1), std::numeric_limits<int64_t>::max(), node)) {
        return reader_.Error(
            absl::StrCat("expected the number of a node, the last of a string negative, got ", Quote(field)));
      }
      strings_.back().nodes.push_back(node);
    }
    if (!is_string_open_ && fields.Next(field)) {
      int32_t tag = 0;
      if (!absl::SimpleAtoi(absl::string_view(field.data(), field.size()), &tag)) {
        parts_.Name(strings_.back().tag, std::string(field));
      } else if (tag != 0) {
        strings_.back().tag = tag;
      }
    }
    return absl::OkStatus();
  }

  absl::Status NumberNodes() {
    if (numbers_.size() > kMaxCount) {
      return absl::InvalidArgumentError(
          absl::StrCat(reader_.name(), ": expected fewer than 2^32 nodes, got ", numbers_.size()));
    }
    for (size_t i = 0; i < numbers_.size(); ++i) {
      by_number_.emplace_back(numbers_[i], static_cast<uint32_t>(i));
    }
    std::sort(by_number_.begin(), by_number_.end());
    for (size_t i = 1; i < by_number_.size(); ++i) {
      if (by_number_[i].first == by_number_[i - 1].first) {
        return absl::InvalidArgumentError(
            absl::StrCat(reader_.name(), ": expected one node of every number, got two of ", by_number_[i].first));
      }
    }
    return absl::OkStatus();
  }

  absl::Status IndexOf(uint64_t number, uint64_t line, uint32_t& index) const {
    const auto at = std::lower_bound(by_number_.begin(), by_number_.end(), std::pair(number, uint32_t{0}));
    if (at == by_number_.end() || at->first != number) {
      return LineError(reader_.name(), line, absl::StrCat("expected the number of a node, got ", number));
    }
    index = at->second;
    return absl::OkStatus();
  }

  LineReader& reader_;
  const bool skips_invalid_;
  std::vector<uint64_t> numbers_;  // of nodes
  std::vector<double> points_;     // of nodes, x 2
  std::vector<double> elevations_;
  std::vector<uint64_t> corners_;  // of triangles, x 3: numbers of nodes
  LineIndex element_lines_;
  std::vector<String> strings_;
  bool is_string_open_ = false;
  int32_t last_tag_ = 0;
  FacetSorter parts_;
  RegionCollector regions_;
  std::vector<std::pair<uint64_t, uint32_t>> by_number_;  // the nodes, sorted
};

}  // namespace

absl::StatusOr<Mesh> Read2dm(const std::string& path, const MeshNumbers& /*numbers*/) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  LineReader reader(std::move(file));
  return Reader2dm(reader, /*skips_invalid=*/false).ReadMesh();
}

absl::Status Read2dmPoints(LineReader& reader, const CloudOptions& options, PointCloud& cloud) {
  return Reader2dm(reader, options.skip_invalid).ReadPoints(options, cloud);
}

}  // namespace wellspace::formats
