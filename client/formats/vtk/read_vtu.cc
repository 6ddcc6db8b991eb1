// VTK's XML for unstructured grids.
#include <string>
#include <utility>
#include <vector>

#include "client/formats/io/input_file.h"
#include "client/formats/io/number.h"
#include "client/formats/mesh_readers.h"
#include "client/formats/vtk/vtk_mesh_xml.h"
#include "core/base/status_macros.h"

namespace wellspace::formats {
namespace {

class VtuReader final : public VtkMeshXmlReader {
 public:
  VtuReader(std::string_view document, const std::string& name, const MeshNumbers& numbers)
      : VtkMeshXmlReader(document, name, "UnstructuredGrid", numbers) {}

 private:
  absl::Status ReadCells(const std::string& parent, std::string_view array) override {
    if (parent != "Cells") {
      return absl::OkStatus();
    }
    if (array == "connectivity") {
      return ReadArray<int64_t>(connectivity_);
    }
    if (array == "offsets") {
      return ReadArray<int64_t>(offsets_);
    }
    return array == "types" ? ReadArray<int64_t>(grid().types) : absl::OkStatus();
  }

  absl::Status EndPiece() override {
    WELLSPACE_RETURN_IF_ERROR(AddCells(connectivity_, offsets_));
    connectivity_.clear();
    offsets_.clear();
    grid().cells = cell_count();
    return absl::OkStatus();
  }

  // Of a piece.
  std::vector<int64_t> connectivity_;
  std::vector<int64_t> offsets_;
};

}  // namespace

absl::StatusOr<Mesh> ReadVtu(const std::string& path, const MeshNumbers& numbers) {
  WELLSPACE_ASSIGN_OR_RETURN(InputFile file, InputFile::Open(path));
  WELLSPACE_ASSIGN_OR_RETURN(const std::string document, file.ReadAll());
  return VtuReader(document, file.name(), numbers).Read();
}

}  // namespace wellspace::formats
