// The schema of the database of sessions, and how files of earlier releases come to it.
#ifndef WELLSPACE_SERVER_STORE_SESSION_SCHEMA_H_
#define WELLSPACE_SERVER_STORE_SESSION_SCHEMA_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/sqlite.h"

namespace wellspace::server {

struct SessionTablesOptions;

// The wait of a commit for another process that has the file locked: a check, or a back-up, as it opens the file.
inline constexpr int kBusyMilliseconds = 10'000;

// The version of the schema that this program knows.
int SchemaVersion();

// Opens the database, has SQLite look whether all its pages fit together, and migrates it: each step in one
// transaction, forward only. A new file is one of version 0.
//
// Errors:     those of SessionTables::Open.
absl::StatusOr<std::unique_ptr<SqliteDatabase>> OpenSchema(const std::string& path,
                                                           const SessionTablesOptions& options);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SESSION_SCHEMA_H_
