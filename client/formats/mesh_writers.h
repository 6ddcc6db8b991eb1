// The writers behind WriteMesh, one for each format. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_

#include <stop_token>
#include <string>

#include "absl/status/status.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

absl::Status WriteVtu(const std::string& path, const MeshView& mesh, std::stop_token stop);
absl::Status WriteNpz(const std::string& path, const MeshView& mesh, std::stop_token stop);
// `path` is that of either file; both are written.
absl::Status WriteNodeAndEle(const std::string& path, const MeshView& mesh, std::stop_token stop);

// "a/mesh.ele" of "a/mesh.node" and the other way round: `path` with its extension replaced.
std::string WithExtension(const std::string& path, const std::string& extension);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_
