#include "server/store/sqlite_records.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::server {
SqliteRecords::SqliteRecords(std::shared_ptr<DataFolder> folder, std::unique_ptr<SessionTables> tables,
                             std::shared_ptr<StoreHealth> health, std::shared_ptr<Ballast> ballast, uint64_t epoch)
    : folder_(std::move(folder)),
      tables_(std::move(tables)),
      health_(std::move(health)),
      ballast_(std::move(ballast)),
      epoch_(epoch),
      queue_([this](std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                    Survives survives) { return ApplyTogether(changes, forgotten, survives); },
             [this] { Checkpoint(); }) {}

absl::StatusOr<std::unique_ptr<SqliteRecords>> SqliteRecords::Open(std::shared_ptr<DataFolder> folder,
                                                                   std::unique_ptr<SessionTables> tables,
                                                                   std::shared_ptr<StoreHealth> health,
                                                                   std::shared_ptr<Ballast> ballast) {
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t epoch, tables->NextEpoch());
  std::unique_ptr<SqliteRecords> records(
      new SqliteRecords(std::move(folder), std::move(tables), std::move(health), std::move(ballast), epoch));
  const absl::Status taken = records->TakeAll();
  if (!taken.ok() && !absl::IsResourceExhausted(taken)) {
    return taken;
  }
  return records;
}

// The row of the epochs is written over where it is, so that room for it is as much as the log of one page takes.
absl::Status SqliteRecords::TakeAll() {
  if (has_taken_) {
    return absl::OkStatus();
  }
  const absl::Status taken = ApplyWithRoom(/*frees_room=*/true, [this] { return tables_->TakeAll(epoch_); });
  has_taken_ = taken.ok();
  return taken;
}

// No change comes before everything is taken over, also where a start has no room for that.
absl::StatusOr<StoredSessions> SqliteRecords::Load() {
  WELLSPACE_ASSIGN_OR_RETURN(StoredSessions stored, tables_->Load());
  for (StoredSession& session : stored.sessions) {
    session.epoch = std::max(session.epoch, epoch_);
  }
  return stored;
}

absl::StatusOr<std::optional<StoredSession>> SqliteRecords::Take(const std::string& session) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  absl::StatusOr<std::optional<StoredSession>> taken = tables_->Take(session);
  if (IsFailure(taken.status())) {
    return health_->Fail(taken.status());
  }
  return taken;
}

absl::StatusOr<Census> SqliteRecords::ReadCensus() {
  Census census{.sessions = {}, .oldest_epoch = epoch_};
  uint64_t everything = 0;
  WELLSPACE_ASSIGN_OR_RETURN(census.sessions, tables_->ReadStates(&everything));
  if (everything != epoch_) {
    return OwnedElsewhere("each session");
  }
  return census;
}

// Not after a failure: the log has bytes then that are not on the disk, and the kernel says that they are.
void SqliteRecords::Checkpoint() {
  if (!health_->Check().ok()) {
    return;
  }
  if (const absl::Status checkpoint = tables_->Checkpoint(); IsFailure(checkpoint)) {
    health_->Fail(checkpoint).IgnoreError();  // committed changes stay so
  }
}

absl::Status SqliteRecords::ApplyTogether(std::span<const SessionChange* const> changes,
                                          std::span<const AnswerKey> forgotten, Survives survives) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  if (const absl::Status taken = TakeAll(); !taken.ok()) {
    return IsFailure(taken) ? health_->Fail(taken) : taken;
  }
  const bool frees_room = std::ranges::all_of(changes, [](const SessionChange* change) { return change->is_deletion; });
  if (!frees_room) {
    WELLSPACE_RETURN_IF_ERROR(CheckRoom());
    // While the database has no room for the write-ahead log that there is, none comes behind it: the room kept for
    // deletions has to be enough to take it over.
    if (const absl::Status taken_over = tables_->Checkpoint(); !taken_over.ok()) {
      return IsFailure(taken_over) ? health_->Fail(taken_over) : taken_over;
    }
  }
  const absl::Status status = ApplyWithRoom(frees_room, [&] { return tables_->Apply(changes, forgotten, survives); });
  return IsFailure(status) ? health_->Fail(status) : status;
}

absl::Status SqliteRecords::CheckRoom() {
  absl::Status status = health_->CheckRoom();
  if (status.code() != absl::StatusCode::kResourceExhausted) {
    return status;
  }
  if (const absl::Status shrunk = tables_->Shrink(); IsFailure(shrunk)) {
    return health_->Fail(shrunk);
  }
  return health_->CheckRoom();
}

absl::Status SqliteRecords::ApplyWithRoom(bool frees_room, const std::function<absl::Status()>& apply) {
  absl::Status status = apply();
  if (status.code() != absl::StatusCode::kResourceExhausted) {
    return status;
  }
  // A write-ahead log that is in the database is written over, and takes no more room.
  if (absl::Status taken_over = tables_->CheckpointNow(); IsFailure(taken_over)) {
    return taken_over;
  }
  status = apply();
  if (status.code() != absl::StatusCode::kResourceExhausted || !frees_room || !ballast_->GiveUp()) {
    return status;
  }
  if (absl::Status taken_over = tables_->CheckpointNow(); IsFailure(taken_over)) {
    return taken_over;
  }
  return apply();
}

}  // namespace wellspace::server
