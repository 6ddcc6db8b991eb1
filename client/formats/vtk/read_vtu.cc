// VTK's XML for unstructured grids.
#include <algorithm>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/line_reader.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/number.h"
#include "client/formats/regions.h"
#include "client/formats/vtk/vtk_array.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/xml_scanner.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr size_t kMaxDepth = 64;

// Collects the arrays of the only piece, then makes the mesh of them.
class VtuReader {
 public:
  VtuReader(std::string_view document, const std::string& name) : xml_(document, name), name_(name) {}

  absl::StatusOr<Mesh> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadElements());
    if (pieces_ != 1) {
      return FileError(absl::StrCat("expected one <Piece> of an <UnstructuredGrid>, got ", pieces_));
    }
    return MakeMesh();
  }

 private:
  absl::Status FileError(std::string_view message) const {
    return absl::InvalidArgumentError(absl::StrCat(name_, ": ", absl::string_view(message.data(), message.size())));
  }

  absl::Status ReadElements() {
    while (true) {
      switch (xml_.Next()) {
        case XmlScanner::Piece::kError:
          return xml_.status();
        case XmlScanner::Piece::kEnd:
          return path_.empty() ? absl::OkStatus()
                               : xml_.Error(absl::StrCat("the file ends inside element ", Quote(path_.back())));
        case XmlScanner::Piece::kText:
          break;
        case XmlScanner::Piece::kStartTag:
          if (path_.size() == kMaxDepth) {
            return xml_.Error(absl::StrCat("expected elements at most ", kMaxDepth, " deep"));
          }
          path_.emplace_back(xml_.value());
          WELLSPACE_RETURN_IF_ERROR(StartElement());
          break;
        case XmlScanner::Piece::kEndTag:
          WELLSPACE_RETURN_IF_ERROR(EndElement());
          break;
      }
    }
  }

  absl::Status EndElement() {
    if (path_.empty() || path_.back() != xml_.value()) {
      return xml_.Error(absl::StrCat("expected the end of ", path_.empty() ? "no element" : Quote(path_.back()),
                                     ", got that of ", Quote(xml_.value())));
    }
    path_.pop_back();
    return absl::OkStatus();
  }

  // REQUIRES:   the start tag's name is the last of path_.
  absl::Status StartElement() {
    const std::string& element = path_.back();
    if (path_.size() == 1) {
      return StartFile();
    }
    if (element == "AppendedData") {
      return xml_.Error("expected arrays in ascii or inline in base64 (format \"binary\"), got appended data");
    }
    if (element == "Piece") {
      ++pieces_;
      if (!ParseUnsigned(xml_.Attribute("NumberOfPoints"), std::numeric_limits<uint32_t>::max(), point_count_) ||
          !ParseUnsigned(xml_.Attribute("NumberOfCells"), std::numeric_limits<uint32_t>::max(), cell_count_)) {
        return xml_.Error("expected NumberOfPoints and NumberOfCells below 2^32 in <Piece>");
      }
      return absl::OkStatus();
    }
    const std::string& parent = path_[path_.size() - 2];
    if (element != "DataArray" || pieces_ != 1) {
      return absl::OkStatus();
    }
    if (parent == "Points") {
      return ReadPoints();
    }
    if (parent == "PointData" && xml_.Attribute("Name") == "weights") {
      has_weights_ = true;
      return ReadArray<double>(weights_);
    }
    if (parent == "CellData" && xml_.Attribute("Name") == kVtkBoundary) {
      has_tags_ = true;
      return ReadArray<int64_t>(tags_);
    }
    // Others may have anything by that name.
    const std::string_view type = xml_.Attribute("type");
    const std::string_view components = xml_.Attribute("NumberOfComponents");
    if (parent == "CellData" && xml_.Attribute("Name") == kVtkRegion && type.find("Int") != std::string_view::npos &&
        (components.empty() || components == "1")) {
      has_regions_ = true;
      return ReadArray<int64_t>(regions_);
    }
    return parent == "Cells" ? ReadCellArray() : absl::OkStatus();
  }

  absl::Status StartFile() {
    if (path_.back() != "VTKFile" || xml_.Attribute("type") != "UnstructuredGrid") {
      return xml_.Error("expected <VTKFile type=\"UnstructuredGrid\" ...>");
    }
    const std::string_view order = xml_.Attribute("byte_order");
    if (!order.empty() && order != "LittleEndian" && order != "BigEndian") {
      return xml_.Error(absl::StrCat("expected byte_order LittleEndian or BigEndian, got ", Quote(order)));
    }
    encoding_.big_endian = order == "BigEndian";
    const std::string_view header = xml_.Attribute("header_type");
    if (!header.empty() && header != "UInt32" && header != "UInt64") {
      return xml_.Error(absl::StrCat("expected header_type UInt32 or UInt64, got ", Quote(header)));
    }
    encoding_.header_word_bytes = header == "UInt64" ? 8 : 4;
    const std::string_view compressor = xml_.Attribute("compressor");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
      return xml_.Error(absl::StrCat("expected compressor vtkZLibDataCompressor or none, got ", Quote(compressor)));
    }
    encoding_.compressed = !compressor.empty();
    return absl::OkStatus();
  }

  absl::Status ReadPoints() {
    if (xml_.Attribute("NumberOfComponents") != "3") {
      return xml_.Error(absl::StrCat("expected NumberOfComponents 3 for the points, got ",
                                     Quote(xml_.Attribute("NumberOfComponents"))));
    }
    return ReadArray<double>(coordinates_);
  }

  absl::Status ReadCellArray() {
    const std::string_view array = xml_.Attribute("Name");
    if (array == "connectivity") {
      return ReadArray<int64_t>(connectivity_);
    }
    if (array == "offsets") {
      return ReadArray<int64_t>(offsets_);
    }
    return array == "types" ? ReadArray<int64_t>(types_) : absl::OkStatus();
  }

  // Reads the text of the current element into `values`, which are doubles or whole numbers.
  template <typename Value>
  absl::Status ReadArray(std::vector<Value>& values) {
    const std::string type(xml_.Attribute("type"));
    const std::string format(xml_.Attribute("format"));
    if (format != "ascii" && format != "binary") {
      return xml_.Error(absl::StrCat("expected format \"ascii\" or \"binary\", got ", Quote(format)));
    }
    const XmlScanner::Piece piece = xml_.Next();
    if (piece == XmlScanner::Piece::kEndTag) {
      values.clear();
      return EndElement();
    }
    if (piece == XmlScanner::Piece::kError) {
      return xml_.status();
    }
    if (piece != XmlScanner::Piece::kText) {
      return xml_.Error("expected the values of the array");
    }
    if (format == "ascii") {
      return ParseAscii(values);
    }
    const absl::StatusOr<std::string> bytes = DecodeVtkArray(xml_.value(), encoding_);
    if (!bytes.ok()) {
      return xml_.Error(std::string(bytes.status().message()));
    }
    return Convert(*bytes, type, values);
  }

  template <typename Value>
  absl::Status ParseAscii(std::vector<Value>& values) {
    values.clear();
    const std::string_view text = xml_.value();
    size_t begin = 0;
    while ((begin = text.find_first_not_of(kXmlSpace, begin)) != std::string_view::npos) {
      const size_t end = std::min(text.find_first_of(kXmlSpace, begin), text.size());
      const std::string_view word = text.substr(begin, end - begin);
      begin = end;
      if constexpr (std::is_same_v<Value, double>) {
        double value = 0;
        if (absl::Status status = ParseFinite(word, value); !status.ok()) {
          return xml_.Error(std::string(status.message()));
        }
        values.push_back(value);
      } else {
        uint64_t value = 0;
        if (!ParseUnsigned(word, std::numeric_limits<int64_t>::max(), value)) {
          return xml_.Error(absl::StrCat("expected a whole number, got ", Quote(word)));
        }
        values.push_back(static_cast<Value>(value));
      }
    }
    return absl::OkStatus();
  }

  template <typename Value>
  absl::Status Convert(const std::string& bytes, const std::string& type, std::vector<Value>& values) {
    if constexpr (std::is_same_v<Value, double>) {
      if (type == "Float64") return ConvertWords<double>(bytes, values);
      if (type == "Float32") return ConvertWords<float>(bytes, values);
      return xml_.Error(absl::StrCat("expected points of type Float32 or Float64, got ", Quote(type)));
    } else {
      if (type == "Int64") return ConvertWords<int64_t>(bytes, values);
      if (type == "UInt64") return ConvertWords<uint64_t>(bytes, values);
      if (type == "Int32") return ConvertWords<int32_t>(bytes, values);
      if (type == "UInt32") return ConvertWords<uint32_t>(bytes, values);
      if (type == "Int16") return ConvertWords<int16_t>(bytes, values);
      if (type == "UInt16") return ConvertWords<uint16_t>(bytes, values);
      if (type == "Int8") return ConvertWords<int8_t>(bytes, values);
      if (type == "UInt8") return ConvertWords<uint8_t>(bytes, values);
      return xml_.Error(absl::StrCat("expected a type from Int8 to UInt64, got ", Quote(type)));
    }
  }

  template <typename Word, typename Value>
  absl::Status ConvertWords(const std::string& bytes, std::vector<Value>& values) {
    if (bytes.size() % sizeof(Word) != 0) {
      return xml_.Error(absl::StrCat("expected a multiple of ", sizeof(Word), " bytes, got ", bytes.size()));
    }
    values.resize(bytes.size() / sizeof(Word));
    for (size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<Value>(LoadWord<Word>(bytes, i, encoding_.big_endian));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Mesh> MakeMesh() const {
    if (coordinates_.size() != 3 * point_count_) {
      return FileError(absl::StrCat("expected ", 3 * point_count_, " coordinates for ", point_count_, " points, got ",
                                    coordinates_.size()));
    }
    if (types_.size() != cell_count_ || offsets_.size() != cell_count_) {
      return FileError(absl::StrCat("expected a type and an offset for each of ", cell_count_, " cells, got ",
                                    types_.size(), " types and ", offsets_.size(), " offsets"));
    }
    if (has_weights_ && weights_.size() != point_count_) {
      return FileError(absl::StrCat("expected a weight for each of ", point_count_, " points, got ", weights_.size()));
    }
    if (has_tags_ && tags_.size() != cell_count_) {
      return FileError(absl::StrCat("expected a tag for each of ", cell_count_, " cells, got ", tags_.size()));
    }
    if (has_regions_ && regions_.size() != cell_count_) {
      return FileError(absl::StrCat("expected a region for each of ", cell_count_, " cells, got ", regions_.size()));
    }
    Mesh mesh;
    mesh.weights = weights_;
    mesh.dimension = !types_.empty() && types_[0] == kVtkTriangle ? 2 : 3;
    WELLSPACE_RETURN_IF_ERROR(TakeCells(mesh));
    return TakePoints(std::move(mesh));
  }

  // The first cell is a simplex. Where cells have tags, there may be facets among them.
  absl::Status TakeCells(Mesh& mesh) const {
    const int64_t expected_type = mesh.dimension == 2 ? kVtkTriangle : kVtkTetrahedron;
    const int64_t facet_type = mesh.dimension == 2 ? kVtkLine : kVtkTriangle;
    const auto is_facet_at = [&](size_t cell) { return has_tags_ && types_[cell] == facet_type; };
    size_t needed = 0;
    for (size_t cell = 0; cell < cell_count_; ++cell) {
      needed += mesh.dimension + (is_facet_at(cell) ? 0 : 1);
    }
    if (connectivity_.size() != needed) {
      return FileError(absl::StrCat("expected ", needed, " vertices for ", cell_count_,
                                    mesh.dimension == 2 ? " triangles" : " tetrahedra", ", got ",
                                    connectivity_.size()));
    }
    FacetSorter facets;
    RegionCollector regions;
    std::vector<uint32_t> vertices;
    size_t first = 0;  // in connectivity_
    for (size_t cell = 0; cell < cell_count_; ++cell) {
      const bool is_facet = is_facet_at(cell);
      if (types_[cell] != expected_type && !is_facet) {
        return FileError(absl::StrCat("cell ", cell, ": expected only triangles (5) or only tetrahedra (10), got type ",
                                      types_[cell]));
      }
      const size_t end = first + mesh.dimension + (is_facet ? 0 : 1);
      if (offsets_[cell] != static_cast<int64_t>(end)) {
        return FileError(absl::StrCat("cell ", cell, ": expected offset ", end, ", got ", offsets_[cell]));
      }
      vertices.clear();
      for (; first < end; ++first) {
        if (connectivity_[first] < 0 || static_cast<uint64_t>(connectivity_[first]) >= point_count_) {
          return FileError(absl::StrCat("cell ", cell, ": expected vertices from 0 to below ", point_count_, ", got ",
                                        connectivity_[first]));
        }
        vertices.push_back(static_cast<uint32_t>(connectivity_[first]));
      }
      if (!is_facet) {
        if (has_regions_ && regions_[cell] != static_cast<int32_t>(regions_[cell])) {
          return FileError(absl::StrCat("cell ", cell, ": expected a region of at most 32 bits, got ", regions_[cell]));
        }
        regions.Add(has_regions_ ? static_cast<int32_t>(regions_[cell]) : 0);
        mesh.simplices.insert(mesh.simplices.end(), vertices.begin(), vertices.end());
      } else if (tags_[cell] < std::numeric_limits<int32_t>::min() ||
                 tags_[cell] > std::numeric_limits<int32_t>::max()) {
        return FileError(absl::StrCat("cell ", cell, ": expected a tag of at most 32 bits, got ", tags_[cell]));
      } else {
        facets.Add(vertices, static_cast<int32_t>(tags_[cell]));
      }
    }
    facets.MoveTo(mesh);
    regions.MoveTo(mesh);
    return absl::OkStatus();
  }

  absl::StatusOr<Mesh> TakePoints(Mesh mesh) const {
    mesh.points.reserve(point_count_ * mesh.dimension);
    for (size_t point = 0; point < point_count_; ++point) {
      for (int axis = 0; axis < mesh.dimension; ++axis) {
        mesh.points.push_back(coordinates_[3 * point + axis]);
      }
      if (mesh.dimension == 2 && coordinates_[3 * point + 2] != 0) {
        return FileError(absl::StrCat("point ", point, ": expected z = 0 in a mesh of triangles, got ",
                                      coordinates_[3 * point + 2]));
      }
    }
    return mesh;
  }

  XmlScanner xml_;
  const std::string name_;
  std::vector<std::string> path_;  // the open elements, outermost first
  VtkEncoding encoding_;
  uint64_t pieces_ = 0;
  uint64_t point_count_ = 0;
  uint64_t cell_count_ = 0;
  std::vector<double> coordinates_;
  bool has_weights_ = false;
  std::vector<double> weights_;
  std::vector<int64_t> connectivity_;
  std::vector<int64_t> offsets_;
  std::vector<int64_t> types_;
  bool has_tags_ = false;
  std::vector<int64_t> tags_;  // of cells
  bool has_regions_ = false;
  std::vector<int64_t> regions_;  // of cells
};

}  // namespace

absl::StatusOr<Mesh> ReadVtu(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtuReader(document, file.name()).Read();
}

}  // namespace wellspace::formats
