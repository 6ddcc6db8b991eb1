// The located mesh of a session: made once, kept until it is not wanted any more.
#include "server/sessions/session_locator.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/simplex/locator.h"
#include "gtest/gtest.h"
#include "server/store/memory_mesh.h"
#include "server/wire/errors.h"
#include "tests/server/jobs/test_jobs.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

// A triangle.
std::shared_ptr<const MeshSnapshot> MeshOf(uint64_t revision) {
  core::Mesh mesh;
  mesh.dimension = 2;
  mesh.domain_low = {0, 0};
  mesh.domain_high = {1, 1};
  mesh.points = {0, 0, 1, 0, 0, 1};
  mesh.simplices = {0, 1, 2};
  return std::make_shared<MemoryMesh>(revision, std::move(mesh));
}

class SessionLocatorTest : public ::testing::Test {
 protected:
  using Located = std::shared_ptr<const LocatedMesh>;

  // The locator that a job gets, and the job's end.
  struct Asked {
    absl::StatusOr<Located> located;
    Event done;
  };

  // Has a job ask, where the last mesh is `mesh`.
  void Ask(const absl::StatusOr<std::shared_ptr<const MeshSnapshot>>& mesh, Asked& asked) {
    ASSERT_NE(pool_.Submit([this, mesh, &asked](Job& job) {
      asked.located =
          locator_.Prepare([&] { return mesh; },
                           [&](const MeshSnapshot& found) { return MakeLocated(found, Lasts::kUntilWanted, job); });
      asked.done.Set();
    }),
              nullptr);
  }

  absl::StatusOr<Located> Prepare(const absl::StatusOr<std::shared_ptr<const MeshSnapshot>>& mesh) {
    Asked asked;
    Ask(mesh, asked);
    EXPECT_TRUE(asked.done.Wait());
    EXPECT_TRUE(pool_.pool.WaitUntilIdle(absl::Minutes(1)));  // it holds the job's memory
    return std::move(asked.located);
  }

  Pool pool_{/*workers=*/4, /*max_queued=*/100, /*max_per_tenant=*/1000, kMaxMemory};
  SessionLocator locator_;
};

TEST_F(SessionLocatorTest, IsMadeOnceForAllThatAsk) {
  const std::shared_ptr<const MeshSnapshot> mesh = MeshOf(3);
  std::vector<Asked> asked(20);
  for (Asked& one : asked) {
    Ask(mesh, one);
  }
  for (Asked& one : asked) {
    ASSERT_TRUE(one.done.Wait());
    ASSERT_TRUE(one.located.ok()) << one.located.status();
    EXPECT_EQ(*one.located, *asked[0].located);
  }
  const Located located = *asked[0].located;
  EXPECT_EQ(located->revision, 3u);
  const auto found = located->locator->Locate(std::vector<double>{0.25, 0.25, 0.75, 0.75}, core::RunContext());
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->simplices, (std::vector<uint32_t>{0, core::kNoSimplex}));
}

TEST_F(SessionLocatorTest, AnotherMeshTakesItsPlace) {
  EXPECT_EQ(locator_.Find(1), nullptr);
  ASSERT_TRUE(Prepare(MeshOf(1)).ok());
  EXPECT_NE(locator_.Find(1), nullptr);
  const uint64_t bytes = pool_.memory.reserved();
  EXPECT_GT(bytes, 0u);
  EXPECT_EQ((*Prepare(MeshOf(2)))->revision, 2u);
  EXPECT_EQ(locator_.Find(1), nullptr);
  EXPECT_NE(locator_.Find(2), nullptr);
  EXPECT_EQ(pool_.memory.reserved(), bytes) << "the one before is freed";
}

TEST_F(SessionLocatorTest, WhatPointsAreLocatedInIsNotGivenUp) {
  Located in_use = *Prepare(MeshOf(1));
  EXPECT_EQ(locator_.SpareBytes(), 0u);
  EXPECT_TRUE(locator_.GiveUp().empty());
  EXPECT_NE(locator_.Find(1), nullptr);
  in_use = nullptr;
  EXPECT_EQ(locator_.SpareBytes(), pool_.memory.yielding());
  EXPECT_EQ(locator_.GiveUp().size(), 1u);
  EXPECT_EQ(locator_.Find(1), nullptr);
  EXPECT_EQ(locator_.SpareBytes(), 0u);
  EXPECT_EQ(pool_.memory.reserved(), 0u);
}

TEST_F(SessionLocatorTest, WhatCannotBeMadeIsAnErrorAndNothingIsKept) {
  const absl::Status none = MakeError(v1::ERROR_REASON_MESH_NOT_READY, "none");
  EXPECT_EQ(Prepare(none).status(), none);
  MemoryReservation others = pool_.memory.Reserve(100 * kMegabyte, "all").value();
  EXPECT_TRUE(IsMemoryLimit(Prepare(MeshOf(1)).status()));
  EXPECT_EQ(locator_.Find(1), nullptr);
  others.Release();
  EXPECT_TRUE(Prepare(MeshOf(1)).ok());
}

}  // namespace
}  // namespace wellspace::server
