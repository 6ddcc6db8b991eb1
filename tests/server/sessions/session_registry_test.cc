// Sessions and their registry, with a clock that the test moves.
#include "server/sessions/session_registry.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "gtest/gtest.h"
#include "server/sessions/session_use.h"
#include "server/store/session_log.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// Work that never begins.
absl::Status Submitted(const std::shared_ptr<Operation>& /*operation*/) { return absl::OkStatus(); }

class SessionRegistryTest : public ::testing::Test {
 protected:
  std::shared_ptr<Session> Create(const std::string& tenant = "a", absl::Duration ttl = absl::Minutes(1),
                                  std::map<std::string, std::string> labels = {}) {
    absl::StatusOr<std::shared_ptr<Session>> session =
        registry_.Create({.tenant = tenant, .parameters = {.dimension = 2}, .labels = std::move(labels), .ttl = ttl});
    status_ = session.status();
    return session.value_or(nullptr);
  }

  bool Finds(const Session& session, const std::string& tenant = "a") {
    status_ = registry_.Find(tenant, session.name()).status();
    return status_.ok();
  }

  ServiceOptions options_{
      .max_points = 10, .max_points_per_tenant = 15, .max_sessions = 5, .max_sessions_per_tenant = 3};
  absl::Time now_ = absl::FromUnixSeconds(1'000'000);
  MemoryBudget memory_{0};
  absl::Duration since_boot_ = absl::Hours(1);
  const std::unique_ptr<SessionLog> log_ = MakeEphemeralLog();
  SessionRegistry registry_{
      options_, memory_, {.wall = [this] { return now_; }, .since_boot = [this] { return since_boot_; }}, *log_};
  absl::Status status_;
};

TEST_F(SessionRegistryTest, NamesCannotBeGuessed) {
  constexpr int kNames = 1000;
  constexpr size_t kBits = 128;
  const size_t prefix = std::string("sessions/").size();
  std::set<std::string> names;
  std::array<int, kBits> ones{};
  for (int i = 0; i < kNames; ++i) {
    const std::shared_ptr<Session> session = Create();
    ASSERT_NE(session, nullptr);
    names.insert(session->name());
    const std::string bytes = absl::HexStringToBytes(session->name().substr(prefix));
    ASSERT_EQ(8 * bytes.size(), kBits);
    for (size_t bit = 0; bit < kBits; ++bit) {
      ones[bit] += static_cast<uint8_t>(bytes[bit / 8]) >> bit % 8 & 1;
    }
    registry_.Remove(*session);
  }
  EXPECT_EQ(names.size(), kNames);
  // No bit of them is known: each is a one about half of the time, within seven standard deviations.
  for (const int count : ones) {
    EXPECT_NEAR(count, kNames / 2, 7 * std::sqrt(kNames / 4.0));
  }
}

TEST_F(SessionRegistryTest, AnotherTenantsSessionDoesNotExist) {
  const std::shared_ptr<Session> session = Create("a");
  EXPECT_TRUE(Finds(*session, "a"));
  EXPECT_FALSE(Finds(*session, "b"));
  const absl::Status of_other = status_;
  registry_.Remove(*session);
  EXPECT_FALSE(Finds(*session, "a"));
  EXPECT_EQ(status_.message(), of_other.message()) << "whether a session exists can be told";
  EXPECT_EQ(ToGrpcStatus(status_).error_details(), ToGrpcStatus(of_other).error_details());
  EXPECT_EQ(DetailsOf(of_other).reason, "SESSION_NOT_FOUND");
  EXPECT_TRUE(registry_.List("b", absl::InfinitePast(), 10, {}).empty());
}

TEST_F(SessionRegistryTest, AnUnusedSessionExpires) {
  const std::shared_ptr<Session> session = Create("a", absl::Seconds(10));
  since_boot_ += absl::Seconds(9);
  EXPECT_TRUE(Finds(*session)) << "and renews the lease";
  since_boot_ += absl::Seconds(9);
  EXPECT_EQ(registry_.List("a", absl::InfinitePast(), 10, {}).size(), 1u) << "and renews nothing";
  since_boot_ += absl::Seconds(1);
  EXPECT_TRUE(registry_.List("a", absl::InfinitePast(), 10, {}).empty());
  EXPECT_FALSE(Finds(*session)) << "though the sweep has not come yet";
  EXPECT_EQ(DetailsOf(status_).reason, "SESSION_NOT_FOUND");
  EXPECT_EQ(registry_.RemoveExpired().size(), 1u);
  EXPECT_TRUE(registry_.RemoveExpired().empty());
}

TEST_F(SessionRegistryTest, TheClockOnTheWallMayJump) {
  const std::shared_ptr<Session> session = Create("a", absl::Seconds(10));
  const absl::Time created = session->create_time();
  now_ += absl::Hours(2);
  EXPECT_TRUE(Finds(*session)) << "no lease runs out by it";
  EXPECT_TRUE(registry_.RemoveExpired().empty());
  EXPECT_EQ(session->Describe().expire_time().seconds(), absl::ToUnixSeconds(now_ + absl::Seconds(10)))
      << "what is shown goes by it";
  now_ -= absl::Hours(5);
  since_boot_ += absl::Seconds(9);
  EXPECT_TRUE(Finds(*session));
  EXPECT_GT(Create("a")->create_time(), created) << "the order of creation stays";
  since_boot_ += absl::Seconds(10);
  EXPECT_FALSE(Finds(*session)) << "nor does it last longer";
}

TEST_F(SessionRegistryTest, ASessionInUseDoesNotExpire) {
  const std::shared_ptr<Session> session = Create("a", absl::Seconds(10));
  {
    const SessionUse use(session);
    since_boot_ += absl::Hours(1);
    EXPECT_TRUE(registry_.RemoveExpired().empty());
  }
  since_boot_ += absl::Seconds(9);
  EXPECT_FALSE(session->IsExpired()) << "the end of a use renews the lease";
  since_boot_ += absl::Seconds(1);
  EXPECT_TRUE(session->IsExpired());
}

TEST_F(SessionRegistryTest, ASessionWithAnOperationDoesNotExpire) {
  const std::shared_ptr<Session> session = Create("a", absl::Seconds(10));
  const absl::StatusOr<std::shared_ptr<Operation>> operation =
      session->StartOperation({.dimension = 2}, /*restart=*/false, 0, Submitted);
  ASSERT_TRUE(operation.ok());
  since_boot_ += absl::Hours(1);
  EXPECT_TRUE(registry_.RemoveExpired().empty());
  EXPECT_TRUE(session->Cancel(**operation).ok());
  since_boot_ += absl::Seconds(10);
  EXPECT_EQ(registry_.RemoveExpired().size(), 1u);
}

TEST_F(SessionRegistryTest, SessionsAreLimitedByTenantAndInAll) {
  std::vector<std::shared_ptr<Session>> sessions;
  for (int i = 0; i < 3; ++i) {
    sessions.push_back(Create("a"));
    ASSERT_NE(sessions.back(), nullptr);
  }
  EXPECT_EQ(Create("a"), nullptr);
  EXPECT_EQ(status_.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(DetailsOf(status_).reason, "QUOTA_EXCEEDED");
  ASSERT_NE(Create("b"), nullptr);
  ASSERT_NE(Create("b"), nullptr);
  EXPECT_EQ(Create("b"), nullptr);
  EXPECT_EQ(DetailsOf(status_).reason, "TOO_MANY_SESSIONS");
  EXPECT_TRUE(registry_.Remove(*sessions[1]));
  EXPECT_FALSE(registry_.Remove(*sessions[1]));
  EXPECT_NE(Create("a"), nullptr);
}

TEST_F(SessionRegistryTest, ListsInTheOrderOfCreationWhateverTheClockSays) {
  std::vector<std::string> created;
  for (int i = 0; i < 3; ++i) {
    created.push_back(Create("a", absl::Minutes(1), {{"even", i % 2 == 0 ? "yes" : "no"}})->name());
  }
  Create("b");
  const auto listed = registry_.List("a", absl::InfinitePast(), 10, {});
  ASSERT_EQ(listed.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(listed[i]->name(), created[i]);
    EXPECT_EQ(registry_.List("a", listed[i]->create_time(), 10, {}).size(), 2u - i);
  }
  EXPECT_EQ(registry_.List("a", absl::InfinitePast(), 2, {}).size(), 2u);
  EXPECT_EQ(registry_.List("a", absl::InfinitePast(), 10, {{"even", "yes"}}).size(), 2u);
  EXPECT_EQ(registry_.List("a", absl::InfinitePast(), 10, {{"even", "yes"}, {"odd", ""}}).size(), 0u);
}

TEST_F(SessionRegistryTest, PointsAreLimitedBySessionAndByTenant) {
  const std::shared_ptr<Session> first = Create();
  const std::shared_ptr<Session> second = Create();
  EXPECT_TRUE(first->Append(0, std::vector<double>(20, 0.5), 0).ok());
  const absl::Status too_many = first->Append(10, std::vector<double>(2, 0.5), 0);
  EXPECT_EQ(DetailsOf(too_many).reason, "TOO_MANY_POINTS");
  EXPECT_EQ(DetailsOf(second->Append(0, std::vector<double>(12, 0.5), 0)).reason, "QUOTA_EXCEEDED");
  EXPECT_EQ(second->state()->record.points(), 0u);
  EXPECT_TRUE(second->Append(0, std::vector<double>(10, 0.5), 0).ok());
  EXPECT_TRUE(Create("b")->Append(0, std::vector<double>(20, 0.5), 0).ok());
  const absl::StatusOr<std::shared_ptr<Operation>> under_way = first->Close(0);
  ASSERT_TRUE(under_way.ok());
  EXPECT_EQ(*under_way, nullptr);
  EXPECT_TRUE(second->Append(5, std::vector<double>(10, 0.5), 0).ok()) << "the points of the closed one are free";
  EXPECT_EQ(DetailsOf(first->Append(10, {}, 0)).reason, "SESSION_NOT_FOUND");
}

TEST_F(SessionRegistryTest, KeepsTheLastHundredOperations) {
  const std::shared_ptr<Session> session = Create();
  for (int i = 0; i < 103; ++i) {
    const absl::StatusOr<std::shared_ptr<Operation>> operation =
        session->StartOperation({.dimension = 2}, /*restart=*/false, 0, Submitted);
    ASSERT_TRUE(operation.ok());
    EXPECT_TRUE(session->Cancel(**operation).ok());
  }
  const auto kept = session->ListOperations(0, 1000);
  ASSERT_EQ(kept.size(), 100u);
  EXPECT_EQ(kept.front()->number(), 4u);
  EXPECT_EQ(session->ListOperations(101, 1000).size(), 2u);
  EXPECT_TRUE(session->FindOperation(session->name() + "/operations/103").ok());
  EXPECT_EQ(DetailsOf(session->FindOperation(session->name() + "/operations/3").status()).reason,
            "OPERATION_NOT_FOUND");
}

// A registry beside others, whose store answers what the test says.
class SharedRegistryTest : public SessionRegistryTest {
 protected:
  std::shared_ptr<Session> CreateOffered() {
    const std::shared_ptr<Session> session =
        shared_.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Minutes(1)}).value();
    EXPECT_TRUE(session->StartOperation({.dimension = 2}, /*restart=*/false, 0, Submitted).ok());
    EXPECT_TRUE(session->SetOffer(true).ok());
    EXPECT_TRUE(session->IsOffered());
    return session;
  }

  std::vector<std::string> Listed() {
    std::vector<std::string> names;
    for (const std::shared_ptr<Session>& session : shared_.List("a", absl::InfinitePast(), 10, {})) {
      names.push_back(session->name());
    }
    return names;
  }

  std::map<std::string, absl::Status> answers_;  // of `find`, by name; others: OK
  absl::StatusOr<std::set<std::string>> offered_ = std::set<std::string>();
  int finds_ = 0;
  int lists_ = 0;
  SessionRegistry shared_{options_,
                          memory_,
                          {.wall = [this] { return now_; }, .since_boot = [this] { return since_boot_; }},
                          *log_,
                          UnguessableSessionName,
                          SessionRegistry::Others{.find =
                                                      [this](const std::string& /*tenant*/, const std::string& name) {
                                                        ++finds_;
                                                        return answers_[name];
                                                      },
                                                  .list_offered =
                                                      [this] {
                                                        ++lists_;
                                                        return offered_;
                                                      }}};
};

TEST_F(SharedRegistryTest, DamageIsToldOfWhereTheSessionIsStillOurs) {
  const absl::Status damaged = absl::DataLossError("a file is gone");
  const std::shared_ptr<Session> session = CreateOffered();
  EXPECT_EQ(shared_.ErrorOfFile(*session, damaged), damaged) << "the store says that it is";
  EXPECT_EQ(finds_, 1);
  answers_[session->name()] = SessionElsewhereError("there", session->name(), "there:1");
  EXPECT_TRUE(IsElsewhereError(shared_.ErrorOfFile(*session, damaged))) << "the other has removed it";
  answers_[session->name()] = MakeError(v1::ERROR_REASON_STORE_FAILED, "not now");
  EXPECT_EQ(DetailsOf(shared_.ErrorOfFile(*session, damaged)).reason, "STORE_FAILED");
  finds_ = 0;
  EXPECT_TRUE(absl::IsCancelled(shared_.ErrorOfFile(*session, absl::CancelledError(""))));
  EXPECT_TRUE(session->SetOffer(false).ok());
  EXPECT_EQ(shared_.ErrorOfFile(*session, damaged), damaged) << "no other may have it";
  EXPECT_EQ(finds_, 0);
  session->NoteElsewhere("there:1");
  EXPECT_TRUE(IsElsewhereError(shared_.ErrorOfFile(*session, damaged)));
}

TEST_F(SharedRegistryTest, AListAsksTheStoreOnce) {
  const std::vector<std::shared_ptr<Session>> sessions = {CreateOffered(), CreateOffered(), CreateOffered()};
  offered_->insert(sessions[0]->name());
  answers_[sessions[1]->name()] = SessionElsewhereError("there", sessions[1]->name(), "there:1");
  EXPECT_EQ(Listed(), (std::vector<std::string>{sessions[0]->name(), sessions[2]->name()}))
      << "the third one's offer begins or ends just now";
  EXPECT_EQ(lists_, 1);
  EXPECT_EQ(finds_, 2) << "of those that the store does not name";
}

TEST_F(SharedRegistryTest, SessionsAreListedWhileTheStoreIsAway) {
  const std::shared_ptr<Session> session = CreateOffered();
  const absl::Status away = MakeError(v1::ERROR_REASON_STORE_FAILED, "not now");
  offered_ = away;
  EXPECT_EQ(Listed(), std::vector<std::string>{session->name()});
  offered_ = std::set<std::string>();  // it is away again when the session is asked for
  answers_[session->name()] = away;
  EXPECT_EQ(Listed(), std::vector<std::string>{session->name()});
}

// As one whose parameters are of a later version.
TEST_F(SharedRegistryTest, WhatCannotBeRestoredIsToldOf) {
  StoredSession stored{.epoch = 1, .state = {}, .steps = {}, .operations = {}};
  stored.state.set_name("sessions/later");
  stored.state.set_tenant("a");
  stored.state.set_ttl_ns(absl::ToInt64Nanoseconds(absl::Minutes(1)));
  stored.state.mutable_parameters()->set_dimension(77);
  for (SessionRegistry* registry : {&registry_, &shared_}) {
    EXPECT_FALSE(registry->Restore(stored).ok());
    status_ = registry->Find("a", "sessions/later").status();
    EXPECT_EQ(DetailsOf(status_).reason, "FILE_DAMAGED");
    EXPECT_NE(status_.message().find("sessions/later is stored, and this server cannot restore it: "),
              std::string::npos)
        << status_;
    EXPECT_TRUE(absl::IsNotFound(registry->Find("b", "sessions/later").status())) << "it is another tenant's";
    EXPECT_EQ(registry->Count(), 0);
  }
  answers_["sessions/later"] = SessionElsewhereError("there", "sessions/later", "there:1");
  EXPECT_TRUE(IsElsewhereError(shared_.Find("a", "sessions/later").status())) << "a server that can has it";
  answers_.clear();
  stored.state.mutable_parameters()->set_dimension(2);
  EXPECT_TRUE(shared_.Restore(stored).ok());
  EXPECT_TRUE(shared_.Find("a", "sessions/later").ok());
}

}  // namespace
}  // namespace wellspace::server
