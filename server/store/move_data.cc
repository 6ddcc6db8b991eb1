#include "server/store/move_data.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/store/data_folder.h"
#include "server/store/postgres.h"
#include "server/store/postgres_rows.h"
#include "server/store/postgres_schema.h"
#include "server/store/session_tables.h"
#include "server/store/write_ahead_log.h"

namespace wellspace::server {
namespace {

constexpr char kMovedEnd[] = ".moved";
constexpr char kMovedSchema[] = "wellspace_moved_";

// The name of the owner that has sessions while they are on their way. Its lease is out, so that any server takes them.
constexpr char kMover[] = "move-data";

absl::Status Refusal(const std::string& message) { return absl::FailedPreconditionError(message); }

std::string AbsolutePath(const DataFolder& folder) { return std::filesystem::absolute(folder.paths().root).string(); }

absl::Status RemoveIfThere(FileSystem& files, const std::string& path) {
  const absl::Status removed = files.Remove(path);
  return absl::IsNotFound(removed) ? absl::OkStatus() : removed;
}

// The files that SQLite and its mark have beside the database.
absl::Status RemoveBesides(const DataPaths& paths, FileSystem& files) {
  for (const char* end : {"-wal", "-shm", "-journal", "-mark"}) {
    WELLSPACE_RETURN_IF_ERROR(RemoveIfThere(files, paths.database() + end));
  }
  return absl::OkStatus();
}

// No server begins or renews its lease until the end of the transaction, and none lives.
absl::Status LockOut(pqxx::dbtransaction& transaction) {
  transaction.exec0("LOCK TABLE wellspace.owners IN ACCESS EXCLUSIVE MODE");
  const pqxx::result living = transaction.exec(
      "SELECT name FROM wellspace.owners WHERE lease_until > clock_timestamp() ORDER BY lease_until LIMIT 1");
  return living.empty() ? absl::OkStatus()
                        : Refusal(absl::StrCat("the server '", living[0][0].as<std::string>(),
                                               "' is running with this database, or was until a moment ago; stop all "
                                               "of them first, and wait for the end of --lease after a kill"));
}

struct Mover {
  int64_t owner = 0;
  int64_t epoch = 0;
};

Mover AddMover(pqxx::dbtransaction& transaction) {
  // Left by a move before this one, perhaps.
  transaction.exec_params0("UPDATE wellspace.owners SET name = name || ' ' || id WHERE name = $1", kMover);
  const pqxx::row own = transaction.exec_params1(
      "INSERT INTO wellspace.owners(name, epoch, lease_until)"
      " VALUES($1, nextval('wellspace.epochs'), '-infinity') RETURNING id, epoch",
      kMover);
  return {.owner = own[0].as<int64_t>(), .epoch = own[1].as<int64_t>()};
}

// Makes room in the database for the records of `folder`; what a move of the same that was interrupted has left goes.
absl::Status ClearFor(pqxx::dbtransaction& transaction, const DataFolder& folder, Pairing& pairing) {
  const pqxx::row store = transaction.exec1("SELECT id, folder FROM wellspace.store FOR UPDATE");
  pairing.id = store[0].as<std::string>();
  pairing.folder = store[1].is_null() ? "" : store[1].as<std::string>();
  if (!pairing.folder.empty() && pairing.folder != AbsolutePath(folder)) {
    return Refusal(
        absl::StrCat("the database has the records of another folder, ", pairing.folder, "; name a new database"));
  }
  const auto sessions = transaction.exec1("SELECT count(*) FROM wellspace.sessions")[0].as<int64_t>();
  if (pairing.folder.empty() && sessions > 0) {
    return Refusal(absl::StrCat("the database has ", sessions, " sessions of its own; name a new database"));
  }
  // The folder does not belong to the database, so that no server can have begun with the two.
  transaction.exec0("DELETE FROM wellspace.sessions");
  transaction.exec0("DELETE FROM wellspace.answers");
  transaction.exec0("DELETE FROM wellspace.usage");
  transaction.exec0("DELETE FROM wellspace.owners");
  transaction.exec_params0("UPDATE wellspace.store SET folder = $1", AbsolutePath(folder));
  return absl::OkStatus();
}

// Whether a move out of the database with the id of `paired` came to its end there, and not yet in the folder.
absl::StatusOr<bool> HasMovedOut(PostgresLink& link, const Pairing& paired) {
  bool has = false;
  WELLSPACE_RETURN_IF_ERROR(link.Read([&](pqxx::dbtransaction& transaction) {
    has = false;
    for (const pqxx::row& row : transaction.exec(absl::StrCat(
             "SELECT quote_ident(nspname) FROM pg_namespace WHERE starts_with(nspname, '", kMovedSchema, "')"))) {
      has =
          has ||
          transaction.exec1(absl::StrCat("SELECT id FROM ", row[0].as<std::string>(), ".store"))[0].as<std::string>() ==
              paired.id;
    }
    return absl::OkStatus();
  }));
  return has;
}

// Takes all sessions from their owners, who can change nothing from then on. Returns the epoch.
absl::StatusOr<Mover> TakeAllOver(PostgresLink& link, const Pairing& paired) {
  Mover mover;
  const absl::Status taken = link.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(LockOut(transaction));
    if (transaction.exec1("SELECT id FROM wellspace.store")[0].as<std::string>() != paired.id) {
      return Refusal(absl::StrCat("the folder has the files of another database, ", paired.database,
                                  ", as its file 'store' says; name that one"));
    }
    mover = AddMover(transaction);
    transaction.exec_params0("UPDATE wellspace.sessions SET owner = $1, epoch = $2", mover.owner, mover.epoch);
    transaction.exec_params0("DELETE FROM wellspace.owners WHERE id <> $1", mover.owner);
    return absl::OkStatus();
  });
  WELLSPACE_RETURN_IF_ERROR(taken);
  return mover;
}

// Puts the schema aside, if no server has begun since TakeAllOver.
absl::Status PutAside(PostgresLink& link, const Mover& mover) {
  return link.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    WELLSPACE_RETURN_IF_ERROR(LockOut(transaction));
    const pqxx::row others =
        transaction.exec_params1("SELECT count(*) FROM wellspace.owners WHERE id <> $1", mover.owner);
    if (others[0].as<int64_t>() > 0) {
      return Refusal("a server has begun with this database meanwhile; stop it, and move again");
    }
    transaction.exec0(absl::StrCat("ALTER SCHEMA wellspace RENAME TO ", kMovedSchema, mover.epoch));
    return absl::OkStatus();
  });
}

// The folder may take its time between two statements: the database is not to end the transaction for that.
void WaitWithoutEnd(pqxx::dbtransaction& transaction) {
  transaction.exec0("SET LOCAL idle_in_transaction_session_timeout = 0");
}

// Writes a database into the folder, which is none of a server's as long as the folder belongs to PostgreSQL.
absl::Status WriteTables(PostgresLink& link, const DataPaths& paths, FileSystem& files, const Mover& mover) {
  WELLSPACE_RETURN_IF_ERROR(RemoveIfThere(files, paths.database()));
  WELLSPACE_RETURN_IF_ERROR(RemoveBesides(paths, files));
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(paths.database(), {.files = &files}));
  return link.Read([&](pqxx::dbtransaction& transaction) {
    WaitWithoutEnd(transaction);
    return tables->Fill(static_cast<uint64_t>(mover.epoch),
                        [&](RecordRows& rows) { return sql::CopyRows(transaction, mover.epoch, rows); });
  });
}

}  // namespace

absl::Status MoveToPostgres(const std::string& folder, const PostgresOptions& database) {
  FileSystem& files = PosixFileSystem();
  const DataPaths paths{folder};
  WELLSPACE_ASSIGN_OR_RETURN(const std::string shown, ShownPostgresAddress(database.address));
  if (const absl::Status found = files.Open(paths.database(), FileSystem::Mode::kRead).status(); !found.ok()) {
    return absl::IsNotFound(found)
               ? absl::NotFoundError(absl::StrCat(folder, " has no database of its own; expected a folder of --data"))
               : found;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<DataFolder> opened, DataFolder::Open(folder, files));
  WELLSPACE_RETURN_IF_ERROR(DataFolder::CheckNotPaired(paths, files));
  WELLSPACE_RETURN_IF_ERROR(CheckLog(files, paths.database()));
  WELLSPACE_ASSIGN_OR_RETURN(std::unique_ptr<SessionTables> tables,
                             SessionTables::Open(paths.database(), {.may_be_new = false, .files = &files}));
  WELLSPACE_ASSIGN_OR_RETURN(const uint64_t epoch, tables->NextEpoch());
  PostgresLink link(database, PreparePostgres);
  WELLSPACE_RETURN_IF_ERROR(OpenPostgresSchema(link));
  Pairing pairing;
  const absl::Status copied = link.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    WaitWithoutEnd(transaction);
    WELLSPACE_RETURN_IF_ERROR(LockOut(transaction));
    WELLSPACE_RETURN_IF_ERROR(ClearFor(transaction, *opened, pairing));
    // Files have epochs in their names: no owner there gets one that an owner here has had.
    transaction.exec_params("SELECT setval('wellspace.epochs', greatest(nextval('wellspace.epochs'), $1))",
                            static_cast<int64_t>(epoch));
    const Mover mover = AddMover(transaction);
    sql::PostgresRows rows(transaction, mover.owner);
    return tables->CopyRows(mover.epoch, rows);
  });
  WELLSPACE_RETURN_IF_ERROR(copied);
  pairing.database = shown;
  WELLSPACE_RETURN_IF_ERROR(opened->SetPairing(pairing));  // from now on it is PostgreSQL's
  tables.reset();
  WELLSPACE_RETURN_IF_ERROR(files.Rename(paths.database(), paths.database() + kMovedEnd));
  WELLSPACE_RETURN_IF_ERROR(RemoveBesides(paths, files));
  WELLSPACE_RETURN_IF_ERROR(RemoveIfThere(files, paths.ballast()));
  return files.SynchronizeFolder(folder);
}

absl::Status MoveToFolder(const PostgresOptions& database, const std::string& folder) {
  FileSystem& files = PosixFileSystem();
  const DataPaths paths{folder};
  WELLSPACE_RETURN_IF_ERROR(ShownPostgresAddress(database.address).status());
  if (const absl::Status found = files.Open(paths.pairing(), FileSystem::Mode::kRead).status(); !found.ok()) {
    return absl::IsNotFound(found) ? absl::NotFoundError(absl::StrCat(
                                         folder, " has no file 'store': it has the files of no database elsewhere"))
                                   : found;
  }
  WELLSPACE_ASSIGN_OR_RETURN(const std::unique_ptr<DataFolder> opened, DataFolder::Open(folder, files));
  WELLSPACE_ASSIGN_OR_RETURN(const Pairing paired, opened->PairedWith());
  PostgresLink link(database, [](pqxx::connection&) {});
  WELLSPACE_ASSIGN_OR_RETURN(const bool has_moved, HasMovedOut(link, paired));
  if (!has_moved) {
    WELLSPACE_RETURN_IF_ERROR(OpenPostgresSchema(link));
    WELLSPACE_ASSIGN_OR_RETURN(const Mover mover, TakeAllOver(link, paired));
    WELLSPACE_RETURN_IF_ERROR(WriteTables(link, paths, files, mover));
    WELLSPACE_RETURN_IF_ERROR(files.SynchronizeFolder(folder));
    WELLSPACE_RETURN_IF_ERROR(PutAside(link, mover));
  }
  WELLSPACE_RETURN_IF_ERROR(opened->SetPairing({}));  // from now on it is the folder's
  return RemoveIfThere(files, paths.database() + kMovedEnd);
}

}  // namespace wellspace::server
