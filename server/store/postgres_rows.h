// The rows of PostgreSQL's tables: how records stand in them, and the rows of a transaction. For the store alone.
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_ROWS_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_ROWS_H_

#include <cstdint>
#include <optional>
#include <pqxx/pqxx>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/status_macros.h"
#include "server/store/postgres_schema.h"
#include "server/store/record_keys.h"
#include "server/store/record_rows.h"
#include "server/store/records.h"
#include "server/wire/errors.h"

namespace wellspace::server::sql {

inline pqxx::binarystring Blob(std::string_view bytes) { return {bytes.data(), bytes.size()}; }

// An array of bytea, as a parameter of a statement.
inline std::string ArrayOf(const std::vector<std::string>& blobs) {
  return absl::StrCat("{",
                      absl::StrJoin(blobs, ",",
                                    [](std::string* out, const std::string& blob) {
                                      absl::StrAppend(out, "\"\\\\x", absl::BytesToHexString(blob), "\"");
                                    }),
                      "}");
}

inline int64_t Checksum(const std::string& key, std::string_view record) {
  return static_cast<int64_t>(ChecksumOf(key, record));
}

// The key of the record of a session, the same for every owner.
inline std::string KeyOf(std::string_view session) { return KeyOfSession(session, /*epoch=*/0); }

inline absl::Status Damaged(const std::string& what) {
  return MakeError(v1::ERROR_REASON_FILE_DAMAGED, absl::StrCat("the database: ", what, " is damaged"));
}

// The record in these fields of a row; `what` says which it is.
template <typename Record>
absl::StatusOr<Record> Parse(const std::string& key, const pqxx::row& row, int record, const std::string& what) {
  Record parsed;
  const pqxx::binarystring bytes(row[record]);
  if (!ParseRecord(key, {bytes.get(), bytes.size()}, row[record + 1].as<int64_t>(), parsed)) {
    return Damaged(what);
  }
  return parsed;
}

inline absl::StatusOr<store::v1::StepRecord> ParseStep(const pqxx::row& row) {
  const auto session = row[0].as<int64_t>();
  const auto number = row[1].as<int64_t>();
  return Parse<store::v1::StepRecord>(KeyOfStep(session, number, row[2].as<int64_t>()), row, 3,
                                      absl::StrCat("step ", number, " of session ", session));
}

// A row of id, name, epoch, state and crc32c, from the column `first` on.
inline absl::StatusOr<StoredSession> ParseSession(const pqxx::row& row, int first = 0) {
  const auto name = row[first + 1].as<std::string>();
  StoredSession session{.epoch = row[first + 2].as<uint64_t>(), .state = {}, .steps = {}, .operations = {}};
  WELLSPACE_ASSIGN_OR_RETURN(
      session.state,
      Parse<store::v1::SessionRecord>(KeyOf(name), row, first + 3, absl::StrCat("the record of session '", name, "'")));
  return session;
}

inline absl::StatusOr<store::v1::AnswerRecord> ParseAnswer(const pqxx::row& row) {
  const pqxx::binarystring tenant(row[0]);
  const pqxx::binarystring request(row[1]);
  return Parse<store::v1::AnswerRecord>(KeyOfAnswer(tenant.str(), request.str()), row, 2,
                                        absl::StrCat("the answer to request '", request.str(), "'"));
}

// A row of tenant, day, owner, record and crc32c.
inline absl::StatusOr<store::v1::UsageRecord> ParseUsage(const pqxx::row& row) {
  const std::string tenant = pqxx::binarystring(row[0]).str();
  const auto day = row[1].as<int64_t>();
  return Parse<store::v1::UsageRecord>(KeyOfUsage(tenant, day, row[2].as<int64_t>()), row, 3,
                                       absl::StrCat("the usage of tenant '", tenant, "' on day ", day));
}

// The rows that a change writes, for an owner.
class PostgresRows final : public RecordRows {
 public:
  PostgresRows(pqxx::dbtransaction& transaction, int64_t owner) : transaction_(transaction), owner_(owner) {}

  absl::StatusOr<Row> FindSession(const std::string& session) override {
    const pqxx::result found = transaction_.exec_prepared(kFindSession, session);
    Row row;
    if (!found.empty()) {
      row = {.id = found[0][0].as<int64_t>(), .own_epoch = found[0][1].as<int64_t>()};
      row.epoch = row.own_epoch;
    }
    return row;
  }

  absl::StatusOr<int64_t> InsertSession(const std::string& session, int64_t epoch, const std::string& record) override {
    return transaction_
        .exec_prepared1(kInsertSession, session, owner_, epoch, Blob(record), Checksum(KeyOf(session), record))[0]
        .as<int64_t>();
  }

  absl::Status UpdateSession(const std::string& session, const Row& row, const std::string& record) override {
    return Run(kUpdateSession, *row.id, Blob(record), Checksum(KeyOf(session), record));
  }

  absl::Status SetOffer(int64_t session, const WorkOffer& offer) override {
    return offer.stands ? Run(kOfferSession, session, Blob(offer.tenant)) : Run(kWithdrawSession, session);
  }

  absl::Status DeleteSession(int64_t id) override { return Run(kDeleteSession, id); }

  absl::StatusOr<int64_t> NextStep(int64_t session) override {
    return transaction_.exec_prepared1(kNextStep, session)[0].as<int64_t>();
  }

  absl::Status InsertStep(int64_t session, int64_t number, int64_t kind, const std::string& record) override {
    return Run(kInsertStep, session, number, kind, Blob(record), Checksum(KeyOfStep(session, number, kind), record));
  }

  absl::Status PutOperation(int64_t session, int64_t number, const std::string& record) override {
    return Run(kPutOperation, session, number, Blob(record), Checksum(KeyOfOperation(session, number), record));
  }

  absl::Status DropOperation(int64_t session, int64_t number) override { return Run(kDropOperation, session, number); }

  absl::Status InsertSizes(int64_t session, int64_t number, int64_t part, const std::string& record) override {
    return Run(kInsertSizes, session, number, part, Blob(record), Checksum(KeyOfSizes(session, number, part), record));
  }

  absl::Status DropSizes(int64_t session, int64_t number) override { return Run(kDropSizes, session, number); }

  absl::StatusOr<bool> InsertAnswer(const store::v1::AnswerRecord& answer, const std::string& record) override {
    const pqxx::result inserted =
        transaction_.exec_prepared(kInsertAnswer, Blob(answer.tenant()), Blob(answer.request_id()), Blob(record),
                                   Checksum(KeyOfAnswer(answer.tenant(), answer.request_id()), record));
    return inserted.affected_rows() > 0;
  }

  absl::StatusOr<std::optional<store::v1::UsageRecord>> FindUsage(const std::string& tenant, int32_t day) override {
    std::optional<store::v1::UsageRecord> found;
    const pqxx::result rows = transaction_.exec_prepared(kFindUsage, Blob(tenant), int64_t{day}, owner_);
    if (!rows.empty()) {
      WELLSPACE_ASSIGN_OR_RETURN(found, ParseUsage(rows[0]));
    }
    return found;
  }

  absl::Status PutUsage(const store::v1::UsageRecord& usage, const std::string& record) override {
    return Run(kPutUsage, Blob(usage.tenant()), int64_t{usage.day()}, owner_, Blob(record),
               Checksum(KeyOfUsage(usage.tenant(), usage.day(), owner_), record));
  }

 private:
  template <typename... Values>
  absl::Status Run(const char* statement, const Values&... values) {
    transaction_.exec_prepared0(statement, values...);
    return absl::OkStatus();
  }

  pqxx::dbtransaction& transaction_;
  const int64_t owner_;
};

// Puts all rows into those of another database, whose sessions are at `epoch` there.
//
// Errors:     FILE_DAMAGED, of a record; those of `rows`.
absl::Status CopyRows(pqxx::dbtransaction& transaction, int64_t epoch, RecordRows& rows);

}  // namespace wellspace::server::sql

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_ROWS_H_
