// Meshes in memory to writers, row after row. Private to this folder.
#ifndef WELLSPACE_CLIENT_FORMATS_MESH_ROWS_H_
#define WELLSPACE_CLIENT_FORMATS_MESH_ROWS_H_

#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/mesh.h"
#include "client/formats/write_mesh.h"

namespace wellspace::formats {

// Makes the writer of a format.
using CreateWriter = absl::StatusOr<std::unique_ptr<MeshWriter>> (*)(const std::string& path, const MeshShape& shape,
                                                                     std::stop_token stop);

// Hands the rows of `mesh`, of first order, to `writer`, and ends it.
absl::Status WriteRows(const MeshView& mesh, MeshWriter& writer);

// Writes `mesh`, of which `shape` tells what the format has a place for, with elements of second order; appends the
// notes of the writer to `notes`. Middle nodes have the mean of the ends of their edges, the origin kMiddleOrigin and
// the least tag of a facet of their edge, which is 0 inside.
//
// Memory:     that of the writer, of MiddleNodes, and 4 bytes for each of these.
// Errors:     of the writer and of MiddleNodes.
absl::Status WriteSecondOrder(const MeshView& mesh, const MeshShape& shape, const std::string& path,
                              CreateWriter create, const std::stop_token& stop, std::vector<std::string>& notes);

// A writer of second order, which gets rows of first order: it keeps them all, and writes the file at its end.
std::unique_ptr<MeshWriter> CreateSecondOrder(const std::string& path, const MeshShape& shape, CreateWriter create,
                                              std::stop_token stop);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_MESH_ROWS_H_
