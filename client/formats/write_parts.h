// Files of partitioned meshes that are more than the mesh of a part.
#ifndef WELLSPACE_CLIENT_FORMATS_WRITE_PARTS_H_
#define WELLSPACE_CLIENT_FORMATS_WRITE_PARTS_H_

#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/mesh.h"
#include "client/formats/mesh_part.h"

namespace wellspace::formats {

// Writes VTK's file of pieces (.pvtu) for the files of parts, which lie beside it: `shape` is that of any of them.
//
// Errors:     of opening and writing.
absl::Status WritePvtu(const std::string& path, const MeshShape& shape, const std::vector<std::string>& pieces,
                       std::stop_token stop);

// Writes a mesh in 2-D or 3-D and its partition as one file of Gmsh's MSH 4.1, in binary: an entity for each region in
// each part, one for each part of the boundary in each, and the ghosts of every part. Gmsh numbers parts from 1 on.
// Parts that are kept otherwise are appended to `notes`, if that is there.
//
// Errors:     of opening and writing; INVALID_ARGUMENT for another dimension, or too many vertices for the format.
absl::Status WritePartitionedMsh(const std::string& path, const MeshView& mesh, const PartitionView& partition,
                                 std::stop_token stop, std::vector<std::string>* notes);

}  // namespace wellspace::formats

#endif  // WELLSPACE_CLIENT_FORMATS_WRITE_PARTS_H_
