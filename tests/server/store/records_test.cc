// The contract of every implementation of Records, with two processes that share them.
#include "server/store/records.h"

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/ballast.h"
#include "server/store/memory_records.h"
#include "server/store/postgres_records.h"
#include "server/store/sqlite_records.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

// Records that two processes share.
class SharedRecords {
 public:
  virtual ~SharedRecords() = default;
  // Those of a process that begins now. It may take everything over, or nothing.
  virtual std::shared_ptr<Records> Begin() = 0;
};

class SharedMemory final : public SharedRecords {
 public:
  std::shared_ptr<Records> Begin() override { return records_; }

 private:
  const std::shared_ptr<MemoryRecords> records_ = std::make_shared<MemoryRecords>();
};

class SharedDatabase final : public SharedRecords {
 public:
  std::shared_ptr<Records> Begin() override {
    const auto ballast = std::make_shared<Ballast>(PosixFileSystem(), folder_.path() + "/ballast", 0);
    absl::StatusOr<std::unique_ptr<SqliteRecords>> records =
        SqliteRecords::Open(/*folder=*/nullptr, SessionTables::Open(folder_.path() + "/sessions.db", {}).value(),
                            std::make_shared<StoreHealth>(nullptr, ballast), ballast);
    EXPECT_TRUE(records.ok()) << records.status();
    return *std::move(records);
  }

 private:
  const TestFolder folder_;
};

// Each process has a name of its own, and a lease that lasts.
class SharedPostgres final : public SharedRecords {
 public:
  std::shared_ptr<Records> Begin() override {
    absl::StatusOr<std::unique_ptr<PostgresRecords>> records =
        PostgresRecords::Open({.address = address_, .owner = absl::StrCat("process ", ++processes_)},
                              /*folder=*/nullptr, std::make_shared<StoreHealth>(nullptr));
    EXPECT_TRUE(records.ok()) << records.status();
    return *std::move(records);
  }

 private:
  const std::string address_ = PostgresServer::OfThisProgram().NewDatabase();
  int processes_ = 0;
};

struct Implementation {
  const char* name;
  std::function<std::unique_ptr<SharedRecords>()> make;
  std::function<std::string()> why_not = [] { return std::string(); };  // it cannot be tested here
};

class RecordsTest : public ::testing::TestWithParam<Implementation> {
 protected:
  static absl::Status Apply(Records& records, const SessionChange& change) {
    return records.Apply(change, Survives::kPowerLoss);
  }

  static SessionChange Creation(uint64_t number, uint64_t epoch) {
    return {.session = SessionName(number), .epoch = epoch, .is_creation = true, .state = MakeState(number)};
  }

  // A change of everything that a session has, with the answer to request `id`.
  static SessionChange Change(uint64_t number, uint64_t epoch, const std::string& id, uint64_t revision = 2) {
    SessionChange change{.session = SessionName(number),
                         .epoch = epoch,
                         .state = MakeState(number, revision),
                         .steps = {MakePointsStep(0, {1, 2, 3}, 3)},
                         .answer = MakeAnswer("tenant", id, absl::StrCat("of revision ", revision))};
    change.operations.emplace_back().set_number(revision);
    change.sizes = StoredSizes{.number = revision, .parts = {}};
    change.sizes->parts.emplace_back().mutable_samples()->add_sizes(0.5);
    return change;
  }

  static store::v1::UsageRecord Usage(const std::string& tenant, int32_t day, uint64_t vertices) {
    store::v1::UsageRecord usage;
    usage.set_tenant(tenant);
    usage.set_day(day);
    usage.set_meshes(1);
    usage.set_vertices(vertices);
    usage.set_processor_time_ns(static_cast<int64_t>(10 * vertices));
    return usage;
  }

  // Of each tenant its name, meshes, vertices, processor time, sessions and stored bytes.
  static std::string UsageIn(Records& records, const UsageRange& range = {}) {
    const absl::StatusOr<UsageByTenant> usage = records.ReadUsage(range);
    if (!usage.ok()) {
      return usage.status().ToString();
    }
    std::string text;
    for (const auto& [tenant, of] : *usage) {
      absl::StrAppend(&text, tenant, " ", of.meshes, " ", of.vertices, " ", of.processor_time_ns, " ", of.sessions, " ",
                      of.stored_bytes, "\n");
    }
    return text;
  }

  // The session as another process finds it, as far as anything is kept.
  std::string Found(const std::string& session) {
    const auto record = first_->ReadRecord(session).value();
    std::string text = record.has_value() ? record->DebugString() : "";
    const auto sizes = first_->ReadSizes(session);
    return absl::StrCat(text, sizes->size());
  }

  void SetUp() override {
    if (const std::string why = GetParam().why_not(); !why.empty()) {
      GTEST_SKIP() << why;
    }
    shared_ = GetParam().make();
    first_ = shared_->Begin();
  }

  std::unique_ptr<SharedRecords> shared_;
  std::shared_ptr<Records> first_;
};

TEST_P(RecordsTest, AChangeIsItsOwnersAlone) {
  ASSERT_TRUE(Apply(*first_, Creation(1, first_->epoch())).ok());
  ASSERT_TRUE(Apply(*first_, Change(1, first_->epoch(), "a")).ok());
  const std::shared_ptr<Records> second = shared_->Begin();
  const auto taken = second->Take(SessionName(1));
  ASSERT_TRUE(taken.ok() && taken->has_value()) << taken.status();
  EXPECT_EQ((*taken)->state.name(), SessionName(1));
  EXPECT_GT((*taken)->epoch, first_->epoch());
  // The first was stopped, and goes on.
  const std::string before = Found(SessionName(1));
  const SessionChange change = Change(1, first_->epoch(), "b", 3);
  EXPECT_TRUE(IsOwnedElsewhere(Apply(*first_, change)));
  EXPECT_TRUE(IsOwnedElsewhere(
      Apply(*first_, {.session = SessionName(1), .epoch = first_->epoch(), .operations = change.operations})));
  EXPECT_TRUE(
      IsOwnedElsewhere(Apply(*first_, {.session = SessionName(1), .epoch = first_->epoch(), .is_deletion = true})));
  EXPECT_EQ(Found(SessionName(1)), before);
  EXPECT_FALSE(first_->FindAnswer({"tenant", "b"})->has_value()) << "nor is its request answered";
  EXPECT_TRUE(Apply(*second, Change(1, (*taken)->epoch, "b", 3)).ok());
  EXPECT_TRUE(Apply(*second, {.session = SessionName(1), .epoch = (*taken)->epoch, .is_deletion = true}).ok());
}

TEST_P(RecordsTest, WhatItsOwnerHasDeletedIsNotMadeAgainByAnother) {
  ASSERT_TRUE(Apply(*first_, Creation(1, first_->epoch())).ok());
  const std::shared_ptr<Records> second = shared_->Begin();
  const uint64_t epoch = second->Take(SessionName(1)).value()->epoch;
  ASSERT_TRUE(Apply(*second, {.session = SessionName(1), .epoch = epoch, .is_deletion = true}).ok());
  EXPECT_TRUE(IsOwnedElsewhere(Apply(*first_, Change(1, first_->epoch(), "a"))));
  EXPECT_EQ(Found(SessionName(1)), "0");
  EXPECT_FALSE(second->Take(SessionName(1)).value().has_value());
}

TEST_P(RecordsTest, NoEpochIsGivenTwice) {
  ASSERT_TRUE(Apply(*first_, Creation(1, first_->epoch())).ok());
  ASSERT_TRUE(Apply(*first_, Creation(2, first_->epoch())).ok());
  const std::shared_ptr<Records> second = shared_->Begin();
  uint64_t last = first_->epoch();
  for (int i = 0; i < 6; ++i) {
    Records& one = i % 2 == 0 ? *first_ : *second;
    const uint64_t epoch = one.Take(SessionName(1 + i % 3 / 2)).value()->epoch;
    EXPECT_GT(epoch, last);
    last = epoch;
  }
}

TEST_P(RecordsTest, ARequestIsAnsweredOnceByWhicheverProcess) {
  ASSERT_TRUE(Apply(*first_, Creation(1, first_->epoch())).ok());
  ASSERT_TRUE(Apply(*first_, Change(1, first_->epoch(), "a")).ok());
  const std::shared_ptr<Records> second = shared_->Begin();
  const uint64_t epoch = second->Take(SessionName(1)).value()->epoch;
  const std::string before = Found(SessionName(1));
  EXPECT_TRUE(IsAnsweredBefore(Apply(*second, Change(1, epoch, "a", 3)))) << "the answer was lost on its way";
  EXPECT_EQ(Found(SessionName(1)), before) << "it is not done twice";
  EXPECT_EQ(second->FindAnswer({"tenant", "a"}).value()->response(), "of revision 2");
  EXPECT_FALSE(second->FindAnswer({"tenant", "b"})->has_value());
  EXPECT_FALSE(second->FindAnswer({"another tenant", "a"})->has_value());
  EXPECT_TRUE(Apply(*second, Change(1, epoch, "b", 3)).ok());
  second->Forget(std::vector<AnswerKey>{{"tenant", "a"}});
  EXPECT_TRUE(Apply(*second, Change(1, epoch, "a", 4)).ok()) << "it is another request now";
  EXPECT_EQ(second->FindAnswer({"tenant", "a"}).value()->response(), "of revision 4");
}

TEST_P(RecordsTest, OfCallsWithOneRequestIdAtOnceOneIsMade) {
  constexpr int kThreads = 8;
  for (int number = 0; number < kThreads; ++number) {
    ASSERT_TRUE(Apply(*first_, Creation(number, first_->epoch())).ok());
  }
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> made = 0;
    std::atomic<int> refused = 0;
    std::vector<std::thread> threads;
    for (int number = 0; number < kThreads; ++number) {
      threads.emplace_back([&, number] {
        SessionChange change = Change(number, first_->epoch(), absl::StrCat(round), 2 + round);
        change.sizes.reset();
        const absl::Status status = Apply(*first_, change);
        made += status.ok() ? 1 : 0;
        refused += IsAnsweredBefore(status) ? 1 : 0;
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    ASSERT_EQ(made, 1);
    ASSERT_EQ(refused, kThreads - 1);
  }
}

// Changes that wait are made together; one that is refused costs the others nothing.
TEST_P(RecordsTest, ARefusedChangeCostsNoOther) {
  constexpr int kThreads = 8;
  constexpr int kChanges = 20;
  std::vector<std::thread> threads;
  std::atomic<int> wrong = 0;
  for (int number = 0; number < kThreads; ++number) {
    ASSERT_TRUE(Apply(*first_, Creation(number, first_->epoch())).ok());
  }
  for (int number = 0; number < kThreads; ++number) {
    threads.emplace_back([&, number] {
      for (int i = 0; i < kChanges; ++i) {
        const bool is_stale = (number + i) % 3 == 0;
        const absl::Status status =
            Apply(*first_, Change(number, first_->epoch() + (is_stale ? 1 : 0), absl::StrCat(number, " ", i), 2 + i));
        wrong += (is_stale ? IsOwnedElsewhere(status) : status.ok()) ? 0 : 1;
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(wrong, 0);
}

TEST_P(RecordsTest, UsageIsCountedWithItsChangeOrNot) {
  SessionChange creation = Creation(1, first_->epoch());
  creation.state->set_tenant("one");
  creation.state->set_stored_bytes(1000);
  creation.usage = {Usage("one", 5, 7)};
  ASSERT_TRUE(Apply(*first_, creation).ok());
  EXPECT_EQ(UsageIn(*first_), "one 1 7 70 1 1000\n");
  SessionChange change = Change(1, first_->epoch(), "a");
  change.state->set_tenant("one");
  change.state->set_stored_bytes(3000);
  change.usage = {Usage("one", 5, 1), Usage("two", 6, 2), Usage("one", 5, 30)};
  ASSERT_TRUE(Apply(*first_, change).ok());
  const std::string told = "one 3 38 380 1 3000\ntwo 1 2 20 0 0\n";
  EXPECT_EQ(UsageIn(*first_), told);
  SessionChange repeated = Change(1, first_->epoch(), "a", 3);
  repeated.usage = change.usage;
  EXPECT_TRUE(IsAnsweredBefore(Apply(*first_, repeated)));
  change.epoch += 7;
  EXPECT_TRUE(IsOwnedElsewhere(Apply(*first_, change)));
  EXPECT_EQ(UsageIn(*first_), told) << "a refused change counts nothing";
  ASSERT_TRUE(Apply(*first_, {.session = SessionName(1), .epoch = first_->epoch(), .is_deletion = true}).ok());
  EXPECT_EQ(UsageIn(*first_), "one 3 38 380 0 0\ntwo 1 2 20 0 0\n") << "work stays, bytes do not";
}

TEST_P(RecordsTest, UsageOfNoSessionIsAskedForByTenantAndDay) {
  const auto tell = [&](Records& records, const store::v1::UsageRecord& usage) {
    return Apply(records, {.session = "", .epoch = records.epoch(), .usage = {usage}});
  };
  ASSERT_TRUE(tell(*first_, Usage("one", 5, 1)).ok());
  ASSERT_TRUE(tell(*first_, Usage("one", 6, 10)).ok());
  ASSERT_TRUE(tell(*first_, Usage("two", 6, 100)).ok());
  const std::shared_ptr<Records> second = shared_->Begin();
  ASSERT_TRUE(tell(*second, Usage("one", 6, 1000)).ok());
  ASSERT_TRUE(tell(*second, Usage("one", 6, 2000)).ok());
  for (Records* records : {first_.get(), second.get()}) {
    EXPECT_EQ(UsageIn(*records), "one 4 3011 30110 0 0\ntwo 1 100 1000 0 0\n");
    EXPECT_EQ(UsageIn(*records, {.tenant = "one"}), "one 4 3011 30110 0 0\n");
    EXPECT_EQ(UsageIn(*records, {.tenant = "one", .first_day = 6}), "one 3 3010 30100 0 0\n");
    EXPECT_EQ(UsageIn(*records, {.last_day = 5}), "one 1 1 10 0 0\n");
    EXPECT_EQ(UsageIn(*records, {.tenant = "none"}), "");
  }
}

// Of records that are kept.
class DurableRecordsTest : public RecordsTest {};

TEST_P(DurableRecordsTest, WhoTakesASessionGetsAllOfIt) {
  ASSERT_TRUE(Apply(*first_, Creation(1, first_->epoch())).ok());
  ASSERT_TRUE(Apply(*first_, Creation(2, first_->epoch())).ok());
  ASSERT_TRUE(Apply(*first_, Change(1, first_->epoch(), "a")).ok());
  ASSERT_TRUE(Apply(*first_, Change(2, first_->epoch(), "b", 5)).ok());
  const auto text = [](StoredSession session) {
    StoredSessions one;
    one.sessions.push_back(std::move(session));
    return TextOf(one);
  };
  const StoredSessions all = first_->Load().value();
  ASSERT_EQ(all.sessions.size(), 2u);
  const std::shared_ptr<Records> second = shared_->Begin();
  for (const StoredSession& session : all.sessions) {
    EXPECT_EQ(text(*second->Take(session.state.name()).value()), text(session));
  }
  const StoredSessions taken = second->Load().value();
  EXPECT_EQ(TextOf(taken), TextOf(all));
  EXPECT_EQ(taken.sessions[1].epoch, taken.sessions[0].epoch + 1);
  const Census census = second->ReadCensus().value();
  EXPECT_EQ(census.sessions.size(), 2u) << "of all owners";
  EXPECT_FALSE(second->Take(SessionName(3)).value().has_value());
}

TEST_P(DurableRecordsTest, OperationsAreListedOfAllOwnersWhereThereAreSeveral) {
  const std::shared_ptr<Records> second = shared_->Begin();
  if (!first_->is_shared()) {
    EXPECT_THAT(*first_->ListOperations({}, 10), ::testing::IsEmpty());
    return;
  }
  ASSERT_TRUE(first_->Announce("first:1").ok());
  for (int number = 1; number <= 3; ++number) {
    Records& owner = number == 2 ? *second : *first_;
    ASSERT_TRUE(Apply(owner, Creation(number, owner.epoch())).ok());
    ASSERT_TRUE(Apply(owner, Change(number, owner.epoch(), absl::StrCat(number), 5)).ok());
    ASSERT_TRUE(Apply(owner, Change(number, owner.epoch(), absl::StrCat(number, "b"), 7)).ok());
  }
  for (const size_t count : {1, 2, 4, 100}) {
    std::string listed;
    OperationPlace after;
    for (bool is_last = false; !is_last;) {
      const std::vector<StoredOperation> page = second->ListOperations(after, count).value();
      ASSERT_LE(page.size(), count);
      is_last = page.size() < count;
      for (const StoredOperation& one : page) {
        absl::StrAppend(&listed,
                        one.session == SessionName(2)   ? "2"
                        : one.session == SessionName(1) ? "1"
                                                        : "3",
                        ".", one.operation.number(), one.owner == "process 1" ? "f" : "s",
                        one.address == "first:1" ? "a" : "", " ");
        after = one.place;
      }
    }
    EXPECT_EQ(listed, "1.5fa 1.7fa 2.5s 2.7s 3.5fa 3.7fa ");
  }
}

const Implementation kMemory = {"Memory", [] { return std::make_unique<SharedMemory>(); }};
const Implementation kSqlite = {"Sqlite", [] { return std::make_unique<SharedDatabase>(); }};
const Implementation kPostgres = {"Postgres", [] { return std::make_unique<SharedPostgres>(); },
                                  &PostgresServer::WhyNot};
const auto kNameOf = [](const auto& of) { return of.param.name; };
INSTANTIATE_TEST_SUITE_P(All, RecordsTest, ::testing::Values(kMemory, kSqlite, kPostgres), kNameOf);
INSTANTIATE_TEST_SUITE_P(All, DurableRecordsTest, ::testing::Values(kSqlite, kPostgres), kNameOf);

// A process that opens the database owns everything in it.
TEST(SqliteRecords, TheLastToBeginOwnsAll) {
  SharedDatabase shared;
  const std::shared_ptr<Records> first = shared.Begin();
  const SessionChange creation{
      .session = SessionName(1), .epoch = first->epoch(), .is_creation = true, .state = MakeState(1)};
  ASSERT_TRUE(first->Apply(creation, Survives::kPowerLoss).ok());
  const std::shared_ptr<Records> second = shared.Begin();
  EXPECT_GT(second->epoch(), first->epoch());
  EXPECT_EQ(second->Load()->sessions.at(0).epoch, second->epoch());
  SessionChange change{.session = SessionName(1), .epoch = first->epoch(), .state = MakeState(1, 2)};
  EXPECT_TRUE(IsOwnedElsewhere(first->Apply(change, Survives::kPowerLoss)));
  SessionChange other = creation;
  other.session = SessionName(2);
  EXPECT_TRUE(IsOwnedElsewhere(first->Apply(other, Survives::kPowerLoss))) << "it would be no one's";
  EXPECT_TRUE(IsOwnedElsewhere(first->ReadCensus().status())) << "it removes nothing, either";
  change.epoch = second->epoch();
  EXPECT_TRUE(second->Apply(change, Survives::kPowerLoss).ok());
  EXPECT_THAT(second->ReadCensus()->sessions, ::testing::SizeIs(1));
}

}  // namespace
}  // namespace wellspace::server
