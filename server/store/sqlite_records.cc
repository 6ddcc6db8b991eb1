#include "server/store/sqlite_records.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace wellspace::server {
namespace {

// Of one transaction: enough that a synchronisation costs each little, and few enough that none waits for long.
constexpr size_t kMaxBatch = 256;
constexpr uint64_t kMaxBatchBytes = uint64_t{8} << 20;

uint64_t BytesOf(const SessionChange& change) {
  uint64_t bytes = change.answer.has_value() ? change.answer->ByteSizeLong() : 0;
  for (const store::v1::StepRecord& step : change.steps) {
    bytes += step.ByteSizeLong();
  }
  if (change.sizes.has_value()) {
    bytes += change.sizes->in_turn.bytes;
    for (const store::v1::SizesRecord& part : change.sizes->parts) {
      bytes += part.ByteSizeLong();
    }
  }
  return bytes;
}

// Whether, after this error, the contents of the disk are unknown.
bool IsFailure(const absl::Status& status) {
  return status.code() == absl::StatusCode::kUnavailable || status.code() == absl::StatusCode::kDataLoss;
}

}  // namespace

SqliteRecords::SqliteRecords(std::shared_ptr<DataFolder> folder, std::unique_ptr<SessionTables> tables,
                             std::shared_ptr<StoreHealth> health, std::shared_ptr<Ballast> ballast, uint64_t epoch)
    : folder_(std::move(folder)),
      tables_(std::move(tables)),
      health_(std::move(health)),
      ballast_(std::move(ballast)),
      epoch_(epoch) {}

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

// The first call in the queue commits all that wait, while others come and wait behind. Then the next one is first.
absl::Status SqliteRecords::Apply(const SessionChange& change, Survives survives) {
  Waiting waiting{.change = &change, .survives = survives, .bytes = BytesOf(change)};
  std::unique_lock lock(mutex_);
  queue_.push_back(&waiting);
  waiting.changed.wait(lock, [&] { return waiting.is_done || queue_.front() == &waiting; });
  if (waiting.is_done) {
    return waiting.status;
  }
  const std::vector<Waiting*> batch = TakeBatch();
  std::vector<AnswerKey> forgotten = std::exchange(forgotten_, {});
  lock.unlock();

  ApplyBatch(batch, std::move(forgotten));

  lock.lock();
  for (Waiting* other : batch) {
    other->is_done = true;
    if (other != &waiting) {
      other->changed.notify_one();  // under the lock: it ends, with its condition variable, when the lock is free
    }
  }
  // All but the first leave the queue; that keeps the others waiting.
  queue_.erase(queue_.begin() + 1, queue_.begin() + static_cast<std::ptrdiff_t>(batch.size()));
  lock.unlock();

  Checkpoint();

  lock.lock();
  queue_.pop_front();
  if (!queue_.empty()) {
    queue_.front()->changed.notify_one();
  }
  return waiting.status;
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

std::vector<SqliteRecords::Waiting*> SqliteRecords::TakeBatch() {
  std::vector<Waiting*> batch;
  uint64_t bytes = 0;
  for (Waiting* waiting : queue_) {
    bytes += waiting->bytes;
    if (batch.size() == kMaxBatch || (!batch.empty() && bytes > kMaxBatchBytes)) {
      break;
    }
    batch.push_back(waiting);
  }
  return batch;
}

void SqliteRecords::ApplyBatch(std::span<Waiting* const> batch, std::vector<AnswerKey> forgotten) {
  const absl::Status status = ApplyTogether(batch, forgotten);
  for (Waiting* waiting : batch) {
    waiting->status = status;
  }
  if (status.ok() || IsFailure(status)) {
    return;
  }
  if (batch.size() > 1) {
    // One of them may be at fault: each for itself, then.
    for (Waiting* const& waiting : batch) {
      waiting->status = ApplyTogether({&waiting, 1}, forgotten);
      if (waiting->status.ok()) {
        forgotten.clear();
      }
    }
  }
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.begin(), forgotten.begin(), forgotten.end());
}

absl::Status SqliteRecords::ApplyTogether(std::span<Waiting* const> batch, std::span<const AnswerKey> forgotten) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  if (const absl::Status taken = TakeAll(); !taken.ok()) {
    return IsFailure(taken) ? health_->Fail(taken) : taken;
  }
  std::vector<const SessionChange*> changes;
  bool survives_power_loss = false;
  for (const Waiting* waiting : batch) {
    changes.push_back(waiting->change);
    survives_power_loss |= waiting->survives == Survives::kPowerLoss;
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
  const absl::Status status = ApplyWithRoom(frees_room, [&] {
    return tables_->Apply(changes, forgotten, survives_power_loss ? Survives::kPowerLoss : Survives::kProcessDeath);
  });
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

void SqliteRecords::Forget(std::span<const AnswerKey> answers) {
  const std::lock_guard lock(mutex_);
  forgotten_.insert(forgotten_.end(), answers.begin(), answers.end());
}

}  // namespace wellspace::server
