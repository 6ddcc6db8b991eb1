// The mesh of a session at one revision.
#ifndef WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_
#define WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/mesh/mesh.h"
#include "grpcpp/support/byte_buffer.h"
#include "server/jobs/memory_budget.h"
#include "wellspace/store/v1/records.pb.h"
#include "wellspace/v1/mesh.pb.h"

namespace wellspace::server {

// A mesh as it was at one revision of its session, in memory or in a file. Immutable: a download holds it for as long
// as it wants, also when the session has another mesh by then.
//
// Thread safety: thread-safe.
class MeshSnapshot {
 public:
  virtual ~MeshSnapshot() = default;
  MeshSnapshot(const MeshSnapshot&) = delete;
  MeshSnapshot& operator=(const MeshSnapshot&) = delete;

  // The record that names the mesh in a SessionRecord: all that is known of it without a look at its arrays. Of a mesh
  // that is in memory alone the record has nothing about a file.
  const store::v1::MeshRecord& record() const { return record_; }
  uint64_t revision() const { return record_.revision(); }

  // Its memory, chunks on their way included, in bytes.
  virtual uint64_t memory_bytes() const = 0;
  // Memory of the mesh that Load makes, in bytes: about as many.
  uint64_t loaded_bytes() const {
    return LoadedBytes(record_.domain_low_size(), record_.vertices(), record_.simplices());
  }
  static uint64_t LoadedBytes(uint64_t dimension, uint64_t vertices, uint64_t simplices) {
    return vertices * dimension * sizeof(double) + simplices * (dimension + 1) * sizeof(uint32_t);
  }
  // Keeps the reservation of its memory as long as it lives. To be called once, before others know it.
  virtual void KeepMemory(MemoryReservation memory) = 0;

  // The session has another mesh now: this one's file is removed at the end of its use.
  virtual void MakeObsolete() = 0;
  // Other work may have its memory from now on: it is kept until that wants it. No lock of a session is to be held.
  virtual void YieldMemory() {}

  // The message that is sent ahead of the chunks; their number and the revision are in it.
  //
  // Errors:     of this and the following: DATA_LOSS, naming the file.
  virtual absl::StatusOr<v1::MeshMetadata> Metadata(bool with_boundary) const = 0;
  virtual absl::StatusOr<uint64_t> ChunkCount(bool with_boundary) const = 0;

  // A response that has nothing but the chunk number `index`, with its checksum, in field `field`.
  //
  // REQUIRES:   index < ChunkCount(with_boundary).
  // Guarantees: the same bytes whenever it is asked, from memory or from a file.
  virtual absl::StatusOr<grpc::ByteBuffer> SerializeChunk(uint64_t index, int field, bool with_boundary) const = 0;

  // A copy of the arrays that core::Mesher::Update needs.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<core::Mesh> Load(const core::RunContext& context) const = 0;

  // All of it but the statistics, for which others ask Metadata. It may be this one's own.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<std::shared_ptr<const core::Mesh>> Whole(const core::RunContext& context) const = 0;
  // Memory of that, in bytes; 0 where it is this one's own.
  virtual absl::StatusOr<uint64_t> WholeBytes() const = 0;

  // A copy of its points: vertices x dimension, row-major.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<core::HugeVector<double>> LoadPoints(const core::RunContext& context) const = 0;

  // Errors:     INTERNAL: `made` is another mesh.
  virtual absl::Status CheckSame(const core::Mesh& made) const = 0;

 protected:
  // The error of CheckSame where the meshes differ.
  static absl::Status OtherMesh() {
    return absl::InternalError("the steps of the session make another mesh than they made before");
  }

  explicit MeshSnapshot(store::v1::MeshRecord record) : record_(std::move(record)) {}

 private:
  const store::v1::MeshRecord record_;
};

// The record of `mesh` at `revision`, but for its file.
store::v1::MeshRecord RecordOf(uint64_t revision, const core::Mesh& mesh);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_
