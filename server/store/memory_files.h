// Points and meshes that end with the process.
#ifndef WELLSPACE_SERVER_STORE_MEMORY_FILES_H_
#define WELLSPACE_SERVER_STORE_MEMORY_FILES_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/files.h"
#include "server/store/memory_mesh.h"

namespace wellspace::server {

// Each is in memory as long as the session holds it.
//
// Thread safety: that of Files.
class MemoryFiles : public Files {
 public:
  std::unique_ptr<PointStore> OpenPoints(SessionPoints /*points*/) override { return std::make_unique<MemoryPoints>(); }
  void DropPoints(const std::string& /*session*/, const store::v1::PointsFile& /*file*/) override {}
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& /*session*/, uint64_t revision,
                                                         uint64_t /*epoch*/, core::Mesh mesh,
                                                         const core::RunContext& /*context*/) override {
    return std::make_shared<MemoryMesh>(revision, std::move(mesh));
  }
  std::shared_ptr<MeshSnapshot> FindMesh(const store::v1::SessionRecord& /*record*/) override { return nullptr; }
  void RemoveAll(const store::v1::SessionRecord& /*deleted*/) override {}
  absl::StatusOr<Garbage> RemoveGarbage(const ReadCensus& /*read*/) override { return Garbage(); }
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_MEMORY_FILES_H_
