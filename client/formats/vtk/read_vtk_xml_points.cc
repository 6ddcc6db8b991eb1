// The points of VTK's XML files: of polygons, of unstructured, structured and rectilinear grids, of images, and of
// files of pieces.
#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/grid_points.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_xml.h"
#include "client/formats/vtk/xml_scanner.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// The points of a file, a row each, and their data.
struct PointTable {
  std::vector<std::string> names = {"x", "y", "z"};
  std::vector<std::vector<double>> columns = std::vector<std::vector<double>>(3);
  uint64_t cells = 0;  // that are no vertices
};

class VtkXmlPointsReader final : public VtkXmlReader {
 public:
  VtkXmlPointsReader(std::string_view document, const std::string& name, const char* kind, const CloudOptions& options)
      : VtkXmlReader(document, name, kind), kind_(kind), file_bytes_(document.size()), options_(options) {}

  absl::StatusOr<PointTable> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadElements());
    if (coordinates_.size() != 3 * point_count()) {
      return FileError(absl::StrCat("expected ", 3 * point_count(), " coordinates for ", point_count(), " points, got ",
                                    coordinates_.size()));
    }
    PointTable table;
    table.columns = ColumnsOf(coordinates_, 3);
    coordinates_ = {};
    WELLSPACE_RETURN_IF_ERROR(AddColumns(arrays_, point_count(), "points", table.names, table.columns));
    table.cells = cell_count() - std::min(vertex_cells_, cell_count());
    return table;
  }

 private:
  bool IsImage() const { return kind_ == "ImageData"; }
  bool IsRectilinear() const { return kind_ == "RectilinearGrid"; }

  // Of an image: its origin, spacing and direction, each of which may be left out.
  absl::Status StartDataset() override {
    const auto take = [&](const char* attribute, auto& numbers) -> absl::Status {
      const std::string_view text = xml().Attribute(attribute);
      if (text.empty()) {
        return absl::OkStatus();
      }
      const std::optional<std::vector<double>> parsed = ParseVtkNumbers(text, numbers.size());
      if (!parsed.has_value()) {
        return xml().Error(absl::StrCat("expected ", numbers.size(), " finite numbers as ", attribute, " in <", kind_,
                                        ">, got ", Quote(text)));
      }
      std::copy(parsed->begin(), parsed->end(), numbers.begin());
      return absl::OkStatus();
    };
    if (IsImage()) {
      WELLSPACE_RETURN_IF_ERROR(take("Origin", image_.origin));
      WELLSPACE_RETURN_IF_ERROR(take("Spacing", image_.spacing));
      WELLSPACE_RETURN_IF_ERROR(take("Direction", image_.direction));
    }
    return absl::OkStatus();
  }

  absl::Status ReadDataArray(const std::string& parent) override {
    if (parent == "Points") {
      return xml().Attribute("NumberOfComponents") == "3"
                 ? ReadAnyNumbers(coordinates_)
                 : xml().Error(absl::StrCat("expected NumberOfComponents 3 for the points, got ",
                                            Quote(xml().Attribute("NumberOfComponents"))));
    }
    if (parent == "Coordinates" && IsRectilinear()) {
      if (axes_read_ == 3) {
        return xml().Error("expected three arrays in <Coordinates>, got another one");
      }
      return ReadAnyNumbers(axes_[axes_read_++]);
    }
    if (parent == "Cells" && xml().Attribute("Name") == "types") {
      std::vector<int64_t> types;
      WELLSPACE_RETURN_IF_ERROR(ReadArray<int64_t>(types));
      for (const int64_t type : types) {
        vertex_cells_ += type == kVtkVertex || type == kVtkPolyVertex ? 1 : 0;
      }
      return absl::OkStatus();
    }
    if (parent != "PointData" || (!options_.keep_attributes && options_.columns.empty()) ||
        xml().Attribute("type") == "String") {
      return absl::OkStatus();
    }
    return ReadData(first_point(), point_count(), arrays_);
  }

  // The points of a grid that are told by its axes.
  absl::Status EndPiece() override {
    if (!IsImage() && !IsRectilinear()) {
      return absl::OkStatus();
    }
    const uint64_t most = MostGridPoints(file_bytes_);
    if (point_count() > most) {
      return xml().Error(absl::StrCat("expected an Extent of at most ", most, " points of a file of ", file_bytes_,
                                      " bytes, got ", point_count()));
    }
    for (int axis = 0; axis < 3 && IsRectilinear(); ++axis) {
      if (axes_[axis].size() != extent().PointsAlong(axis)) {
        return xml().Error(absl::StrCat("expected ", extent().PointsAlong(axis), " coordinates along axis ", axis,
                                        ", as Extent says, got ", axes_[axis].size()));
      }
    }
    const auto add = [&](double x, double y, double z) { coordinates_.insert(coordinates_.end(), {x, y, z}); };
    if (IsImage()) {
      image_.ForEachPoint(extent(), add);
    } else {
      ForEachRectilinearPoint(axes_, add);
    }
    axes_ = {};
    axes_read_ = 0;
    return absl::OkStatus();
  }

  const std::string kind_;
  const uint64_t file_bytes_;
  const CloudOptions& options_;
  std::vector<double> coordinates_;
  std::vector<DataArray> arrays_;
  uint64_t vertex_cells_ = 0;
  VtkImage image_;
  // Of a rectilinear piece.
  std::array<std::vector<double>, 3> axes_;
  size_t axes_read_ = 0;
};

absl::StatusOr<PointTable> ReadTable(InputFile& file, const char* kind, const CloudOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtkXmlPointsReader(document, file.name(), kind, options).Read();
}

absl::Status ReadVtkXmlPoints(InputFile& file, const char* kind, const CloudOptions& options, PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(const PointTable table, ReadTable(file, kind, options));
  NoteCells(table.cells, cloud);
  return AddAllRows(table.names, table.columns, options, cloud);
}

// The files of the pieces that `document`, a file of pieces of `kind`, names: all beside it, or in folders there.
absl::StatusOr<std::vector<std::string>> PiecesOf(std::string_view document, const std::string& name,
                                                  const char* kind) {
  XmlScanner xml(document, name);
  std::vector<std::string> sources;
  std::set<std::string> seen;  // in one spelling
  bool is_begun = false;
  for (XmlScanner::Piece piece = xml.Next(); piece != XmlScanner::Piece::kEnd; piece = xml.Next()) {
    if (piece == XmlScanner::Piece::kError) {
      return xml.status();
    }
    if (piece != XmlScanner::Piece::kStartTag) {
      continue;
    }
    if (!std::exchange(is_begun, true) &&
        (xml.value() != "VTKFile" || xml.Attribute("type") != absl::StrCat("P", kind))) {
      return xml.Error(absl::StrCat("expected <VTKFile type=\"P", kind, "\" ...>"));
    }
    if (xml.value() != "Piece") {
      continue;
    }
    const std::string source(xml.Attribute("Source"));
    const std::string padded = absl::StrCat("/", source, "/");
    if (source.empty() || source[0] == '/' || source.find('\0') != std::string::npos ||
        padded.find("/../") != std::string::npos) {
      return xml.Error(absl::StrCat("expected as Source of <Piece> a file beside this one, or in a folder there, got ",
                                    Quote(source)));
    }
    if (!seen.insert(std::filesystem::path(source).lexically_normal()).second) {
      return xml.Error(absl::StrCat("expected each piece once, got another ", Quote(source)));
    }
    sources.push_back(source);
  }
  return sources;
}

// The piece of file `name` at `folder` and `source`. An error names the file, and `source` in printable characters.
absl::StatusOr<InputFile> OpenPiece(const std::string& name, const std::string& folder, const std::string& source) {
  const std::string path = folder + source;
  absl::StatusOr<InputFile> piece = InputFile::Open(path);
  if (!piece.ok()) {
    std::string reason(piece.status().message());
    reason.erase(0, reason.find(path) + path.size());
    return absl::Status(piece.status().code(), absl::StrCat(name, ": cannot open the piece ", Quote(source), reason));
  }
  return piece;
}

// The points of all pieces. Those that pieces have in common come as often; the mesher merges them.
absl::Status ReadPieces(InputFile& file, const char* kind, const CloudOptions& options, PointCloud& cloud) {
  if (cloud.name == "<stdin>") {
    return absl::InvalidArgumentError(
        "<stdin>: expected a path, beside which the files of the pieces lie, got standard input");
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  WELLSPACE_ASSIGN_OR_RETURN(const std::vector<std::string> sources, PiecesOf(document, cloud.name, kind));
  if (sources.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(cloud.name, ": expected one <Piece> or more, got none"));
  }
  const size_t slash = cloud.name.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "./" : cloud.name.substr(0, slash + 1);
  PointTable all;
  for (const std::string& source : sources) {
    WELLSPACE_ASSIGN_OR_RETURN(InputFile piece, OpenPiece(cloud.name, folder, source));
    WELLSPACE_ASSIGN_OR_RETURN(PointTable table, ReadTable(piece, kind, options));
    if (table.columns[0].empty()) {
      continue;  // of a rank without points, and often without names of data
    }
    if (all.columns[0].empty()) {
      all.names = table.names;
      all.columns.resize(all.names.size());
    } else if (all.names != table.names) {
      return absl::InvalidArgumentError(
          absl::StrCat(piece.name(), ": expected data of points as in the pieces before, ",
                       Quote(absl::StrJoin(all.names, " ")), ", got ", Quote(absl::StrJoin(table.names, " "))));
    }
    if (table.columns[0].size() > kMaxCount - all.columns[0].size()) {
      return absl::InvalidArgumentError(absl::StrCat(piece.name(), ": expected fewer than 2^32 points in all pieces"));
    }
    for (size_t i = 0; i < all.columns.size(); ++i) {
      all.columns[i].insert(all.columns[i].end(), table.columns[i].begin(), table.columns[i].end());
    }
    all.cells += table.cells;
  }
  NoteCells(all.cells, cloud);
  return AddAllRows(all.names, all.columns, options, cloud);
}

}  // namespace

absl::Status ReadVtp(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadVtkXmlPoints(file, "PolyData", options, cloud);
}

absl::Status ReadVtuPoints(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadVtkXmlPoints(file, "UnstructuredGrid", options, cloud);
}

absl::Status ReadVts(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadVtkXmlPoints(file, "StructuredGrid", options, cloud);
}

absl::Status ReadVtr(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadVtkXmlPoints(file, "RectilinearGrid", options, cloud);
}

absl::Status ReadVti(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadVtkXmlPoints(file, "ImageData", options, cloud);
}

absl::Status ReadPvtp(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadPieces(file, "PolyData", options, cloud);
}

absl::Status ReadPvtu(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadPieces(file, "UnstructuredGrid", options, cloud);
}

absl::Status ReadPvts(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadPieces(file, "StructuredGrid", options, cloud);
}

absl::Status ReadPvtr(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadPieces(file, "RectilinearGrid", options, cloud);
}

absl::Status ReadPvti(InputFile& file, const CloudOptions& options, PointCloud& cloud) {
  return ReadPieces(file, "ImageData", options, cloud);
}

}  // namespace wellspace::formats
