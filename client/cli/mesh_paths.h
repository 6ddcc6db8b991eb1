// Files of meshes that commands are given; and what is said of files that are none.
#ifndef WELLSPACE_CLIENT_CLI_MESH_PATHS_H_
#define WELLSPACE_CLIENT_CLI_MESH_PATHS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::cli {

// Reads the mesh of `path` as formats::ReadMesh does.
//
// Errors:     of a cloud, a domain or a picture, by their extensions, what the file is and which command is for it.
absl::StatusOr<formats::Mesh> ReadMeshInput(const std::string& path);

// Tells early whether a mesh cannot be written to `path`, as formats::CheckMeshOutput does.
//
// Errors:     of a picture that it is one, and how a mesh is drawn.
absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension = 0,
                             bool may_have_weights = false);

}  // namespace wellspace::cli

#endif  // WELLSPACE_CLIENT_CLI_MESH_PATHS_H_
