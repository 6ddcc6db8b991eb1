#include "server/store/postgres_lease.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/store/postgres_schema.h"
#include "server/wire/errors.h"

namespace wellspace::server {
namespace {

// Between looks at the lease of an owner that has this name.
constexpr absl::Duration kLook = absl::Milliseconds(200);
// A lease is renewed so many times before it is out.
constexpr int kRenewals = 3;
constexpr int64_t kNotNow = std::numeric_limits<int64_t>::max();

int64_t Nanoseconds(absl::Duration since_boot) { return absl::ToInt64Nanoseconds(since_boot); }
int64_t NowInNanoseconds() { return Nanoseconds(SinceBoot()); }

}  // namespace

PostgresLease::PostgresLease(std::string name, absl::Duration length, PostgresLink& link,
                             std::shared_ptr<StoreHealth> health)
    : name_(std::move(name)), length_(length), link_(link), health_(std::move(health)) {}

PostgresLease::~PostgresLease() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (keeper_.joinable()) {
    keeper_.join();
    link_
        .Transact([&](pqxx::dbtransaction& transaction) {
          transaction.exec_prepared(sql::kGiveBack, owner_);
          return absl::OkStatus();
        })
        .IgnoreError();  // then it is out after a while
  }
}

absl::Status PostgresLease::Begin(const std::function<absl::Status(pqxx::dbtransaction& transaction)>& take) {
  // One of this name that died was heard of a lease ago at most. One that lives renews its lease meanwhile.
  const absl::Duration deadline = SinceBoot() + length_ + length_ / kRenewals;
  for (bool lives = true; lives;) {
    WELLSPACE_RETURN_IF_ERROR(TryToBegin(take, &lives));
    if (lives && SinceBoot() > deadline) {
      return absl::FailedPreconditionError(absl::StrCat("another server with the name '", name_,
                                                        "' has sessions in this database, and lives; give each server "
                                                        "a name of its own"));
    }
    if (lives) {
      absl::SleepFor(std::min(kLook, length_ / 10));
    }
  }
  keeper_ = std::thread([this] { Keep(); });
  return absl::OkStatus();
}

absl::Status PostgresLease::TryToBegin(const std::function<absl::Status(pqxx::dbtransaction& transaction)>& take,
                                       bool* lives) {
  const absl::Duration asked = SinceBoot();
  WELLSPACE_RETURN_IF_ERROR(link_.Transact([&](pqxx::dbtransaction& transaction) -> absl::Status {
    const pqxx::result before = transaction.exec_params(
        "SELECT id, lease_until > clock_timestamp() FROM wellspace.owners WHERE name = $1 FOR UPDATE", name_);
    *lives = !before.empty() && before[0][1].as<bool>();
    if (*lives) {
      return absl::OkStatus();
    }
    if (!before.empty()) {
      // The name is given on; its sessions stay its own until they are taken.
      transaction.exec_params0("UPDATE wellspace.owners SET name = name || ' ' || id WHERE id = $1",
                               before[0][0].as<int64_t>());
    }
    const pqxx::row own = transaction.exec_params1(
        "INSERT INTO wellspace.owners(name, epoch, lease_until)"
        " VALUES($1, nextval('wellspace.epochs'), clock_timestamp() + make_interval(secs => $2)) RETURNING id, epoch",
        name_, absl::ToDoubleSeconds(length_));
    owner_ = own[0].as<int64_t>();
    epoch_ = own[1].as<uint64_t>();
    return take(transaction);
  }));
  end_ = Nanoseconds(asked + length_);
  return absl::OkStatus();
}

void PostgresLease::Keep() {
  std::unique_lock lock(mutex_);
  const auto pause = absl::ToChronoMilliseconds(length_ / kRenewals);
  while (!changed_.wait_for(lock, pause, [&] { return is_ending_; })) {
    lock.unlock();
    Renew();
    lock.lock();
  }
}

// Where the database is not there the next time may be better: changes are refused by epochs, and not by the lease.
void PostgresLease::Renew() {
  const absl::Duration asked = SinceBoot();
  bool is_owner = true;
  const absl::Status renewed = link_.Transact([&](pqxx::dbtransaction& transaction) {
    is_owner = transaction.exec_prepared(sql::kRenewLease, owner_, absl::ToDoubleSeconds(length_)).affected_rows() > 0;
    return absl::OkStatus();
  });
  if (!renewed.ok()) {
    steady_from_ = kNotNow;
    return;
  }
  if (!is_owner) {
    health_
        ->Fail(absl::AbortedError("the lease ran out, and other servers have taken all sessions over; start again to "
                                  "own some"))
        .IgnoreError();
    return;
  }
  if (steady_from_ == kNotNow || NowInNanoseconds() >= end_) {
    steady_from_ = Nanoseconds(SinceBoot() + length_);
  }
  end_ = Nanoseconds(asked + length_);
}

absl::Status PostgresLease::Announce(const std::string& address) {
  return link_.Transact([&](pqxx::dbtransaction& transaction) {
    transaction.exec_params0("UPDATE wellspace.owners SET address = $2 WHERE id = $1", owner_, address);
    return absl::OkStatus();
  });
}

absl::Status PostgresLease::Check() const {
  return NowInNanoseconds() < end_
             ? absl::OkStatus()
             : MakeError(v1::ERROR_REASON_STORE_FAILED,
                         "the lease of this server is out, since the database was not reached for so long: another "
                         "server may have the session by now");
}

bool PostgresLease::IsSteady() const { return NowInNanoseconds() >= steady_from_; }

}  // namespace wellspace::server
