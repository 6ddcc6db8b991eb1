// The database of sessions: one row for each record.
#ifndef WELLSPACE_SERVER_STORE_SESSION_TABLES_H_
#define WELLSPACE_SERVER_STORE_SESSION_TABLES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/file_system.h"
#include "server/store/records.h"
#include "server/store/sqlite.h"
#include "server/store/write_ahead_log.h"

namespace wellspace::server {

class RecordRows;

struct SessionTablesOptions {
  const char* vfs = nullptr;    // of SQLite; null: that of the machine
  bool is_exclusive = false;    // no other process may look at it meanwhile; needs no shared memory
  bool is_read_only = false;    // has to be there; is neither changed nor migrated
  bool may_be_new = true;       // else one without tables is refused
  FileSystem* files = nullptr;  // where the mark of its write-ahead log is kept (LogMark); null: none is
  int checkpoint_pages = 1000;  // the write-ahead log is taken over into the database when it has as many: 4 MiB
};

// Each record has a CRC32C beside it, of itself and of its key: SQLite has none in its pages.
//
// Thread safety: thread-safe; one function works at a time.
// Errors:     of all functions, if not said otherwise: FILE_DAMAGED, naming the file; STORE_FAILED; OUT_OF_MEMORY;
//             INTERNAL.
class SessionTables {
 public:
  // The schema that this program knows; those before it are migrated.
  static const int kSchema;

  // Errors:     FAILED_PRECONDITION: the file is of a newer program, or of another one.
  static absl::StatusOr<std::unique_ptr<SessionTables>> Open(const std::string& path,
                                                             const SessionTablesOptions& options);
  ~SessionTables();

  // The epoch that the next owner gets.
  absl::StatusOr<uint64_t> NextEpoch();
  // Takes all sessions over, at `epoch`: changes of earlier owners are refused from now on.
  //
  // REQUIRES:   NextEpoch has returned `epoch`.
  // Errors:     those of Apply; ABORTED: another has taken it meanwhile.
  absl::Status TakeAll(uint64_t epoch);
  // As Records::Take.
  absl::StatusOr<std::optional<StoredSession>> Take(const std::string& session);

  // Applies `changes` in their order, and drops `forgotten`, in one transaction. With Survives::kProcessDeath it may be
  // undone by a loss of power, until another one is committed: of two that follow one another at least one is not.
  //
  // Errors:     those of Records::Apply, and OUT_OF_MEMORY: nothing has changed. INTERNAL: one of the changes
  //             creates a session that is there, or one without a record. STORE_FAILED, FILE_DAMAGED: it is not known
  //             what has changed.
  absl::Status Apply(std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                     Survives survives);

  // Has committed changes take up less room, once that is worth it. To be called after Apply, by the same thread.
  //
  // Errors:     DISK_FULL: later, then; STORE_FAILED, FILE_DAMAGED: nothing may be written any more.
  absl::Status Checkpoint();
  // The same, whether it is worth it or not: the next commit is written over those that are in the database by now.
  absl::Status CheckpointNow();

  // Gives the room back that deletions have left in the database and its log, as far as no other process reads them.
  //
  // Errors:     those of Checkpoint.
  absl::Status Shrink();

  // All records. With `problems`, damaged records are left out, and the fault of each is appended there.
  absl::StatusOr<StoredSessions> Load(std::vector<std::string>* problems = nullptr);

  absl::StatusOr<std::vector<store::v1::StepRecord::Features>> ReadFeatures(const std::string& session);
  absl::StatusOr<std::vector<StoredSizes>> ReadSizes(const std::string& session);

  // As Records::ReadUsage.
  absl::StatusOr<UsageByTenant> ReadUsage(const UsageRange& range);

  // As Records::FindAnswer.
  absl::StatusOr<std::optional<store::v1::AnswerRecord>> FindAnswer(const AnswerKey& request);

  // None: there is no such session.
  absl::StatusOr<std::optional<store::v1::SessionRecord>> ReadState(const std::string& session);
  // Of all sessions. `*everything`, if not null, is the epoch of the last owner that has taken all.
  absl::StatusOr<std::vector<store::v1::SessionRecord>> ReadStates(uint64_t* everything = nullptr);

  // The faults of the file itself, by PRAGMA integrity_check; none: it is whole.
  absl::StatusOr<std::vector<std::string>> CheckFile();

  // Puts all rows into those of another database, whose sessions are at `epoch` there.
  //
  // Errors:     those of `rows`.
  absl::Status CopyRows(int64_t epoch, RecordRows& rows);
  // Has `fill` put rows into tables that have none, in one transaction. `epoch` is the last that an owner of them has
  // got.
  //
  // Errors:     those of Apply, and of `fill`.
  absl::Status Fill(uint64_t epoch, const std::function<absl::Status(RecordRows& rows)>& fill);

  // Copies all to the new file `path`, as it is at one moment.
  //
  // Errors:     DISK_FULL and STORE_FAILED are about the copy.
  absl::Status BackUp(const std::string& path, const SessionTablesOptions& options);

 private:
  struct Statements;
  class Rows;
  struct Epochs {
    int64_t last = 0;        // that any owner has got
    int64_t everything = 0;  // that of the last owner that has taken all
  };

  SessionTables(std::unique_ptr<SqliteDatabase> database, int checkpoint_pages);
  absl::Status Prepare();
  // Takes the write-ahead log over into the database, and cuts it off.
  absl::Status TakeOver();
  absl::Status CheckpointLocked();
  // The salts of the write-ahead log, which has `frames` frames.
  absl::StatusOr<LogPosition> ReadPosition(int frames);
  // To be called once a commit is synchronised.
  absl::Status SetMark();
  // To be called once all `frames` of the write-ahead log are in the database, before SQLite begins it anew.
  absl::Status MarkAsTaken(int frames);
  // The following want mutex_ to be held. Runs `write` in a transaction.
  absl::Status Transact(Survives survives, const std::function<absl::Status()>& write);
  absl::StatusOr<Epochs> ReadEpochs();
  absl::Status WriteEpochs(const Epochs& epochs);
  absl::StatusOr<std::optional<int64_t>> FindId(const std::string& session);
  // The record and the epoch of its row; `*id` is the row's.
  absl::StatusOr<std::optional<StoredSession>> ReadOne(const std::string& session, int64_t* id);
  // The checksum of the session's record in a row of this epoch.
  absl::StatusOr<uint64_t> ChecksumAt(const std::string& session, int64_t epoch);
  absl::Status SetSurvives(Survives survives);

  // Parses the record in a row of tenant, day, record and crc32c. Returns its damage; empty: there is none.
  static std::string ParseUsage(const SqliteStatement& row, store::v1::UsageRecord& usage);

  // Calls `take` with each row of `statement`. A fault that it returns is an error, or goes into `problems`.
  absl::Status ForEach(SqliteStatement& statement, std::vector<std::string>* problems,
                       const std::function<std::string(const SqliteStatement& row)>& take);
  absl::Status CopyRowsLocked(int64_t epoch, RecordRows& rows);
  absl::Status CopyUsageLocked(RecordRows& rows);
  // Of all sessions, or of the one that there is.
  absl::Status LoadSteps(std::span<StoredSession> sessions, std::span<const int64_t> ids, bool is_of_one,
                         std::vector<std::string>* problems);
  absl::Status LoadAnswers(std::vector<store::v1::AnswerRecord>& answers, std::vector<std::string>* problems);

  const int checkpoint_pages_;
  std::mutex mutex_;  // of all below
  const std::unique_ptr<SqliteDatabase> database_;
  std::unique_ptr<Statements> statements_;
  std::unique_ptr<LogMark> mark_;  // may be null
  int untold_frames_ = 0;  // are in the database, which the mark has to say before anything is committed; 0: none
  Survives survives_ = Survives::kPowerLoss;  // of the commit under way
  bool has_unsynchronised_commit_ = false;    // the last one
  // The write-ahead log may have bytes that are not on the disk, though they can be read: nothing may be committed
  // behind them.
  bool has_doubtful_log_ = false;
  int log_pages_ = 0;      // in the write-ahead log, to be taken over into the database
  int commit_frames_ = 0;  // in the write-ahead log, those of the last commit the last of them; 0: it has written none
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_SESSION_TABLES_H_
