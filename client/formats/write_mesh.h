// Meshes to files.
//
// Formats:
//   vtu   VTK's XML, 2-D and 3-D only: arrays inline in base64, compressed by zlib; points padded to 3-D; point data
//         "input", 1 for the vertices that are input points.
//   npz   numpy's archive of arrays: `points` of type Float64, vertices x dimension; `simplices` of type UInt32,
//         simplices x (dimension + 1); deflated.
//   node  TetGen's and Triangle's pair of .node and .ele, given by either name; indices start at 0. TetGen itself knows
//         3-D only, Triangle 2-D.
#ifndef WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_
#define WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/mesh.h"

namespace wellspace::formats {

// The names that `format` may take below.
std::vector<std::string> MeshFormats();

// Tells early whether WriteMesh would refuse `path` and `format` for a mesh of `dimension` (0: not known yet), as far as
// that can be known without writing.
absl::Status CheckMeshOutput(const std::string& path, const std::string& format, int dimension = 0);

// Writes `mesh` to `path`; "-" is standard output. `format` empty: by the extension; standard output is vtu.
//
// Guarantees: coordinates read back to the bit; on an error, or when `stop` ends it with CANCELLED, no file is left or
//             changed.
// Errors:     INVALID_ARGUMENT for an unknown format, or one that cannot hold this mesh or go there; of writing, naming
//             the file.
absl::Status WriteMesh(const std::string& path, const std::string& format, const MeshView& mesh,
                       std::stop_token stop = {});

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_WRITE_MESH_H_
