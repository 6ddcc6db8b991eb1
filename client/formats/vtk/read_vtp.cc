// VTK's XML for polygons: the points, also of unstructured and structured grids, and meshes in the plane.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/cloud_readers.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/point_rows.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_mesh_xml.h"
#include "client/formats/vtk/vtk_xml.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

constexpr uint64_t kMaxVtkComponents = 64;

class VtkXmlPointsReader final : public VtkXmlReader {
 public:
  VtkXmlPointsReader(std::string_view document, const std::string& name, const char* kind, const CloudOptions& options,
                     PointCloud& cloud)
      : VtkXmlReader(document, name, kind), options_(options), cloud_(cloud) {}

  absl::Status Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadElements());
    if (coordinates_.size() != 3 * point_count()) {
      return FileError(absl::StrCat("expected ", 3 * point_count(), " coordinates for ", point_count(), " points, got ",
                                    coordinates_.size()));
    }
    std::vector<std::string> names = {"x", "y", "z"};
    std::vector<std::vector<double>> columns = Columns(coordinates_, 3);
    coordinates_ = {};
    for (const PointArray& array : arrays_) {
      if (array.values.size() != array.components * point_count()) {
        return FileError(absl::StrCat("expected ", array.components, " values of ", Quote(array.name), " for each of ",
                                      point_count(), " points, got ", array.values.size()));
      }
      for (std::vector<double>& column : Columns(array.values, array.components)) {
        columns.push_back(std::move(column));
      }
      const std::vector<std::string> components = DataNames(array.name, array.components);
      names.insert(names.end(), components.begin(), components.end());
    }
    NoteCells(cell_count() - std::min(vertex_cells_, cell_count()), cloud_);
    return AddAllRows(names, columns, options_, cloud_);
  }

 private:
  struct PointArray {
    std::string name;
    uint64_t components = 1;
    std::vector<double> values;
  };

  absl::Status ReadDataArray(const std::string& parent) override {
    if (parent == "Points") {
      return xml().Attribute("NumberOfComponents") == "3"
                 ? ReadAnyNumbers(coordinates_)
                 : xml().Error(absl::StrCat("expected NumberOfComponents 3 for the points, got ",
                                            Quote(xml().Attribute("NumberOfComponents"))));
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
    PointArray array{.name = std::string(xml().Attribute("Name")), .components = 1, .values = {}};
    const std::string_view components = xml().Attribute("NumberOfComponents");
    if (!components.empty() &&
        (!ParseUnsigned(components, kMaxVtkComponents, array.components) || array.components == 0)) {
      return xml().Error(
          absl::StrCat("expected NumberOfComponents from 1 to ", kMaxVtkComponents, ", got ", Quote(components)));
    }
    // That of the pieces before goes on.
    for (PointArray& begun : arrays_) {
      if (first_point() > 0 && begun.name == array.name && begun.components == array.components &&
          begun.values.size() == first_point() * begun.components) {
        return ReadData(begun);
      }
    }
    arrays_.push_back(std::move(array));
    return ReadData(arrays_.back());
  }

  absl::Status ReadData(PointArray& array) {
    WELLSPACE_RETURN_IF_ERROR(ReadAnyNumbers(array.values));
    const uint64_t wanted = array.components * point_count();
    if (xml().Attribute("type") == "Bit" && array.values.size() > wanted && array.values.size() - wanted < 8) {
      array.values.resize(wanted);  // the bits that fill the last byte
    }
    return absl::OkStatus();
  }

  static std::vector<std::vector<double>> Columns(const std::vector<double>& values, uint64_t width) {
    std::vector<std::vector<double>> columns(width);
    for (size_t i = 0; i < values.size(); ++i) {
      columns[i % width].push_back(values[i]);
    }
    return columns;
  }

  const CloudOptions& options_;
  PointCloud& cloud_;
  std::vector<double> coordinates_;
  std::vector<PointArray> arrays_;
  uint64_t vertex_cells_ = 0;
};

// Cells by their kinds, each with vertices and ends of its own.
class VtpMeshReader final : public VtkMeshXmlReader {
 public:
  VtpMeshReader(std::string_view document, const std::string& name)
      : VtkMeshXmlReader(document, name, "PolyData", /*numbers=*/"") {}

 private:
  struct Section {
    std::string_view name;
    std::vector<int64_t> connectivity{};
    std::vector<int64_t> offsets{};
  };

  absl::Status ReadCells(const std::string& parent, std::string_view array) override {
    for (Section& section : sections_) {
      if (parent == section.name && (array == "connectivity" || array == "offsets")) {
        return ReadArray<int64_t>(array == "offsets" ? section.offsets : section.connectivity);
      }
    }
    return absl::OkStatus();
  }

  // Data of cells are in the order of the sections.
  absl::Status EndPiece() override {
    for (Section& section : sections_) {
      int64_t begin = 0;
      for (const int64_t end : section.offsets) {
        grid().types.push_back(VtkPolyDataType(section.name, std::max<int64_t>(end - begin, 0)));
        begin = end;
      }
      grid().cells += section.offsets.size();
      WELLSPACE_RETURN_IF_ERROR(AddCells(section.connectivity, section.offsets));
      section.connectivity.clear();
      section.offsets.clear();
    }
    return absl::OkStatus();
  }

  // Of a piece.
  std::array<Section, 4> sections_ = {Section{"Verts"}, Section{"Lines"}, Section{"Polys"}, Section{"Strips"}};
};

absl::Status ReadVtkXmlPoints(InputFile& file, const char* kind, const CloudOptions& options, PointCloud& cloud) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtkXmlPointsReader(document, cloud.name, kind, options, cloud).Read();
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

absl::StatusOr<Mesh> ReadVtpMesh(const std::string& path) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtpMeshReader(document, file.name()).Read();
}

}  // namespace wellspace::formats
