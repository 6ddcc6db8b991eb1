// Meshes out of the cells that files of VTK have. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// Points, cells and their data, of all pieces of a file one after the other.
struct VtkGrid {
  std::string file;  // its name, for messages
  uint64_t points = 0;
  uint64_t cells = 0;
  std::vector<double> coordinates{};    // three of each point
  std::vector<int64_t> connectivity{};  // vertices of the cells, of one after the other
  std::vector<int64_t> offsets{};       // where the vertices of each cell end
  std::vector<int64_t> types{};         // of cells
  bool has_weights = false;
  std::vector<double> weights{};  // of points
  std::string numbers_name{};     // of data of points that are asked for; may be empty
  std::vector<double> numbers{};  // that data
  bool has_tags = false;
  std::vector<int64_t> tags{};  // of cells
  bool has_regions = false;
  std::vector<int64_t> regions{};      // of cells
  std::vector<Attribute> cell_data{};  // that is asked for
  std::string names{};                 // as NameLines has them
};

// The mesh of the tetrahedra of a grid or, if there are none, of its triangles in the plane z = 0. Cells of one
// dimension less are facets where cells have tags; other points and lines are left out, with a note. Data of cells are
// those of the simplices. Without any cells
// the mesh has no simplices, and dimension 3 unless the names say that it is flat.
//
// Errors:     INVALID_ARGUMENT unless as many values have come as there are points and cells; for other cells; for
//             indices and numbers out of their range.
absl::StatusOr<Mesh> MakeVtkMesh(VtkGrid grid);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_VTK_VTK_MESH_H_
