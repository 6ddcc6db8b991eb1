// The difference between the meshes of a session at two revisions, as it is sent.
#ifndef WELLSPACE_SERVER_STORE_DELTA_SNAPSHOT_H_
#define WELLSPACE_SERVER_STORE_DELTA_SNAPSHOT_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/mesh_delta.h"
#include "grpcpp/support/byte_buffer.h"
#include "grpcpp/support/slice.h"
#include "server/base/options.h"
#include "server/jobs/memory_budget.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// The responses that bring it, ready to be sent. Immutable: a download holds it for as long as it wants.
//
// Thread safety: thread-safe.
// Invariants: the parts that a download without the boundary gets are the first ones.
class DeltaSnapshot {
 public:
  // `delta` leads from the mesh of revision `base_revision` to the mesh `next`, of `revision`. A response has at most
  // `max_bytes`.
  DeltaSnapshot(uint64_t base_revision, uint64_t revision, const core::MeshDelta& delta, const core::Mesh& next,
                uint64_t max_bytes = kMaxResponseBytes);

  uint64_t base_revision() const { return base_revision_; }
  uint64_t revision() const { return revision_; }
  // Its memory, in bytes.
  uint64_t memory_bytes() const { return memory_bytes_; }
  // Keeps the reservation of its memory as long as it lives. To be called once, before others know it.
  void KeepMemory(MemoryReservation memory) { memory_ = std::move(memory); }

  // The message that is sent ahead of the parts; their number and the checksums are in it.
  v1::MeshMetadata Metadata(bool with_boundary) const;
  uint64_t PartCount(bool with_boundary) const { return with_boundary ? parts_.size() : plain_parts_; }

  // A response that has nothing but the part number `index`.
  //
  // REQUIRES:   index < PartCount(with_boundary), for some `with_boundary`.
  grpc::ByteBuffer Part(uint64_t index) const { return {&parts_[index], 1}; }

 private:
  MemoryReservation memory_;
  const uint64_t base_revision_;
  const uint64_t revision_;
  std::string metadata_;            // a serialized MeshMetadata, with the boundary
  std::vector<grpc::Slice> parts_;  // serialized DownloadMeshResponses
  uint64_t plain_parts_ = 0;
  uint64_t memory_bytes_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DELTA_SNAPSHOT_H_
