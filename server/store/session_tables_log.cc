// Methods of SessionTables about SQLite's write-ahead log.
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/session_schema.h"
#include "server/store/session_tables.h"
#include "server/wire/errors.h"

namespace wellspace::server {

absl::Status SessionTables::TakeOver() {
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(Survives::kPowerLoss));
  int frames = 0;
  int taken_over = 0;
  int code = sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_FULL, &frames, &taken_over);
  if (code == SQLITE_OK && taken_over == frames) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(frames));
    code = sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  }
  // Busy: a back-up reads it, and only the end of the log is not cut off.
  return code == SQLITE_OK || code == SQLITE_BUSY ? absl::OkStatus() : database_->ErrorOf(code);
}

absl::StatusOr<LogPosition> SessionTables::ReadPosition(int frames) {
  sqlite3_file* log = nullptr;
  int code = sqlite3_file_control(database_->handle(), "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
  std::array<unsigned char, 24> header{};
  code = code == SQLITE_OK ? log->pMethods->xRead(log, header.data(), static_cast<int>(header.size()), 0) : code;
  if (code != SQLITE_OK) {
    return MakeError(v1::ERROR_REASON_STORE_FAILED,
                     absl::StrCat(LogPathOf(database_->path()), ": cannot be read (SQLite ", code, ")"));
  }
  const auto number = [&](size_t at) {
    return uint32_t{header[at]} << 24 | uint32_t{header[at + 1]} << 16 | uint32_t{header[at + 2]} << 8 | header[at + 3];
  };
  return LogPosition{.salts = {number(16), number(20)}, .frames = static_cast<uint32_t>(frames)};
}

absl::Status SessionTables::SetMark() {
  if (mark_ == nullptr) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const LogPosition position, ReadPosition(commit_frames_));
  const absl::Status written = mark_->Write(position);
  // Without room it is as it was before: it may say fewer.
  return written.code() == absl::StatusCode::kResourceExhausted ? absl::OkStatus() : written;
}

absl::Status SessionTables::MarkAsTaken(int frames) {
  if (mark_ == nullptr || frames <= 0) {
    return absl::OkStatus();
  }
  untold_frames_ = frames;
  WELLSPACE_ASSIGN_OR_RETURN(LogPosition position, ReadPosition(frames));
  position.is_in_database = true;
  const absl::Status written = mark_->Write(position);
  if (written.code() == absl::StatusCode::kResourceExhausted) {
    return MakeError(v1::ERROR_REASON_DISK_FULL,
                     absl::StrCat("the server has no room to write this down: ", std::string(written.message())));
  }
  WELLSPACE_RETURN_IF_ERROR(written);
  WELLSPACE_RETURN_IF_ERROR(mark_->Synchronize());
  untold_frames_ = 0;
  return absl::OkStatus();
}

absl::Status SessionTables::Checkpoint() {
  const std::lock_guard lock(mutex_);
  return log_pages_ < checkpoint_pages_ ? absl::OkStatus() : CheckpointLocked();
}

absl::Status SessionTables::CheckpointNow() {
  const std::lock_guard lock(mutex_);
  return CheckpointLocked();
}

absl::Status SessionTables::CheckpointLocked() {
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(Survives::kPowerLoss));
  int frames = 0;
  int taken_over = 0;
  const int code =
      sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_PASSIVE, &frames, &taken_over);
  if (code == SQLITE_BUSY) {
    return absl::OkStatus();  // a back-up is under way
  }
  if (code != SQLITE_OK) {
    return database_->ErrorOf(code);
  }
  log_pages_ = 0;
  return taken_over == frames ? MarkAsTaken(frames) : absl::OkStatus();
}

absl::Status SessionTables::Shrink() {
  const std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(Survives::kPowerLoss));
  if (untold_frames_ > 0) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(untold_frames_));
  }
  commit_frames_ = 0;
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("PRAGMA incremental_vacuum"));
  if (commit_frames_ > 0) {
    has_unsynchronised_commit_ = false;
    WELLSPACE_RETURN_IF_ERROR(SetMark());
  }
  sqlite3_busy_timeout(database_->handle(), 0);  // it is tried again
  const absl::Status taken_over = TakeOver();
  sqlite3_busy_timeout(database_->handle(), kBusyMilliseconds);
  log_pages_ = taken_over.ok() ? 0 : log_pages_;
  return taken_over;
}

}  // namespace wellspace::server
