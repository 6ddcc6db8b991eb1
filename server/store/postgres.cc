#include "server/store/postgres.h"

#include <algorithm>
#include <array>
#include <random>
#include <string_view>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "absl/time/clock.h"
#include "core/base/status_macros.h"
#include "server/base/clock.h"
#include "server/wire/errors.h"
#include "server/wire/hidden_folders.h"

namespace wellspace::server {
namespace {

// Of one transaction, where others are in its way.
constexpr int kMostAttempts = 8;
constexpr absl::Duration kPause = absl::Milliseconds(20);

// Names of the statements that each connection has.
constexpr char kNoteNumber[] = "note_number";
constexpr char kReadNumber[] = "read_number";

// A database that does not answer is given up after some seconds, and not after TCP's quarter of an hour.
constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kTimeouts = {{{"connect_timeout", "5"},
                                                                                     {"tcp_user_timeout", "10000"},
                                                                                     {"keepalives_idle", "5"},
                                                                                     {"keepalives_interval", "2"},
                                                                                     {"keepalives_count", "3"}}};

// `address` with the timeouts that it does not have.
std::string WithTimeouts(std::string address) {
  for (const auto& [key, value] : kTimeouts) {
    if (address.find(absl::StrCat(std::string(key), "=")) != std::string::npos) {
      continue;
    }
    const char* const join = address.find('?') == std::string::npos ? "?" : "&";
    absl::StrAppend(&address, join, std::string(key), "=", std::string(value));
  }
  return address;
}

// The other side does so, too: else it takes a connection that is cut off for one that lives, for two hours.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kServerTimeouts = {
    {{"tcp_user_timeout", "10000"},
     {"tcp_keepalives_idle", "5"},
     {"tcp_keepalives_interval", "2"},
     {"tcp_keepalives_count", "3"}}};
// A busy machine may pause for so long.
constexpr absl::Duration kLeastIdle = absl::Seconds(1);

std::string MillisecondsOf(absl::Duration duration) { return absl::StrCat(absl::ToInt64Milliseconds(duration)); }

std::string RandomId() {
  std::random_device random;
  return absl::StrFormat("%08x%08x%08x%08x", random(), random(), random(), random());
}

// Whether the transaction may simply be run again: another was in its way, or has come or gone meanwhile. libpqxx gives
// these no state.
bool IsInTheWay(const std::exception& error) {
  return dynamic_cast<const pqxx::deadlock_detected*>(&error) != nullptr ||
         dynamic_cast<const pqxx::serialization_failure*>(&error) != nullptr ||
         dynamic_cast<const pqxx::foreign_key_violation*>(&error) != nullptr ||
         dynamic_cast<const pqxx::unique_violation*>(&error) != nullptr;
}

// Whether the connection has gone. A transaction that reads is in doubt to libpqxx, too, if it goes during the commit.
bool IsGone(const std::exception& error) {
  return dynamic_cast<const pqxx::broken_connection*>(&error) != nullptr ||
         dynamic_cast<const pqxx::in_doubt_error*>(&error) != nullptr ||
         dynamic_cast<const pqxx::statement_completion_unknown*>(&error) != nullptr;
}

std::string Saying(std::string_view what, const std::string& said) {
  return absl::StrCat(std::string(what), std::string(kDatabaseSays), said);
}

}  // namespace

absl::Status ErrorOfPostgres(const std::exception& exception) {
  const std::string text = absl::StrReplaceAll(absl::StripAsciiWhitespace(exception.what()), {{"\n", " "}, {"\t", ""}});
  if (IsGone(exception)) {
    return MakeError(v1::ERROR_REASON_STORE_FAILED, Saying("there is no connection to the database", text));
  }
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) {
    return MakeError(v1::ERROR_REASON_OUT_OF_MEMORY, "there is no memory for what the database answers");
  }
  const auto* const error = dynamic_cast<const pqxx::sql_error*>(&exception);
  const std::string state = error == nullptr ? "" : error->sqlstate();
  if (dynamic_cast<const pqxx::insufficient_privilege*>(&exception) != nullptr) {
    return absl::PermissionDeniedError(Saying("the role of this server has not the rights that it needs", text));
  }
  if (dynamic_cast<const pqxx::disk_full*>(&exception) != nullptr) {
    return MakeError(v1::ERROR_REASON_DISK_FULL, Saying("the disk of the database is full", text));
  }
  // connection exceptions, shortage of resources, intervention of its operator, a database that is read-only now
  if (state.starts_with("08") || state.starts_with("53") || state.starts_with("57") || state == "25006") {
    return MakeError(v1::ERROR_REASON_STORE_FAILED, Saying("the database does not serve", text));
  }
  return MakeError(v1::ERROR_REASON_INTERNAL, Saying("the database has refused a statement", text));
}

PostgresLink::PostgresLink(const PostgresOptions& options, Prepare prepare)
    : address_(WithTimeouts(options.address)),
      id_(RandomId()),
      look_up_for_(options.look_up_for),
      prepare_(std::move(prepare)) {}

pqxx::connection& PostgresLink::Connect() {
  if (connection_ == nullptr) {
    auto made = std::make_unique<pqxx::connection>(address_);
    made->set_variable("statement_timeout", "'30s'");
    // A server that stands still, or is cut off, within a transaction does not keep others from its rows for longer. A
    // commit of which the database has not heard is no more by the time when it is given up to look it up.
    made->set_variable("idle_in_transaction_session_timeout", MillisecondsOf(std::max(look_up_for_ / 2, kLeastIdle)));
    for (const auto& [name, value] : kServerTimeouts) {
      made->set_variable(std::string(name), std::string(value));
    }
    made->prepare(kNoteNumber,
                  "INSERT INTO wellspace.commits(link, number, time) VALUES($1, $2, clock_timestamp())"
                  " ON CONFLICT(link) DO UPDATE SET number = excluded.number, time = excluded.time");
    // It waits for a transaction of this link that still has the row, or is about to insert it.
    made->prepare(kReadNumber,
                  "INSERT INTO wellspace.commits AS known(link, number, time) VALUES($1, 0, clock_timestamp())"
                  " ON CONFLICT(link) DO UPDATE SET number = known.number RETURNING number");
    prepare_(*made);
    connection_ = std::move(made);
  }
  return *connection_;
}

absl::Status PostgresLink::Transact(const Work& work, Doubt doubt) {
  const std::lock_guard lock(mutex_);
  return Run(doubt == Doubt::kLookUp ? Kind::kWrite : Kind::kRepeatableWrite, work);
}

absl::Status PostgresLink::Read(const Work& work) {
  const std::lock_guard lock(mutex_);
  return Run(Kind::kRead, work);
}

template <typename Transaction>
absl::Status PostgresLink::RunOnce(Kind kind, const Work& work, bool* is_in_doubt) {
  Transaction transaction(Connect());
  if (kind == Kind::kWrite) {
    transaction.exec_prepared0(kNoteNumber, id_, ++last_number_);
  }
  if (absl::Status done = work(transaction); !done.ok()) {
    return done;  // its end rolls back
  }
  *is_in_doubt = kind == Kind::kWrite;
  transaction.commit();
  *is_in_doubt = false;
  return absl::OkStatus();
}

absl::Status PostgresLink::Run(Kind kind, const Work& work) {
  using Snapshot = pqxx::transaction<pqxx::repeatable_read, pqxx::read_only>;
  for (int attempt = 1;; ++attempt) {
    const bool was_connected = connection_ != nullptr;
    bool is_in_doubt = false;
    try {
      return kind == Kind::kRead ? RunOnce<Snapshot>(kind, work, &is_in_doubt)
                                 : RunOnce<pqxx::work>(kind, work, &is_in_doubt);
    } catch (const std::exception& error) {
      const absl::Status status = ErrorOfPostgres(error);
      const bool is_gone = IsGone(error);
      // One that is being shut down says so before it goes.
      if (is_in_doubt || absl::IsUnavailable(status) || dynamic_cast<const pqxx::sql_error*>(&error) == nullptr) {
        connection_ = nullptr;
      }
      if (is_in_doubt) {
        return LookUp();
      }
      // The database was restarted, perhaps, or another transaction was in the way; nothing has changed.
      const bool may_help = is_gone ? was_connected : IsInTheWay(error);
      if (!may_help || attempt == kMostAttempts) {
        return status;
      }
      absl::SleepFor(is_gone ? absl::ZeroDuration() : attempt * kPause);
    }
  }
}

// The number of a transaction in the database is no help: one that was given shortly before a crash is given again.
absl::Status PostgresLink::LookUp() {
  const absl::Duration deadline = SinceBoot() + look_up_for_;
  std::string cause;
  while (SinceBoot() < deadline) {
    try {
      pqxx::work transaction(Connect());
      transaction.exec0(absl::StrCat("SET LOCAL lock_timeout = ",
                                     MillisecondsOf(std::max(deadline - SinceBoot(), absl::Milliseconds(1)))));
      const auto number = transaction.exec_prepared1(kReadNumber, id_)[0].as<int64_t>();
      return number == last_number_
                 ? absl::OkStatus()
                 : MakeError(v1::ERROR_REASON_STORE_FAILED, "the database went away before it had made the change");
    } catch (const std::exception& error) {
      connection_ = nullptr;
      cause = std::string(ErrorOfPostgres(error).message());
    }
    absl::SleepFor(kPause);
  }
  return absl::DataLossError(absl::StrCat("it is not known whether the database has made a change: ", cause));
}

}  // namespace wellspace::server
