// By what a process is known to the others that share a PostgreSQL database: a row, with a lease.
#ifndef WELLSPACE_SERVER_STORE_POSTGRES_LEASE_H_
#define WELLSPACE_SERVER_STORE_POSTGRES_LEASE_H_

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "server/store/postgres.h"
#include "server/store/store_health.h"

namespace wellspace::server {

// A lease is renewed three times while it runs. Its end is reckoned twice: by the clock of the database, for the
// others, and by one of this machine that neither jumps nor stops, from before the renewal was asked for. So this
// process knows of the end no later than they do.
//
// Thread safety: thread-safe.
// Invariants: an owner's row goes in the transaction that takes its sessions, once its lease is out, and not otherwise.
class PostgresLease {
 public:
  // `length`: how long the process counts as living after it was last heard of.
  //
  // REQUIRES:   `link` outlives this, and has PreparePostgres.
  PostgresLease(std::string name, absl::Duration length, PostgresLink& link, std::shared_ptr<StoreHealth> health);
  // Gives the lease back: the next server that looks takes the sessions over.
  ~PostgresLease();
  PostgresLease(const PostgresLease&) = delete;
  PostgresLease& operator=(const PostgresLease&) = delete;

  // Becomes an owner, and calls `take` in the same transaction. Where an owner of this name has ended without a word,
  // its lease is waited for. To be called once, before the others.
  //
  // Errors:     those of PostgresLink and of `take`. FAILED_PRECONDITION: an owner of this name lives.
  absl::Status Begin(const std::function<absl::Status(pqxx::dbtransaction& transaction)>& take);

  int64_t owner() const { return owner_; }   // of the row
  uint64_t epoch() const { return epoch_; }  // the first that it got

  // As Records.
  absl::Status Announce(const std::string& address);
  absl::Status Check() const;

  // Whether the database has been heard of for a whole lease, as at the beginning. After it was away leases are out of
  // owners that have only not come to renew them.
  bool IsSteady() const;

 private:
  // One attempt of Begin. Sets `*lives`, if another of this name does.
  absl::Status TryToBegin(const std::function<absl::Status(pqxx::dbtransaction& transaction)>& take, bool* lives);
  void Keep();
  void Renew();

  const std::string name_;
  const absl::Duration length_;
  PostgresLink& link_;
  const std::shared_ptr<StoreHealth> health_;
  int64_t owner_ = 0;
  uint64_t epoch_ = 0;
  std::atomic<int64_t> end_ = 0;          // of the lease, in nanoseconds since boot
  std::atomic<int64_t> steady_from_ = 0;  // likewise; kNotNow: not before the database is heard of again

  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_ending_ = false;  // guarded by mutex_
  std::thread keeper_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_STORE_POSTGRES_LEASE_H_
