// Files of meshes that commands are given; and the errors about files that are none.
#ifndef WELLSPACE_CLIENT_CLI_MESH_PATHS_H_
#define WELLSPACE_CLIENT_CLI_MESH_PATHS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::cli {

// Reads the mesh of `path` as formats::ReadMesh does.
//
// Errors:     for a cloud, a domain or a picture, by extension, they name the kind of file and the command for it.
absl::StatusOr<formats::Mesh> ReadMeshInput(const std::string& path);

// Gives vertices of a mesh with a boundary their tags, the least of the facets at each. If `always`, origins that are
// not known are those of Steiner vertices; otherwise such a mesh gets neither.
void MarkVertices(bool always, formats::Mesh& mesh);

// Tells early whether a mesh cannot be written to `path`, as formats::CheckMeshOutput does.
//
// Errors:     of a picture that it is one, and how a mesh is drawn.
absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension = 0,
                             bool may_have_weights = false, formats::MeshOrder order = formats::MeshOrder::kFirst);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_MESH_PATHS_H_
