// Meshes in VTK's XML: the common part of unstructured grids and polygonal data. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_XML_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_XML_H_

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/mesh.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_mesh.h"
#include "client/formats/vtk/vtk_xml.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {

// Collects the arrays of all pieces, then makes the mesh of them.
//
// Thread safety: thread-compatible.
class VtkMeshXmlReader : public VtkXmlReader {
 public:
  absl::StatusOr<Mesh> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadElements());
    grid_.points = point_count();
    std::vector<std::string> names;
    std::vector<std::vector<double>> columns;
    WELLSPACE_RETURN_IF_ERROR(AddColumns(cell_arrays_, grid_.cells, "cells", names, columns));
    for (size_t i = 0; i < names.size(); ++i) {
      grid_.cell_data.push_back({std::move(names[i]), std::move(columns[i])});
    }
    return MakeVtkMesh(std::move(grid_));
  }

 protected:
  VtkMeshXmlReader(std::string_view document, const std::string& name, const char* kind, const MeshNumbers& numbers)
      : VtkXmlReader(document, name, kind), keeps_cell_data_(numbers.of_simplices) {
    grid_.file = name;
    grid_.numbers_name = numbers.of_vertices;
  }

  // An array of another element of a piece.
  virtual absl::Status ReadCells(const std::string& parent, std::string_view array) = 0;

  VtkGrid& grid() { return grid_; }

  // Adds cells of the piece that is being read: `ends` are counted in `vertices`, which are counted in the piece.
  //
  // Errors:     INVALID_ARGUMENT for a vertex that the piece does not have.
  absl::Status AddCells(std::span<const int64_t> vertices, std::span<const int64_t> ends) {
    const auto begin = static_cast<int64_t>(grid_.connectivity.size());
    const uint64_t points = point_count() - first_point();
    for (size_t i = 0; i < vertices.size(); ++i) {
      if (vertices[i] < 0 || static_cast<uint64_t>(vertices[i]) >= points) {
        const auto cell = std::upper_bound(ends.begin(), ends.end(), static_cast<int64_t>(i)) - ends.begin();
        return FileError(absl::StrCat("cell ", grid_.offsets.size() + cell, ": expected vertices from 0 to below ",
                                      points, ", got ", vertices[i]));
      }
      grid_.connectivity.push_back(vertices[i] + static_cast<int64_t>(first_point()));
    }
    for (const int64_t end : ends) {
      grid_.offsets.push_back(end > static_cast<int64_t>(vertices.size()) ? end : begin + end);
    }
    return absl::OkStatus();
  }

 private:
  absl::Status ReadDataArray(const std::string& parent) override {
    const std::string_view array = xml().Attribute("Name");
    if (parent == "Points") {
      return ReadPoints(grid_.coordinates);
    }
    if (parent == "PointData" && array == "weights") {
      grid_.has_weights = true;
      return ReadArray<double>(grid_.weights);
    }
    if (parent == "PointData" && !grid_.numbers_name.empty() && array == grid_.numbers_name) {
      return ReadAnyNumbers(grid_.numbers);
    }
    if (parent == "CellData" && array == kVtkBoundary) {
      grid_.has_tags = true;
      return ReadArray<int64_t>(grid_.tags);
    }
    // Others may have anything by that name.
    const std::string_view type = xml().Attribute("type");
    const std::string_view components = xml().Attribute("NumberOfComponents");
    const bool is_whole = type.find("Int") != std::string_view::npos && (components.empty() || components == "1");
    if (parent == "CellData" && array == kVtkRegion && is_whole) {
      grid_.has_regions = true;
      return ReadArray<int64_t>(grid_.regions);
    }
    if (parent == "FieldData" && array == kVtkNames && is_whole) {
      std::vector<int64_t> letters;
      WELLSPACE_RETURN_IF_ERROR(ReadArray<int64_t>(letters));
      for (const int64_t letter : letters) {
        grid_.names += static_cast<char>(static_cast<uint8_t>(letter));
      }
      return absl::OkStatus();
    }
    if (parent == "CellData" && keeps_cell_data_ && type != "String") {
      return ReadData(first_cell(), end_cell(), cell_arrays_);
    }
    return ReadCells(parent, array);
  }

  const bool keeps_cell_data_;
  VtkGrid grid_;
  std::vector<DataArray> cell_arrays_;
};

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_XML_H_
