#include "server/store/session_log.h"

#include <optional>

#include "core/base/status_macros.h"
#include "server/store/memory_files.h"
#include "server/store/memory_records.h"

namespace wellspace::server {

absl::Status SessionLog::Commit(const SessionChange& change, Survives survives) {
  std::optional<store::v1::SessionRecord> deleted;
  if (change.is_deletion) {
    WELLSPACE_ASSIGN_OR_RETURN(deleted, records_->ReadRecord(change.session));
  }
  WELLSPACE_RETURN_IF_ERROR(records_->Apply(change, survives));
  if (deleted.has_value()) {
    files_->RemoveAll(*deleted);
  }
  return absl::OkStatus();
}

absl::StatusOr<Garbage> SessionLog::RemoveGarbage() {
  return files_->RemoveGarbage([this] { return records_->ReadCensus(); });
}

std::unique_ptr<SessionLog> MakeEphemeralLog() {
  return std::make_unique<SessionLog>(std::make_unique<MemoryRecords>(), std::make_unique<MemoryFiles>());
}

}  // namespace wellspace::server
