// SQLite's C interface, as far as the store needs it, with errors as those of the service.
#ifndef WELLSPACE_SERVER_STORE_SQLITE_H_
#define WELLSPACE_SERVER_STORE_SQLITE_H_

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace wellspace::server {

class SqliteStatement;

// A connection.
//
// Thread safety: thread-compatible.
// Errors:     of all functions here: DISK_FULL; OUT_OF_MEMORY; FILE_DAMAGED, naming the file; STORE_FAILED where the
//             disk fails; else INTERNAL. The transaction, if there is one, is rolled back by its owner.
class SqliteDatabase {
 public:
  // `flags` as of sqlite3_open_v2; `vfs`: null for that of the machine.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::string& path, int flags, const char* vfs);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // Runs statements that answer nothing, or whose answers do not matter.
  absl::Status Execute(const std::string& statements);
  absl::StatusOr<SqliteStatement> Prepare(std::string_view statement);

  // The one number, or text, that `query` answers.
  absl::StatusOr<int64_t> QueryNumber(const std::string& query);
  absl::StatusOr<std::string> QueryText(const std::string& query);

  // The error of the last call, which returned `code`.
  absl::Status ErrorOf(int code) const;

  sqlite3* handle() const { return handle_; }
  const std::string& path() const { return path_; }

 private:
  SqliteDatabase(std::string path, sqlite3* handle) : path_(std::move(path)), handle_(handle) {}

  const std::string path_;
  sqlite3* const handle_;
};

// A prepared statement, to be run as often as wanted. Does not outlive its database.
//
// Thread safety: thread-compatible.
class SqliteStatement {
 public:
  SqliteStatement() = default;
  SqliteStatement(SqliteDatabase* database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}

  // Sets the parameters in their order: numbers and texts, and blobs by Blob. Texts and blobs have to live until Reset.
  template <typename... Values>
  void Bind(const Values&... values) {
    Reset();
    int place = 0;
    (BindOne(++place, values), ...);
  }
  struct Blob {
    std::string_view bytes;
  };

  // Goes on to the next row; false: there is none.
  absl::StatusOr<bool> Step();
  // Runs a statement that answers nothing.
  absl::Status Run();
  void Reset();

  int64_t Number(int column) const { return sqlite3_column_int64(statement_.get(), column); }
  bool IsNull(int column) const { return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL; }
  // Lives until the next step.
  std::string_view Bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };

  void BindOne(int place, uint64_t value) {
    Note(sqlite3_bind_int64(statement_.get(), place, static_cast<int64_t>(value)));
  }
  void BindOne(int place, int64_t value) { Note(sqlite3_bind_int64(statement_.get(), place, value)); }
  void BindOne(int place, std::string_view text);
  void BindOne(int place, Blob blob);
  // The first error of Bind, which Step then returns.
  void Note(int code) { bind_error_ = bind_error_ == SQLITE_OK ? code : bind_error_; }

  SqliteDatabase* database_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bind_error_ = SQLITE_OK;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SQLITE_H_
