// Records that move between a folder and PostgreSQL: all of them are there, and none is in both places.
#include "server/store/move_data.h"

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/check_data.h"
#include "server/store/durable_log.h"
#include "server/store/shared_log.h"
#include "tests/server/store/postgres_server.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

class MoveDataTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = PostgresServer::WhyNot(); !why.empty()) {
      GTEST_SKIP() << why;
    }
    database_.address = PostgresServer::OfThisProgram().NewDatabase();
    database_.owner = "one";
    database_.lease = absl::Seconds(2);
  }

  std::unique_ptr<SessionLog> OpenOwn() const {
    absl::StatusOr<std::unique_ptr<SessionLog>> log = OpenDurableLog({.folder = folder_.path()});
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }
  absl::StatusOr<std::unique_ptr<SessionLog>> TryShared(const std::string& folder = "") const {
    return OpenSharedLog({.folder = folder.empty() ? folder_.path() : folder,
                          .database = database_,
                          .on_failure = [](const absl::Status&) {}});
  }
  std::unique_ptr<SessionLog> OpenShared() const {
    absl::StatusOr<std::unique_ptr<SessionLog>> log = TryShared();
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }

  // A session with everything that one can have. Steps are of several kinds, in an order that has to stay.
  static void Write(SessionLog& log, uint64_t number) {
    SessionChange change{.session = SessionName(number),
                         .state = MakeState(number, 3),
                         .steps = {MakePointsStep(0, {1, 2, 3}, 3)},
                         .answer = MakeAnswer("tenant", absl::StrCat("request ", number), "done")};
    change.steps.emplace_back().mutable_features()->mutable_segments()->add_ends(static_cast<uint32_t>(number));
    change.steps.push_back(MakePointsStep(1, {4, 5, 6}, 3));
    change.operations.emplace_back().set_number(1);
    change.operations.emplace_back().set_number(2);
    for (const int32_t day : {7, 8}) {
      store::v1::UsageRecord& usage = change.usage.emplace_back();
      usage.set_tenant(absl::StrCat("tenant ", number));
      usage.set_day(day);
      usage.set_vertices(number * day);
    }
    for (const uint64_t set : {2, 5}) {
      StoredSizes sizes{.number = set, .parts = {}};
      sizes.parts.emplace_back().mutable_samples()->add_sizes(0.5 * static_cast<double>(number));
      sizes.parts.emplace_back().mutable_samples()->add_sizes(0.25);
      change.sizes = std::move(sizes);
      ASSERT_EQ(CommitTo(log, std::exchange(change, {.session = SessionName(number)})), absl::OkStatus());
    }
  }

  // All that is known of the sessions 1 and 2, but for their epochs.
  static std::string TextOf(SessionLog& log, StoredSessions stored) {
    for (StoredSession& session : stored.sessions) {
      session.epoch = 0;
    }
    std::string text = server::TextOf(stored);
    for (const uint64_t number : {1, 2}) {
      const auto all_features = log.records().ReadFeatures(SessionName(number));
      EXPECT_TRUE(all_features.ok()) << all_features.status();
      for (const auto& features : *all_features) {
        absl::StrAppend(&text, features.DebugString());
      }
      const auto all_sizes = log.records().ReadSizes(SessionName(number));
      EXPECT_TRUE(all_sizes.ok()) << all_sizes.status();
      for (const StoredSizes& sizes : *all_sizes) {
        absl::StrAppend(&text, sizes.number, ": ");
        for (const auto& part : sizes.parts) {
          absl::StrAppend(&text, part.DebugString());
        }
      }
    }
    for (const int64_t day : {7, 8}) {
      const absl::StatusOr<UsageByTenant> all_usage = log.records().ReadUsage({.first_day = day, .last_day = day});
      EXPECT_TRUE(all_usage.ok()) << all_usage.status();
      for (const auto& [tenant, usage] : *all_usage) {
        absl::StrAppend(&text, "day ", day, ": ", tenant, " ", usage.vertices, " ", usage.stored_bytes, "\n");
      }
    }
    return text;
  }
  static std::string TextOf(SessionLog& log) {
    absl::StatusOr<StoredSessions> stored = log.records().Load();
    EXPECT_TRUE(stored.ok()) << stored.status();
    return stored.ok() ? TextOf(log, *std::move(stored)) : "";
  }

  void ExpectRefusal(const absl::Status& status, const std::string& part) const {
    EXPECT_FALSE(status.ok());
    EXPECT_THAT(std::string(status.message()), HasSubstr(part));
  }
  bool Has(const std::string& name) const { return std::filesystem::exists(folder_.path() + "/" + name); }

  const TestFolder folder_;
  PostgresOptions database_;
};

TEST_F(MoveDataTest, ThereAndBack) {
  std::string before;
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  uint64_t own_epoch = 0;
  {
    const auto own = OpenOwn();
    before = TextOf(*own);
    own_epoch = own->records().epoch();
    EXPECT_THAT(before, HasSubstr("request 2"));
    EXPECT_THAT(before, HasSubstr("day 8: tenant 2 16"));
  }
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  EXPECT_FALSE(Has("sessions.db"));
  EXPECT_TRUE(Has("sessions.db.moved"));
  EXPECT_FALSE(Has("sessions.db-mark"));
  EXPECT_FALSE(OpenDurableLog({.folder = folder_.path()}).ok()) << "the records are elsewhere";
  uint64_t shared_epoch = 0;
  {
    const auto shared = OpenShared();
    ASSERT_NE(shared, nullptr);
    EXPECT_EQ(TextOf(*shared), before);
    shared_epoch = shared->records().epoch();
    EXPECT_GT(shared_epoch, own_epoch) << "no name of a file is given twice";
    // It can be changed there.
    ASSERT_EQ(CommitTo(*shared, {.session = SessionName(1), .state = MakeState(1, 9)}), absl::OkStatus());
    ASSERT_EQ(CommitTo(*shared, {.session = SessionName(1), .state = MakeState(1, 3)}), absl::OkStatus());
  }
  ASSERT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus());
  EXPECT_FALSE(Has("store"));
  EXPECT_FALSE(Has("sessions.db.moved"));
  const auto own = OpenOwn();
  ASSERT_NE(own, nullptr);
  EXPECT_EQ(TextOf(*own), before);
  EXPECT_GT(own->records().epoch(), shared_epoch);
  ASSERT_EQ(CommitTo(*own, {.session = SessionName(2), .state = MakeState(2, 4)}), absl::OkStatus());
}

// Into the same database again, whose schema of before is put aside.
TEST_F(MoveDataTest, SeveralTimes) {
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus()) << i;
    ASSERT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus()) << i;
  }
  EXPECT_THAT(TextOf(*OpenOwn()), HasSubstr("request 1"));
}

// What a move that was cut off between its two halves has left: rows that no server can have begun with.
TEST_F(MoveDataTest, AMoveThatWasCutOffIsRepeated) {
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  const std::string before = TextOf(*OpenOwn());
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  std::filesystem::remove(folder_.path() + "/store");
  std::filesystem::rename(folder_.path() + "/sessions.db.moved", folder_.path() + "/sessions.db");
  ExpectRefusal(TryShared().status(), "the files of the database");
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  EXPECT_EQ(TextOf(*OpenShared()), before);

  const std::string pairing = BytesOfFile(folder_.path() + "/store");
  ASSERT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus());
  WriteFile(folder_.path() + "/store", pairing);
  EXPECT_FALSE(OpenDurableLog({.folder = folder_.path()}).ok());
  EXPECT_FALSE(TryShared().ok()) << "its tables are put aside";
  ASSERT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus());
  EXPECT_EQ(TextOf(*OpenOwn()), before);
}

TEST_F(MoveDataTest, RunningServersAreInTheWay) {
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
    ExpectRefusal(MoveToPostgres(folder_.path(), database_), "has this folder in use");
  }
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  const auto shared = OpenShared();
  ASSERT_TRUE(shared->records().Load().ok());
  ExpectRefusal(MoveToFolder(database_, folder_.path()), "the server 'one' is running");
  EXPECT_EQ(CommitTo(*shared, {.session = SessionName(1), .state = MakeState(1, 5)}), absl::OkStatus())
      << "and goes on";
}

// A server that stood still beyond its lease while its records went away can change nothing any more.
TEST_F(MoveDataTest, WhoStoodStillChangesNothing) {
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  const auto shared = OpenShared();
  const std::string before = TextOf(*shared);
  PostgresServer& server = PostgresServer::OfThisProgram();
  server.Run("UPDATE wellspace.owners SET lease_until = clock_timestamp() - interval '1 second'",
             server.last_database());
  ASSERT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus());
  EXPECT_FALSE(CommitTo(*shared, {.session = SessionName(1), .state = MakeState(1, 5)}).ok());
  EXPECT_FALSE(CommitTo(*shared, {.session = SessionName(7), .is_creation = true, .state = MakeState(7)}).ok());
  EXPECT_EQ(TextOf(*OpenOwn()), before);
}

TEST_F(MoveDataTest, WhatIsNotThereOrNotTheirs) {
  const TestFolder empty;
  ExpectRefusal(MoveToPostgres(empty.path() + "/none", database_), "no database of its own");
  EXPECT_FALSE(std::filesystem::exists(empty.path() + "/none"));
  ExpectRefusal(MoveToFolder(database_, empty.path()), "no file 'store'");
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  ExpectRefusal(MoveToPostgres(folder_.path(), {.address = "mysql:x", .owner = "", .lease = absl::Seconds(2)}), "");
  // A database with the sessions of another folder.
  const TestFolder other;
  {
    const auto log = TryShared(other.path());
    ASSERT_TRUE(log.ok()) << log.status();
    ASSERT_TRUE((*log)->records().Load().ok());
    ASSERT_EQ(CommitTo(**log, {.session = SessionName(9), .is_creation = true, .state = MakeState(9)}),
              absl::OkStatus());
  }
  ExpectRefusal(MoveToPostgres(folder_.path(), database_), other.path());
  EXPECT_TRUE(Has("sessions.db"));
  EXPECT_FALSE(Has("store"));
  EXPECT_THAT(TextOf(*OpenOwn()), HasSubstr("request 1"));
  // A folder of another database.
  database_.address = PostgresServer::OfThisProgram().NewDatabase();
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  ExpectRefusal(MoveToFolder(database_, other.path()), "another database");
}

// Nothing moves where a record is damaged.
TEST_F(MoveDataTest, DamageStaysWhereItIs) {
  {
    const auto own = OpenOwn();
    Write(*own, 1);
    Write(*own, 2);
  }
  ASSERT_EQ(MoveToPostgres(folder_.path(), database_), absl::OkStatus());
  PostgresServer& server = PostgresServer::OfThisProgram();
  server.Run("UPDATE wellspace.sizes SET crc32c = crc32c + 1 WHERE part = 1 AND number = 5", server.last_database());
  const absl::Status moved = MoveToFolder(database_, folder_.path());
  EXPECT_EQ(ReasonOf(moved), "FILE_DAMAGED") << moved;
  EXPECT_THAT(std::string(moved.message()), HasSubstr("part 1 of sizes 5"));
  EXPECT_TRUE(Has("store"));
  EXPECT_FALSE(OpenDurableLog({.folder = folder_.path()}).ok());
  server.Run("UPDATE wellspace.sizes SET crc32c = crc32c - 1 WHERE part = 1 AND number = 5", server.last_database());
  EXPECT_EQ(MoveToFolder(database_, folder_.path()), absl::OkStatus());
}

}  // namespace
}  // namespace wellspace::server
