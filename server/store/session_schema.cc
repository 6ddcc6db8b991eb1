#include "server/store/session_schema.h"

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/session_tables.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// In the header of the file, by which `file` and we know its type: "WsSe".
constexpr int64_t kApplicationId = 0x57735365;

// The steps that make version n + 1 of version n. A released step is never changed: there are files that it has made.
constexpr std::array kMigrations = {
    "CREATE TABLE sessions(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, state BLOB NOT NULL,"
    "                      crc32c INTEGER NOT NULL);"
    // kind: the number of the field of StepRecord that is set.
    "CREATE TABLE steps(session INTEGER NOT NULL, number INTEGER NOT NULL, kind INTEGER NOT NULL,"
    "                   record BLOB NOT NULL, crc32c INTEGER NOT NULL, PRIMARY KEY(session, number)) WITHOUT ROWID;"
    "CREATE TABLE operations(session INTEGER NOT NULL, number INTEGER NOT NULL, record BLOB NOT NULL,"
    "                        crc32c INTEGER NOT NULL, PRIMARY KEY(session, number)) WITHOUT ROWID;"
    "CREATE TABLE answers(tenant TEXT NOT NULL, request_id TEXT NOT NULL, record BLOB NOT NULL, time INTEGER NOT NULL,"
    "                     crc32c INTEGER NOT NULL, PRIMARY KEY(tenant, request_id)) WITHOUT ROWID;",
    // number: of the set, of which each row is a part.
    "CREATE TABLE sizes(session INTEGER NOT NULL, number INTEGER NOT NULL, part INTEGER NOT NULL, record BLOB NOT NULL,"
    "                   crc32c INTEGER NOT NULL, PRIMARY KEY(session, number, part)) WITHOUT ROWID;",
    // A session is at the greater of two epochs: its own, and that of the last owner that has taken everything.
    "ALTER TABLE sessions ADD COLUMN epoch INTEGER NOT NULL DEFAULT 0;"
    "CREATE TABLE epochs(id INTEGER PRIMARY KEY CHECK(id = 0), last INTEGER NOT NULL, everything INTEGER NOT NULL,"
    "                    crc32c INTEGER NOT NULL);",
    "CREATE TABLE usage(tenant TEXT NOT NULL, day INTEGER NOT NULL, record BLOB NOT NULL, crc32c INTEGER NOT NULL,"
    "                   PRIMARY KEY(tenant, day)) WITHOUT ROWID;",
};

absl::Status Migrate(SqliteDatabase& database, int64_t version) {
  for (; version < SchemaVersion(); ++version) {
    const absl::Status migrated = database.Execute(absl::StrCat("BEGIN IMMEDIATE;", kMigrations[version],
                                                                "PRAGMA application_id=", kApplicationId,
                                                                ";PRAGMA user_version=", version + 1, ";COMMIT"));
    if (!migrated.ok()) {
      database.Execute("ROLLBACK").IgnoreError();
      return migrated;
    }
  }
  return absl::OkStatus();
}

// The version of the schema of the file.
absl::StatusOr<int64_t> CheckVersion(SqliteDatabase& database, bool is_read_only) {
  WELLSPACE_ASSIGN_OR_RETURN(const int64_t application, database.QueryNumber("PRAGMA application_id"));
  WELLSPACE_ASSIGN_OR_RETURN(const int64_t version, database.QueryNumber("PRAGMA user_version"));
  WELLSPACE_ASSIGN_OR_RETURN(const int64_t tables, database.QueryNumber("SELECT count(*) FROM sqlite_master"));
  const std::string& path = database.path();
  if (application != kApplicationId && (application != 0 || tables != 0 || version != 0)) {
    return absl::FailedPreconditionError(
        absl::StrCat(path, ": this is a database of another program; name a folder of wellspaced, or an empty one"));
  }
  if (version > SchemaVersion()) {
    return absl::FailedPreconditionError(
        absl::StrCat(path, ": its schema is of version ", version, ", and this program knows versions up to ",
                     SchemaVersion(), "; start the newer wellspaced, or restore a back-up that was made before it"));
  }
  if (is_read_only && version == 0 && tables == 0) {
    return MakeError(v1::ERROR_REASON_FILE_DAMAGED, absl::StrCat(path, ": the database is empty"));
  }
  if (is_read_only && version != SchemaVersion()) {
    return absl::FailedPreconditionError(absl::StrCat(path, ": its schema is of version ", version,
                                                      ", and has to be brought to version ", SchemaVersion(),
                                                      " first: start wellspaced with this folder once"));
  }
  return version;
}

// Whether the database has nothing in it, though it should.
absl::Status CheckNotEmpty(SqliteDatabase& database, int64_t version, const SessionTablesOptions& options) {
  return version > 0 || options.may_be_new
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                         absl::StrCat(database.path(),
                                      ": the database is empty, and there are files of sessions; "
                                      "restore a back-up"));
}

// Looks at every page once, and whether the one index, that of names, has the rows of its table.
absl::Status CheckPages(SqliteDatabase& database) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string answer, database.QueryText("PRAGMA integrity_check(1)"));
  return answer == "ok" ? absl::OkStatus()
                        : MakeError(v1::ERROR_REASON_FILE_DAMAGED,
                                    absl::StrCat(database.path(), ": ", answer, "; restore a back-up"));
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> OpenFile(const std::string& path, int flags,
                                                         const SessionTablesOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SqliteDatabase> database, SqliteDatabase::Open(path, flags, options.vfs));
  sqlite3_busy_timeout(database->handle(), kBusyMilliseconds);
  // The mode of locking comes before anything that looks into the file. Temporary tables, none so far, are in
  // memory: a full disk must not be met where nothing is written.
  WELLSPACE_RETURN_IF_ERROR(database->Execute(absl::StrCat(
      options.is_exclusive ? "PRAGMA locking_mode=EXCLUSIVE;" : "",
      "PRAGMA temp_store=MEMORY;PRAGMA mmap_size=0;PRAGMA cell_size_check=ON;PRAGMA trusted_schema=OFF;"
      // Else a deletion writes zeros over all that it deletes, to the write-ahead log: on a full disk it could not.
      "PRAGMA secure_delete=FAST;")));
  if ((flags & SQLITE_OPEN_READWRITE) != 0 && sqlite3_db_readonly(database->handle(), "main") == 1) {
    return database->ErrorOf(SQLITE_READONLY);
  }
  return database;
}

}  // namespace

int SchemaVersion() { return static_cast<int>(kMigrations.size()); }

absl::StatusOr<std::unique_ptr<SqliteDatabase>> OpenSchema(const std::string& path,
                                                           const SessionTablesOptions& options) {
  const int flags = options.is_read_only ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SqliteDatabase> database, OpenFile(path, flags, options));
  WELLSPACE_ASSIGN_OR_RETURN(const int64_t version, CheckVersion(*database, options.is_read_only));
  WELLSPACE_RETURN_IF_ERROR(CheckNotEmpty(*database, version, options));
  WELLSPACE_RETURN_IF_ERROR(CheckPages(*database));
  if (options.is_read_only) {
    return database;
  }
  if (version == 0) {
    // Before anything is in it: so that it can give room back (SessionTables::Shrink).
    WELLSPACE_RETURN_IF_ERROR(database->Execute("PRAGMA auto_vacuum=INCREMENTAL"));
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::string mode, database->QueryText("PRAGMA journal_mode=WAL"));
  if (mode != "wal") {
    return MakeError(v1::ERROR_REASON_INTERNAL, absl::StrCat(path, ": SQLite cannot keep a write-ahead log here, but ",
                                                             mode, "; use a folder on a local disk"));
  }
  // Checkpoints are SessionTables::Checkpoint's: SQLite's own would pass over their errors.
  WELLSPACE_RETURN_IF_ERROR(database->Execute("PRAGMA synchronous=FULL;PRAGMA wal_autocheckpoint=0"));
  WELLSPACE_RETURN_IF_ERROR(Migrate(*database, version));
  return database;
}

}  // namespace wellspace::server
