// A mesh in memory, as the core has made it.
#ifndef WELLSPACE_SERVER_STORE_MEMORY_MESH_H_
#define WELLSPACE_SERVER_STORE_MEMORY_MESH_H_

#include <atomic>
#include <memory>

#include "server/store/mesh_chunks.h"
#include "server/store/mesh_snapshot.h"

namespace wellspace::server {

// Thread safety: that of MeshSnapshot.
class MemoryMesh final : public MeshSnapshot {
 public:
  MemoryMesh(uint64_t revision, core::Mesh mesh);

  uint64_t memory_bytes() const override { return chunks_->memory_bytes(); }
  void KeepMemory(MemoryReservation memory) override { chunks_->KeepMemory(std::move(memory)); }
  void MakeObsolete() override {}
  void YieldMemory() override {
    if (!yields_.exchange(true)) {
      chunks_->YieldMemory();
    }
  }
  absl::StatusOr<v1::MeshMetadata> Metadata(bool with_boundary) const override;
  absl::StatusOr<uint64_t> ChunkCount(bool with_boundary) const override { return chunks_->count(with_boundary); }
  absl::StatusOr<grpc::ByteBuffer> SerializeChunk(uint64_t index, int field, bool with_boundary) const override;
  absl::StatusOr<core::Mesh> Load(const core::RunContext& context) const override;
  absl::StatusOr<std::shared_ptr<const core::Mesh>> Whole(const core::RunContext& context) const override;
  absl::StatusOr<uint64_t> WholeBytes() const override { return 0; }
  absl::StatusOr<core::HugeVector<double>> LoadPoints(const core::RunContext& context) const override;
  absl::Status CheckSame(const core::Mesh& made) const override;

 private:
  const std::shared_ptr<MeshChunks> chunks_;
  std::atomic<bool> yields_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MEMORY_MESH_H_
