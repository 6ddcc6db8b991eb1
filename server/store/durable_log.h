// The log of a server whose sessions outlive it: a database, and files beside it. docs/design/durability.md
#ifndef WELLSPACE_SERVER_STORE_DURABLE_LOG_H_
#define WELLSPACE_SERVER_STORE_DURABLE_LOG_H_

#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/base/options.h"
#include "server/store/file_system.h"
#include "server/store/session_log.h"
#include "server/store/session_tables.h"

namespace wellspace::server {

struct DurableLogOptions {
  std::string folder;
  FileSystem* files = &PosixFileSystem();  // outlives the log, its points and its meshes
  absl::Time (*now)() = &absl::Now;        // the clock by which files in lost/ have their day
  // Called once, when the contents of the disk are unknown: the server has to end. By any thread, which may
  // hold locks of its own.
  std::function<void(const absl::Status& cause)> on_failure{};

  // Room that is kept for deletions, should the disk be full; 0: none.
  uint64_t ballast_bytes = 0;

  // Files of points that are open at once until they are synchronised; more uploads end with DISK_FULL.
  uint64_t max_written_files = 256;

  SessionTablesOptions tables{};                      // other ones: for tests
  uint64_t max_mesh_chunk_bytes = kMaxResponseBytes;  // other ones: for tests
};

// The size of the ballast on the disk that has, or is to have, `folder`: 16 MiB, or of a small disk a sixteenth.
uint64_t BallastBytesFor(const std::string& folder);

// Opens the folder, or makes it: SqliteRecords, and FolderFiles. Damage to files of sessions is no error here,
// but of these sessions' reads.
//
// Errors:     those of DataFolder::Open, DataFolder::CheckNotPaired, DataFolder::FindDatabase, CheckLog and
//             SessionTables::Open.
absl::StatusOr<std::unique_ptr<SessionLog>> OpenDurableLog(const DurableLogOptions& options);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_DURABLE_LOG_H_
