// The log of a server whose sessions outlive it: a database, and files beside it. docs/design/durability.md
#ifndef WELLSPACE_SERVER_STORE_DURABLE_LOG_H_
#define WELLSPACE_SERVER_STORE_DURABLE_LOG_H_

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/base/options.h"
#include "server/store/ballast.h"
#include "server/store/chunk_buffers.h"
#include "server/store/data_folder.h"
#include "server/store/file_system.h"
#include "server/store/files_in_use.h"
#include "server/store/session_log.h"
#include "server/store/session_tables.h"
#include "server/store/store_health.h"
#include "server/store/written_files.h"

namespace wellspace::server {

struct DurableLogOptions {
  std::string folder;
  FileSystem* files = &PosixFileSystem();  // outlives the log, its points and its meshes
  absl::Time (*now)() = &absl::Now;        // the clock by which files in lost/ have their day
  // Called once, when it is not known any longer what is on the disk: the server has to end. By any thread, which may
  // hold locks of its own.
  std::function<void(const absl::Status& cause)> on_failure{};

  // Room that is kept for deletions, should the disk be full; 0: none.
  uint64_t ballast_bytes = 0;

  // Files of points that are open at once until they are synchronised; more uploads end with DISK_FULL.
  uint64_t max_written_files = 256;

  SessionTablesOptions tables{};                      // other ones: for tests
  uint64_t max_mesh_chunk_bytes = kMaxResponseBytes;  // other ones: for tests
};

// How much is kept so on the disk that has, or is to have, `folder`: 16 MiB, or of a small disk a sixteenth.
uint64_t BallastBytesFor(const std::string& folder);

// Thread safety: that of SessionLog.
// Invariants: (1) a change that was acknowledged outlives what Survives says; (2) what a change names was synchronised
//             before; (3) after a failure nothing is acknowledged any more.
class DurableLog final : public SessionLog {
 public:
  // Opens the folder, or makes it. What is wrong with files of sessions is no error here, but of these sessions' reads.
  //
  // Errors:     those of DataFolder::Open, DataFolder::FindDatabase, CheckLog and SessionTables::Open.
  static absl::StatusOr<std::unique_ptr<DurableLog>> Open(const DurableLogOptions& options);

  bool is_durable() const override { return true; }
  absl::StatusOr<StoredSessions> Load() override { return tables_->Load(); }
  absl::Status Commit(const SessionChange& change, Survives survives = Survives::kPowerLoss) override;
  void Forget(std::span<const AnswerKey> answers) override;
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) override {
    return tables_->ReadFeatures(session);
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) override {
    return tables_->ReadSizes(session);
  }
  std::unique_ptr<PointStore> OpenPoints(const std::string& session, int dimension, uint64_t number,
                                         std::vector<store::v1::StepRecord::Points> committed) override;
  void DropPoints(const std::string& session, uint64_t number) override;
  absl::StatusOr<std::shared_ptr<MeshSnapshot>> KeepMesh(const std::string& session, uint64_t revision, core::Mesh mesh,
                                                         const core::RunContext& context) override;
  std::shared_ptr<MeshSnapshot> FindMesh(const std::string& session, const store::v1::SessionRecord& record) override;

  absl::StatusOr<Garbage> RemoveGarbage() override;

 private:
  // A change, and the thread that waits for it.
  struct Waiting {
    const SessionChange* change = nullptr;
    Survives survives = Survives::kPowerLoss;
    uint64_t bytes = 0;
    bool is_done = false;
    absl::Status status{};
    std::condition_variable changed{};
  };

  DurableLog(const DurableLogOptions& options, std::unique_ptr<DataFolder> folder,
             std::unique_ptr<SessionTables> tables, std::unique_ptr<Folder> files_folder);

  absl::Status Enqueue(const SessionChange& change, Survives survives);
  std::vector<Waiting*> TakeBatch();
  void CommitBatch(std::span<Waiting* const> batch, std::vector<AnswerKey> forgotten);
  absl::Status Apply(std::span<Waiting* const> batch, std::span<const AnswerKey> forgotten);
  // Errors:     those of StoreHealth::CheckRoom, once the database has given back what it does not need.
  absl::Status CheckRoom();
  // Calls `apply`, and again once there may be room for what it writes.
  absl::Status ApplyWithRoom(bool frees_room, const std::function<absl::Status()>& apply);

  FileSystem& files_;
  absl::Time (*const now_)();
  const uint64_t max_mesh_chunk_bytes_;
  const std::shared_ptr<Ballast> ballast_;
  const std::shared_ptr<StoreHealth> health_;
  const std::unique_ptr<DataFolder> folder_;
  const std::unique_ptr<SessionTables> tables_;
  const std::shared_ptr<FilesInUse> in_use_;
  const std::shared_ptr<WrittenFiles> written_;
  const std::shared_ptr<ChunkBuffers> buffers_ = std::make_shared<ChunkBuffers>();

  std::mutex mutex_;
  // Guarded by mutex_.
  std::deque<Waiting*> queue_;  // the thread of the first commits for those behind it, too
  std::vector<AnswerKey> forgotten_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DURABLE_LOG_H_
