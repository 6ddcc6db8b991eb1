#include "server/store/postgres_records.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/store/postgres_rows.h"
#include "server/store/postgres_schema.h"
#include "server/store/record_keys.h"
#include "server/store/record_rows.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

using sql::Blob;
using sql::Parse;
using sql::ParseAnswer;
using sql::ParseSession;
using sql::ParseStep;
using sql::PostgresRows;

// Of an owner that is no more, answers are kept for so long: longer than RequestIds does.
constexpr absl::Duration kKeptAnswers = absl::Hours(1);

// Steps, but those of features, and operations of these sessions, whose rows are `ids`. `where` says which rows.
absl::Status LoadSteps(pqxx::dbtransaction& transaction, const std::string& where, std::span<StoredSession> sessions,
                       std::span<const int64_t> ids) {
  std::unordered_map<int64_t, StoredSession*> by_id;
  for (size_t i = 0; i < ids.size(); ++i) {
    by_id[ids[i]] = &sessions[i];
  }
  for (const pqxx::row& row : transaction.exec(
           absl::StrCat("SELECT session, number, kind, record, crc32c FROM wellspace.steps WHERE session IN (", where,
                        ") ORDER BY session, number"))) {
    WELLSPACE_ASSIGN_OR_RETURN(store::v1::StepRecord step, ParseStep(row));
    if (step.step_case() != kFeaturesStep) {
      by_id.at(row[0].as<int64_t>())->steps.push_back(std::move(step));
    }
  }
  for (const pqxx::row& row : transaction.exec(
           absl::StrCat("SELECT session, number, record, crc32c FROM wellspace.operations WHERE session IN (", where,
                        ") ORDER BY session, number"))) {
    const auto session = row[0].as<int64_t>();
    const auto number = row[1].as<int64_t>();
    WELLSPACE_ASSIGN_OR_RETURN(
        by_id.at(session)->operations.emplace_back(),
        Parse<store::v1::OperationRecord>(KeyOfOperation(session, number), row, 2,
                                          absl::StrCat("operation ", number, " of session ", session)));
  }
  return absl::OkStatus();
}

// The sessions of which `condition` says which they are, in the order of their creation.
absl::StatusOr<std::vector<StoredSession>> LoadSessions(pqxx::dbtransaction& transaction,
                                                        const std::string& condition) {
  std::vector<StoredSession> sessions;
  std::vector<int64_t> ids;
  const std::string which = absl::StrCat(" FROM wellspace.sessions WHERE ", condition);
  for (const pqxx::row& row :
       transaction.exec(absl::StrCat("SELECT id, name, epoch, state, crc32c", which, " ORDER BY id"))) {
    WELLSPACE_ASSIGN_OR_RETURN(sessions.emplace_back(), ParseSession(row));
    ids.push_back(row[0].as<int64_t>());
  }
  WELLSPACE_RETURN_IF_ERROR(LoadSteps(transaction, absl::StrCat("SELECT id", which), sessions, ids));
  std::ranges::stable_sort(sessions, {}, [](const StoredSession& s) { return s.state.create_time_ns(); });
  return sessions;
}

// Owners that are no more. While the database was away leases ran out of owners that live: `is_steady` ($2) says that
// there has been time to renew them. Those that were given back are out in any case.
constexpr char kDeadOwners[] =
    " FROM wellspace.owners WHERE id <> $1 AND lease_until <="
    " CASE WHEN $2 THEN clock_timestamp() ELSE '-infinity' END";

bool HasDeadOwners(pqxx::dbtransaction& transaction, int64_t owner, bool is_steady) {
  return transaction.exec_params1(absl::StrCat("SELECT EXISTS(SELECT", kDeadOwners, ")"), owner, is_steady)[0]
      .as<bool>();
}

// Gives the sessions of owners that are no more to `owner`, at `epoch`.
void TakeFromTheDead(pqxx::dbtransaction& transaction, int64_t owner, uint64_t epoch, bool is_steady) {
  // An owner that comes to renew its lease meanwhile waits, and finds that its row is gone; so does a session that it
  // makes.
  for (const pqxx::row& row :
       transaction.exec_params(absl::StrCat("SELECT id", kDeadOwners, " ORDER BY id FOR UPDATE"), owner, is_steady)) {
    const auto id = row[0].as<int64_t>();
    transaction.exec_params0("UPDATE wellspace.sessions SET owner = $1, epoch = $2, offered_at = NULL WHERE owner = $3",
                             owner, epoch, id);
    transaction.exec_params0("DELETE FROM wellspace.owners WHERE id = $1", id);
  }
  // No server looks for the numbers of transactions of a day ago. A link that is in use writes its own anew.
  transaction.exec0(
      "DELETE FROM wellspace.commits WHERE link IN (SELECT link FROM wellspace.commits"
      " WHERE time < clock_timestamp() - interval '1 day' FOR UPDATE SKIP LOCKED)");
}

// Holds database and folder to one another.
absl::Status Pair(PostgresLink& link, const std::string& shown, DataFolder& folder) {
  return link.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    const pqxx::row store = transaction.exec1("SELECT id, folder FROM wellspace.store FOR UPDATE");
    WELLSPACE_RETURN_IF_ERROR(folder.Pair({.id = store[0].as<std::string>(),
                                           .database = shown,
                                           .folder = store[1].is_null() ? "" : store[1].as<std::string>()}));
    if (store[1].is_null()) {
      transaction.exec_params0("UPDATE wellspace.store SET folder = $1",
                               std::filesystem::absolute(folder.paths().root).string());
    }
    return absl::OkStatus();
  });
}

}  // namespace

PostgresRecords::PostgresRecords(const PostgresOptions& options, std::shared_ptr<StoreHealth> health)
    : health_(std::move(health)),
      writing_(options, PreparePostgres),
      reading_(options, PreparePostgres),
      owning_(options, PreparePostgres),
      lease_(options.owner, options.lease, owning_, health_),
      queue_([this](std::span<const SessionChange* const> changes, std::span<const AnswerKey> forgotten,
                    Survives survives) { return ApplyTogether(changes, forgotten, survives); },
             [] {}) {}

absl::StatusOr<std::unique_ptr<PostgresRecords>> PostgresRecords::Open(const PostgresOptions& options,
                                                                       std::shared_ptr<DataFolder> folder,
                                                                       std::shared_ptr<StoreHealth> health) {
  WELLSPACE_ASSIGN_OR_RETURN(const std::string shown, ShownPostgresAddress(options.address));
  std::unique_ptr<PostgresRecords> records(new PostgresRecords(options, std::move(health)));
  WELLSPACE_RETURN_IF_ERROR(OpenPostgresSchema(records->writing_));
  if (folder != nullptr) {
    WELLSPACE_RETURN_IF_ERROR(Pair(records->writing_, shown, *folder));
  }
  WELLSPACE_RETURN_IF_ERROR(records->lease_.Begin([&](pqxx::dbtransaction& transaction) {
    TakeFromTheDead(transaction, records->lease_.owner(), records->lease_.epoch(), /*is_steady=*/true);
    return absl::OkStatus();
  }));
  return records;
}

absl::Status PostgresRecords::ApplyTogether(std::span<const SessionChange* const> changes,
                                            std::span<const AnswerKey> forgotten, Survives survives) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  return NoteFailure(writing_.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    if (survives == Survives::kProcessDeath) {
      transaction.exec0("SET LOCAL synchronous_commit = off");
    }
    for (const AnswerKey& key : forgotten) {
      transaction.exec_prepared0(sql::kDropAnswer, Blob(key.tenant), Blob(key.request_id));
    }
    PostgresRows rows(transaction, lease_.owner());
    for (const SessionChange* change : changes) {
      try {
        WELLSPACE_RETURN_IF_ERROR(WriteChange(rows, *change));
      } catch (const pqxx::foreign_key_violation&) {
        return OwnedElsewhere(change->session);  // this process is no owner any more
      }
    }
    return WriteUsage(rows, changes);
  }));
}

// Changes of before its end may be there or not: the next process finds out.
absl::Status PostgresRecords::NoteFailure(const absl::Status& status) {
  return absl::IsDataLoss(status) ? health_->Fail(status) : status;
}

absl::Status PostgresRecords::ChangeOwners(PostgresLink& link, const PostgresLink::Work& work) {
  absl::Status of_work;
  const absl::Status status = link.Transact([&](pqxx::dbtransaction& transaction) {
    of_work = work(transaction);
    return of_work;
  });
  return of_work.ok() ? NoteFailure(status) : status;
}

absl::StatusOr<StoredSessions> PostgresRecords::Load() {
  StoredSessions stored;
  const absl::Status loaded = reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    stored = {};
    WELLSPACE_ASSIGN_OR_RETURN(stored.sessions, LoadSessions(transaction, absl::StrCat("owner = ", lease_.owner())));
    for (const pqxx::row& row : transaction.exec(
             "SELECT tenant, request_id, record, crc32c FROM wellspace.answers ORDER BY time, tenant, request_id")) {
      WELLSPACE_ASSIGN_OR_RETURN(stored.answers.emplace_back(), ParseAnswer(row));
    }
    return absl::OkStatus();
  });
  WELLSPACE_RETURN_IF_ERROR(loaded);
  return stored;
}

absl::StatusOr<std::optional<StoredSession>> PostgresRecords::Take(const std::string& session) {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  std::optional<StoredSession> taken;
  WELLSPACE_RETURN_IF_ERROR(ChangeOwners(writing_, [&](pqxx::dbtransaction& transaction) -> absl::Status {
    taken.reset();
    const pqxx::result rows = transaction.exec_prepared(sql::kTakeSession, session, lease_.owner());
    if (rows.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(taken, ParseSession(rows[0]));
    const auto id = rows[0][0].as<int64_t>();
    return LoadSteps(transaction, absl::StrCat(id), {&*taken, 1}, {&id, 1});
  }));
  return taken;
}

absl::StatusOr<std::vector<StoredSession>> PostgresRecords::TakeOrphans() {
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  const bool is_steady = lease_.IsSteady();
  bool has_dead = false;
  WELLSPACE_RETURN_IF_ERROR(owning_.Read([&](pqxx::dbtransaction& transaction) {
    has_dead = HasDeadOwners(transaction, lease_.owner(), is_steady);
    return absl::OkStatus();
  }));
  std::vector<StoredSession> taken;
  if (!has_dead) {
    return taken;
  }
  WELLSPACE_RETURN_IF_ERROR(ChangeOwners(reading_, [&](pqxx::dbtransaction& transaction) -> absl::Status {
    // Not that of this process: one that it has had may be that of a session which it gets back.
    const auto epoch = transaction.exec1("SELECT nextval('wellspace.epochs')")[0].as<uint64_t>();
    TakeFromTheDead(transaction, lease_.owner(), epoch, is_steady);
    transaction.exec_params0("DELETE FROM wellspace.answers WHERE time < clock_timestamp() - make_interval(secs => $1)",
                             absl::ToDoubleSeconds(kKeptAnswers));
    WELLSPACE_ASSIGN_OR_RETURN(
        taken, LoadSessions(transaction, absl::StrCat("owner = ", lease_.owner(), " AND epoch = ", epoch)));
    return absl::OkStatus();
  }));
  return taken;
}

absl::StatusOr<std::vector<StoredSession>> PostgresRecords::TakeOffered(const RoomForWork& room) {
  std::vector<StoredSession> taken;
  WELLSPACE_RETURN_IF_ERROR(health_->Check());
  const std::string full = sql::ArrayOf(room.full_tenants);
  bool has_offered = false;
  WELLSPACE_RETURN_IF_ERROR(owning_.Read([&](pqxx::dbtransaction& transaction) {
    has_offered = transaction.exec_prepared1(sql::kHasOffered, lease_.owner(), full)[0].as<bool>();
    return absl::OkStatus();
  }));
  if (!has_offered) {
    return taken;
  }
  WELLSPACE_RETURN_IF_ERROR(ChangeOwners(reading_, [&](pqxx::dbtransaction& transaction) -> absl::Status {
    taken.clear();
    std::vector<int64_t> ids;
    for (const pqxx::row& row :
         transaction.exec_prepared(sql::kTakeOffered, lease_.owner(), full, static_cast<int64_t>(room.sessions))) {
      ids.push_back(row[0].as<int64_t>());
    }
    if (!ids.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(taken,
                                 LoadSessions(transaction, absl::StrCat("id IN (", absl::StrJoin(ids, ","), ")")));
    }
    return absl::OkStatus();
  }));
  return taken;
}

absl::StatusOr<std::vector<std::string>> PostgresRecords::ListOffered() {
  std::vector<std::string> names;
  WELLSPACE_RETURN_IF_ERROR(owning_.Read([&](pqxx::dbtransaction& transaction) {
    names.clear();
    for (const pqxx::row& row : transaction.exec_prepared(sql::kListOffered, lease_.owner())) {
      names.push_back(row[0].as<std::string>());
    }
    return absl::OkStatus();
  }));
  return names;
}

absl::StatusOr<std::vector<StoredOperation>> PostgresRecords::ListOperations(const OperationPlace& after,
                                                                             size_t count) {
  std::vector<StoredOperation> listed;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    listed.clear();
    for (const pqxx::row& row : transaction.exec_prepared(
             sql::kListOperations, after.session, static_cast<int64_t>(after.number), static_cast<int64_t>(count))) {
      const auto id = row[0].as<int64_t>();
      const auto number = row[1].as<int64_t>();
      WELLSPACE_ASSIGN_OR_RETURN(
          store::v1::OperationRecord operation,
          Parse<store::v1::OperationRecord>(KeyOfOperation(id, number), row, 2,
                                            absl::StrCat("operation ", number, " of session ", id)));
      WELLSPACE_ASSIGN_OR_RETURN(const StoredSession session, ParseSession(row, 4));
      listed.push_back({.place = {.session = id, .number = static_cast<uint64_t>(number)},
                        .session = session.state.name(),
                        .tenant = session.state.tenant(),
                        .owner = row[9].as<std::string>(),
                        .address = row[10].as<std::string>(),
                        .operation = std::move(operation)});
    }
    return absl::OkStatus();
  }));
  return listed;
}

absl::StatusOr<std::optional<SessionOwner>> PostgresRecords::FindOwner(const std::string& session) {
  std::optional<SessionOwner> owner;
  WELLSPACE_RETURN_IF_ERROR(owning_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    owner.reset();
    const pqxx::result rows = transaction.exec_prepared(sql::kFindOwner, session);
    if (rows.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(const StoredSession found, ParseSession(rows[0]));
    owner = SessionOwner{.tenant = found.state.tenant(),
                         .address = rows[0][6].as<std::string>(),
                         .is_self = rows[0][5].as<int64_t>() == lease_.owner(),
                         .lives = rows[0][7].as<bool>()};
    return absl::OkStatus();
  }));
  return owner;
}

absl::StatusOr<std::optional<store::v1::AnswerRecord>> PostgresRecords::FindAnswer(const AnswerKey& request) {
  std::optional<store::v1::AnswerRecord> answer;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    const pqxx::result rows =
        transaction.exec_prepared(sql::kReadAnswer, Blob(request.tenant), Blob(request.request_id));
    if (rows.empty()) {
      return absl::OkStatus();
    }
    WELLSPACE_ASSIGN_OR_RETURN(answer, ParseAnswer(rows[0]));
    return absl::OkStatus();
  }));
  return answer;
}

absl::StatusOr<std::vector<store::v1::StepRecord::Features>> PostgresRecords::ReadFeatures(const std::string& session) {
  std::vector<store::v1::StepRecord::Features> features;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    features.clear();
    for (const pqxx::row& row : transaction.exec_prepared(sql::kReadFeatures, session, kFeaturesStep)) {
      WELLSPACE_ASSIGN_OR_RETURN(store::v1::StepRecord step, ParseStep(row));
      features.push_back(std::move(*step.mutable_features()));
    }
    return absl::OkStatus();
  }));
  return features;
}

absl::StatusOr<std::vector<StoredSizes>> PostgresRecords::ReadSizes(const std::string& session) {
  std::vector<StoredSizes> sets;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    sets.clear();
    for (const pqxx::row& row : transaction.exec_prepared(sql::kReadSizes, session)) {
      const auto id = row[0].as<int64_t>();
      const auto number = row[1].as<int64_t>();
      const auto part = row[2].as<int64_t>();
      if (sets.empty() || sets.back().number != static_cast<uint64_t>(number)) {
        sets.push_back({.number = static_cast<uint64_t>(number), .parts = {}});
      }
      WELLSPACE_ASSIGN_OR_RETURN(sets.back().parts.emplace_back(),
                                 Parse<store::v1::SizesRecord>(
                                     KeyOfSizes(id, number, part), row, 3,
                                     absl::StrCat("part ", part, " of sizes ", number, " of session '", session, "'")));
    }
    return absl::OkStatus();
  }));
  return sets;
}

absl::StatusOr<std::optional<store::v1::SessionRecord>> PostgresRecords::ReadRecord(const std::string& session) {
  std::optional<store::v1::SessionRecord> record;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    record.reset();
    const pqxx::result rows = transaction.exec_prepared(sql::kReadSession, session);
    if (!rows.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(StoredSession found, ParseSession(rows[0]));
      record = std::move(found.state);
    }
    return absl::OkStatus();
  }));
  return record;
}

absl::StatusOr<UsageByTenant> PostgresRecords::ReadUsage(const UsageRange& range) {
  UsageByTenant usage;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    usage.clear();
    for (const pqxx::row& row :
         transaction.exec_prepared(sql::kReadUsage, Blob(range.tenant), range.first_day, range.last_day)) {
      WELLSPACE_ASSIGN_OR_RETURN(const store::v1::UsageRecord record, sql::ParseUsage(row));
      AddWork(record, usage);
    }
    for (const pqxx::row& row : transaction.exec("SELECT id, name, epoch, state, crc32c FROM wellspace.sessions")) {
      WELLSPACE_ASSIGN_OR_RETURN(const StoredSession session, ParseSession(row));
      if (range.tenant.empty() || range.tenant == session.state.tenant()) {
        AddSession(session.state, usage);
      }
    }
    return absl::OkStatus();
  }));
  return usage;
}

absl::StatusOr<Census> PostgresRecords::ReadCensus() {
  Census census;
  WELLSPACE_RETURN_IF_ERROR(reading_.Read([&](pqxx::dbtransaction& transaction) -> absl::Status {
    census = {};
    // An owner lives until its sessions are taken, whatever its lease: it may still have a change under way.
    const pqxx::row owners = transaction.exec1(
        absl::StrCat("SELECT min(epoch), count(*) FILTER (WHERE id = ", lease_.owner(), ") FROM wellspace.owners"));
    if (owners[1].as<int64_t>() == 0) {
      return OwnedElsewhere("each session");
    }
    census.oldest_epoch = owners[0].as<uint64_t>();
    for (const pqxx::row& row :
         transaction.exec("SELECT id, name, epoch, state, crc32c FROM wellspace.sessions ORDER BY id")) {
      WELLSPACE_ASSIGN_OR_RETURN(StoredSession session, ParseSession(row));
      census.sessions.push_back(std::move(session.state));
    }
    return absl::OkStatus();
  }));
  return census;
}

}  // namespace wellspace::server
