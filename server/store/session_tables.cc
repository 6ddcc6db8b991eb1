#include "server/store/session_tables.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/record_rows.h"
#include "server/store/session_schema.h"
#include "server/store/session_statements.h"
#include "server/wire/errors.h"

namespace wellspace::server {

const int SessionTables::kSchema = SchemaVersion();

SessionTables::SessionTables(std::unique_ptr<SqliteDatabase> database, int checkpoint_pages)
    : checkpoint_pages_(checkpoint_pages),
      database_(std::move(database)),
      statements_(std::make_unique<Statements>()) {}

SessionTables::~SessionTables() {
  statements_.reset();  // before the database
  if (mark_ == nullptr) {
    return;
  }
  // SQLite removes the log as it closes, which is right only once the mark allows it.
  int frames = 0;
  int taken_over = 0;
  const int code =
      sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_PASSIVE, &frames, &taken_over);
  if (code != SQLITE_OK || taken_over < frames || !MarkAsTaken(frames).ok()) {
    sqlite3_db_config(database_->handle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  }
}

absl::StatusOr<std::unique_ptr<SessionTables>> SessionTables::Open(const std::string& path,
                                                                   const SessionTablesOptions& options) {
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SqliteDatabase> database, OpenSchema(path, options));
  std::unique_ptr<SessionTables> tables(new SessionTables(std::move(database), options.checkpoint_pages));
  WELLSPACE_RETURN_IF_ERROR(tables->Prepare());
  if (!options.is_read_only) {
    if (options.files != nullptr) {
      WELLSPACE_ASSIGN_OR_RETURN(tables->mark_, LogMark::Open(*options.files, path));
    }
    // A process before this one may have ended since it could not synchronise the write-ahead log. The kernel then
    // shows the pages that it has in memory, and takes them for written: so they are written again, into the database.
    const absl::Status taken_over = tables->TakeOver();
    tables->has_doubtful_log_ = !taken_over.ok();
    if (!taken_over.ok() && taken_over.code() != absl::StatusCode::kResourceExhausted) {
      return taken_over;  // else there is no room yet: the tables can be read
    }
    sqlite3_wal_hook(
        tables->database_->handle(),
        [](void* self, sqlite3*, const char*, int pages) {
          auto* const own = static_cast<SessionTables*>(self);
          own->log_pages_ = pages;
          own->commit_frames_ = pages;
          return SQLITE_OK;
        },
        tables.get());
  }
  return tables;
}

absl::Status SessionTables::Prepare() {
  const auto prepare = [&](SqliteStatement& into, std::string_view statement) -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(into, database_->Prepare(statement));
    return absl::OkStatus();
  };
  const std::pair<SqliteStatement*, std::string_view> statements[] = {
      {&statements_->begin, "BEGIN IMMEDIATE"},
      {&statements_->commit, "COMMIT"},
      {&statements_->rollback, "ROLLBACK"},
      {&statements_->read_epochs, "SELECT last, everything, crc32c FROM epochs"},
      {&statements_->write_epochs, "REPLACE INTO epochs(id, last, everything, crc32c) VALUES(0, ?, ?, ?)"},
      {&statements_->find_session,
       "SELECT everything, sessions.id, sessions.epoch FROM epochs LEFT JOIN sessions ON name = ?"},
      {&statements_->find_id, "SELECT id FROM sessions WHERE name = ?"},
      {&statements_->insert_session, "INSERT INTO sessions(name, state, crc32c, epoch) VALUES(?, ?, ?, ?)"},
      {&statements_->update_session, "UPDATE sessions SET state = ?, crc32c = ? WHERE id = ?"},
      {&statements_->delete_session, "DELETE FROM sessions WHERE id = ?"},
      {&statements_->read_session, "SELECT id, name, state, crc32c, epoch FROM sessions WHERE name = ?"},
      {&statements_->take_session, "UPDATE sessions SET crc32c = ?, epoch = ? WHERE id = ?"},
      {&statements_->next_step, "SELECT coalesce(max(number) + 1, 0) FROM steps WHERE session = ?"},
      {&statements_->insert_step, "INSERT INTO steps(session, number, kind, record, crc32c) VALUES(?, ?, ?, ?, ?)"},
      {&statements_->delete_steps, "DELETE FROM steps WHERE session = ?"},
      {&statements_->read_features,
       "SELECT session, number, kind, record, crc32c FROM steps WHERE session = ? AND kind = ? ORDER BY number"},
      {&statements_->put_operation, "REPLACE INTO operations(session, number, record, crc32c) VALUES(?, ?, ?, ?)"},
      {&statements_->drop_operation, "DELETE FROM operations WHERE session = ? AND number = ?"},
      {&statements_->delete_operations, "DELETE FROM operations WHERE session = ?"},
      {&statements_->insert_sizes, "INSERT INTO sizes(session, number, part, record, crc32c) VALUES(?, ?, ?, ?, ?)"},
      {&statements_->read_sizes,
       "SELECT session, number, part, record, crc32c FROM sizes WHERE session = ? ORDER BY number, part"},
      {&statements_->drop_sizes, "DELETE FROM sizes WHERE session = ? AND number = ?"},
      {&statements_->delete_sizes, "DELETE FROM sizes WHERE session = ?"},
      {&statements_->put_answer,
       "INSERT OR IGNORE INTO answers(tenant, request_id, record, time, crc32c) VALUES(?, ?, ?, ?, ?)"},
      {&statements_->read_answer,
       "SELECT tenant, request_id, record, crc32c FROM answers WHERE tenant = ? AND request_id = ?"},
      {&statements_->drop_answer, "DELETE FROM answers WHERE tenant = ? AND request_id = ?"},
      {&statements_->put_usage, "REPLACE INTO usage(tenant, day, record, crc32c) VALUES(?, ?, ?, ?)"},
      {&statements_->find_usage, "SELECT tenant, day, record, crc32c FROM usage WHERE tenant = ? AND day = ?"},
      {&statements_->read_usage,
       "SELECT tenant, day, record, crc32c FROM usage WHERE (?1 = '' OR tenant = ?1) AND day BETWEEN ?2 AND ?3"},
  };
  for (const auto& [into, statement] : statements) {
    WELLSPACE_RETURN_IF_ERROR(prepare(*into, statement));
  }
  return absl::OkStatus();
}

absl::Status SessionTables::SetSurvives(Survives survives) {
  if (survives != survives_) {
    // NORMAL: the write-ahead log is synchronised before it is taken over into the database, and by the next FULL.
    WELLSPACE_RETURN_IF_ERROR(
        database_->Execute(survives == Survives::kPowerLoss ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=NORMAL"));
    survives_ = survives;
  }
  return absl::OkStatus();
}

// The rows of a transaction.
class SessionTables::Rows final : public RecordRows {
 public:
  explicit Rows(SessionTables& tables)
      : tables_(tables), database_(*tables.database_), statements_(*tables.statements_) {}

  absl::StatusOr<Row> FindSession(const std::string& session) override {
    SqliteStatement& find = statements_.find_session;
    find.Bind(std::string_view(session));
    WELLSPACE_ASSIGN_OR_RETURN(const bool has_epochs, find.Step());
    Row row;
    if (has_epochs) {
      row.epoch = find.Number(0);
      if (!find.IsNull(1)) {
        row.id = find.Number(1);
        row.own_epoch = find.Number(2);
        row.epoch = std::max(row.epoch, row.own_epoch);
      }
    }
    find.Reset();
    if (!has_epochs) {
      return MakeError(v1::ERROR_REASON_INTERNAL, "changes are made by who has taken the sessions over");
    }
    return row;
  }

  absl::StatusOr<int64_t> InsertSession(const std::string& session, int64_t epoch, const std::string& record) override {
    WELLSPACE_RETURN_IF_ERROR(Run(statements_.insert_session, std::string_view(session), SqliteStatement::Blob{record},
                                  ChecksumOf(KeyOfSession(session, epoch), record), epoch));
    return sqlite3_last_insert_rowid(database_.handle());
  }

  absl::Status UpdateSession(const std::string& session, const Row& row, const std::string& record) override {
    return Run(statements_.update_session, SqliteStatement::Blob{record},
               ChecksumOf(KeyOfSession(session, row.own_epoch), record), *row.id);
  }

  absl::Status DeleteSession(int64_t id) override {
    for (SqliteStatement* statement : {&statements_.delete_steps, &statements_.delete_operations,
                                       &statements_.delete_sizes, &statements_.delete_session}) {
      WELLSPACE_RETURN_IF_ERROR(Run(*statement, id));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<int64_t> NextStep(int64_t session) override {
    SqliteStatement& next = statements_.next_step;
    next.Bind(session);
    WELLSPACE_RETURN_IF_ERROR(next.Step().status());
    const int64_t number = next.Number(0);
    next.Reset();
    return number;
  }

  absl::Status InsertStep(int64_t session, int64_t number, int64_t kind, const std::string& record) override {
    return Run(statements_.insert_step, session, number, kind, SqliteStatement::Blob{record},
               ChecksumOf(KeyOfStep(session, number, kind), record));
  }

  absl::Status PutOperation(int64_t session, int64_t number, const std::string& record) override {
    return Run(statements_.put_operation, session, number, SqliteStatement::Blob{record},
               ChecksumOf(KeyOfOperation(session, number), record));
  }

  absl::Status DropOperation(int64_t session, int64_t number) override {
    return Run(statements_.drop_operation, session, number);
  }

  absl::Status InsertSizes(int64_t session, int64_t number, int64_t part, const std::string& record) override {
    return Run(statements_.insert_sizes, session, number, part, SqliteStatement::Blob{record},
               ChecksumOf(KeyOfSizes(session, number, part), record));
  }

  absl::Status DropSizes(int64_t session, int64_t number) override {
    return Run(statements_.drop_sizes, session, number);
  }

  absl::StatusOr<bool> InsertAnswer(const store::v1::AnswerRecord& answer, const std::string& record) override {
    WELLSPACE_RETURN_IF_ERROR(Run(statements_.put_answer, std::string_view(answer.tenant()),
                                  std::string_view(answer.request_id()), SqliteStatement::Blob{record},
                                  static_cast<int64_t>(answer.time_ns()),
                                  ChecksumOf(KeyOfAnswer(answer.tenant(), answer.request_id()), record)));
    return sqlite3_changes(database_.handle()) > 0;
  }

  absl::StatusOr<std::optional<store::v1::UsageRecord>> FindUsage(const std::string& tenant, int32_t day) override {
    SqliteStatement& find = statements_.find_usage;
    find.Bind(std::string_view(tenant), int64_t{day});
    std::optional<store::v1::UsageRecord> found;
    WELLSPACE_RETURN_IF_ERROR(
        tables_.ForEach(find, nullptr, [&](const SqliteStatement& row) { return ParseUsage(row, found.emplace()); }));
    return found;
  }

  absl::Status PutUsage(const store::v1::UsageRecord& usage, const std::string& record) override {
    return Run(statements_.put_usage, std::string_view(usage.tenant()), int64_t{usage.day()},
               SqliteStatement::Blob{record}, ChecksumOf(KeyOfUsage(usage.tenant(), usage.day(), /*owner=*/0), record));
  }

 private:
  template <typename... Values>
  static absl::Status Run(SqliteStatement& statement, const Values&... values) {
    statement.Bind(values...);
    return statement.Run();
  }

  SessionTables& tables_;
  SqliteDatabase& database_;
  Statements& statements_;
};

absl::Status SessionTables::Apply(std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                                  Survives survives) {
  const std::lock_guard lock(mutex_);
  Rows rows(*this);
  return Transact(survives, [&]() -> absl::Status {
    for (const AnswerKey& key : forgotten) {
      statements_->drop_answer.Bind(std::string_view(key.tenant), std::string_view(key.request_id));
      WELLSPACE_RETURN_IF_ERROR(statements_->drop_answer.Run());
    }
    for (const SessionChange* change : changes) {
      WELLSPACE_RETURN_IF_ERROR(WriteChange(rows, *change));
    }
    return WriteUsage(rows, changes);
  });
}

absl::Status SessionTables::Transact(Survives survives, const std::function<absl::Status()>& write) {
  if (has_doubtful_log_) {
    WELLSPACE_RETURN_IF_ERROR(TakeOver());
    has_doubtful_log_ = false;
  }
  if (untold_frames_ > 0) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(untold_frames_));
  }
  // FindLogDamage relies on this.
  survives = has_unsynchronised_commit_ ? Survives::kPowerLoss : survives;
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(survives));
  commit_frames_ = 0;
  const auto apply = [&]() -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(statements_->begin.Run());
    WELLSPACE_RETURN_IF_ERROR(write());
    return statements_->commit.Run();
  };
  const absl::Status applied = RunGuarded(apply);
  if (!applied.ok() && sqlite3_get_autocommit(database_->handle()) == 0) {
    WELLSPACE_RETURN_IF_ERROR(statements_->rollback.Run());
  }
  if (applied.ok() && commit_frames_ > 0) {
    has_unsynchronised_commit_ = survives != Survives::kPowerLoss;
    return has_unsynchronised_commit_ ? absl::OkStatus() : SetMark();
  }
  return applied;
}

absl::Status SessionTables::Fill(uint64_t epoch, const std::function<absl::Status(RecordRows& rows)>& fill) {
  const std::lock_guard lock(mutex_);
  Rows rows(*this);
  return Transact(Survives::kPowerLoss, [&]() -> absl::Status {
    const auto last = static_cast<int64_t>(epoch);
    WELLSPACE_RETURN_IF_ERROR(WriteEpochs({.last = last, .everything = last}));
    return fill(rows);
  });
}

absl::StatusOr<uint64_t> SessionTables::NextEpoch() {
  const std::lock_guard lock(mutex_);
  WELLSPACE_ASSIGN_OR_RETURN(const Epochs epochs, ReadEpochs());
  return static_cast<uint64_t>(epochs.last + 1);
}

absl::Status SessionTables::TakeAll(uint64_t epoch) {
  const std::lock_guard lock(mutex_);
  return Transact(Survives::kPowerLoss, [&]() -> absl::Status {
    const auto taken = static_cast<int64_t>(epoch);
    WELLSPACE_ASSIGN_OR_RETURN(const Epochs epochs, ReadEpochs());
    return epochs.last + 1 == taken ? WriteEpochs({.last = taken, .everything = taken})
                                    : OwnedElsewhere("each session");
  });
}

absl::StatusOr<std::optional<StoredSession>> SessionTables::Take(const std::string& session) {
  const std::lock_guard lock(mutex_);
  std::optional<StoredSession> taken;
  const auto take = [&]() -> absl::Status {
    int64_t id = 0;
    WELLSPACE_ASSIGN_OR_RETURN(taken, ReadOne(session, &id));
    if (!taken.has_value()) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(Epochs epochs, ReadEpochs());
    ++epochs.last;
    taken->epoch = static_cast<uint64_t>(epochs.last);
    // The record itself stays, byte for byte; its checksum is that of its row.
    WELLSPACE_ASSIGN_OR_RETURN(const uint64_t checksum, ChecksumAt(session, epochs.last));
    statements_->take_session.Bind(checksum, epochs.last, id);
    WELLSPACE_RETURN_IF_ERROR(statements_->take_session.Run());
    WELLSPACE_RETURN_IF_ERROR(WriteEpochs(epochs));
    return LoadSteps({&*taken, 1}, {&id, 1}, /*is_of_one=*/true, nullptr);
  };
  WELLSPACE_RETURN_IF_ERROR(Transact(Survives::kPowerLoss, take));
  return taken;
}

absl::StatusOr<SessionTables::Epochs> SessionTables::ReadEpochs() {
  SqliteStatement& read = statements_->read_epochs;
  WELLSPACE_ASSIGN_OR_RETURN(const bool found, read.Step());
  Epochs epochs;
  bool is_whole = true;
  if (found) {
    epochs = {.last = read.Number(0), .everything = read.Number(1)};
    is_whole = ChecksumOf(KeyOfEpochs(epochs.last, epochs.everything), "") == static_cast<uint64_t>(read.Number(2));
  }
  read.Reset();
  if (!is_whole) {
    return MakeError(v1::ERROR_REASON_FILE_DAMAGED, absl::StrCat(database_->path(), ": the epochs are damaged"));
  }
  return epochs;
}

absl::Status SessionTables::WriteEpochs(const Epochs& epochs) {
  statements_->write_epochs.Bind(epochs.last, epochs.everything,
                                 ChecksumOf(KeyOfEpochs(epochs.last, epochs.everything), ""));
  return statements_->write_epochs.Run();
}

}  // namespace wellspace::server
