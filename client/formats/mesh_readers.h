// The readers behind ReadMesh, one for each format. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// Numbers beside a mesh that are asked for. A reader leaves out those that its format has no place for.
struct MeshNumbers {
  std::string of_vertices{};  // the name of those that Mesh::numbers gets; empty: none
  bool of_simplices = false;  // all: Mesh::simplex_attributes gets them
};

absl::StatusOr<Mesh> ReadVtu(const std::string& path, const MeshNumbers& numbers);
// With numbers of vertices the simplices may be missing.
absl::StatusOr<Mesh> ReadNpz(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> ReadMsh(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> ReadVtk(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> ReadVtpMesh(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> ReadMedit(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> ReadAdcirc(const std::string& path, const MeshNumbers& numbers);
absl::StatusOr<Mesh> Read2dm(const std::string& path, const MeshNumbers& numbers);
// `path` is that of either file.
absl::StatusOr<Mesh> ReadNodeAndEle(const std::string& path, const MeshNumbers& numbers);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_
