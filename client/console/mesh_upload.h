// Files that come to the console, and the sessions that are made of them.
#ifndef WELLSPACE_CLIENT_CONSOLE_MESH_UPLOAD_H_
#define WELLSPACE_CLIENT_CONSOLE_MESH_UPLOAD_H_

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/client.h"
#include "client/formats/io/temporary_folder.h"

namespace wellspace::console {

struct MeshUpload {
  std::string body_path;           // the file that has come; it is moved away
  std::string name;                // as its sender calls it; any bytes. Its extension tells the format
  client::MeshOptions parameters;  // but for the dimension, which is that of the file
  client::CrossingRule crossings = client::CrossingRule::kRefuse;
};

struct UploadedMesh {
  client::Operation operation;
  std::vector<std::string> notes;  // on how the file was read
};

// The last part of `name` with letters, digits, dots, dashes and underscores alone; at most 100 bytes, of which the
// extensions are kept. Never empty, nor hidden, nor a path.
std::string SafeFileName(std::string_view name);

// `status` without the path of the folder, which means nothing to the page.
absl::Status WithoutFolder(const absl::Status& status, const formats::TemporaryFolder& folder);

// Reads the file, makes a session with the label "file" of it, which has its points, segments and triangles, and starts
// its refinement. As for the tool, .stl, .smesh and 3-D .poly are surfaces, whose inside is meant. On
// an error no session is left.
//
// Errors:     those of reading, with the name of the file; of the client's calls; CANCELLED.
absl::StatusOr<UploadedMesh> UploadMesh(client::Client& client, const MeshUpload& upload,
                                        const client::CallOptions& call);

}  // namespace wellspace::console

#endif  // WELLSPACE_CLIENT_CONSOLE_MESH_UPLOAD_H_
