#include "server/store/postgres_schema.h"

#include <array>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace wellspace::server {
namespace {

constexpr int kOldestServer = 130000;  // gen_random_uuid

// Those who make the tables at once wait for this.
constexpr char kLockSchema[] = "SELECT pg_advisory_xact_lock(5995635)";

// Each makes version n + kFirstVersion of the version before. A released step is never changed: there are databases
// that it has made. Versions are those of SQLite's tables, so that one number says which records there are.
constexpr int kFirstVersion = 3;
constexpr std::array kPostgresMigrations = {
    "CREATE SCHEMA IF NOT EXISTS wellspace;"
    // folder: that of the files that the records name, where it was first named; null: none was yet.
    "CREATE TABLE wellspace.store(version integer NOT NULL, id text NOT NULL, folder text);"
    "INSERT INTO wellspace.store VALUES(0, gen_random_uuid()::text);"
    "CREATE SEQUENCE wellspace.epochs AS bigint;"
    // epoch: the first that it got. address: where it serves; null: it has not told. lease_until: -infinity once it was
    // given back.
    "CREATE TABLE wellspace.owners(id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, name text NOT NULL UNIQUE,"
    "                              epoch bigint NOT NULL, address text, lease_until timestamptz NOT NULL);"
    // No session is of an owner that there is not: a change that would make one is refused. offered_at: since when its
    // owner lets others have it; null: it does not. offered_of: its tenant then.
    "CREATE TABLE wellspace.sessions(id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, name text NOT NULL UNIQUE,"
    "                                owner bigint NOT NULL REFERENCES wellspace.owners, epoch bigint NOT NULL,"
    "                                state bytea NOT NULL, crc32c bigint NOT NULL, offered_at timestamptz,"
    "                                offered_of bytea);"
    "CREATE INDEX ON wellspace.sessions(owner);"
    "CREATE INDEX ON wellspace.sessions(offered_at) WHERE offered_at IS NOT NULL;"
    "CREATE TABLE wellspace.steps(session bigint NOT NULL REFERENCES wellspace.sessions ON DELETE CASCADE,"
    "                             number bigint NOT NULL, kind bigint NOT NULL, record bytea NOT NULL,"
    "                             crc32c bigint NOT NULL, PRIMARY KEY(session, number));"
    "CREATE TABLE wellspace.operations(session bigint NOT NULL REFERENCES wellspace.sessions ON DELETE CASCADE,"
    "                                  number bigint NOT NULL, record bytea NOT NULL, crc32c bigint NOT NULL,"
    "                                  PRIMARY KEY(session, number));"
    "CREATE TABLE wellspace.sizes(session bigint NOT NULL REFERENCES wellspace.sessions ON DELETE CASCADE,"
    "                             number bigint NOT NULL, part bigint NOT NULL, record bytea NOT NULL,"
    "                             crc32c bigint NOT NULL, PRIMARY KEY(session, number, part));"
    "CREATE TABLE wellspace.answers(tenant bytea NOT NULL, request_id bytea NOT NULL, record bytea NOT NULL,"
    "                               time timestamptz NOT NULL, crc32c bigint NOT NULL,"
    "                               PRIMARY KEY(tenant, request_id));"
    // The last transaction of each link that was committed (PostgresLink). time: of that.
    "CREATE TABLE wellspace.commits(link text PRIMARY KEY, number bigint NOT NULL, time timestamptz NOT NULL);",
    // owner: of a process that has told it, and that may be no more. Each writes its own rows: none waits for another.
    "CREATE TABLE wellspace.usage(tenant bytea NOT NULL, day bigint NOT NULL, owner bigint NOT NULL,"
    "                             record bytea NOT NULL, crc32c bigint NOT NULL, PRIMARY KEY(tenant, day, owner));",
};
constexpr int kVersion = kFirstVersion + static_cast<int>(kPostgresMigrations.size()) - 1;

constexpr std::pair<const char*, const char*> kStatements[] = {
    // Others that would take the session over, or change it, wait for the end of the transaction.
    {sql::kFindSession, "SELECT id, epoch FROM wellspace.sessions WHERE name = $1 FOR UPDATE"},
    {sql::kInsertSession,
     "INSERT INTO wellspace.sessions(name, owner, epoch, state, crc32c) VALUES($1, $2, $3, $4, $5) RETURNING id"},
    {sql::kUpdateSession, "UPDATE wellspace.sessions SET state = $2, crc32c = $3 WHERE id = $1"},
    {sql::kDeleteSession, "DELETE FROM wellspace.sessions WHERE id = $1"},
    {sql::kTakeSession,
     "UPDATE wellspace.sessions SET owner = $2, epoch = nextval('wellspace.epochs'), offered_at = NULL"
     " WHERE name = $1 RETURNING id, name, epoch, state, crc32c"},
    {sql::kOfferSession, "UPDATE wellspace.sessions SET offered_at = clock_timestamp(), offered_of = $2 WHERE id = $1"},
    {sql::kWithdrawSession, "UPDATE wellspace.sessions SET offered_at = NULL WHERE id = $1"},
    {sql::kHasOffered,
     "SELECT EXISTS(SELECT FROM wellspace.sessions WHERE offered_at IS NOT NULL AND owner <> $1"
     "              AND NOT offered_of = ANY($2::bytea[]))"},
    // Rows that another has locked, to take the session or to change it, are left to that one: nothing here waits.
    {sql::kTakeOffered,
     "WITH offered AS MATERIALIZED"
     " (SELECT id FROM wellspace.sessions WHERE offered_at IS NOT NULL AND owner <> $1"
     "  AND NOT offered_of = ANY($2::bytea[]) ORDER BY offered_at LIMIT $3 FOR UPDATE SKIP LOCKED)"
     " UPDATE wellspace.sessions SET owner = $1, epoch = nextval('wellspace.epochs'), offered_at = NULL"
     " FROM offered WHERE sessions.id = offered.id RETURNING sessions.id"},
    {sql::kListOffered, "SELECT name FROM wellspace.sessions WHERE offered_at IS NOT NULL AND owner = $1"},
    {sql::kListOperations,
     "SELECT operations.session, number, operations.record, operations.crc32c,"
     "       sessions.id, sessions.name, sessions.epoch, state, sessions.crc32c, owners.name, coalesce(address, '')"
     " FROM wellspace.operations JOIN wellspace.sessions ON sessions.id = session"
     " JOIN wellspace.owners ON owners.id = owner"
     " WHERE (session, number) > ($1, $2) ORDER BY session, number LIMIT $3"},
    {sql::kReadSession, "SELECT id, name, epoch, state, crc32c FROM wellspace.sessions WHERE name = $1"},
    {sql::kNextStep, "SELECT coalesce(max(number) + 1, 0) FROM wellspace.steps WHERE session = $1"},
    {sql::kInsertStep, "INSERT INTO wellspace.steps(session, number, kind, record, crc32c) VALUES($1, $2, $3, $4, $5)"},
    {sql::kReadFeatures,
     "SELECT session, number, kind, record, crc32c FROM wellspace.steps"
     " WHERE session = (SELECT id FROM wellspace.sessions WHERE name = $1) AND kind = $2 ORDER BY number"},
    // An operation that has begun, or ended, is no work for others any more.
    {sql::kPutOperation,
     "WITH withdrawn AS"
     " (UPDATE wellspace.sessions SET offered_at = NULL WHERE id = $1 AND offered_at IS NOT NULL)"
     " INSERT INTO wellspace.operations(session, number, record, crc32c) VALUES($1, $2, $3, $4)"
     " ON CONFLICT(session, number) DO UPDATE SET record = excluded.record, crc32c = excluded.crc32c"},
    {sql::kDropOperation, "DELETE FROM wellspace.operations WHERE session = $1 AND number = $2"},
    {sql::kInsertSizes,
     "INSERT INTO wellspace.sizes(session, number, part, record, crc32c) VALUES($1, $2, $3, $4, $5)"},
    {sql::kReadSizes,
     "SELECT session, number, part, record, crc32c FROM wellspace.sizes"
     " WHERE session = (SELECT id FROM wellspace.sessions WHERE name = $1) ORDER BY number, part"},
    {sql::kDropSizes, "DELETE FROM wellspace.sizes WHERE session = $1 AND number = $2"},
    {sql::kInsertAnswer,
     // By the clock of the database: those of servers may be hours apart, and jump.
     "INSERT INTO wellspace.answers(tenant, request_id, record, time, crc32c)"
     " VALUES($1, $2, $3, clock_timestamp(), $4)"
     " ON CONFLICT DO NOTHING"},
    {sql::kReadAnswer,
     "SELECT tenant, request_id, record, crc32c FROM wellspace.answers WHERE tenant = $1 AND request_id = $2"},
    {sql::kDropAnswer, "DELETE FROM wellspace.answers WHERE tenant = $1 AND request_id = $2"},
    {sql::kPutUsage,
     "INSERT INTO wellspace.usage(tenant, day, owner, record, crc32c) VALUES($1, $2, $3, $4, $5)"
     " ON CONFLICT(tenant, day, owner) DO UPDATE SET record = excluded.record, crc32c = excluded.crc32c"},
    {sql::kFindUsage,
     "SELECT tenant, day, owner, record, crc32c FROM wellspace.usage WHERE tenant = $1 AND day = $2 AND owner = $3"},
    {sql::kReadUsage,
     "SELECT tenant, day, owner, record, crc32c FROM wellspace.usage"
     " WHERE ($1 = ''::bytea OR tenant = $1) AND day BETWEEN $2 AND $3"},
    {sql::kRenewLease,
     "UPDATE wellspace.owners SET lease_until = clock_timestamp() + make_interval(secs => $2) WHERE id = $1"},
    {sql::kGiveBack, "UPDATE wellspace.owners SET lease_until = '-infinity' WHERE id = $1"},
    // Whether it lives is asked by the clock that has given the lease.
    {sql::kFindOwner,
     "SELECT sessions.id, sessions.name, sessions.epoch, state, crc32c, owner, coalesce(address, ''),"
     "       lease_until > clock_timestamp()"
     " FROM wellspace.sessions JOIN wellspace.owners ON owners.id = owner WHERE sessions.name = $1"},
};

absl::Status Migrate(pqxx::dbtransaction& transaction) {
  transaction.exec(kLockSchema);
  const bool is_new = transaction.exec1("SELECT to_regclass('wellspace.store') IS NULL")[0].as<bool>();
  const int version =
      is_new ? kFirstVersion - 1 : transaction.exec1("SELECT version FROM wellspace.store")[0].as<int>();
  if (version > kVersion) {
    return absl::FailedPreconditionError(
        absl::StrCat("the tables are of version ", version, ", and this program knows versions up to ", kVersion,
                     "; start the newer wellspaced, or restore a back-up that was made before it"));
  }
  for (int from = version; from < kVersion; ++from) {
    transaction.exec(kPostgresMigrations[from + 1 - kFirstVersion]);
  }
  if (version < kVersion) {
    transaction.exec(absl::StrCat("UPDATE wellspace.store SET version = ", kVersion));
  }
  return absl::OkStatus();
}

}  // namespace

void PreparePostgres(pqxx::connection& connection) {
  for (const auto& [name, statement] : kStatements) {
    connection.prepare(name, statement);
  }
}

absl::Status OpenPostgresSchema(PostgresLink& link) {
  absl::Status opened = link.Transact(
      [](pqxx::dbtransaction& transaction) {
        const int version = transaction.conn().server_version();
        return version < kOldestServer ? absl::FailedPreconditionError(
                                             absl::StrCat("PostgreSQL ", version / 10000,
                                                          " is too old; 13 and later are known to have all that it "
                                                          "takes"))
                                       : Migrate(transaction);
      },
      PostgresLink::Doubt::kRunAgain);
  if (!absl::IsPermissionDenied(opened)) {
    return opened;
  }
  return absl::PermissionDeniedError(
      absl::StrCat(std::string(opened.message()),
                   "; the role needs CREATE on the database for the first start, and has to own the schema wellspace"));
}

}  // namespace wellspace::server
