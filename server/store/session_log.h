// The log of sessions: records, and the files that they name.
#ifndef WELLSPACE_SERVER_STORE_SESSION_LOG_H_
#define WELLSPACE_SERVER_STORE_SESSION_LOG_H_

#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/files.h"
#include "server/store/records.h"

namespace wellspace::server {

// The records and the files, and the order in which both are written and removed.
//
// Thread safety: thread-safe.
class SessionLog {
 public:
  SessionLog(std::unique_ptr<Records> records, std::unique_ptr<Files> files)
      : records_(std::move(records)), files_(std::move(files)) {}

  bool is_durable() const { return records_->is_durable(); }
  Records& records() { return *records_; }
  Files& files() { return *files_; }

  // Applies `change` to the records. The files of a session that is deleted go after that.
  //
  // Errors:     those of Records::Apply.
  absl::Status Commit(const SessionChange& change, Survives survives = Survives::kPowerLoss);

  // Removes files that nothing written down names. To be called after the start, and hourly.
  //
  // Errors:     those of Files::RemoveGarbage, and of Records::ReadCensus.
  absl::StatusOr<Garbage> RemoveGarbage();

 private:
  const std::unique_ptr<Records> records_;
  const std::unique_ptr<Files> files_;
};

// The log of a server whose sessions end with it: points and meshes are in memory.
std::unique_ptr<SessionLog> MakeEphemeralLog();

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SESSION_LOG_H_
