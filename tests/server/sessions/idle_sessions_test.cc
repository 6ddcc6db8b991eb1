// Idle sessions that give up their structure, and their state afterwards.
#include "server/sessions/idle_sessions.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "server/observability/work_counters.h"
#include "server/sessions/session_registry.h"
#include "server/sessions/session_use.h"
#include "server/store/durable_log.h"
#include "server/store/session_log.h"
#include "spdlog/logger.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/store/store_support.h"
#include "tests/support/seeded_test.h"

namespace wellspace::server {
namespace {

using Want = MemoryBudget::Want;

constexpr uint64_t kMegabyte = uint64_t{1} << 20;

Session::Spare SpareOf(uint64_t bytes, int last_use) { return {.bytes = bytes, .last_use = absl::Seconds(last_use)}; }

TEST(ChooseIdle, TheLongestIdleGiveUpFirstAndNoMoreThanNeeded) {
  const std::vector<Session::Spare> sessions = {SpareOf(10, 3), SpareOf(10, 1), SpareOf(10, 2)};
  EXPECT_EQ(ChooseIdle(sessions, 0, Want::kAllOrNothing), (std::vector<size_t>{}));
  EXPECT_EQ(ChooseIdle(sessions, 1, Want::kAllOrNothing), (std::vector<size_t>{1}));
  EXPECT_EQ(ChooseIdle(sessions, 11, Want::kAllOrNothing), (std::vector<size_t>{1, 2}));
  EXPECT_EQ(ChooseIdle(sessions, 30, Want::kAllOrNothing), (std::vector<size_t>{0, 1, 2}));
}

TEST(ChooseIdle, WhatIsNotEnoughIsGivenUpOnlyForOneThatWaits) {
  const std::vector<Session::Spare> sessions = {SpareOf(10, 3), SpareOf(10, 1)};
  EXPECT_EQ(ChooseIdle(sessions, 21, Want::kAllOrNothing), (std::vector<size_t>{}));
  EXPECT_EQ(ChooseIdle(sessions, 21, Want::kAsMuchAsPossible), (std::vector<size_t>{0, 1}));
}

TEST(ChooseIdle, SmallOnesAreSparedThatALargeOneMakesNeedless) {
  const std::vector<Session::Spare> sessions = {SpareOf(1, 1), SpareOf(2, 2), SpareOf(100, 3), SpareOf(100, 4)};
  EXPECT_EQ(ChooseIdle(sessions, 100, Want::kAllOrNothing), (std::vector<size_t>{2}));
  EXPECT_EQ(ChooseIdle(sessions, 101, Want::kAllOrNothing), (std::vector<size_t>{0, 2}));
  EXPECT_EQ(ChooseIdle(sessions, 102, Want::kAllOrNothing), (std::vector<size_t>{1, 2}));
}

class ChooseIdlePropertyTest : public test::SeededTest {
 protected:
  ChooseIdlePropertyTest() : SeededTest(10) {}
};

TEST_F(ChooseIdlePropertyTest, ItsGuaranteesHold) {
  for (int round = 0; round < 2000; ++round) {
    std::vector<Session::Spare> sessions(random_.Next() % 8);
    for (Session::Spare& session : sessions) {
      session = SpareOf(1 + random_.Next() % 20, static_cast<int>(random_.Next() % 10));
    }
    const uint64_t missing = random_.Next() % 80;
    const auto bytes_of = [&](const std::vector<size_t>& some) {
      uint64_t bytes = 0;
      for (const size_t i : some) {
        bytes += sessions[i].bytes;
      }
      return bytes;
    };
    uint64_t all = 0;
    for (const Session::Spare& session : sessions) {
      all += session.bytes;
    }
    const std::vector<size_t> chosen = ChooseIdle(sessions, missing, Want::kAllOrNothing);
    if (all < missing) {
      EXPECT_TRUE(chosen.empty());
      EXPECT_EQ(ChooseIdle(sessions, missing, Want::kAsMuchAsPossible).size(), sessions.size());
      continue;
    }
    EXPECT_EQ(ChooseIdle(sessions, missing, Want::kAsMuchAsPossible), chosen);
    EXPECT_GE(bytes_of(chosen), missing);
    absl::Duration last = -absl::InfiniteDuration();
    for (const size_t i : chosen) {
      EXPECT_LT(bytes_of(chosen) - sessions[i].bytes, missing) << "it could be left out";
      last = std::max(last, sessions[i].last_use);
    }
    // All that were used before the last one are not enough without it.
    uint64_t before = 0;
    for (const Session::Spare& session : sessions) {
      before += session.last_use < last ? session.bytes : 0;
    }
    EXPECT_TRUE(chosen.empty() || before < missing);
  }
}

// Sessions with structures of 20 MB that are none, in a budget of 100 MB.
class IdleSessionsTest : public ::testing::Test {
 protected:
  static constexpr uint64_t kStructure = 20 * kMegabyte;

  explicit IdleSessionsTest(std::unique_ptr<SessionLog> log = nullptr)
      : log_(log != nullptr ? std::move(log) : OpenDurableLog({.folder = folder_.path()}).value()) {
    (void)log_->records().Load();
  }

  std::shared_ptr<Session> Create() {
    return registry_.Create({.tenant = "a", .parameters = {.dimension = 2}, .labels = {}, .ttl = absl::Hours(1)})
        .value();
  }

  std::shared_ptr<Operation> Start(Session& session) {
    return session
        .StartOperation({.dimension = 2}, /*restart=*/false, 0,
                        [](const std::shared_ptr<Operation>& /*operation*/) { return absl::OkStatus(); })
        .value();
  }

  void End(Session& session, Operation& operation) {
    core::RunContext context;
    std::optional<SessionWork> work = session.BeginWork(operation);
    ASSERT_TRUE(work.has_value());
    work->mesher = script_(operation.parameters(), {}, context).value();
    work->memory = memory_.Reserve(kStructure, "a structure").value();
    work->memory.MakeLasting(session.inputs().lasts);
    WorkResult result{.status = absl::OkStatus(),
                      .work = *std::move(work),
                      .mesh = session.KeepMesh(MakeMesh({.dimension = 2}), context).value()};
    ASSERT_TRUE(session.EndWork(operation, result));
  }

  // A session that was refined, and used last now.
  std::shared_ptr<Session> Refined() {
    std::shared_ptr<Session> session = Create();
    End(*session, *Start(*session));
    since_boot_ += absl::Minutes(1);
    return session;
  }

  static bool HasStructure(Session& session) {
    uint64_t version = 0;
    return session.Query(&version, [](const core::Mesher&) { return absl::OkStatus(); }).ok();
  }

  absl::Duration since_boot_ = absl::Hours(1);
  const Clock clock_{.since_boot = [this] { return since_boot_; }};
  MesherFactory script_ = ScriptedMesher([](core::Phase, core::RunContext&) { return absl::OkStatus(); });
  TestFolder folder_;
  ServiceOptions options_;
  MemoryBudget memory_{kProcessMemoryBytes + 100 * kMegabyte};
  std::unique_ptr<SessionLog> log_;
  SessionRegistry registry_{options_, memory_, clock_, *log_};
  spdlog::logger logger_{"none"};
  WorkCounters counters_;
  WorkObserver observer_{logger_, counters_};
  IdleSessions idle_{registry_, memory_, observer_, clock_};
};

TEST_F(IdleSessionsTest, TheOneThatWasNotUsedForLongestGivesUp) {
  const std::shared_ptr<Session> first = Refined();
  const std::shared_ptr<Session> second = Refined();
  const std::shared_ptr<Session> third = Refined();
  EXPECT_TRUE(first->Renew());
  EXPECT_EQ(memory_.yielding(), 3 * kStructure);
  EXPECT_TRUE(memory_.MakeRoom(50 * kMegabyte, Want::kAllOrNothing));
  EXPECT_EQ(memory_.yielding(), 2 * kStructure);
  EXPECT_TRUE(HasStructure(*first));
  EXPECT_FALSE(HasStructure(*second));
  EXPECT_TRUE(HasStructure(*third));
  EXPECT_EQ(counters_.structures_given_up, 1u);
  EXPECT_EQ(second->Describe().state(), v1::Session::STATE_READY) << "it is as it was";
  EXPECT_NE(second->meshes().last(), nullptr);
  EXPECT_EQ(second->GetSize(0).replayed_steps, 1u);
}

TEST_F(IdleSessionsTest, WhoStartsAnOperationSeesWhatIsReplayedFirst) {
  const std::shared_ptr<Session> session = Refined();
  EXPECT_GT(session->GiveUpMemory(), 0u);
  uint64_t replayed_steps = 0;
  const auto submit = [&](const std::shared_ptr<Operation>&) {
    replayed_steps = session->GetSize(0).replayed_steps;
    return absl::OkStatus();
  };
  ASSERT_TRUE(session->StartOperation(*session->state()->parameters, /*restart=*/false, 0, submit).ok());
  EXPECT_EQ(replayed_steps, 1u) << "else a long replay would be taken for small work";
  EXPECT_EQ(session->GetSize(0).replayed_steps, 1u) << "one that an earlier process left is submitted while it waits";
}

TEST_F(IdleSessionsTest, NothingIsGivenUpWithoutNeedOrForNothing) {
  const std::shared_ptr<Session> session = Refined();
  EXPECT_TRUE(memory_.MakeRoom(70 * kMegabyte, Want::kAllOrNothing)) << "there is room";
  EXPECT_FALSE(memory_.MakeRoom(101 * kMegabyte, Want::kAllOrNothing)) << "there will never be";
  EXPECT_TRUE(HasStructure(*session));
  EXPECT_TRUE(memory_.CanMakeRoom()) << "for another, who wants less";
}

TEST_F(IdleSessionsTest, OneThatIsBusyOrInUseGivesUpWhenItIsIdle) {
  const std::shared_ptr<Session> busy = Refined();
  const std::shared_ptr<Session> used = Refined();
  const std::shared_ptr<Operation> operation = Start(*busy);
  std::optional<StructureUse> use(used);
  EXPECT_FALSE(memory_.MakeRoom(70 * kMegabyte, Want::kAsMuchAsPossible));
  EXPECT_TRUE(HasStructure(*used));
  EXPECT_FALSE(memory_.CanMakeRoom());
  use.reset();
  EXPECT_TRUE(memory_.CanMakeRoom());
  EXPECT_TRUE(memory_.MakeRoom(70 * kMegabyte, Want::kAsMuchAsPossible));
  EXPECT_FALSE(HasStructure(*used));
  EXPECT_FALSE(memory_.MakeRoom(100 * kMegabyte, Want::kAsMuchAsPossible));
  EXPECT_FALSE(memory_.CanMakeRoom());
  ASSERT_TRUE(busy->Cancel(*operation).ok());
  EXPECT_TRUE(memory_.CanMakeRoom());
  EXPECT_TRUE(memory_.MakeRoom(99 * kMegabyte, Want::kAsMuchAsPossible));
  EXPECT_EQ(counters_.structures_given_up, 2u);
}

TEST_F(IdleSessionsTest, OneThatAnswersAQueryIsLeftAlone) {
  const std::shared_ptr<Session> session = Refined();
  uint64_t version = 0;
  ASSERT_TRUE(session
                  ->Query(&version,
                          [&](const core::Mesher&) {
                            EXPECT_EQ(session->GiveUpMemory(), 0u);
                            return absl::OkStatus();
                          })
                  .ok());
  EXPECT_EQ(session->GiveUpMemory(), kStructure);
  EXPECT_EQ(session->GiveUpMemory(), 0u) << "there is nothing any more";
}

TEST_F(IdleSessionsTest, DifferencesOfMeshesAreGivenUpToo) {
  const std::shared_ptr<Session> session = Refined();
  const auto delta = std::make_shared<DeltaSnapshot>(2, 3, core::MeshDelta{.dimension = 2}, MakeMesh({.dimension = 2}));
  (void)session->meshes().deltas().Advance(delta, kStructure);
  const uint64_t bytes = session->meshes().deltas().memory_bytes();
  EXPECT_GT(bytes, 0u);
  EXPECT_EQ(session->GetSpare()->bytes, kStructure + bytes);
  EXPECT_EQ(session->GiveUpMemory(), kStructure + bytes);
  EXPECT_EQ(session->meshes().deltas().memory_bytes(), 0u);
  EXPECT_FALSE(session->GetSpare().has_value());
}

class EphemeralIdleSessionsTest : public IdleSessionsTest {
 protected:
  EphemeralIdleSessionsTest() : IdleSessionsTest(MakeEphemeralLog()) {}
};

TEST_F(EphemeralIdleSessionsTest, NeverGiveUp) {
  const std::shared_ptr<Session> session = Refined();
  EXPECT_EQ(memory_.yielding(), 0u);
  EXPECT_GE(memory_.lasting(), kStructure);
  EXPECT_FALSE(memory_.CanMakeRoom());
  EXPECT_FALSE(memory_.MakeRoom(90 * kMegabyte, Want::kAsMuchAsPossible));
  EXPECT_TRUE(HasStructure(*session));
  EXPECT_EQ(session->GiveUpMemory(), 0u);
}

}  // namespace
}  // namespace wellspace::server
