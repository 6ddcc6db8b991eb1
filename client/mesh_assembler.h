// A mesh from the chunks of a stream, with nothing that the server says believed unchecked.
#ifndef WELLSPACE_CLIENT_MESH_ASSEMBLER_H_
#define WELLSPACE_CLIENT_MESH_ASSEMBLER_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/client.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::client {

// Takes the metadata, then the chunks in their order.
//
// Thread safety: thread-compatible.
// Invariants: memory grows with what has arrived, not with what was announced.
class MeshAssembler {
 public:
  // REQUIRES:   dimension >= 1, that of the points that were sent; `input_points` is their number.
  MeshAssembler(int dimension, uint64_t input_points) : dimension_(dimension), input_points_(input_points) {}

  // Errors:     DATA_LOSS, naming what is wrong; the stream is to be given up.
  absl::Status SetMetadata(const v1::MeshMetadata& metadata);
  absl::Status AddChunk(const v1::MeshChunk& chunk);

  // The mesh, once the stream has ended.
  //
  // Guarantees: the arrays have the shapes that client::Mesh promises, all numbers of vertices are in range.
  // Errors:     DATA_LOSS when something is missing.
  absl::StatusOr<Mesh> Finish();

 private:
  const int dimension_;
  const uint64_t input_points_;
  bool has_metadata_ = false;
  uint64_t vertex_count_ = 0;
  uint64_t simplex_count_ = 0;
  uint64_t chunk_count_ = 0;
  uint64_t next_chunk_ = 0;
  Mesh mesh_;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_MESH_ASSEMBLER_H_
