#include "server/store/sqlite.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Errors of the system for which nothing has been lost: no room for a file, or for a descriptor of one.
bool IsForWantOfRoom(int error) {
  return error == ENOSPC || error == EDQUOT || error == EFBIG || error == EMFILE || error == ENFILE;
}

// Whether a failure of this kind leaves the contents of the disk known, unlike those to synchronise: SQLite takes the
// transaction back, as when it is full, by which it means ENOSPC alone.
bool IsOfWriteOrOpen(int code) {
  switch (code) {
    case SQLITE_IOERR_WRITE:
    case SQLITE_IOERR_TRUNCATE:
    case SQLITE_IOERR_SHMOPEN:
    case SQLITE_IOERR_SHMSIZE:
    case SQLITE_IOERR_SHMMAP:
      return true;
    default:
      return (code & 0xff) == SQLITE_CANTOPEN;
  }
}

// `error`: that of the system, or 0.
v1::ErrorReason ReasonOf(int code, int error) {
  if (IsOfWriteOrOpen(code) && IsForWantOfRoom(error)) {
    return v1::ERROR_REASON_DISK_FULL;
  }
  switch (code & 0xff) {  // the rest says more of it
    case SQLITE_FULL:
      return v1::ERROR_REASON_DISK_FULL;
    case SQLITE_NOMEM:
      return v1::ERROR_REASON_OUT_OF_MEMORY;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return v1::ERROR_REASON_FILE_DAMAGED;
    case SQLITE_IOERR:
      return code == SQLITE_IOERR_NOMEM ? v1::ERROR_REASON_OUT_OF_MEMORY : v1::ERROR_REASON_STORE_FAILED;
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return v1::ERROR_REASON_STORE_FAILED;
    default:
      return v1::ERROR_REASON_INTERNAL;
  }
}

// The cause of an error, and the advice for it, where SQLite's own words do not give them.
std::string ExplanationOf(int code, int error, const char* words) {
  if ((code & 0xff) == SQLITE_CANTOPEN && error == ENOENT) {
    return "the database is missing";
  }
  if (IsOfWriteOrOpen(code) && IsForWantOfRoom(error)) {
    return "the server has no room to write this down";
  }
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "the server has no room to write this down";
    case SQLITE_CORRUPT:
      return absl::StrCat("the file is damaged, a back-up has to take its place: ", words);
    case SQLITE_NOTADB:
      return "the file is damaged, and no database any more: a back-up has to take its place";
    case SQLITE_IOERR:
      return "the database, or its write-ahead log, cannot be read or written";
    case SQLITE_CANTOPEN:
      return "the database, or its write-ahead log, cannot be opened; the user that the server runs as needs "
             "permission "
             "to read and write both, and their folder";
    case SQLITE_PERM:
    case SQLITE_READONLY:
      return "the database cannot be written to; the user that the server runs as needs permission to write it, and "
             "its folder";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "another program has the database locked";
    default:
      return words;
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::Open(const std::string& path, int flags,
                                                                     const char* vfs) {
  sqlite3* handle = nullptr;
  // Our callers have locks of their own.
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, vfs);
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(path, handle));
  if (handle == nullptr) {
    return MakeError(v1::ERROR_REASON_OUT_OF_MEMORY, absl::StrCat(path, ": no memory for SQLite"));
  }
  sqlite3_extended_result_codes(handle, 1);
  if (code != SQLITE_OK) {
    return database->ErrorOf(code);
  }
  return database;
}

SqliteDatabase::~SqliteDatabase() { sqlite3_close_v2(handle_); }

absl::Status SqliteDatabase::ErrorOf(int code) const {
  const int last_error = errno;
  // Of a commit SQLite does not note it; then it is the one that the thread's last system call has left.
  const int noted = sqlite3_system_errno(handle_);
  const int error = noted == 0 && IsOfWriteOrOpen(code) ? last_error : noted;
  const v1::ErrorReason reason = ReasonOf(code, error);
  std::string message =
      absl::StrCat(path_, ": ", ExplanationOf(code, error, sqlite3_errmsg(handle_)), " (SQLite ", code);
  absl::StrAppend(&message,
                  (reason == v1::ERROR_REASON_STORE_FAILED || IsOfWriteOrOpen(code)) && error != 0
                      ? absl::StrCat(": ", std::strerror(error))
                      : "",
                  ")");
  return MakeError(reason, message);
}

absl::Status SqliteDatabase::Execute(const std::string& statements) {
  errno = 0;
  const int code = sqlite3_exec(handle_, statements.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK ? absl::OkStatus() : ErrorOf(code);
}

absl::StatusOr<SqliteStatement> SqliteDatabase::Prepare(std::string_view statement) {
  sqlite3_stmt* prepared = nullptr;
  const int code = sqlite3_prepare_v3(handle_, statement.data(), static_cast<int>(statement.size()),
                                      SQLITE_PREPARE_PERSISTENT, &prepared, nullptr);
  if (code != SQLITE_OK) {
    return ErrorOf(code);
  }
  return SqliteStatement(this, prepared);
}

absl::StatusOr<int64_t> SqliteDatabase::QueryNumber(const std::string& query) {
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement statement, Prepare(query));
  WELLSPACE_RETURN_IF_ERROR(statement.Step().status());
  const int64_t number = statement.Number(0);
  WELLSPACE_RETURN_IF_ERROR(statement.Step().status());  // its change is committed by this step, or is not
  return number;
}

absl::StatusOr<std::string> SqliteDatabase::QueryText(const std::string& query) {
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement statement, Prepare(query));
  WELLSPACE_RETURN_IF_ERROR(statement.Step().status());
  std::string text(statement.Bytes(0));
  WELLSPACE_RETURN_IF_ERROR(statement.Step().status());
  return text;
}

void SqliteStatement::BindOne(int place, std::string_view text) {
  Note(sqlite3_bind_text64(statement_.get(), place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8));
}

void SqliteStatement::BindOne(int place, Blob blob) {
  // A null pointer would be NULL, which is no empty blob.
  Note(blob.bytes.empty()
           ? sqlite3_bind_zeroblob(statement_.get(), place, 0)
           : sqlite3_bind_blob64(statement_.get(), place, blob.bytes.data(), blob.bytes.size(), SQLITE_STATIC));
}

absl::StatusOr<bool> SqliteStatement::Step() {
  errno = 0;
  const int code = bind_error_ == SQLITE_OK ? sqlite3_step(statement_.get()) : bind_error_;
  if (code == SQLITE_ROW || code == SQLITE_DONE) {
    return code == SQLITE_ROW;
  }
  const absl::Status error = database_->ErrorOf(code);
  Reset();
  return error;
}

absl::Status SqliteStatement::Run() {
  const absl::Status status = Step().status();
  Reset();
  return status;
}

void SqliteStatement::Reset() {
  sqlite3_reset(statement_.get());
  bind_error_ = SQLITE_OK;
}

std::string_view SqliteStatement::Bytes(int column) const {
  const void* bytes = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes == nullptr ? std::string_view() : std::string_view(static_cast<const char*>(bytes), size);
}

}  // namespace wellspace::server
