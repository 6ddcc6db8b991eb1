// VTK's XML for unstructured grids.
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/boundary.h"
#include "client/formats/io/input_file.h"
#include "client/formats/io/line_reader.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/regions.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_xml.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Collects the arrays of the only piece, then makes the mesh of them.
class VtuReader final : public VtkXmlReader {
 public:
  VtuReader(std::string_view document, const std::string& name, const std::string& numbers)
      : VtkXmlReader(document, name, "UnstructuredGrid"), numbers_name_(numbers) {}

  absl::StatusOr<Mesh> Read() {
    WELLSPACE_RETURN_IF_ERROR(ReadElements());
    return MakeMesh();
  }

 private:
  absl::Status ReadDataArray(const std::string& parent) override {
    const std::string_view array = xml().Attribute("Name");
    if (parent == "Points") {
      return ReadPoints(coordinates_);
    }
    if (parent == "PointData" && array == "weights") {
      has_weights_ = true;
      return ReadArray<double>(weights_);
    }
    if (parent == "PointData" && !numbers_name_.empty() && array == numbers_name_) {
      numbers_.clear();
      return ReadArray<double>(numbers_);
    }
    if (parent == "CellData" && array == kVtkBoundary) {
      has_tags_ = true;
      return ReadArray<int64_t>(tags_);
    }
    // Others may have anything by that name.
    const std::string_view type = xml().Attribute("type");
    const std::string_view components = xml().Attribute("NumberOfComponents");
    if (parent == "CellData" && array == kVtkRegion && type.find("Int") != std::string_view::npos &&
        (components.empty() || components == "1")) {
      has_regions_ = true;
      return ReadArray<int64_t>(regions_);
    }
    return parent == "Cells" ? ReadCellArray(array) : absl::OkStatus();
  }

  absl::Status ReadCellArray(std::string_view array) {
    if (array == "connectivity") {
      return ReadArray<int64_t>(connectivity_);
    }
    if (array == "offsets") {
      return ReadArray<int64_t>(offsets_);
    }
    return array == "types" ? ReadArray<int64_t>(types_) : absl::OkStatus();
  }

  absl::StatusOr<Mesh> MakeMesh() const {
    if (coordinates_.size() != 3 * point_count()) {
      return FileError(absl::StrCat("expected ", 3 * point_count(), " coordinates for ", point_count(), " points, got ",
                                    coordinates_.size()));
    }
    if (types_.size() != cell_count() || offsets_.size() != cell_count()) {
      return FileError(absl::StrCat("expected a type and an offset for each of ", cell_count(), " cells, got ",
                                    types_.size(), " types and ", offsets_.size(), " offsets"));
    }
    if (has_weights_ && weights_.size() != point_count()) {
      return FileError(absl::StrCat("expected a weight for each of ", point_count(), " points, got ", weights_.size()));
    }
    if (!numbers_.empty() && numbers_.size() != point_count()) {
      return FileError(absl::StrCat("point data ", Quote(numbers_name_), ": expected a number for each of ",
                                    point_count(), " points, got ", numbers_.size()));
    }
    if (has_tags_ && tags_.size() != cell_count()) {
      return FileError(absl::StrCat("expected a tag for each of ", cell_count(), " cells, got ", tags_.size()));
    }
    if (has_regions_ && regions_.size() != cell_count()) {
      return FileError(absl::StrCat("expected a region for each of ", cell_count(), " cells, got ", regions_.size()));
    }
    Mesh mesh;
    mesh.weights = weights_;
    mesh.numbers = numbers_;
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
    for (size_t cell = 0; cell < cell_count(); ++cell) {
      needed += mesh.dimension + (is_facet_at(cell) ? 0 : 1);
    }
    if (connectivity_.size() != needed) {
      return FileError(absl::StrCat("expected ", needed, " vertices for ", cell_count(),
                                    mesh.dimension == 2 ? " triangles" : " tetrahedra", ", got ",
                                    connectivity_.size()));
    }
    FacetSorter facets;
    RegionCollector regions;
    std::vector<uint32_t> vertices;
    size_t first = 0;  // in connectivity_
    for (size_t cell = 0; cell < cell_count(); ++cell) {
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
        if (connectivity_[first] < 0 || static_cast<uint64_t>(connectivity_[first]) >= point_count()) {
          return FileError(absl::StrCat("cell ", cell, ": expected vertices from 0 to below ", point_count(), ", got ",
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
    mesh.points.reserve(point_count() * mesh.dimension);
    for (size_t point = 0; point < point_count(); ++point) {
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

  std::vector<double> coordinates_;
  bool has_weights_ = false;
  std::vector<double> weights_;
  const std::string numbers_name_;  // of point data that are asked for; may be empty
  std::vector<double> numbers_;
  std::vector<int64_t> connectivity_;
  std::vector<int64_t> offsets_;
  std::vector<int64_t> types_;
  bool has_tags_ = false;
  std::vector<int64_t> tags_;  // of cells
  bool has_regions_ = false;
  std::vector<int64_t> regions_;  // of cells
};

}  // namespace

absl::StatusOr<Mesh> ReadVtu(const std::string& path, const std::string& numbers) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtuReader(document, file.name(), numbers).Read();
}

}  // namespace wellspace::formats
