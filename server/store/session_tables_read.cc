// Methods of SessionTables that read.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/record_rows.h"
#include "server/store/session_statements.h"
#include "server/store/session_tables.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Parses the record in a row of id, name, state, crc32c and epoch. Returns its damage; empty: there is none.
std::string ParseSession(const SqliteStatement& row, store::v1::SessionRecord& record) {
  return ParseRecord(KeyOfSession(row.Bytes(1), row.Number(4)), row.Bytes(2), row.Number(3), record)
             ? ""
             : absl::StrCat("the record of session '", std::string(row.Bytes(1)), "' is damaged");
}

// That in a row of tenant, request_id, record and crc32c.
std::string ParseAnswer(const SqliteStatement& row, store::v1::AnswerRecord& answer) {
  return ParseRecord(KeyOfAnswer(row.Bytes(0), row.Bytes(1)), row.Bytes(2), row.Number(3), answer)
             ? ""
             : absl::StrCat("the answer to request '", std::string(row.Bytes(1)), "' is damaged");
}

// Has `read` answer the rows of `range`.
void BindAll(const UsageRange& range, SqliteStatement& read) {
  read.Bind(std::string_view(range.tenant), range.first_day, range.last_day);
}

}  // namespace

std::string SessionTables::ParseUsage(const SqliteStatement& row, store::v1::UsageRecord& usage) {
  return ParseRecord(KeyOfUsage(row.Bytes(0), row.Number(1), /*owner=*/0), row.Bytes(2), row.Number(3), usage)
             ? ""
             : absl::StrCat("the usage of tenant '", std::string(row.Bytes(0)), "' on day ", row.Number(1),
                            " is damaged");
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
                               database_->Prepare("SELECT id, name, state, crc32c, epoch FROM sessions ORDER BY id"));
    WELLSPACE_ASSIGN_OR_RETURN(const Epochs epochs, ReadEpochs());
    WELLSPACE_RETURN_IF_ERROR(ForEach(rows, problems, [&](const SqliteStatement& row) {
      StoredSession session;
      if (std::string problem = ParseSession(row, session.state); !problem.empty()) {
        return problem;
      }
      session.epoch = static_cast<uint64_t>(std::max(epochs.everything, row.Number(4)));
      ids.push_back(row.Number(0));
      stored.sessions.push_back(std::move(session));
      return std::string();
    }));
    WELLSPACE_RETURN_IF_ERROR(LoadSteps(stored.sessions, ids, /*is_of_one=*/false, problems));
    WELLSPACE_RETURN_IF_ERROR(LoadAnswers(stored.answers, problems));
    // It is not loaded, and is looked at so that no damage can hide from the start, or from a check.
    BindAll(UsageRange(), statements_->read_usage);
    return ForEach(statements_->read_usage, problems, [](const SqliteStatement& row) {
      store::v1::UsageRecord usage;
      return ParseUsage(row, usage);
    });
  };
  const absl::Status loaded = load();
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("COMMIT"));
  WELLSPACE_RETURN_IF_ERROR(loaded);
  std::ranges::stable_sort(stored.sessions, {}, [](const StoredSession& s) { return s.state.create_time_ns(); });
  return stored;
}

absl::Status SessionTables::CopyRows(int64_t epoch, RecordRows& rows) {
  const std::lock_guard lock(mutex_);
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("BEGIN"));
  const absl::Status copied = CopyRowsLocked(epoch, rows);
  WELLSPACE_RETURN_IF_ERROR(database_->Execute("COMMIT"));
  return copied;
}

absl::Status SessionTables::CopyRowsLocked(int64_t epoch, RecordRows& rows) {
  std::unordered_map<int64_t, int64_t> ids;  // of the rows there, by those here
  absl::Status status;                       // of `rows`
  // Calls `take` with each row of a table, once the record in it is found whole.
  const auto copy = [&]<typename Record>(std::string_view query, int record_column, const auto& key_of,
                                         const auto& take, Record record) -> absl::Status {
    WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement table, database_->Prepare(query));
    WELLSPACE_RETURN_IF_ERROR(ForEach(table, nullptr, [&](const SqliteStatement& row) -> std::string {
      const std::string key = key_of(row);
      const std::string_view bytes = row.Bytes(record_column);
      if (!ParseRecord(key, bytes, row.Number(record_column + 1), record)) {
        return absl::StrCat("the record of ", key, " is damaged");
      }
      status = status.ok() ? take(row, std::string(bytes)) : status;
      return "";
    }));
    return status;
  };
  const auto id_of = [&](const SqliteStatement& row) { return ids[row.Number(0)]; };
  WELLSPACE_RETURN_IF_ERROR(copy(
      "SELECT id, name, epoch, state, crc32c FROM sessions ORDER BY id", 3,
      [](const SqliteStatement& row) { return KeyOfSession(row.Bytes(1), row.Number(2)); },
      [&](const SqliteStatement& row, const std::string& record) -> absl::Status {
        const absl::StatusOr<int64_t> id = rows.InsertSession(std::string(row.Bytes(1)), epoch, record);
        ids[row.Number(0)] = id.ok() ? *id : 0;
        return id.status();
      },
      store::v1::SessionRecord()));
  WELLSPACE_RETURN_IF_ERROR(copy(
      "SELECT session, number, kind, record, crc32c FROM steps ORDER BY session, number", 3,
      [](const SqliteStatement& row) { return KeyOfStep(row.Number(0), row.Number(1), row.Number(2)); },
      [&](const SqliteStatement& row, const std::string& record) {
        return rows.InsertStep(id_of(row), row.Number(1), row.Number(2), record);
      },
      store::v1::StepRecord()));
  WELLSPACE_RETURN_IF_ERROR(copy(
      "SELECT session, number, record, crc32c FROM operations ORDER BY session, number", 2,
      [](const SqliteStatement& row) { return KeyOfOperation(row.Number(0), row.Number(1)); },
      [&](const SqliteStatement& row, const std::string& record) {
        return rows.PutOperation(id_of(row), row.Number(1), record);
      },
      store::v1::OperationRecord()));
  WELLSPACE_RETURN_IF_ERROR(copy(
      "SELECT session, number, part, record, crc32c FROM sizes ORDER BY session, number, part", 3,
      [](const SqliteStatement& row) { return KeyOfSizes(row.Number(0), row.Number(1), row.Number(2)); },
      [&](const SqliteStatement& row, const std::string& record) {
        return rows.InsertSizes(id_of(row), row.Number(1), row.Number(2), record);
      },
      store::v1::SizesRecord()));
  WELLSPACE_RETURN_IF_ERROR(copy(
      "SELECT tenant, request_id, record, crc32c FROM answers", 2,
      [](const SqliteStatement& row) { return KeyOfAnswer(row.Bytes(0), row.Bytes(1)); },
      [&](const SqliteStatement& /*row*/, const std::string& record) -> absl::Status {
        store::v1::AnswerRecord answer;
        answer.ParseFromString(record);
        return rows.InsertAnswer(answer, record).status();
      },
      store::v1::AnswerRecord()));
  return CopyUsageLocked(rows);
}

absl::Status SessionTables::CopyUsageLocked(RecordRows& rows) {
  absl::Status status;  // of `rows`
  BindAll(UsageRange(), statements_->read_usage);
  WELLSPACE_RETURN_IF_ERROR(ForEach(statements_->read_usage, nullptr, [&](const SqliteStatement& row) {
    store::v1::UsageRecord usage;
    std::string problem = ParseUsage(row, usage);
    if (problem.empty() && status.ok()) {
      status = AddUsage(rows, usage);
    }
    return problem;
  }));
  return status;
}

absl::Status SessionTables::LoadSteps(std::span<StoredSession> sessions, std::span<const int64_t> ids, bool is_of_one,
                                      std::vector<std::string>* problems) {
  const std::string of_one = is_of_one ? absl::StrCat(" WHERE session = ", ids.front()) : "";
  std::unordered_map<int64_t, StoredSession*> by_id;
  for (size_t i = 0; i < ids.size(); ++i) {
    by_id[ids[i]] = &sessions[i];
  }
  // Those of features are looked at, too, so that none can hide from ReadFeatures.
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement steps,
                             database_->Prepare(absl::StrCat("SELECT session, number, kind, record, crc32c FROM steps",
                                                             of_one, " ORDER BY session, number")));
  WELLSPACE_RETURN_IF_ERROR(ForEach(steps, problems, [&](const SqliteStatement& row) {
    const auto session = by_id.find(row.Number(0));
    store::v1::StepRecord step;
    if (session == by_id.end()) {
      return absl::StrCat("step ", row.Number(1), " is of session ", row.Number(0), ", which is not there");
    }
    if (!ParseRecord(KeyOfStep(row.Number(0), row.Number(1), row.Number(2)), row.Bytes(3), row.Number(4), step)) {
      return absl::StrCat("step ", row.Number(1), " of session '", session->second->state.name(), "' is damaged");
    }
    if (step.step_case() != kFeaturesStep) {
      session->second->steps.push_back(std::move(step));
    }
    return std::string();
  }));
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement operations,
                             database_->Prepare(absl::StrCat("SELECT session, number, record, crc32c FROM operations",
                                                             of_one, " ORDER BY session, number")));
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
    std::string problem = ParseAnswer(row, answer);
    if (problem.empty()) {
      answers.push_back(std::move(answer));
    }
    return problem;
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
  read.Bind(*id, int64_t{kFeaturesStep});
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

absl::StatusOr<std::optional<int64_t>> SessionTables::FindId(const std::string& session) {
  SqliteStatement& read = statements_->find_id;
  read.Bind(std::string_view(session));
  WELLSPACE_ASSIGN_OR_RETURN(const bool found, read.Step());
  const std::optional<int64_t> id = found ? std::optional(read.Number(0)) : std::nullopt;
  read.Reset();
  return id;
}

absl::StatusOr<std::optional<StoredSession>> SessionTables::ReadOne(const std::string& session, int64_t* id) {
  std::optional<StoredSession> one;
  SqliteStatement& read = statements_->read_session;
  read.Bind(std::string_view(session));
  WELLSPACE_RETURN_IF_ERROR(ForEach(read, nullptr, [&](const SqliteStatement& row) {
    *id = row.Number(0);
    one.emplace().epoch = static_cast<uint64_t>(row.Number(4));
    return ParseSession(row, one->state);
  }));
  return one;
}

absl::StatusOr<uint64_t> SessionTables::ChecksumAt(const std::string& session, int64_t epoch) {
  uint64_t checksum = 0;
  SqliteStatement& read = statements_->read_session;
  read.Bind(std::string_view(session));
  WELLSPACE_RETURN_IF_ERROR(ForEach(read, nullptr, [&](const SqliteStatement& row) {
    checksum = ChecksumOf(KeyOfSession(session, epoch), row.Bytes(2));
    return std::string();
  }));
  return checksum;
}

absl::StatusOr<std::optional<store::v1::SessionRecord>> SessionTables::ReadState(const std::string& session) {
  const std::lock_guard lock(mutex_);
  int64_t id = 0;
  WELLSPACE_ASSIGN_OR_RETURN(std::optional<StoredSession> one, ReadOne(session, &id));
  return one.has_value() ? std::optional(std::move(one->state)) : std::nullopt;
}

absl::StatusOr<std::vector<store::v1::SessionRecord>> SessionTables::ReadStates(uint64_t* everything) {
  const std::lock_guard lock(mutex_);
  if (everything != nullptr) {
    WELLSPACE_ASSIGN_OR_RETURN(const Epochs epochs, ReadEpochs());
    *everything = static_cast<uint64_t>(epochs.everything);
  }
  std::vector<store::v1::SessionRecord> states;
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement rows,
                             database_->Prepare("SELECT id, name, state, crc32c, epoch FROM sessions ORDER BY id"));
  WELLSPACE_RETURN_IF_ERROR(
      ForEach(rows, nullptr, [&](const SqliteStatement& row) { return ParseSession(row, states.emplace_back()); }));
  return states;
}

absl::StatusOr<std::optional<store::v1::AnswerRecord>> SessionTables::FindAnswer(const AnswerKey& request) {
  const std::lock_guard lock(mutex_);
  std::optional<store::v1::AnswerRecord> answer;
  SqliteStatement& read = statements_->read_answer;
  read.Bind(std::string_view(request.tenant), std::string_view(request.request_id));
  WELLSPACE_RETURN_IF_ERROR(
      ForEach(read, nullptr, [&](const SqliteStatement& row) { return ParseAnswer(row, answer.emplace()); }));
  return answer;
}

absl::StatusOr<UsageByTenant> SessionTables::ReadUsage(const UsageRange& range) {
  const std::lock_guard lock(mutex_);
  UsageByTenant usage;
  BindAll(range, statements_->read_usage);
  WELLSPACE_RETURN_IF_ERROR(ForEach(statements_->read_usage, nullptr, [&](const SqliteStatement& row) {
    store::v1::UsageRecord record;
    std::string problem = ParseUsage(row, record);
    if (problem.empty()) {
      AddWork(record, usage);
    }
    return problem;
  }));
  WELLSPACE_ASSIGN_OR_RETURN(SqliteStatement rows,
                             database_->Prepare("SELECT id, name, state, crc32c, epoch FROM sessions"));
  WELLSPACE_RETURN_IF_ERROR(ForEach(rows, nullptr, [&](const SqliteStatement& row) {
    store::v1::SessionRecord record;
    std::string problem = ParseSession(row, record);
    if (problem.empty() && (range.tenant.empty() || range.tenant == record.tenant())) {
      AddSession(record, usage);
    }
    return problem;
  }));
  return usage;
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
