// SQLite's write-ahead log, read without SQLite: whether all of it is there that was acknowledged.
//
// SQLite takes a log for ended at its first frame that is not whole. That is right where a write was torn by a loss of
// power, and wrong where a bit has flipped: all that was committed behind it would be gone without a word.
// The format: https://www.sqlite.org/fileformat2.html#the_write_ahead_log
#ifndef WELLSPACE_SERVER_STORE_WRITE_AHEAD_LOG_H_
#define WELLSPACE_SERVER_STORE_WRITE_AHEAD_LOG_H_

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/file_system.h"

namespace wellspace::server {

// A place in a write-ahead log.
struct LogPosition {
  std::array<uint32_t, 2> salts{};  // of the log; it has others each time it begins anew
  uint32_t frames = 0;
  // The database has these frames, too, so that the log may begin anew, or go. Until then it must be whole all the
  // same: SQLite reads from it first, and would find pages of the frames before a bad one.
  bool is_in_database = false;

  bool operator==(const LogPosition&) const = default;
};

// The paths of the log of a database, and of its mark.
std::string LogPathOf(const std::string& database);
std::string MarkPathOf(const std::string& database);

// A file beside the database that says which frames of its log were synchronised, and have to be there. It is written
// after each commit and not synchronised, so that after a loss of power it may say fewer. It never says more: before
// the log is begun anew, cut off or removed, a mark is synchronised that allows it.
//
// Thread safety: thread-compatible.
class LogMark {
 public:
  static constexpr uint64_t kBytes = 28;

  // Makes the file, with a mark that no log has to be there for, unless there is one that can be read.
  //
  // Errors:     of this and the following: those of a FileSystem.
  static absl::StatusOr<std::unique_ptr<LogMark>> Open(FileSystem& files, const std::string& database);

  // The mark that is there. None: there is no such file, or its contents are no mark.
  static absl::StatusOr<std::optional<LogPosition>> Read(FileSystem& files, const std::string& database);

  absl::Status Write(const LogPosition& position);
  // So that it outlives a loss of power.
  absl::Status Synchronize() { return file_->Synchronize(); }

 private:
  explicit LogMark(std::unique_ptr<File> file) : file_(std::move(file)) {}

  const std::unique_ptr<File> file_;
};

// Walks the frames of the log of `database`. Returns its damage, naming the file; empty: the log ends where it was
// written last, or where a write was torn that no change was acknowledged for.
//
// A bad frame is no torn write if the mark has it, or if a frame of the same log stands behind it and behind two
// commits more: of two commits at least one is synchronised before the next begins (SessionTables::Apply).
//
// A server may write the log meanwhile.
//
// Complexity: O(bytes of the log).
// Errors:     those of a FileSystem.
absl::StatusOr<std::string> FindLogDamage(FileSystem& files, const std::string& database);

// The same as an error.
//
// Errors:     FILE_DAMAGED, naming the file; those of a FileSystem.
absl::Status CheckLog(FileSystem& files, const std::string& database);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_WRITE_AHEAD_LOG_H_
