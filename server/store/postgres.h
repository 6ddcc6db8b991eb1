// PostgreSQL by libpqxx, as far as the store needs it, with errors as those of the service.
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <pqxx/pqxx>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/store/postgres_options.h"

namespace wellspace::server {

// A connection that is made again when it has gone, one transaction at a time.
//
// Thread safety: thread-safe; transactions wait for one another.
// Errors:     of all functions here: STORE_FAILED, with the database's own words: it cannot be reached, or does not
//             answer; nothing has changed. PERMISSION_DENIED: the role has no right to it. DISK_FULL: of the database.
//             INTERNAL: anything else.
class PostgresLink {
 public:
  using Work = std::function<absl::Status(pqxx::dbtransaction& transaction)>;
  // Has the statements prepared that transactions use.
  using Prepare = std::function<void(pqxx::connection& connection)>;

  // The address is not connected to by this.
  PostgresLink(const PostgresOptions& options, Prepare prepare);

  // How it is found out whether a commit was made whose answer got lost.
  enum class Doubt {
    kLookUp,    // by a row that the transaction writes besides: the tables of OpenPostgresSchema are there
    kRunAgain,  // not at all: where it was made `work` changes nothing
  };

  // Runs `work` in a transaction, and commits it unless `work` returns an error. It may be run several times: where
  // another transaction was in the way, or the connection of before has gone. After a commit whose answer got lost it
  // was made, or nothing has changed.
  //
  // Errors:     those of `work`; DATA_LOSS: it is not known whether the transaction was committed, and the database
  //             cannot be asked for PostgresOptions::look_up_for.
  absl::Status Transact(const Work& work, Doubt doubt = Doubt::kLookUp);
  // The same, with all of one moment, and without changes.
  absl::Status Read(const Work& work);

 private:
  enum class Kind { kWrite, kRepeatableWrite, kRead };

  // The following want mutex_ to be held.
  absl::Status Run(Kind kind, const Work& work);
  pqxx::connection& Connect();
  template <typename Transaction>
  absl::Status RunOnce(Kind kind, const Work& work, bool* is_in_doubt);
  // Whether the last transaction was committed.
  absl::Status LookUp();

  const std::string address_;
  const std::string id_;  // of this link among all that there were and will be
  const absl::Duration look_up_for_;
  const Prepare prepare_;
  std::mutex mutex_;                              // of all below
  std::unique_ptr<pqxx::connection> connection_;  // null: none
  int64_t last_number_ = 0;                       // of the transactions that write, from 1 on
};

// The status for callers of an exception of PostgreSQL, with its words in one line.
absl::Status ErrorOfPostgres(const std::exception& exception);

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_H_
