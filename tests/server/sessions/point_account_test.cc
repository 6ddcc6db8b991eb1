// Points, segments, sizes and bytes against the limits of session, tenant and memory.
#include "server/sessions/point_account.h"

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

constexpr int kDimension = 2;
constexpr uint64_t kPointBytes = kDimension * sizeof(double);

class PointAccountTest : public ::testing::Test {
 protected:
  std::unique_ptr<PointAccount> Open(MemoryBudget& memory) {
    return std::make_unique<PointAccount>("sessions/1", kDimension, in_memory_, options_, memory, tenant_);
  }

  // Tries to take points that never fit, `bulk` at once, on several threads beside others that take and return one
  // point of the rest. Returns how often one of the latter was refused.
  int CountRefusals(uint64_t bulk, MemoryBudget& memory) {
    constexpr int kPairs = 3;
    constexpr int kTimes = 20'000;
    std::atomic<int> refusals = 0;
    std::atomic<int> at_work = kPairs;
    std::vector<std::thread> threads;
    for (int i = 0; i < kPairs; ++i) {
      threads.emplace_back([&] {
        const std::unique_ptr<PointAccount> account = Open(memory);
        while (at_work > 0) {
          EXPECT_FALSE(account->Take(bulk).ok());
        }
      });
      threads.emplace_back([&] {
        const std::unique_ptr<PointAccount> account = Open(memory);
        for (int k = 0; k < kTimes; ++k) {
          if (account->Take(1).ok()) {
            account->Return(1);
          } else {
            ++refusals;
          }
        }
        --at_work;
      });
    }
    for (std::thread& thread : threads) {
      thread.join();
    }
    return refusals;
  }

  ServiceOptions options_{.max_points = 1000, .max_points_per_tenant = 1500};
  bool in_memory_ = true;
  std::shared_ptr<TenantPoints> tenant_ = std::make_shared<TenantPoints>();
  MemoryBudget unlimited_{0};
};

TEST_F(PointAccountTest, TakesAsManyAsASessionMayHave) {
  const std::unique_ptr<PointAccount> account = Open(unlimited_);
  EXPECT_TRUE(account->Take(400).ok());
  EXPECT_TRUE(account->Take(600).ok());
  const absl::Status refused = account->Take(1);
  EXPECT_EQ(DetailsOf(refused).reason, "TOO_MANY_POINTS");
  EXPECT_EQ(refused.message(), "sessions/1 would have 1001 points; a session of this server has at most 1000");
  EXPECT_EQ(account->points(), 1000u);
  EXPECT_EQ(tenant_->amount().points, 1000u);
  EXPECT_EQ(unlimited_.lasting(), 1000 * kPointBytes);
  account->Return(1);
  EXPECT_TRUE(account->Take(1).ok());
}

TEST_F(PointAccountTest, TakesAsManyAsATenantMayHaveInAll) {
  const std::unique_ptr<PointAccount> first = Open(unlimited_);
  const std::unique_ptr<PointAccount> second = Open(unlimited_);
  EXPECT_TRUE(first->Take(900).ok());
  EXPECT_TRUE(second->Take(600).ok());
  const absl::Status refused = second->Take(2);
  EXPECT_EQ(DetailsOf(refused).reason, "QUOTA_EXCEEDED");
  EXPECT_EQ(refused.message(), "your sessions would have 1502 points together; they may have at most 1500");
  EXPECT_EQ(second->points(), 600u);
  EXPECT_EQ(tenant_->amount().points, 1500u);
  EXPECT_EQ(unlimited_.lasting(), 1500 * kPointBytes);
  first->Return(2);
  EXPECT_TRUE(second->Take(2).ok());
}

TEST_F(PointAccountTest, TakesAsManyAsTheMemoryHolds) {
  MemoryBudget memory(kProcessMemoryBytes + 100 * kPointBytes);
  const std::unique_ptr<PointAccount> account = Open(memory);
  EXPECT_TRUE(account->Take(100).ok());
  EXPECT_EQ(DetailsOf(account->Take(1)).reason, "MEMORY_LIMIT");
  EXPECT_EQ(account->points(), 100u);
  EXPECT_EQ(tenant_->amount().points, 100u);
  account->Return(40);
  EXPECT_EQ(memory.reserved(), 60 * kPointBytes);
  EXPECT_TRUE(account->Take(40).ok());
}

TEST_F(PointAccountTest, SegmentsAndSeedsCountAsPointsOfTheTenantAndTakeTheirMemory) {
  std::unique_ptr<PointAccount> account = Open(unlimited_);
  EXPECT_TRUE(account->Take(100).ok());
  EXPECT_TRUE(account->TakeFeatures({.segments = 1000, .seeds = 50}).ok());
  EXPECT_EQ(tenant_->amount().points, 1150u);
  EXPECT_EQ(unlimited_.lasting(), 100 * kPointBytes + FeatureBytes({.segments = 1000, .seeds = 50}));
  EXPECT_EQ(DetailsOf(account->TakeFeatures({.segments = 1})).reason, "TOO_MANY_POINTS");
  EXPECT_EQ(DetailsOf(account->TakeFeatures({.seeds = 951})).reason, "TOO_MANY_POINTS");
  const absl::Status refused = account->TakeFeatures({.seeds = 351});
  EXPECT_EQ(DetailsOf(refused).reason, "QUOTA_EXCEEDED");
  EXPECT_EQ(refused.message(),
            "your sessions would have 1501 points, segments, triangles and seeds together; they may have at most 1500");
  EXPECT_EQ(tenant_->amount().points, 1150u);
  account->Return(100);
  account->Close();
  EXPECT_EQ(tenant_->amount().points, 0u);
  account.reset();
  EXPECT_EQ(unlimited_.reserved(), 0u);

  MemoryBudget memory(kProcessMemoryBytes + FeatureBytes({.segments = 10}));
  EXPECT_EQ(DetailsOf(Open(memory)->TakeFeatures({.segments = 11})).reason, "MEMORY_LIMIT");
}

TEST_F(PointAccountTest, SizesCountAsPointsOfTheTenantAndTakeTheirMemory) {
  std::unique_ptr<PointAccount> account = Open(unlimited_);
  const uint64_t bytes = kPointBytes + sizeof(double);
  EXPECT_TRUE(account->TakeSizes(1500).ok());
  EXPECT_EQ(tenant_->amount().points, 1500u);
  EXPECT_EQ(unlimited_.lasting(), 1500 * bytes);
  EXPECT_EQ(DetailsOf(account->TakeSizes(1)).reason, "QUOTA_EXCEEDED");
  account->ReturnSizes(600);
  EXPECT_EQ(tenant_->amount().points, 900u);
  EXPECT_EQ(unlimited_.lasting(), 900 * bytes);
}

TEST_F(PointAccountTest, PointsInAFileTakeNoMemory) {
  in_memory_ = false;
  MemoryBudget memory(kProcessMemoryBytes + 8);
  const std::unique_ptr<PointAccount> account = Open(memory);
  EXPECT_TRUE(account->Take(2).ok());
  EXPECT_EQ(memory.reserved(), 0u);
  EXPECT_EQ(tenant_->amount().points, 2u);
}

TEST_F(PointAccountTest, WhatWasThereBeforeIsTakenWhateverTheLimits) {
  const std::unique_ptr<PointAccount> account = Open(unlimited_);
  account->Restore({.points = options_.max_points + 1, .features = {.segments = 2, .seeds = 1}});
  EXPECT_EQ(tenant_->amount().points, options_.max_points + 4);
  EXPECT_FALSE(account->Take(1).ok());
  account->ReturnFeatures({.segments = 2, .seeds = 1});
  account->Return(2);
  EXPECT_EQ(tenant_->amount().points, options_.max_points - 1);
  EXPECT_TRUE(account->Take(1).ok());
}

TEST_F(PointAccountTest, BytesOfATenantAreThoseOfInputsAndMeshes) {
  in_memory_ = false;  // points in a file count, too
  options_.max_stored_bytes_per_tenant = 100 * kPointBytes;
  const std::unique_ptr<PointAccount> first = Open(unlimited_);
  const std::unique_ptr<PointAccount> second = Open(unlimited_);
  EXPECT_TRUE(first->Take(60).ok());
  EXPECT_EQ(first->stored_bytes(), 60 * kPointBytes);
  EXPECT_TRUE(second->CheckMesh(40 * kPointBytes).ok());
  EXPECT_TRUE(second->TakeMesh(40 * kPointBytes).ok());
  second->SettleMesh(40 * kPointBytes);
  const absl::Status refused = first->Take(2);
  EXPECT_EQ(DetailsOf(refused).reason, "STORAGE_QUOTA_EXCEEDED");
  EXPECT_FALSE(DetailsOf(refused).may_retry) << "time frees nothing";
  EXPECT_EQ(
      refused.message(),
      absl::StrCat("your sessions keep ", 100 * kPointBytes, " bytes, and the new points of sessions/1 would take ",
                   2 * kPointBytes, " more; they may keep at most ", 100 * kPointBytes,
                   ". What frees some: DeleteSession, RemovePoints, SetSizes without samples"));
  EXPECT_EQ(tenant_->amount().bytes, 100 * kPointBytes);
  EXPECT_EQ(DetailsOf(first->TakeSizes(1)).reason, "STORAGE_QUOTA_EXCEEDED");
  EXPECT_EQ(DetailsOf(first->TakeFeatures({.segments = 1})).reason, "STORAGE_QUOTA_EXCEEDED");
  EXPECT_EQ(DetailsOf(second->CheckMesh(40 * kPointBytes + 1)).reason, "STORAGE_QUOTA_EXCEEDED");
  EXPECT_EQ(DetailsOf(second->TakeMesh(40 * kPointBytes + 1)).reason, "STORAGE_QUOTA_EXCEEDED");
  // A mesh takes the place of the one before; the bytes that it has less are free once it is there.
  EXPECT_TRUE(second->TakeMesh(10 * kPointBytes).ok());
  EXPECT_FALSE(first->Take(1).ok());
  second->SettleMesh(10 * kPointBytes);
  EXPECT_TRUE(first->Take(30).ok());
  first->Return(90);
  EXPECT_EQ(tenant_->amount().bytes, 10 * kPointBytes);
  second->Close();
  EXPECT_EQ(tenant_->amount().bytes, 0u);
  EXPECT_TRUE(second->TakeMesh(1000 * kPointBytes).ok()) << "of a session that is gone, nothing counts";
  second->SettleMesh(1000 * kPointBytes);
  EXPECT_EQ(tenant_->amount().bytes, 0u);
}

TEST_F(PointAccountTest, AboveTheLimitOfBytesWhatTakesNoneIsTaken) {
  options_.max_stored_bytes_per_tenant = 10 * kPointBytes;
  const std::unique_ptr<PointAccount> account = Open(unlimited_);
  account->Restore({.points = 20, .mesh_bytes = 5 * kPointBytes});
  EXPECT_EQ(account->stored_bytes(), 25 * kPointBytes);
  EXPECT_EQ(DetailsOf(account->Take(1)).reason, "STORAGE_QUOTA_EXCEEDED");
  EXPECT_TRUE(account->Take(0).ok());
  EXPECT_TRUE(account->TakeMesh(5 * kPointBytes).ok());
  account->SettleMesh(4 * kPointBytes);
  account->Return(18);
  EXPECT_TRUE(account->Take(4).ok());
}

TEST_F(PointAccountTest, AClosedAccountHasNoneOfTheTenantsPointsButKeepsItsMemory) {
  std::unique_ptr<PointAccount> account = Open(unlimited_);
  EXPECT_TRUE(account->Take(500).ok());
  account->Close();
  account->Close();
  EXPECT_EQ(tenant_->amount().points, 0u);
  EXPECT_EQ(unlimited_.lasting(), 500 * kPointBytes);
  account->Return(100);
  EXPECT_EQ(tenant_->amount().points, 0u);
  EXPECT_EQ(unlimited_.lasting(), 400 * kPointBytes);
  account.reset();
  EXPECT_EQ(tenant_->amount().points, 0u);
  EXPECT_EQ(unlimited_.reserved(), 0u);
}

TEST_F(PointAccountTest, AnAccountThatEndsReturnsItsPoints) {
  { EXPECT_TRUE(Open(unlimited_)->Take(500).ok()); }
  EXPECT_EQ(tenant_->amount().points, 0u);
}

TEST_F(PointAccountTest, ABulkThatATenantMayNotHaveRefusesNoOther) {
  const std::unique_ptr<PointAccount> account = Open(unlimited_);
  ASSERT_TRUE(account->Take(1000).ok());
  EXPECT_EQ(CountRefusals(501, unlimited_), 0);
  EXPECT_EQ(tenant_->amount().points, 1000u);
}

TEST_F(PointAccountTest, ABulkThatTheMemoryDoesNotHoldRefusesNoOther) {
  MemoryBudget memory(kProcessMemoryBytes + 500 * kPointBytes);
  const std::unique_ptr<PointAccount> account = Open(unlimited_);
  ASSERT_TRUE(account->Take(800).ok());
  EXPECT_EQ(CountRefusals(700, memory), 0) << "points that were refused for their memory counted as the tenant's";
  EXPECT_EQ(tenant_->amount().points, 800u);
  EXPECT_EQ(memory.reserved(), 0u);
}

}  // namespace
}  // namespace wellspace::server
