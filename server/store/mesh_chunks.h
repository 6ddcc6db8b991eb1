// A mesh cut into chunks for a stream.
#ifndef WELLSPACE_SERVER_STORE_MESH_CHUNKS_H_
#define WELLSPACE_SERVER_STORE_MESH_CHUNKS_H_

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/meshers/mesher.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/base/options.h"
#include "server/jobs/memory_budget.h"

namespace wellspace::server {

// An array of a mesh, cut into chunks of as many rows, but for the last.
struct MeshArray {
  int field = 0;  // of v1.MeshChunk
  const void* data = nullptr;
  uint64_t row_bytes = 0;
  uint64_t rows = 0;
  uint64_t rows_per_chunk = 0;

  uint64_t chunks() const { return (rows + rows_per_chunk - 1) / rows_per_chunk; }
};

// The arrays of `mesh` in the order in which they are sent, moved_vertices excepted, which come beside the points. A
// response with a chunk has at most `max_bytes`.
std::vector<MeshArray> CutMesh(const core::Mesh& mesh, uint64_t max_bytes = kMaxResponseBytes);

// The numbers of the vertices, simplices and facets of a part of a mesh: see v1.MeshChunk.
struct PartArrays {
  core::HugeVector<uint32_t> vertex_ids;
  core::HugeVector<uint32_t> vertex_owners;
  core::HugeVector<uint32_t> vertex_rows;
  core::HugeVector<uint32_t> simplex_ids;
  core::HugeVector<uint32_t> simplex_owners;
  core::HugeVector<uint32_t> facet_ids;
};

// Whether only clients that ask for the boundary get this array.
bool IsOfBoundary(int field);

// The chunks that a mesh is cut into.
//
// Thread safety: const functions are thread-safe.
// Invariants: the same mesh is always cut alike; each chunk fits into a response of kMaxResponseBytes. Who asks for the
//             boundary gets other chunks than who does not.
class MeshChunks {
 public:
  // Some values of one array of the mesh, as they lie in memory and on the wire.
  struct Chunk {
    int field = 0;  // of v1.MeshChunk
    const void* data = nullptr;
    uint64_t size = 0;                  // bytes
    std::span<const uint32_t> moved{};  // of the vertices of a chunk of points
  };

  // Memory of chunks that a stream holds a copy of: one that is written, one in the buffers of the connection.
  static constexpr uint64_t kBytesOnTheirWay = 2 * kMaxResponseBytes;

  explicit MeshChunks(core::Mesh mesh, uint64_t max_bytes = kMaxResponseBytes);
  // Of a part of a larger mesh, whose numbers follow all else.
  MeshChunks(core::Mesh mesh, PartArrays part, uint64_t max_bytes = kMaxResponseBytes);

  // Memory of the mesh, and of chunks on their way, in bytes.
  uint64_t memory_bytes() const;
  // Keeps the reservation of its memory as long as the mesh lives.
  void KeepMemory(MemoryReservation memory) { memory_ = std::move(memory); }
  // It is kept until other work wants it. To be called once, after that.
  void YieldMemory() { memory_.MakeYielding(); }

  const core::Mesh& mesh() const { return mesh_; }
  uint64_t count(bool with_boundary = false) const;

  // REQUIRES:   index < count(with_boundary).
  Chunk Get(uint64_t index, bool with_boundary = false) const;

 private:
  MemoryReservation memory_;
  core::Mesh mesh_;
  PartArrays part_;
  std::vector<MeshArray> arrays_;  // in the order in which they are sent
};

// The head of a response that has nothing but the chunk number `index`, in field `field`: `size` bytes, which are
// the values of the array, follow it as they are. `moved`: those of the vertices of a chunk of points.
std::string ChunkHead(int field, uint64_t index, uint32_t crc32c, std::span<const uint32_t> moved, int array_field,
                      uint64_t size);

// A response that has nothing but the chunk number `index` of `mesh`, with its checksum, in field `field`: serialized
// as protocol buffers would, but without a copy of the values. They are those of the mesh, which lives as long as the
// answer.
//
// REQUIRES:   index < mesh->count(with_boundary).
// Guarantees: the same bytes whenever it is asked.
// Complexity: one pass over the values, for the checksum.
grpc::ByteBuffer SerializeChunk(const std::shared_ptr<const MeshChunks>& mesh, uint64_t index, int field,
                                bool with_boundary = false);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MESH_CHUNKS_H_
