// Sessions and their registry, with a clock that the test moves.
#include "server/sessions/session_registry.h"

#include <array>
#include <cmath>
#include <cstdint>
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

}  // namespace
}  // namespace wellspace::server
