#include "server/store/session_tables.h"

#include <algorithm>
#include <array>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "proto/checksum.h"
#include "server/store/session_schema.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// The checksum of a record that belongs to `key`.
uint64_t ChecksumOf(const std::string& key, std::string_view record) {
  return ExtendCrc32c(Crc32c(key.data(), key.size()), record.data(), record.size());
}

std::string KeyOfSession(std::string_view name) { return absl::StrCat("session ", std::string(name)); }
std::string KeyOfStep(int64_t session, int64_t number, int64_t kind) {
  return absl::StrCat("step ", session, " ", number, " ", kind);
}
std::string KeyOfOperation(int64_t session, int64_t number) { return absl::StrCat("operation ", session, " ", number); }
std::string KeyOfSizes(int64_t session, int64_t number, int64_t part) {
  return absl::StrCat("sizes ", session, " ", number, " ", part);
}
std::string KeyOfAnswer(std::string_view tenant, std::string_view request_id) {
  return absl::StrCat("answer ", tenant.size(), " ", std::string(tenant), " ", std::string(request_id));
}

// Whether `record` is that of `key`, undamaged.
template <typename Record>
bool ParseRecord(const std::string& key, std::string_view bytes, int64_t checksum, Record& record) {
  return ChecksumOf(key, bytes) == static_cast<uint64_t>(checksum) &&
         record.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

constexpr int kFeatures = store::v1::StepRecord::kFeatures;

}  // namespace

struct SessionTables::Statements {
  SqliteStatement begin, commit, rollback;
  SqliteStatement find_session, insert_session, update_session, delete_session, read_session;
  SqliteStatement next_step, insert_step, delete_steps, read_features;
  SqliteStatement put_operation, drop_operation, delete_operations;
  SqliteStatement insert_sizes, read_sizes, drop_sizes, delete_sizes;
  SqliteStatement put_answer, drop_answer;
};

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
    // shows what it has in memory, and takes it for written: so it is written again, into the database.
    const absl::Status taken_over = tables->TakeOver();
    tables->has_doubtful_log_ = !taken_over.ok();
    if (!taken_over.ok() && taken_over.code() != absl::StatusCode::kResourceExhausted) {
      return taken_over;  // else there is no room yet: what is there can be read
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
      {&statements_->find_session, "SELECT id FROM sessions WHERE name = ?"},
      {&statements_->insert_session, "INSERT INTO sessions(name, state, crc32c) VALUES(?, ?, ?)"},
      {&statements_->update_session, "UPDATE sessions SET state = ?, crc32c = ? WHERE id = ?"},
      {&statements_->delete_session, "DELETE FROM sessions WHERE id = ?"},
      {&statements_->read_session, "SELECT name, state, crc32c FROM sessions WHERE name = ?"},
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
       "REPLACE INTO answers(tenant, request_id, record, time, crc32c) VALUES(?, ?, ?, ?, ?)"},
      {&statements_->drop_answer, "DELETE FROM answers WHERE tenant = ? AND request_id = ?"},
  };
  for (const auto& [into, statement] : statements) {
    WELLSPACE_RETURN_IF_ERROR(prepare(*into, statement));
  }
  return absl::OkStatus();
}

absl::Status SessionTables::SetSurvives(SessionLog::Survives survives) {
  if (survives != survives_) {
    // NORMAL: the write-ahead log is synchronised before it is taken over into the database, and by the next FULL.
    WELLSPACE_RETURN_IF_ERROR(database_->Execute(
        survives == SessionLog::Survives::kPowerLoss ? "PRAGMA synchronous=FULL" : "PRAGMA synchronous=NORMAL"));
    survives_ = survives;
  }
  return absl::OkStatus();
}

absl::Status SessionTables::Apply(std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                                  SessionLog::Survives survives) {
  const std::lock_guard lock(mutex_);
  if (has_doubtful_log_) {
    WELLSPACE_RETURN_IF_ERROR(TakeOver());
    has_doubtful_log_ = false;
  }
  if (untold_frames_ > 0) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(untold_frames_));
  }
  // FindLogDamage relies on this.
  survives = has_unsynchronised_commit_ ? SessionLog::Survives::kPowerLoss : survives;
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(survives));
  commit_frames_ = 0;
  const auto apply = [&]() -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(statements_->begin.Run());
    for (const AnswerKey& key : forgotten) {
      statements_->drop_answer.Bind(std::string_view(key.tenant), std::string_view(key.request_id));
      WELLSPACE_RETURN_IF_ERROR(statements_->drop_answer.Run());
    }
    for (const SessionChange* change : changes) {
      WELLSPACE_RETURN_IF_ERROR(ApplyOne(*change));
    }
    return statements_->commit.Run();
  };
  const absl::Status applied = RunGuarded(apply);
  if (!applied.ok() && sqlite3_get_autocommit(database_->handle()) == 0) {
    WELLSPACE_RETURN_IF_ERROR(statements_->rollback.Run());
  }
  if (applied.ok() && commit_frames_ > 0) {
    has_unsynchronised_commit_ = survives != SessionLog::Survives::kPowerLoss;
    return has_unsynchronised_commit_ ? absl::OkStatus() : SetMark();
  }
  return applied;
}

absl::Status SessionTables::TakeOver() {
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(SessionLog::Survives::kPowerLoss));
  int frames = 0;
  int taken_over = 0;
  int code = sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_FULL, &frames, &taken_over);
  if (code == SQLITE_OK && taken_over == frames) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(frames));
    code = sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  }
  // Busy: a back-up reads it, and only the end of the log is not cut off.
  return code == SQLITE_OK || code == SQLITE_BUSY ? absl::OkStatus() : database_->ErrorOf(code);
}

absl::StatusOr<LogPosition> SessionTables::ReadPosition(int frames) {
  sqlite3_file* log = nullptr;
  int code = sqlite3_file_control(database_->handle(), "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
  std::array<unsigned char, 24> header{};
  code = code == SQLITE_OK ? log->pMethods->xRead(log, header.data(), static_cast<int>(header.size()), 0) : code;
  if (code != SQLITE_OK) {
    return MakeError(v1::ERROR_REASON_STORE_FAILED,
                     absl::StrCat(LogPathOf(database_->path()), ": cannot be read (SQLite ", code, ")"));
  }
  const auto number = [&](size_t at) {
    return uint32_t{header[at]} << 24 | uint32_t{header[at + 1]} << 16 | uint32_t{header[at + 2]} << 8 | header[at + 3];
  };
  return LogPosition{.salts = {number(16), number(20)}, .frames = static_cast<uint32_t>(frames)};
}

absl::Status SessionTables::SetMark() {
  if (mark_ == nullptr) {
    return absl::OkStatus();
  }
  WELLSPACE_ASSIGN_OR_RETURN(const LogPosition position, ReadPosition(commit_frames_));
  const absl::Status written = mark_->Write(position);
  // Without room it is as it was before: it may say fewer.
  return written.code() == absl::StatusCode::kResourceExhausted ? absl::OkStatus() : written;
}

absl::Status SessionTables::MarkAsTaken(int frames) {
  if (mark_ == nullptr || frames <= 0) {
    return absl::OkStatus();
  }
  untold_frames_ = frames;
  WELLSPACE_ASSIGN_OR_RETURN(LogPosition position, ReadPosition(frames));
  position.is_in_database = true;
  const absl::Status written = mark_->Write(position);
  if (written.code() == absl::StatusCode::kResourceExhausted) {
    return MakeError(v1::ERROR_REASON_DISK_FULL,
                     absl::StrCat("the server has no room to write this down: ", std::string(written.message())));
  }
  WELLSPACE_RETURN_IF_ERROR(written);
  WELLSPACE_RETURN_IF_ERROR(mark_->Synchronize());
  untold_frames_ = 0;
  return absl::OkStatus();
}

absl::Status SessionTables::ApplyOne(const SessionChange& change) {
  WELLSPACE_RETURN_IF_ERROR(change.is_deletion ? Delete(change.session) : Write(change));
  return change.answer.has_value() ? WriteAnswer(*change.answer) : absl::OkStatus();
}

absl::StatusOr<std::optional<int64_t>> SessionTables::FindId(const std::string& session) {
  SqliteStatement& find = statements_->find_session;
  find.Bind(std::string_view(session));
  WELLSPACE_ASSIGN_OR_RETURN(const bool found, find.Step());
  const std::optional<int64_t> id = found ? std::optional(find.Number(0)) : std::nullopt;
  find.Reset();
  return id;
}

absl::Status SessionTables::Delete(const std::string& session) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<int64_t> id, FindId(session));
  if (!id.has_value()) {
    return absl::OkStatus();
  }
  for (SqliteStatement* statement : {&statements_->delete_steps, &statements_->delete_operations,
                                     &statements_->delete_sizes, &statements_->delete_session}) {
    statement->Bind(*id);
    WELLSPACE_RETURN_IF_ERROR(statement->Run());
  }
  return absl::OkStatus();
}

absl::Status SessionTables::Write(const SessionChange& change) {
  WELLSPACE_ASSIGN_OR_RETURN(std::optional<int64_t> id, FindId(change.session));
  if (change.state.has_value()) {
    const std::string state = change.state->SerializeAsString();
    const uint64_t checksum = ChecksumOf(KeyOfSession(change.session), state);
    SqliteStatement& put = id.has_value() ? statements_->update_session : statements_->insert_session;
    if (id.has_value()) {
      put.Bind(SqliteStatement::Blob{state}, checksum, *id);
    } else {
      put.Bind(std::string_view(change.session), SqliteStatement::Blob{state}, checksum);
    }
    WELLSPACE_RETURN_IF_ERROR(put.Run());
    id = id.has_value() ? id : sqlite3_last_insert_rowid(database_->handle());
  }
  if (!id.has_value()) {
    const bool is_of_none = change.steps.empty() && change.operations.empty() && change.dropped_operations.empty() &&
                            !change.sizes.has_value();
    return is_of_none ? absl::OkStatus()
                      : MakeError(v1::ERROR_REASON_INTERNAL,
                                  absl::StrCat("no session ", change.session, " is written down that could change"));
  }
  WELLSPACE_RETURN_IF_ERROR(WriteSteps(*id, change.steps));
  WELLSPACE_RETURN_IF_ERROR(WriteOperations(*id, change));
  return WriteSizes(*id, change);
}

absl::Status SessionTables::WriteSteps(int64_t session, const std::vector<store::v1::StepRecord>& steps) {
  if (steps.empty()) {
    return absl::OkStatus();
  }
  statements_->next_step.Bind(session);
  WELLSPACE_RETURN_IF_ERROR(statements_->next_step.Step().status());
  int64_t number = statements_->next_step.Number(0);
  statements_->next_step.Reset();
  for (const store::v1::StepRecord& step : steps) {
    const std::string record = step.SerializeAsString();
    const int64_t kind = step.step_case();
    statements_->insert_step.Bind(session, number, kind, SqliteStatement::Blob{record},
                                  ChecksumOf(KeyOfStep(session, number, kind), record));
    WELLSPACE_RETURN_IF_ERROR(statements_->insert_step.Run());
    ++number;
  }
  return absl::OkStatus();
}

absl::Status SessionTables::WriteOperations(int64_t session, const SessionChange& change) {
  for (const store::v1::OperationRecord& operation : change.operations) {
    const std::string record = operation.SerializeAsString();
    const auto number = static_cast<int64_t>(operation.number());
    statements_->put_operation.Bind(session, number, SqliteStatement::Blob{record},
                                    ChecksumOf(KeyOfOperation(session, number), record));
    WELLSPACE_RETURN_IF_ERROR(statements_->put_operation.Run());
  }
  for (const uint64_t number : change.dropped_operations) {
    statements_->drop_operation.Bind(session, number);
    WELLSPACE_RETURN_IF_ERROR(statements_->drop_operation.Run());
  }
  return absl::OkStatus();
}

absl::Status SessionTables::WriteSizes(int64_t session, const SessionChange& change) {
  for (const uint64_t number : change.dropped_sizes) {
    statements_->drop_sizes.Bind(session, number);
    WELLSPACE_RETURN_IF_ERROR(statements_->drop_sizes.Run());
  }
  if (!change.sizes.has_value()) {
    return absl::OkStatus();
  }
  const auto number = static_cast<int64_t>(change.sizes->number);
  int64_t part = 0;
  const auto write = [&](const store::v1::SizesRecord& sizes) {
    const std::string record = sizes.SerializeAsString();
    statements_->insert_sizes.Bind(session, number, part, SqliteStatement::Blob{record},
                                   ChecksumOf(KeyOfSizes(session, number, part), record));
    ++part;
    return statements_->insert_sizes.Run();
  };
  for (const store::v1::SizesRecord& sizes : change.sizes->parts) {
    WELLSPACE_RETURN_IF_ERROR(write(sizes));
  }
  const StoredSizes::InTurn& in_turn = change.sizes->in_turn;
  for (size_t i = 0; i < in_turn.count; ++i) {
    WELLSPACE_RETURN_IF_ERROR(write(in_turn.make(i)));
  }
  return absl::OkStatus();
}

absl::Status SessionTables::WriteAnswer(const store::v1::AnswerRecord& answer) {
  const std::string record = answer.SerializeAsString();
  statements_->put_answer.Bind(std::string_view(answer.tenant()), std::string_view(answer.request_id()),
                               SqliteStatement::Blob{record}, static_cast<int64_t>(answer.time_ns()),
                               ChecksumOf(KeyOfAnswer(answer.tenant(), answer.request_id()), record));
  return statements_->put_answer.Run();
}

absl::Status SessionTables::Checkpoint() {
  const std::lock_guard lock(mutex_);
  return log_pages_ < checkpoint_pages_ ? absl::OkStatus() : CheckpointLocked();
}

absl::Status SessionTables::CheckpointNow() {
  const std::lock_guard lock(mutex_);
  return CheckpointLocked();
}

absl::Status SessionTables::CheckpointLocked() {
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(SessionLog::Survives::kPowerLoss));
  int frames = 0;
  int taken_over = 0;
  const int code =
      sqlite3_wal_checkpoint_v2(database_->handle(), nullptr, SQLITE_CHECKPOINT_PASSIVE, &frames, &taken_over);
  if (code == SQLITE_BUSY) {
    return absl::OkStatus();  // a back-up is under way
  }
  if (code != SQLITE_OK) {
    return database_->ErrorOf(code);
  }
  log_pages_ = 0;
  return taken_over == frames ? MarkAsTaken(frames) : absl::OkStatus();
}

absl::Status SessionTables::Shrink() {
  const std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(SetSurvives(SessionLog::Survives::kPowerLoss));
  if (untold_frames_ > 0) {
    WELLSPACE_RETURN_IF_ERROR(MarkAsTaken(untold_frames_));
  }
  commit_frames_ = 0;
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("PRAGMA incremental_vacuum"));
  if (commit_frames_ > 0) {
    has_unsynchronised_commit_ = false;
    WELLSPACE_RETURN_IF_ERROR(SetMark());
  }
  sqlite3_busy_timeout(database_->handle(), 0);  // it is tried again
  const absl::Status taken_over = TakeOver();
  sqlite3_busy_timeout(database_->handle(), kBusyMilliseconds);
  log_pages_ = taken_over.ok() ? 0 : log_pages_;
  return taken_over;
}

absl::Status SessionTables::ForEach(SqliteStatement& statement, std::vector<std::string>* problems,
                                    const std::function<std::string(const SqliteStatement& row)>& take) {
  while (true) {
    WELLSPACE_ASSIGN_OR_RETURN(const bool has_row, statement.Step());
    if (!has_row) {
      statement.Reset();
      return absl::OkStatus();
    }
    const std::string problem = take(statement);
    if (problem.empty()) {
      continue;
    }
    std::string message = absl::StrCat(database_->path(), ": ", problem);
    if (problems == nullptr) {
      statement.Reset();
      return MakeError(v1::ERROR_REASON_FILE_DAMAGED, message);
    }
    problems->push_back(std::move(message));
  }
}

absl::StatusOr<StoredSessions> SessionTables::Load(std::vector<std::string>* problems) {
  const std::lock_guard lock(mutex_);
  // One transaction, so that all is of one moment.
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("BEGIN"));
  StoredSessions stored;
  std::vector<int64_t> ids;
  const auto load = [&]() -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement rows,
                               database_->Prepare("SELECT id, name, state, crc32c FROM sessions ORDER BY id"));
    WELLSPACE_RETURN_IF_ERROR(ForEach(rows, problems, [&](const SqliteStatement& row) {
      StoredSession session;
      const std::string name(row.Bytes(1));
      if (!ParseRecord(KeyOfSession(name), row.Bytes(2), row.Number(3), session.state)) {
        return absl::StrCat("the record of session '", name, "' is damaged");
      }
      ids.push_back(row.Number(0));
      stored.sessions.push_back(std::move(session));
      return std::string();
    }));
    WELLSPACE_RETURN_IF_ERROR(LoadSteps(stored.sessions, ids, problems));
    return LoadAnswers(stored.answers, problems);
  };
  const absl::Status loaded = load();
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("COMMIT"));
  WELLSPACE_RETURN_IF_ERROR(loaded);
  std::ranges::stable_sort(stored.sessions, {}, [](const StoredSession& s) { return s.state.create_time_ns(); });
  return stored;
}

absl::Status SessionTables::LoadSteps(std::span<StoredSession> sessions, std::span<const int64_t> ids,
                                      std::vector<std::string>* problems) {
  std::unordered_map<int64_t, StoredSession*> by_id;
  for (size_t i = 0; i < ids.size(); ++i) {
    by_id[ids[i]] = &sessions[i];
  }
  // Those of features are looked at, too, so that none can hide from ReadFeatures.
  WELLSPACE_ASSIGN_OR_RETURN(
      SqliteStatement steps,
      database_->Prepare("SELECT session, number, kind, record, crc32c FROM steps ORDER BY session, number"));
  WELLSPACE_RETURN_IF_ERROR(ForEach(steps, problems, [&](const SqliteStatement& row) {
    const auto session = by_id.find(row.Number(0));
    store::v1::StepRecord step;
    if (session == by_id.end()) {
      return absl::StrCat("step ", row.Number(1), " is of session ", row.Number(0), ", which is not there");
    }
    if (!ParseRecord(KeyOfStep(row.Number(0), row.Number(1), row.Number(2)), row.Bytes(3), row.Number(4), step)) {
      return absl::StrCat("step ", row.Number(1), " of session '", session->second->state.name(), "' is damaged");
    }
    if (step.step_case() != kFeatures) {
      session->second->steps.push_back(std::move(step));
    }
    return std::string();
  }));
  WELLSPACE_ASSIGN_OR_RETURN(
      SqliteStatement operations,
      database_->Prepare("SELECT session, number, record, crc32c FROM operations ORDER BY session, number"));
  return ForEach(operations, problems, [&](const SqliteStatement& row) {
    const auto session = by_id.find(row.Number(0));
    store::v1::OperationRecord operation;
    if (session == by_id.end()) {
      return absl::StrCat("operation ", row.Number(1), " is of session ", row.Number(0), ", which is not there");
    }
    if (!ParseRecord(KeyOfOperation(row.Number(0), row.Number(1)), row.Bytes(2), row.Number(3), operation)) {
      return absl::StrCat("operation ", row.Number(1), " of session '", session->second->state.name(), "' is damaged");
    }
    session->second->operations.push_back(std::move(operation));
    return std::string();
  });
}

absl::Status SessionTables::LoadAnswers(std::vector<store::v1::AnswerRecord>& answers,
                                        std::vector<std::string>* problems) {
  WELLSPACE_ASSIGN_OR_RETURN(
      SqliteStatement rows,
      database_->Prepare("SELECT tenant, request_id, record, crc32c FROM answers ORDER BY time, tenant, request_id"));
  return ForEach(rows, problems, [&](const SqliteStatement& row) {
    store::v1::AnswerRecord answer;
    if (!ParseRecord(KeyOfAnswer(row.Bytes(0), row.Bytes(1)), row.Bytes(2), row.Number(3), answer)) {
      return absl::StrCat("the answer to request '", std::string(row.Bytes(1)), "' is damaged");
    }
    answers.push_back(std::move(answer));
    return std::string();
  });
}

absl::StatusOr<std::vector<store::v1::StepRecord::Features>> SessionTables::ReadFeatures(const std::string& session) {
  const std::lock_guard lock(mutex_);
  std::vector<store::v1::StepRecord::Features> features;
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<int64_t> id, FindId(session));
  if (!id.has_value()) {
    return features;
  }
  SqliteStatement& read = statements_->read_features;
  read.Bind(*id, int64_t{kFeatures});
  WELLSPACE_RETURN_IF_ERROR(ForEach(read, nullptr, [&](const SqliteStatement& row) {
    store::v1::StepRecord step;
    if (!ParseRecord(KeyOfStep(row.Number(0), row.Number(1), row.Number(2)), row.Bytes(3), row.Number(4), step)) {
      return absl::StrCat("step ", row.Number(1), " of session '", session, "' is damaged");
    }
    features.push_back(std::move(*step.mutable_features()));
    return std::string();
  }));
  return features;
}

absl::StatusOr<std::vector<StoredSizes>> SessionTables::ReadSizes(const std::string& session) {
  const std::lock_guard lock(mutex_);
  std::vector<StoredSizes> sets;
  WELLSPACE_ASSIGN_OR_RETURN(const std::optional<int64_t> id, FindId(session));
  if (!id.has_value()) {
    return sets;
  }
  SqliteStatement& read = statements_->read_sizes;
  read.Bind(*id);
  WELLSPACE_RETURN_IF_ERROR(ForEach(read, nullptr, [&](const SqliteStatement& row) {
    const auto number = static_cast<uint64_t>(row.Number(1));
    if (sets.empty() || sets.back().number != number) {
      sets.push_back({.number = number, .parts = {}});
    }
    if (!ParseRecord(KeyOfSizes(row.Number(0), row.Number(1), row.Number(2)), row.Bytes(3), row.Number(4),
                     sets.back().parts.emplace_back())) {
      return absl::StrCat("part ", row.Number(2), " of sizes ", number, " of session '", session, "' is damaged");
    }
    return std::string();
  }));
  return sets;
}

absl::StatusOr<std::optional<store::v1::SessionRecord>> SessionTables::ReadState(const std::string& session) {
  const std::lock_guard lock(mutex_);
  std::optional<store::v1::SessionRecord> state;
  SqliteStatement& read = statements_->read_session;
  read.Bind(std::string_view(session));
  WELLSPACE_RETURN_IF_ERROR(ForEach(read, nullptr, [&](const SqliteStatement& row) {
    return ParseRecord(KeyOfSession(row.Bytes(0)), row.Bytes(1), row.Number(2), state.emplace())
               ? std::string()
               : absl::StrCat("the record of session '", session, "' is damaged");
  }));
  return state;
}

absl::StatusOr<std::vector<store::v1::SessionRecord>> SessionTables::ReadStates() {
  const std::lock_guard lock(mutex_);
  std::vector<store::v1::SessionRecord> states;
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement rows,
                             database_->Prepare("SELECT name, state, crc32c FROM sessions ORDER BY id"));
  WELLSPACE_RETURN_IF_ERROR(ForEach(rows, nullptr, [&](const SqliteStatement& row) {
    return ParseRecord(KeyOfSession(row.Bytes(0)), row.Bytes(1), row.Number(2), states.emplace_back())
               ? std::string()
               : absl::StrCat("the record of session '", std::string(row.Bytes(0)), "' is damaged");
  }));
  return states;
}

absl::StatusOr<std::vector<std::string>> SessionTables::CheckFile() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> problems;
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement check, database_->Prepare("PRAGMA integrity_check"));
  WELLSPACE_RETURN_IF_ERROR(ForEach(check, nullptr, [&](const SqliteStatement& row) {
    if (row.Bytes(0) != "ok") {
      problems.push_back(absl::StrCat(database_->path(), ": ", std::string(row.Bytes(0))));
    }
    return std::string();
  }));
  return problems;
}

absl::Status SessionTables::BackUp(const std::string& path, const SessionTablesOptions& options) {
  const std::lock_guard lock(mutex_);
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SqliteDatabase> copy,
                             SqliteDatabase::Open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, options.vfs));
  WELLSPACE_RETURN_IF_ERROR(copy->Execute("PRAGMA synchronous=FULL"));
  sqlite3_backup* backup = sqlite3_backup_init(copy->handle(), "main", database_->handle(), "main");
  if (backup == nullptr) {
    return copy->ErrorOf(sqlite3_errcode(copy->handle()));
  }
  sqlite3_backup_step(backup, -1);  // all pages
  const int code = sqlite3_backup_finish(backup);
  return code == SQLITE_OK ? absl::OkStatus() : copy->ErrorOf(code);
}

}  // namespace wellspace::server
