// The log of servers that share their sessions: a PostgreSQL database, and files beside it. docs/adr/0045
#ifndef WELLSPACE_SERVER_STORE_SHARED_LOG_H_
#define WELLSPACE_SERVER_STORE_SHARED_LOG_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/postgres_options.h"
#include "server/store/session_log.h"

namespace wellspace::server {

struct SharedLogOptions {
  std::string folder;  // of the files; the processes share it, too
  PostgresOptions database;
  std::function<void(const absl::Status& cause)> on_failure{};  // as DurableLogOptions
  uint64_t max_written_files = 256;                             // as DurableLogOptions
};

// Opens the folder, or makes it: PostgresRecords, and FolderFiles.
//
// Errors:     those of DataFolder::OpenShared and PostgresRecords::Open.
absl::StatusOr<std::unique_ptr<SessionLog>> OpenSharedLog(const SharedLogOptions& options);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SHARED_LOG_H_
