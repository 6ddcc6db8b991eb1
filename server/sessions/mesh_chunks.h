// A mesh cut into chunks for a stream.
#ifndef WELLSPACE_SERVER_SESSIONS_MESH_CHUNKS_H_
#define WELLSPACE_SERVER_SESSIONS_MESH_CHUNKS_H_

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "core/mesher.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/base/options.h"
#include "server/jobs/memory_budget.h"

namespace wellspace::server {

// How a mesh is cut.
//
// Thread safety: const functions are thread-safe.
// Invariants: the same mesh is always cut alike; each chunk fits into a response of kMaxResponseBytes.
class MeshChunks {
 public:
  // Some values of one array of the mesh, as they lie in memory and on the wire.
  struct Chunk {
    int field = 0;  // of v1.MeshChunk
    const void* data = nullptr;
    uint64_t size = 0;                  // bytes
    std::span<const uint32_t> moved{};  // of the vertices of a chunk of points
  };

  explicit MeshChunks(core::Mesh mesh, uint64_t max_bytes = kMaxResponseBytes);

  // What the mesh takes, and chunks on their way.
  uint64_t memory_bytes() const;
  // Keeps what is reserved for it as long as the mesh lives.
  void KeepMemory(MemoryReservation memory) { memory_ = std::move(memory); }

  const core::Mesh& mesh() const { return mesh_; }
  uint64_t count() const { return point_chunks_ + weight_chunks_ + simplex_chunks_ + input_chunks_; }

  // REQUIRES:   index < count().
  Chunk Get(uint64_t index) const;

 private:
  MemoryReservation memory_;
  core::Mesh mesh_;
  uint64_t points_per_chunk_ = 0;     // rows
  uint64_t simplices_per_chunk_ = 0;  // rows
  uint64_t weights_per_chunk_ = 0;
  uint64_t inputs_per_chunk_ = 0;
  uint64_t point_chunks_ = 0;
  uint64_t weight_chunks_ = 0;
  uint64_t simplex_chunks_ = 0;
  uint64_t input_chunks_ = 0;
};

// A response that has nothing but the chunk number `index` of `mesh`, with its checksum, in field `field`: serialized
// as protocol buffers would, but without a copy of the values. They are those of the mesh, which lives as long as the
// answer.
//
// REQUIRES:   index < mesh->count().
// Guarantees: the same bytes whenever it is asked.
// Complexity: one pass over the values, for the checksum.
grpc::ByteBuffer SerializeChunk(const std::shared_ptr<const MeshChunks>& mesh, uint64_t index, int field);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_SESSIONS_MESH_CHUNKS_H_
