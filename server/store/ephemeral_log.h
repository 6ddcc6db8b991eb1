// The log of a server whose sessions end with it.
#ifndef WELLSPACE_SERVER_STORE_EPHEMERAL_LOG_H_
#define WELLSPACE_SERVER_STORE_EPHEMERAL_LOG_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/memory_mesh.h"
#include "server/store/session_log.h"

namespace wellspace::server {

// Writes nothing down: points and meshes are in memory.
//
// Thread safety: that of SessionLog.
class EphemeralLog : public SessionLog {
 public:
  bool is_durable() const override { return false; }
  absl::StatusOr<StoredSessions> Load() override { return StoredSessions(); }
  absl::Status Commit(const SessionChange& /*change*/, Survives /*survives*/) override { return absl::OkStatus(); }
  void Forget(std::span<const AnswerKey> /*answers*/) override {}
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& /*session*/) override {
    return std::vector<store::v1::StepRecord::Features>();
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& /*session*/) override {
    return std::vector<StoredSizes>();
  }
  std::unique_ptr<PointStore> OpenPoints(const std::string& /*session*/, int /*dimension*/, uint64_t /*number*/,
                                         std::vector<store::v1::StepRecord::Points> /*committed*/) override {
    return std::make_unique<MemoryPoints>();
  }
  void DropPoints(const std::string& /*session*/, uint64_t /*number*/) override {}
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& /*session*/, uint64_t revision,
                                                         core::Mesh mesh,
                                                         const core::RunContext& /*context*/) override {
    return std::make_shared<MemoryMesh>(revision, std::move(mesh));
  }
  absl::StatusOr<Garbage> RemoveGarbage() override { return Garbage(); }
  std::shared_ptr<MeshSnapshot> FindMesh(const std::string& /*session*/,
                                         const store::v1::SessionRecord& /*record*/) override {
    return nullptr;
  }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_EPHEMERAL_LOG_H_
