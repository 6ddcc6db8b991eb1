// The check that a folder of sessions is whole.
#ifndef WELLSPACE_SERVER_STORE_CHECK_DATA_H_
#define WELLSPACE_SERVER_STORE_CHECK_DATA_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/store/file_system.h"
#include "server/store/session_tables.h"

namespace wellspace::server {

struct CheckDataOptions {
  FileSystem* files = &PosixFileSystem();
  SessionTablesOptions tables{};  // other ones: for tests
};

struct DataReport {
  std::vector<std::string> problems;  // each names a file, and its damage
  std::vector<std::string> unknown;   // paths of other files in the folder
  uint64_t sessions = 0;
  uint64_t steps = 0;  // those of features excepted
  uint64_t operations = 0;
  uint64_t answers = 0;
  uint64_t points = 0;
  uint64_t meshes = 0;
  uint64_t file_bytes = 0;  // of points and meshes, as far as sessions name them

  bool is_whole() const { return problems.empty(); }
};

// Checks schema, database, write-ahead log, every record, and every byte of points and meshes that a session names.
// Changes nothing but for sessions.db-shm beside the database, which SQLite needs to read it. A server may serve the
// folder meanwhile: a session that it changes is checked once more, as it is then.
//
// Complexity: O(bytes).
// Errors:     the folder cannot be read at all: those of SessionTables::Open, and of a FileSystem.
absl::StatusOr<DataReport> CheckData(const std::string& folder, const CheckDataOptions& options = {});

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_CHECK_DATA_H_
