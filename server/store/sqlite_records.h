// The records of a server whose sessions outlive it: a SQLite database.
#ifndef WELLSPACE_SERVER_STORE_SQLITE_RECORDS_H_
#define WELLSPACE_SERVER_STORE_SQLITE_RECORDS_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/store/ballast.h"
#include "server/store/change_queue.h"
#include "server/store/data_folder.h"
#include "server/store/records.h"
#include "server/store/session_tables.h"
#include "server/store/store_health.h"

namespace wellspace::server {

// Applies changes in groups: those that wait are one transaction. Who opens the database owns all sessions in it.
//
// Thread safety: that of Records.
// Invariants: (1) a change that was acknowledged outlives the event of its Survives; (2) after a failure nothing is
//             acknowledged any more.
class SqliteRecords final : public Records {
 public:
  // `folder`, which may be null, is held as long as `tables` are open. Where there is no room, deletions have that of
  // `ballast`, and so has the taking over; without that all can be read, and the first change tries again.
  //
  // Errors:     those of SessionTables::TakeAll but DISK_FULL.
  static absl::StatusOr<std::unique_ptr<SqliteRecords>> Open(std::shared_ptr<DataFolder> folder,
                                                             std::unique_ptr<SessionTables> tables,
                                                             std::shared_ptr<StoreHealth> health,
                                                             std::shared_ptr<Ballast> ballast);

  bool is_durable() const override { return true; }
  uint64_t epoch() const override { return epoch_; }
  absl::StatusOr<StoredSessions> Load() override;
  absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session) override;
  absl::Status Apply(const SessionChange& change, Survives survives) override { return queue_.Apply(change, survives); }
  absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request) override {
    return tables_->FindAnswer(request);
  }
  void Forget(std::span<const AnswerKey> answers) override { queue_.Forget(answers); }
  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session) override {
    return tables_->ReadFeatures(session);
  }
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session) override {
    return tables_->ReadSizes(session);
  }
  absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range) override { return tables_->ReadUsage(range); }
  absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadRecord(const std::string& session) override {
    return tables_->ReadState(session);
  }
  absl::StatusOr<Census> ReadCensus() override;

 private:
  SqliteRecords(std::shared_ptr<DataFolder> folder, std::unique_ptr<SessionTables> tables,
                std::shared_ptr<StoreHealth> health, std::shared_ptr<Ballast> ballast, uint64_t epoch);

  // Has all sessions taken over, if that was not done yet. One thread at a time.
  //
  // Errors:     those of SessionTables::TakeAll.
  absl::Status TakeAll();
  absl::Status ApplyTogether(std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                             Survives survives);
  // Has committed changes take up less room, once that is worth it.
  void Checkpoint();
  // Errors:     those of StoreHealth::CheckRoom, once the database has given back unused room.
  absl::Status CheckRoom();
  // Calls `apply`, and again once there may be room for its writes.
  absl::Status ApplyWithRoom(bool frees_room, const std::function<absl::Status()>& apply);

  const std::shared_ptr<DataFolder> folder_;
  const std::unique_ptr<SessionTables> tables_;
  const std::shared_ptr<StoreHealth> health_;
  const std::shared_ptr<Ballast> ballast_;
  const uint64_t epoch_;
  std::atomic<bool> has_taken_ = false;
  ChangeQueue queue_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SQLITE_RECORDS_H_
