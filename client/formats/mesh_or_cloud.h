// Files of which it is not known whether they hold a mesh or points.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_OR_CLOUD_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_OR_CLOUD_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"
#include "client/formats/read_cloud.h"

namespace wellspace::formats {

struct MeshOrCloud {
  bool is_mesh = false;
  std::string format;                   // the name of that in which it was read
  Mesh mesh;                            // of a cloud: its points, and no simplices
  std::vector<Attribute> attributes{};  // of vertices
  uint64_t input_vertices = 0;          // of a cloud all; of a mesh those that its file tells, or 0
  std::vector<std::string> notes{};     // see PointCloud; also the following
  uint64_t skipped = 0;

  MeshView View() const {
    MeshView view = mesh.View();
    view.attributes = attributes;
    view.input_vertices = input_vertices;
    return view;
  }
};

// Reads `path` as ReadMesh does if it is a mesh, otherwise as ReadCloud. A file that may be either (.vtu, .vtk, .vtp)
// is a mesh if it can be read as one, otherwise a note says why it is not; .node is one if its .ele is there. With
// CloudOptions::format, --columns and the like it is a cloud. Data of points of VTK's formats are attributes,
// and with CloudOptions::keep_attributes data of cells are those of simplices.
//
// Errors:     of both.
absl::StatusOr<MeshOrCloud> ReadMeshOrCloud(const std::string& path, const CloudOptions& options);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_OR_CLOUD_H_
