// The writers behind CreateMesh, one for each format. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"
#include "client/formats/tetgen/tetgen.h"
#include "client/formats/write_mesh.h"

namespace wellspace::formats {

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtu(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtkHdf(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNpz(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop);
// `path` is that of either file; both are written, and for a boundary BoundaryFilesOf.
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateNodeAndEle(const std::string& path, const MeshShape& shape,
                                                             std::stop_token stop);

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMsh22(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMsh41(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop);
// These have no place for weights.
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateMedit(const std::string& path, const MeshShape& shape,
                                                        std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateSu2(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateAbaqus(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop);

// These are of the plane alone.
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateAdcirc(const std::string& path, const MeshShape& shape,
                                                         std::stop_token stop);
absl::StatusOr<std::unique_ptr<MeshWriter>> Create2dm(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop);

absl::StatusOr<std::unique_ptr<MeshWriter>> CreateVtk(const std::string& path, const MeshShape& shape,
                                                      std::stop_token stop);
// All of XdmfFilesOf are written, the last two for a boundary.
absl::StatusOr<std::unique_ptr<MeshWriter>> CreateXdmf(const std::string& path, const MeshShape& shape,
                                                       std::stop_token stop);

// How many rows a writer has got.
struct RowCounts {
  uint64_t vertices = 0;
  uint64_t weights = 0;
  uint64_t simplex_regions = 0;
  uint64_t simplices = 0;
  uint64_t facets = 0;
  uint64_t attribute_values = 0;
  uint64_t ridges = 0;
};

// INTERNAL unless as many rows have come as `shape` says.
absl::Status CheckComplete(const MeshShape& shape, const RowCounts& rows);

// The files of a mesh in XDMF: "mesh.xdmf", its arrays "mesh.h5", "mesh_boundary.xdmf", "mesh_boundary.h5".
std::vector<std::string> XdmfFilesOf(const std::string& path);

// "a/mesh.ele" of "a/mesh.node" and the other way round: `path` with its extension replaced.
std::string WithExtension(const std::string& path, const std::string& extension);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_WRITERS_H_
