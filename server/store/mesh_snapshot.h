// The mesh of a session at one revision.
#ifndef WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_
#define WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/mesh.h"
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
  // What is known of it without any look at its arrays.
  struct Figures {
    uint64_t revision = 0;
    uint64_t vertices = 0;
    uint64_t simplices = 0;
    std::vector<double> domain_low{};
    std::vector<double> domain_high{};
  };

  virtual ~MeshSnapshot() = default;
  MeshSnapshot(const MeshSnapshot&) = delete;
  MeshSnapshot& operator=(const MeshSnapshot&) = delete;

  const Figures& figures() const { return figures_; }
  uint64_t revision() const { return figures_.revision; }

  // What names it in a SessionRecord; none of one that is in memory alone.
  virtual std::optional<store::v1::MeshRecord> record() const = 0;

  // What it takes in memory, chunks on their way included.
  virtual uint64_t memory_bytes() const = 0;
  // What Load makes takes about as much.
  uint64_t loaded_bytes() const {
    return LoadedBytes(figures_.domain_low.size(), figures_.vertices, figures_.simplices);
  }
  static uint64_t LoadedBytes(uint64_t dimension, uint64_t vertices, uint64_t simplices) {
    return vertices * dimension * sizeof(double) + simplices * (dimension + 1) * sizeof(uint32_t);
  }
  // Keeps what is reserved for it as long as it lives. To be called once, before others know it.
  virtual void KeepMemory(MemoryReservation memory) = 0;

  // The session has another mesh now: what this has on disk goes with it.
  virtual void MakeObsolete() = 0;

  // What is sent ahead of the chunks, their number and the revision included.
  //
  // Errors:     of this and the following: DATA_LOSS, naming the file.
  virtual absl::StatusOr<v1::MeshMetadata> Metadata(bool with_boundary) const = 0;
  virtual absl::StatusOr<uint64_t> ChunkCount(bool with_boundary) const = 0;

  // A response that has nothing but the chunk number `index`, with its checksum, in field `field`.
  //
  // REQUIRES:   index < ChunkCount(with_boundary).
  // Guarantees: the same bytes whenever it is asked, from memory or from a file.
  virtual absl::StatusOr<grpc::ByteBuffer> SerializeChunk(uint64_t index, int field, bool with_boundary) const = 0;

  // A copy of what core::Mesher::Update needs of it.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<core::Mesh> Load(const core::RunContext& context) const = 0;

  // All of it but the statistics, for which others ask Metadata. It may be this one's own.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<std::shared_ptr<const core::Mesh>> Whole(const core::RunContext& context) const = 0;

  // A copy of its points: vertices x dimension, row-major.
  //
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  virtual absl::StatusOr<core::HugeVector<double>> LoadPoints(const core::RunContext& context) const = 0;

  // Errors:     INTERNAL: `made` is another mesh.
  virtual absl::Status CheckSame(const core::Mesh& made) const = 0;

 protected:
  // What CheckSame says of another mesh.
  static absl::Status OtherMesh() {
    return absl::InternalError("the steps of the session make another mesh than they made before");
  }

  explicit MeshSnapshot(Figures figures) : figures_(std::move(figures)) {}

 private:
  const Figures figures_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MESH_SNAPSHOT_H_
