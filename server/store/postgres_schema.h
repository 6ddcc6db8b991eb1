// The tables of PostgresRecords, and the statements over them.
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_SCHEMA_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_SCHEMA_H_

#include <pqxx/pqxx>

#include "absl/status/status.h"
#include "server/store/postgres.h"

namespace wellspace::server {

// Names of the statements that PreparePostgres prepares.
namespace sql {
inline constexpr char kFindSession[] = "find_session";
inline constexpr char kInsertSession[] = "insert_session";
inline constexpr char kUpdateSession[] = "update_session";
inline constexpr char kOfferSession[] = "offer_session";
inline constexpr char kWithdrawSession[] = "withdraw_session";
inline constexpr char kTakeOffered[] = "take_offered";
inline constexpr char kHasOffered[] = "has_offered";
inline constexpr char kListOffered[] = "list_offered";
inline constexpr char kDeleteSession[] = "delete_session";
inline constexpr char kTakeSession[] = "take_session";
inline constexpr char kListOperations[] = "list_operations";
inline constexpr char kReadSession[] = "read_session";
inline constexpr char kNextStep[] = "next_step";
inline constexpr char kInsertStep[] = "insert_step";
inline constexpr char kReadFeatures[] = "read_features";
inline constexpr char kPutOperation[] = "put_operation";
inline constexpr char kDropOperation[] = "drop_operation";
inline constexpr char kInsertSizes[] = "insert_sizes";
inline constexpr char kReadSizes[] = "read_sizes";
inline constexpr char kDropSizes[] = "drop_sizes";
inline constexpr char kInsertAnswer[] = "insert_answer";
inline constexpr char kReadAnswer[] = "read_answer";
inline constexpr char kDropAnswer[] = "drop_answer";
inline constexpr char kPutUsage[] = "put_usage";
inline constexpr char kFindUsage[] = "find_usage";
inline constexpr char kReadUsage[] = "read_usage";
inline constexpr char kRenewLease[] = "renew_lease";
inline constexpr char kGiveBack[] = "give_back";
inline constexpr char kFindOwner[] = "find_owner";
}  // namespace sql

void PreparePostgres(pqxx::connection& connection);

// Makes the tables, or brings them to the version that this program knows. Processes that do so at once wait for one
// another.
//
// Errors:     those of PostgresLink. FAILED_PRECONDITION: they are of a newer program, or PostgreSQL is too old.
//             PERMISSION_DENIED, with what to grant.
absl::Status OpenPostgresSchema(PostgresLink& link);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_SCHEMA_H_
