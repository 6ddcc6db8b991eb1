// VTK's XML for polygons: meshes of triangles in the plane.
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/io/input_file.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/vtk/vtk_cells.h"
#include "client/formats/vtk/vtk_mesh_xml.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

// Cells by their kinds, each with vertices and ends of its own.
class VtpMeshReader final : public VtkMeshXmlReader {
 public:
  VtpMeshReader(std::string_view document, const std::string& name, bool keeps_cell_data)
      : VtkMeshXmlReader(document, name, "PolyData", {.of_simplices = keeps_cell_data}) {}

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

}  // namespace

absl::StatusOr<Mesh> ReadVtpMesh(const std::string& path, const MeshNumbers& numbers) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtpMeshReader(document, file.name(), numbers.of_simplices).Read();
}

}  // namespace wellspace::formats
