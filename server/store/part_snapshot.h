// One part of a mesh that was cut for solvers on many ranks, as it is sent.
#ifndef WELLSPACE_SERVER_STORE_PART_SNAPSHOT_H_
#define WELLSPACE_SERVER_STORE_PART_SNAPSHOT_H_

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"
#include "core/partition/mesh_part.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/jobs/memory_budget.h"
#include "server/store/mesh_chunks.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// Immutable: a download holds it for as long as it wants.
//
// Thread safety: thread-safe.
// Invariants: the same part of the same mesh has the same chunks, byte for byte, whenever it is taken out.
class PartSnapshot {
 public:
  // The cut that a part is of, and the part's number.
  struct Cut {
    const core::PartitionedMesh& mesh;
    const core::PartOwners& owners;
    uint32_t parts = 1;
    uint32_t part = 0;
  };

  // Of the mesh `whole`, whose metadata are `metadata`, with or without the boundary.
  //
  // Complexity: O(the part).
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  static absl::StatusOr<std::shared_ptr<PartSnapshot>> Make(const core::Mesh& whole, const Cut& cut,
                                                            core::MeshPart part, v1::MeshMetadata metadata,
                                                            bool with_boundary, const core::RunContext& context);
  // Memory of the arrays that Make adds to those of the part, and of chunks on their way. Unit: bytes.
  static uint64_t BytesFor(const core::Mesh& whole, const core::PartSelection& selection);

  // Its memory, chunks on their way included. Unit: bytes.
  uint64_t memory_bytes() const { return chunks_->memory_bytes(); }
  // Keeps the reservation of its memory as long as it lives. To be called once, before others know it.
  void KeepMemory(MemoryReservation memory) { chunks_->KeepMemory(std::move(memory)); }

  // The message that is sent ahead of the chunks.
  const v1::MeshMetadata& metadata() const { return metadata_; }
  uint64_t chunk_count() const { return metadata_.chunk_count(); }

  // A response that has nothing but the chunk number `index`, with its checksum, in field `field`.
  //
  // REQUIRES:   index < chunk_count().
  grpc::ByteBuffer SerializeChunk(uint64_t index, int field) const {
    return server::SerializeChunk(chunks_, index, field, with_boundary_);
  }

 private:
  PartSnapshot(v1::MeshMetadata metadata, std::shared_ptr<MeshChunks> chunks, bool with_boundary)
      : metadata_(std::move(metadata)), chunks_(std::move(chunks)), with_boundary_(with_boundary) {}

  const v1::MeshMetadata metadata_;
  const std::shared_ptr<MeshChunks> chunks_;
  const bool with_boundary_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_PART_SNAPSHOT_H_
