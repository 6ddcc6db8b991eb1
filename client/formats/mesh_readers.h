// The readers behind ReadMesh, one for each format. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// `numbers`, unless it is empty, is the name of numbers of the vertices that Mesh::numbers gets, if the file has them.
absl::StatusOr<Mesh> ReadVtu(const std::string& path, const std::string& numbers);
// With `numbers` the simplices may be missing.
absl::StatusOr<Mesh> ReadNpz(const std::string& path, const std::string& numbers);
absl::StatusOr<Mesh> ReadMsh(const std::string& path, const std::string& numbers);
absl::StatusOr<Mesh> ReadVtk(const std::string& path);
absl::StatusOr<Mesh> ReadVtpMesh(const std::string& path);
absl::StatusOr<Mesh> ReadMedit(const std::string& path);
absl::StatusOr<Mesh> ReadAdcirc(const std::string& path);
absl::StatusOr<Mesh> Read2dm(const std::string& path);
// `path` is that of either file.
absl::StatusOr<Mesh> ReadNodeAndEle(const std::string& path);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_READERS_H_
