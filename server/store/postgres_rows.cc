#include "server/store/postgres_rows.h"

#include <map>

namespace wellspace::server::sql {
namespace {

// Their rows there, by their rows here.
using Ids = std::map<int64_t, int64_t>;

absl::Status CopySessions(pqxx::dbtransaction& transaction, int64_t epoch, RecordRows& rows, Ids& ids) {
  for (const pqxx::row& row :
       transaction.exec("SELECT id, name, epoch, state, crc32c FROM wellspace.sessions ORDER BY id")) {
    WELLSPACE_RETURN_IF_ERROR(ParseSession(row).status());
    WELLSPACE_ASSIGN_OR_RETURN(ids[row[0].as<int64_t>()],
                               rows.InsertSession(row[1].as<std::string>(), epoch, pqxx::binarystring(row[3]).str()));
  }
  return absl::OkStatus();
}

// What one session has, so that no more than that is held.
absl::Status CopyOne(pqxx::dbtransaction& transaction, int64_t from, int64_t to, RecordRows& rows) {
  const std::string of_it = absl::StrCat(" WHERE session = ", from, " ORDER BY number");
  for (const pqxx::row& row :
       transaction.exec(absl::StrCat("SELECT session, number, kind, record, crc32c FROM wellspace.steps", of_it))) {
    WELLSPACE_RETURN_IF_ERROR(ParseStep(row).status());
    WELLSPACE_RETURN_IF_ERROR(
        rows.InsertStep(to, row[1].as<int64_t>(), row[2].as<int64_t>(), pqxx::binarystring(row[3]).str()));
  }
  for (const pqxx::row& row :
       transaction.exec(absl::StrCat("SELECT number, record, crc32c FROM wellspace.operations", of_it))) {
    const auto number = row[0].as<int64_t>();
    WELLSPACE_RETURN_IF_ERROR(
        Parse<store::v1::OperationRecord>(KeyOfOperation(from, number), row, 1,
                                          absl::StrCat("operation ", number, " of session ", from))
            .status());
    WELLSPACE_RETURN_IF_ERROR(rows.PutOperation(to, number, pqxx::binarystring(row[1]).str()));
  }
  for (const pqxx::row& row :
       transaction.exec(absl::StrCat("SELECT number, part, record, crc32c FROM wellspace.sizes", of_it, ", part"))) {
    const auto number = row[0].as<int64_t>();
    const auto part = row[1].as<int64_t>();
    WELLSPACE_RETURN_IF_ERROR(
        Parse<store::v1::SizesRecord>(KeyOfSizes(from, number, part), row, 2,
                                      absl::StrCat("part ", part, " of sizes ", number, " of session ", from))
            .status());
    WELLSPACE_RETURN_IF_ERROR(rows.InsertSizes(to, number, part, pqxx::binarystring(row[2]).str()));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CopyRows(pqxx::dbtransaction& transaction, int64_t epoch, RecordRows& rows) {
  Ids ids;
  WELLSPACE_RETURN_IF_ERROR(CopySessions(transaction, epoch, rows, ids));
  for (const auto& [from, to] : ids) {
    WELLSPACE_RETURN_IF_ERROR(CopyOne(transaction, from, to, rows));
  }
  for (const pqxx::row& row : transaction.exec("SELECT tenant, request_id, record, crc32c FROM wellspace.answers")) {
    WELLSPACE_ASSIGN_OR_RETURN(const store::v1::AnswerRecord answer, ParseAnswer(row));
    WELLSPACE_RETURN_IF_ERROR(rows.InsertAnswer(answer, pqxx::binarystring(row[2]).str()).status());
  }
  for (const pqxx::row& row : transaction.exec("SELECT tenant, day, owner, record, crc32c FROM wellspace.usage")) {
    WELLSPACE_ASSIGN_OR_RETURN(const store::v1::UsageRecord usage, ParseUsage(row));
    WELLSPACE_RETURN_IF_ERROR(AddUsage(rows, usage));
  }
  return absl::OkStatus();
}

}  // namespace wellspace::server::sql
