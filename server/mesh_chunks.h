// A mesh cut into chunks for a stream.
#ifndef WELLSPACE_SERVER_MESH_CHUNKS_H_
#define WELLSPACE_SERVER_MESH_CHUNKS_H_

#include <cstdint>

#include "core/mesher.h"
#include "server/options.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// Makes any chunk of a mesh when it is asked for, so that only those on their way take memory besides the mesh.
//
// Thread safety: immutable; thread-safe.
// Invariants: the same mesh gives the same chunks, byte for byte; each fits into a response of kMaxResponseBytes.
class MeshChunks {
 public:
  explicit MeshChunks(core::Mesh mesh, uint64_t max_bytes = kMaxResponseBytes);

  const core::Mesh& mesh() const { return mesh_; }
  uint64_t count() const { return point_chunks_ + simplex_chunks_ + input_chunks_; }

  // The chunk number `index` with its checksum.
  //
  // REQUIRES:   index < count().
  // Complexity: O(bytes of the chunk).
  v1::MeshChunk Make(uint64_t index) const;

 private:
  core::Mesh mesh_;
  uint64_t points_per_chunk_ = 0;     // rows
  uint64_t simplices_per_chunk_ = 0;  // rows
  uint64_t inputs_per_chunk_ = 0;
  uint64_t point_chunks_ = 0;
  uint64_t simplex_chunks_ = 0;
  uint64_t input_chunks_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_MESH_CHUNKS_H_
