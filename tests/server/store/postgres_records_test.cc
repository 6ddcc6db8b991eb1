// Features of PostgreSQL alone: leases, a database that goes away, and one that cannot be used. Those in common
// with the others: records_test.cc.
#include "server/store/postgres_records.h"

#include <atomic>
#include <latch>
#include <memory>
#include <pqxx/pqxx>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/back_up.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "server/store/postgres_schema.h"
#include "tests/server/service_harness.h"
#include "tests/server/store/cutting_proxy.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

constexpr absl::Duration kShort = absl::Milliseconds(600);

class PostgresRecordsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = PostgresServer::WhyNot(); !why.empty()) {
      GTEST_SKIP() << why;
    }
    server_ = &PostgresServer::OfThisProgram();
    address_ = server_->NewDatabase();
    database_ = server_->last_database();
  }

  absl::StatusOr<std::unique_ptr<PostgresRecords>> Open(const std::string& owner, absl::Duration lease = kShort) {
    return PostgresRecords::Open({.address = address_, .owner = owner, .lease = lease, .look_up_for = kShort}, folder_,
                                 std::make_shared<StoreHealth>([this](const absl::Status&) { ++failures_; }));
  }
  static absl::Status Create(Records& records, uint64_t number, const std::string& id = "") {
    SessionChange change{
        .session = SessionName(number), .epoch = records.epoch(), .is_creation = true, .state = MakeState(number)};
    if (!id.empty()) {
      change.answer = MakeAnswer("tenant", id, "made");
    }
    return records.Apply(change, Survives::kPowerLoss);
  }
  static absl::Status Update(Records& records, uint64_t number, uint64_t epoch, uint64_t revision) {
    return records.Apply({.session = SessionName(number), .epoch = epoch, .state = MakeState(number, revision)},
                         Survives::kPowerLoss);
  }

  PostgresServer* server_ = nullptr;
  std::string address_;
  std::string database_;
  std::shared_ptr<DataFolder> folder_;
  std::atomic<int> failures_ = 0;
};

TEST_F(PostgresRecordsTest, SessionsOfALivingOwnerStayItsOwn) {
  const auto first = Open("first").value();
  ASSERT_TRUE(Create(*first, 1).ok());
  absl::SleepFor(3 * kShort);  // its lease is renewed meanwhile
  const auto second = Open("second").value();
  EXPECT_GT(second->epoch(), first->epoch());
  EXPECT_THAT(second->Load()->sessions, IsEmpty());
  EXPECT_TRUE(Update(*first, 1, first->epoch(), 2).ok());
  EXPECT_EQ(first->ReadCensus()->oldest_epoch, first->epoch());
  EXPECT_EQ(second->ReadCensus()->oldest_epoch, first->epoch()) << "whose files may still come to be named";
  EXPECT_THAT(second->ReadCensus()->sessions, SizeIs(1));
}

TEST_F(PostgresRecordsTest, WhoEndsGivesItsSessionsBackAtOnce) {
  uint64_t epoch = 0;
  {
    const auto first = Open("first", absl::Hours(1)).value();
    epoch = first->epoch();
    ASSERT_TRUE(Create(*first, 1).ok());
    ASSERT_TRUE(Create(*first, 2, "a").ok());
  }
  for (const char* const name : {"first", "second"}) {
    const auto next = Open(name, absl::Hours(1)).value();
    const StoredSessions stored = next->Load().value();
    ASSERT_THAT(stored.sessions, SizeIs(2));
    EXPECT_EQ(stored.sessions[0].epoch, next->epoch());
    EXPECT_THAT(stored.answers, SizeIs(1));
    EXPECT_GT(next->epoch(), epoch);
    EXPECT_EQ(next->ReadCensus()->oldest_epoch, next->epoch());
    epoch = next->epoch();
  }
}

// It was stopped, or cut off, for longer than its lease.
TEST_F(PostgresRecordsTest, AnOwnerWhoseSessionsWereTakenChangesNothing) {
  const auto first = Open("first", absl::Hours(1)).value();
  ASSERT_TRUE(Create(*first, 1).ok());
  server_->Run("UPDATE wellspace.owners SET lease_until = clock_timestamp()", database_);
  EXPECT_TRUE(Update(*first, 1, first->epoch(), 2).ok()) << "it is not taken yet";
  const auto second = Open("second").value();
  const StoredSessions stored = second->Load().value();
  ASSERT_THAT(stored.sessions, SizeIs(1));
  EXPECT_EQ(stored.sessions[0].state.revision(), 2u);
  EXPECT_TRUE(IsOwnedElsewhere(Update(*first, 1, first->epoch(), 3)));
  EXPECT_TRUE(IsOwnedElsewhere(Create(*first, 2))) << "it would have no owner";
  EXPECT_TRUE(IsOwnedElsewhere(first->ReadCensus().status())) << "it removes nothing, either";
  EXPECT_EQ(second->ReadRecord(SessionName(1)).value()->revision(), 2u);
  EXPECT_FALSE(second->ReadRecord(SessionName(2))->has_value());
}

TEST_F(PostgresRecordsTest, AnOwnerThatHasLostAllEnds) {
  const auto first = Open("first").value();
  server_->Run("DELETE FROM wellspace.owners", database_);
  absl::SleepFor(2 * kShort);
  EXPECT_EQ(failures_, 1);
  EXPECT_EQ(ReasonOf(Create(*first, 1)), "STORE_FAILED");
}

TEST_F(PostgresRecordsTest, TwoOfOneNameDoNotLiveAtOnce) {
  const auto first = Open("first").value();
  const absl::Status second = Open("first").status();
  EXPECT_EQ(second.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(second.message()), HasSubstr("'first'"));
  EXPECT_TRUE(Create(*first, 1).ok());
}

// Acknowledged changes are there, and others may be tried again.
TEST_F(PostgresRecordsTest, ADatabaseThatIsKilledComesBack) {
  const auto records = Open("first", absl::Hours(1)).value();
  uint64_t acknowledged = 0;
  for (uint64_t number = 1; number <= 3; ++number) {
    ASSERT_TRUE(Create(*records, number).ok());
    server_->Kill();
    EXPECT_EQ(ReasonOf(Update(*records, 1, records->epoch(), 10 + number)), "STORE_FAILED");
    EXPECT_EQ(ReasonOf(records->ReadRecord(SessionName(1)).status()), "STORE_FAILED");
    server_->Start();
    EXPECT_EQ(records->ReadRecord(SessionName(1)).value()->revision(), acknowledged);
    acknowledged = 20 + number;
    ASSERT_TRUE(Update(*records, 1, records->epoch(), acknowledged).ok());
  }
  EXPECT_THAT(records->Load()->sessions, SizeIs(3));
  EXPECT_EQ(failures_, 0);
}

// Connections are broken at any moment, also in commits: each change was acknowledged and is there, or neither.
TEST_F(PostgresRecordsTest, ConnectionsThatBreakLoseNothing) {
  const auto records = Open("first", absl::Hours(1)).value();
  ASSERT_TRUE(Create(*records, 1).ok());
  std::atomic<bool> is_over = false;
  std::thread breaker([&] {
    while (!is_over) {
      server_->Run("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '" + database_ + "'");
      absl::SleepFor(absl::Milliseconds(3));
    }
  });
  uint64_t revision = 1;
  int refused = 0;
  for (int i = 0; i < 300; ++i) {
    const absl::Status changed = Update(*records, 1, records->epoch(), revision + 1);
    if (changed.ok()) {
      ++revision;
    } else {
      EXPECT_EQ(ReasonOf(changed), "STORE_FAILED") << changed;
      ++refused;
    }
    if (i % 10 == 0) {
      const auto found = records->ReadRecord(SessionName(1));
      if (found.ok()) {
        EXPECT_EQ((*found)->revision(), revision);
      }
    }
  }
  is_over = true;
  breaker.join();
  EXPECT_EQ(records->ReadRecord(SessionName(1)).value()->revision(), revision);
  EXPECT_GT(revision, 10u) << refused;
  EXPECT_EQ(failures_, 0);
}

// The sessions of an owner that ends without a word are another's when its lease is out, and not before.
TEST_F(PostgresRecordsTest, SessionsOfOneThatDiedAreTakenWhileOthersRun) {
  const auto first = Open("first", absl::Hours(1)).value();
  const auto second = Open("second").value();
  ASSERT_TRUE(first->Announce("first:7233").ok());
  ASSERT_TRUE(Create(*first, 1, "a").ok());
  ASSERT_TRUE(Create(*second, 2).ok());
  EXPECT_THAT(*second->TakeOrphans(), IsEmpty());
  const SessionOwner owner = second->FindOwner(SessionName(1))->value();
  EXPECT_EQ(owner.address, "first:7233");
  EXPECT_EQ(owner.tenant, MakeState(1).tenant());
  EXPECT_TRUE(owner.lives);
  EXPECT_FALSE(owner.is_self);
  EXPECT_TRUE(first->FindOwner(SessionName(1))->value().is_self);
  EXPECT_FALSE(first->FindOwner(SessionName(3))->has_value());

  server_->Run("UPDATE wellspace.owners SET lease_until = clock_timestamp() WHERE name = 'first'", database_);
  EXPECT_FALSE(second->FindOwner(SessionName(1))->value().lives);
  const std::vector<StoredSession> taken = second->TakeOrphans().value();
  ASSERT_THAT(taken, SizeIs(1));
  EXPECT_EQ(taken[0].state.name(), SessionName(1));
  EXPECT_GT(taken[0].epoch, second->epoch()) << "at an epoch that no change under way has";
  EXPECT_TRUE(second->FindOwner(SessionName(1))->value().is_self);
  EXPECT_THAT(*second->TakeOrphans(), IsEmpty());
  EXPECT_TRUE(Update(*second, 1, taken[0].epoch, 5).ok());
  EXPECT_TRUE(IsOwnedElsewhere(Update(*first, 1, first->epoch(), 6)));
  EXPECT_TRUE(IsOwnedElsewhere(Create(*first, 3)));
  EXPECT_EQ(first->ReadRecord(SessionName(1)).value()->revision(), 5u);
}

// One that cannot renew its lease does not answer for its sessions from when others may have them.
std::vector<std::string> NamesOf(const std::vector<StoredSession>& sessions) {
  std::vector<std::string> names;
  for (const StoredSession& session : sessions) {
    names.push_back(session.state.name());
  }
  return names;
}

absl::Status Offer(Records& records, uint64_t number, bool stands = true) {
  return records.Apply({.session = SessionName(number),
                        .epoch = records.epoch(),
                        .offer = WorkOffer{.stands = stands, .tenant = MakeState(number).tenant()}},
                       Survives::kPowerLoss);
}

// A session that is offered is taken by one of the others, those first that were offered first, and never by its owner.
TEST_F(PostgresRecordsTest, WhatIsOfferedIsTakenOnce) {
  const auto first = Open("first").value();
  const auto second = Open("second").value();
  const auto third = Open("third").value();
  for (const uint64_t number : {1, 2, 3}) {
    ASSERT_TRUE(Create(*first, number).ok());
  }
  ASSERT_TRUE(Offer(*first, 2).ok());
  ASSERT_TRUE(Offer(*first, 1).ok());
  EXPECT_THAT(*first->TakeOffered({.sessions = 9}), IsEmpty());
  EXPECT_THAT(*first->ListOffered(), UnorderedElementsAre(SessionName(1), SessionName(2)));
  EXPECT_THAT(*second->ListOffered(), IsEmpty());
  // Tenants are bytes, whatever they are.
  EXPECT_THAT(*second->TakeOffered(
                  {.sessions = 9, .full_tenants = {"\\\"}\xff", MakeState(1).tenant(), MakeState(2).tenant()}}),
              IsEmpty());

  const std::vector<StoredSession> taken = second->TakeOffered({.sessions = 1, .full_tenants = {"another"}}).value();
  ASSERT_THAT(NamesOf(taken), ElementsAre(SessionName(2)));
  EXPECT_GT(taken[0].epoch, second->epoch());
  EXPECT_TRUE(second->FindOwner(SessionName(2))->value().is_self);
  EXPECT_THAT(*first->ListOffered(), ElementsAre(SessionName(1)));
  EXPECT_THAT(NamesOf(*third->TakeOffered({.sessions = 9})), ElementsAre(SessionName(1)));
  EXPECT_THAT(*second->TakeOffered({.sessions = 9}), IsEmpty());
  // Its owner of before can neither change it nor offer it.
  EXPECT_TRUE(IsOwnedElsewhere(Update(*first, 2, first->epoch(), 3)));
  EXPECT_TRUE(IsOwnedElsewhere(Offer(*first, 2)));
  EXPECT_TRUE(IsOwnedElsewhere(Offer(*first, 2, /*stands=*/false)));
  EXPECT_TRUE(IsOwnedElsewhere(Offer(*first, 4))) << "there is none";
  EXPECT_TRUE(Update(*second, 2, taken[0].epoch, 3).ok());
  EXPECT_TRUE(Update(*first, 3, first->epoch(), 3).ok());
}

// By a withdrawal, by an operation that changes, and with the owner's lease.
TEST_F(PostgresRecordsTest, AnOfferEnds) {
  const auto first = Open("first", absl::Hours(1)).value();
  const auto second = Open("second").value();
  for (const uint64_t number : {1, 2, 3, 4}) {
    ASSERT_TRUE(Create(*first, number).ok());
    ASSERT_TRUE(Offer(*first, number).ok());
  }
  EXPECT_THAT(*first->ListOffered(), SizeIs(4));
  ASSERT_TRUE(Offer(*first, 1, /*stands=*/false).ok());
  store::v1::OperationRecord operation;
  operation.set_number(1);
  ASSERT_TRUE(
      first
          ->Apply({.session = SessionName(2), .epoch = first->epoch(), .operations = {operation}}, Survives::kPowerLoss)
          .ok());
  ASSERT_TRUE(Update(*first, 3, first->epoch(), 3).ok());  // its labels, for example: the operation waits still
  EXPECT_THAT(*first->ListOffered(), UnorderedElementsAre(SessionName(3), SessionName(4)));
  EXPECT_THAT(NamesOf(*second->TakeOffered({.sessions = 1})), ElementsAre(SessionName(3)));
  server_->Run("UPDATE wellspace.owners SET lease_until = clock_timestamp() WHERE name = 'first'", database_);
  EXPECT_THAT(*second->TakeOrphans(), SizeIs(3));
  EXPECT_THAT(*second->ListOffered(), IsEmpty());
}

TEST_F(PostgresRecordsTest, WhoTakesWaitsForNoOne) {
  const auto first = Open("first").value();
  constexpr uint64_t kSessions = 40;
  for (uint64_t number = 1; number <= kSessions; ++number) {
    ASSERT_TRUE(Create(*first, number).ok());
    ASSERT_TRUE(Offer(*first, number).ok());
  }
  // The first is being changed by its owner, and stays so.
  pqxx::connection connection(address_);
  pqxx::work change(connection);
  change.exec("SELECT FROM wellspace.sessions WHERE name = '" + SessionName(1) + "' FOR UPDATE");
  std::vector<std::unique_ptr<PostgresRecords>> others;
  std::vector<std::vector<std::string>> taken(3);
  std::vector<std::jthread> threads;
  for (size_t i = 0; i < taken.size(); ++i) {
    others.push_back(Open(absl::StrCat("other ", i)).value());
  }
  for (size_t i = 0; i < taken.size(); ++i) {
    threads.emplace_back([&, i] {
      for (int round = 0; round < 40; ++round) {
        for (std::string& name : NamesOf(others[i]->TakeOffered({.sessions = 2}).value())) {
          taken[i].push_back(std::move(name));
        }
      }
    });
  }
  threads.clear();
  std::vector<std::string> all;
  for (const std::vector<std::string>& names : taken) {
    all.insert(all.end(), names.begin(), names.end());
  }
  EXPECT_THAT(all, SizeIs(kSessions - 1));
  EXPECT_THAT(std::set<std::string>(all.begin(), all.end()), SizeIs(kSessions - 1)) << "none twice";
  EXPECT_THAT(*first->ListOffered(), ElementsAre(SessionName(1)));
  change.abort();
  EXPECT_THAT(NamesOf(*others[0]->TakeOffered({.sessions = 2})), ElementsAre(SessionName(1)));
}

TEST_F(PostgresRecordsTest, AnOwnerKnowsWhenItsLeaseIsOut) {
  const auto first = Open("first").value();
  EXPECT_TRUE(first->CheckOwnership().ok());
  server_->Kill();
  absl::SleepFor(2 * kShort);
  EXPECT_EQ(ReasonOf(first->CheckOwnership()), "STORE_FAILED");
  server_->Start();
  const absl::Time deadline = absl::Now() + absl::Seconds(30);
  while (!first->CheckOwnership().ok() && absl::Now() < deadline) {
    absl::SleepFor(absl::Milliseconds(20));
  }
  EXPECT_TRUE(first->CheckOwnership().ok()) << "nothing was taken meanwhile";
  EXPECT_TRUE(Create(*first, 1).ok());
  EXPECT_EQ(failures_, 0);
}

// After the database was away all leases are out, though their owners live.
TEST_F(PostgresRecordsTest, WhoLivesKeepsItsSessionsWhenTheDatabaseComesBack) {
  const auto first = Open("first").value();
  const auto second = Open("second").value();
  ASSERT_TRUE(Create(*first, 1).ok());
  server_->Kill();
  absl::SleepFor(2 * kShort);
  server_->Start();
  const absl::Time end = absl::Now() + 4 * kShort;
  while (absl::Now() < end) {
    const auto taken = second->TakeOrphans();
    EXPECT_TRUE(!taken.ok() || taken->empty());
    absl::SleepFor(absl::Milliseconds(5));
  }
  EXPECT_TRUE(Update(*first, 1, first->epoch(), 2).ok());
  EXPECT_EQ(failures_, 0);
}

// The answer to a commit gets lost, once before the database hears of it, and once after it has made it: that is looked
// up, and each change is there if and only if it was acknowledged.
TEST_F(PostgresRecordsTest, ACommitInDoubtIsLookedUp) {
  CuttingProxy proxy(server_->port());
  address_ = absl::StrCat("postgresql://tester@127.0.0.1:", proxy.port(), "/", database_);
  const auto records = Open("first", absl::Hours(1)).value();
  ASSERT_TRUE(Create(*records, 1).ok());
  proxy.CutNext(CuttingProxy::Cut::kAfterCommit);
  EXPECT_TRUE(Update(*records, 1, records->epoch(), 2).ok()) << "the database has made it";
  EXPECT_EQ(records->ReadRecord(SessionName(1)).value()->revision(), 2u);
  proxy.CutNext(CuttingProxy::Cut::kBeforeCommit);
  EXPECT_EQ(ReasonOf(Update(*records, 1, records->epoch(), 3)), "STORE_FAILED") << "it has not";
  EXPECT_EQ(records->ReadRecord(SessionName(1)).value()->revision(), 2u);
  EXPECT_TRUE(Update(*records, 1, records->epoch(), 4).ok());
  EXPECT_EQ(records->ReadRecord(SessionName(1)).value()->revision(), 4u);
  EXPECT_EQ(failures_, 0);
}

// The database crashes with the commit under way, and gives the numbers of transactions that it had given shortly
// before to others: theirs is another outcome.
TEST_F(PostgresRecordsTest, ACommitInDoubtIsLookedUpAfterACrash) {
  PostgresLink link({.address = address_, .owner = "link", .look_up_for = absl::Seconds(20)}, PreparePostgres);
  ASSERT_TRUE(OpenPostgresSchema(link).ok());
  server_->Run("CREATE TABLE made(number integer); CHECKPOINT", database_);
  for (const int others : {0, 20}) {
    const absl::Status lost = link.Transact([&](pqxx::dbtransaction& transaction) {
      transaction.exec0("INSERT INTO made VALUES(1)");
      server_->Kill();
      server_->Start();
      for (int i = 0; i < others; ++i) {
        server_->Run("INSERT INTO made VALUES(2)", database_);
      }
      return absl::OkStatus();
    });
    EXPECT_EQ(ReasonOf(lost), "STORE_FAILED") << lost;
    EXPECT_THAT(std::string(lost.message()), HasSubstr("before it had made the change"));
  }
  int64_t made = -1;
  EXPECT_TRUE(link.Read([&](pqxx::dbtransaction& transaction) {
                    made = transaction.exec1("SELECT count(*) FROM made WHERE number = 1")[0].as<int64_t>();
                    return absl::OkStatus();
                  })
                  .ok());
  EXPECT_EQ(made, 0);
}

// A server stands still within a transaction: others do not wait until it goes on.
TEST_F(PostgresRecordsTest, WhoStandsStillKeepsNoOneWaiting) {
  const PostgresOptions options{.address = address_, .owner = "link", .look_up_for = kShort};
  PostgresLink first(options, PreparePostgres);
  PostgresLink second(options, PreparePostgres);
  ASSERT_TRUE(OpenPostgresSchema(first).ok());
  const auto lock_store = [](pqxx::dbtransaction& transaction) {
    transaction.exec1("SELECT version FROM wellspace.store FOR UPDATE");
    return absl::OkStatus();
  };
  std::latch is_locked(1);
  std::latch is_over(1);
  int attempts = 0;
  std::jthread stands_still([&] {
    EXPECT_TRUE(first
                    .Transact([&](pqxx::dbtransaction& transaction) {
                      if (++attempts == 1) {
                        lock_store(transaction).IgnoreError();
                        is_locked.count_down();
                        is_over.wait();
                      }
                      return lock_store(transaction);
                    })
                    .ok())
        << "it is made anew";
  });
  is_locked.wait();
  EXPECT_TRUE(second.Transact(lock_store).ok());
  is_over.count_down();
  stands_still.join();
  EXPECT_EQ(attempts, 2);
}

// How old an answer is, is decided by one clock: those of servers jump.
TEST_F(PostgresRecordsTest, AnswersAreKeptByTheClockOfTheDatabase) {
  const AnswerKey key{.tenant = "tenant", .request_id = "create 1"};
  const auto take_over = [&](const std::string& from, const std::string& by) {
    const auto other = Open(by).value();
    const auto owner = Open(from).value();
    server_->Run("UPDATE wellspace.owners SET lease_until = '-infinity' WHERE name = '" + from + "'", database_);
    EXPECT_TRUE(other->TakeOrphans().ok());
    return other->FindAnswer(key).value();
  };
  {
    const auto records = Open("maker").value();
    ASSERT_TRUE(Create(*records, 1, key.request_id).ok());
  }
  EXPECT_TRUE(take_over("first", "second").has_value()) << "its maker said that it was made in 2023";
  server_->Run("UPDATE wellspace.answers SET time = time - interval '2 hours'", database_);
  EXPECT_FALSE(take_over("third", "fourth").has_value());
}

// To the library of PostgreSQL, the end of a transaction that only reads is in doubt, too; here it is read again.
TEST_F(PostgresRecordsTest, AReadThatLosesItsConnectionAtItsEndIsMadeAgain) {
  CuttingProxy proxy(server_->port());
  address_ = absl::StrCat("postgresql://tester@127.0.0.1:", proxy.port(), "/", database_);
  const auto records = Open("first", absl::Hours(1)).value();
  ASSERT_TRUE(Create(*records, 1).ok());
  ASSERT_TRUE(Update(*records, 1, records->epoch(), 2).ok());
  ASSERT_TRUE(records->ReadRecord(SessionName(1)).ok()) << "it is connected";
  for (const CuttingProxy::Cut cut : {CuttingProxy::Cut::kAfterCommit, CuttingProxy::Cut::kBeforeCommit}) {
    proxy.CutNext(cut);
    const auto record = records->ReadRecord(SessionName(1));
    ASSERT_TRUE(record.ok()) << record.status();
    EXPECT_EQ((*record)->revision(), 2u);
  }
  EXPECT_EQ(failures_, 0);
}

// Where that cannot be found out the server ends, and the next one sees what there is.
TEST_F(PostgresRecordsTest, ACommitWhoseOutcomeCannotBeFoundOutIsAFailure) {
  const std::string direct = address_;
  CuttingProxy proxy(server_->port());
  address_ = absl::StrCat("postgresql://tester@127.0.0.1:", proxy.port(), "/", database_);
  {
    const auto records = Open("first").value();
    ASSERT_TRUE(Create(*records, 1).ok());
    proxy.CutNext(CuttingProxy::Cut::kForGood);
    const absl::Status in_doubt = Update(*records, 1, records->epoch(), 2);
    EXPECT_EQ(ReasonOf(in_doubt), "STORE_FAILED");
    EXPECT_THAT(std::string(in_doubt.message()), HasSubstr("not known whether the database has made a change"));
    EXPECT_EQ(failures_, 1);
    EXPECT_EQ(ReasonOf(Update(*records, 1, records->epoch(), 3)), "STORE_FAILED")
        << "now and for every change after it";
  }
  address_ = direct;
  EXPECT_EQ(Open("second").value()->ReadRecord(SessionName(1)).value()->revision(), 2u);
}

// As a database says it whose disk is full.
TEST_F(PostgresRecordsTest, AFullDatabaseIsNamed) {
  const auto records = Open("first", absl::Hours(1)).value();
  ASSERT_TRUE(Create(*records, 1).ok());
  server_->Run(
      "CREATE FUNCTION full_disk() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
      " RAISE 'could not extend file: No space left on device' USING ERRCODE = 'disk_full'; END $$;"
      "CREATE TRIGGER full_disk BEFORE UPDATE ON wellspace.sessions EXECUTE FUNCTION full_disk()",
      database_);
  const absl::Status full = Update(*records, 1, records->epoch(), 2);
  EXPECT_EQ(ReasonOf(full), "DISK_FULL");
  EXPECT_THAT(std::string(full.message()), HasSubstr("the disk of the database"));
  EXPECT_TRUE(Create(*records, 2).ok()) << "others go on";
  server_->Run("DROP TRIGGER full_disk ON wellspace.sessions", database_);
  EXPECT_TRUE(Update(*records, 1, records->epoch(), 2).ok());
  EXPECT_EQ(failures_, 0);
}

TEST_F(PostgresRecordsTest, DatabaseAndFolderBelongToOneAnother) {
  const TestFolder own;
  const TestFolder other;
  const auto opens_with = [&](const TestFolder& folder) {
    folder_ = DataFolder::OpenShared(folder.path(), PosixFileSystem()).value();
    const absl::Status status = Open("first").status();
    folder_ = nullptr;
    return status;
  };
  EXPECT_TRUE(opens_with(own).ok());
  EXPECT_TRUE(opens_with(own).ok());
  const absl::Status not_its = opens_with(other);
  EXPECT_EQ(not_its.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(not_its.message()), HasSubstr(absl::StrCat("are in ", own.path())));
  const std::string first_database = database_;
  address_ = server_->NewDatabase();
  const absl::Status of_another = opens_with(own);
  EXPECT_EQ(of_another.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(of_another.message()),
              ::testing::AllOf(HasSubstr("the files of another database"), HasSubstr("/" + first_database)));
  // Nor does a server with a database in the folder take it, nor this one such a folder.
  const absl::Status by_sqlite = OpenDurableLog({.folder = own.path()}).status();
  EXPECT_EQ(by_sqlite.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(by_sqlite.message()),
              ::testing::AllOf(HasSubstr("/" + first_database), HasSubstr("--store")));
  EXPECT_EQ(CheckData(own.path()).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(BackUp(own.path(), absl::StrCat(other.path(), "/copy")).status().code(),
            absl::StatusCode::kFailedPrecondition);
  const TestFolder sqlite;
  {
    const auto log = OpenDurableLog({.folder = sqlite.path()}).value();
    EXPECT_THAT(std::string(opens_with(sqlite).message()), HasSubstr("in use"));
  }
  EXPECT_THAT(std::string(opens_with(sqlite).message()), HasSubstr("has a database of its own, sessions.db"));
}

TEST_F(PostgresRecordsTest, ADatabaseThatCannotBeUsedIsNamed) {
  const auto refusal = [&](const std::string& address) {
    address_ = address;
    return Open("first").status();
  };
  const std::string good = address_;
  const absl::Status missing = refusal(server_->AddressOf("missing"));
  EXPECT_THAT(std::string(missing.message()), HasSubstr("database \"missing\" does not exist"));
  server_->Run("DROP ROLE IF EXISTS reader");
  server_->Run("CREATE ROLE reader LOGIN");
  const absl::Status without_rights = refusal(server_->AddressOf(database_, "reader"));
  EXPECT_EQ(without_rights.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(without_rights.message()), HasSubstr("permission denied for database " + database_));
  EXPECT_THAT(std::string(without_rights.message()), HasSubstr("CREATE"));
  EXPECT_TRUE(refusal(good).ok());
  const absl::Status of_another = refusal(server_->AddressOf(database_, "reader"));
  EXPECT_EQ(of_another.code(), absl::StatusCode::kPermissionDenied);
  EXPECT_THAT(std::string(of_another.message()), HasSubstr("permission denied for schema wellspace"));
  server_->Run("UPDATE wellspace.store SET version = 99", database_);
  const absl::Status newer = refusal(good);
  EXPECT_EQ(newer.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(newer.message()), HasSubstr("version 99"));
  EXPECT_THAT(std::string(refusal("postgresql://tester:secret@127.0.0.1:1/test1").message()),
              ::testing::AllOf(HasSubstr("127.0.0.1"), HasSubstr("refused"), ::testing::Not(HasSubstr("secret"))));
  EXPECT_FALSE(refusal("nonsense").ok());
}

TEST_F(PostgresRecordsTest, ADamagedRecordIsFound) {
  const auto records = Open("first").value();
  ASSERT_TRUE(Create(*records, 1).ok());
  server_->Run("UPDATE wellspace.sessions SET state = set_byte(state, 3, get_byte(state, 3) # 4)", database_);
  const absl::Status damaged = records->Load().status();
  EXPECT_EQ(ReasonOf(damaged), "FILE_DAMAGED");
  EXPECT_THAT(std::string(damaged.message()), HasSubstr(SessionName(1)));
}

}  // namespace
}  // namespace wellspace::server
