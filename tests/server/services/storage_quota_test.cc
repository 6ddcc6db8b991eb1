// The quota of a tenant's stored bytes: data that count, calls refused, calls that free some, also after a restart.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/store/durable_log.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"
#include "tests/support/clouds.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

constexpr uint64_t kPointBytes = 2 * sizeof(double);
constexpr uint64_t kSizeBytes = 3 * sizeof(double);
constexpr uint64_t kQuota = 100'000;

// With true as parameter sessions are kept on disk.
class StorageQuotaTest : public ::testing::TestWithParam<bool> {
 protected:
  StorageQuotaTest() {
    options_.max_stored_bytes_per_tenant = kQuota;
    Start();
  }
  ~StorageQuotaTest() override { Stop(); }

  void Start() {
    std::unique_ptr<SessionLog> log;
    if (GetParam()) {
      absl::StatusOr<std::unique_ptr<SessionLog>> opened = OpenDurableLog({.folder = folder_.path()});
      ASSERT_TRUE(opened.ok()) << opened.status();
      log = *std::move(opened);
    }
    service_.emplace(FakeMesher, options_, Transport::kInProcess, FakeEstimator, core::Mesher::Create,
                     SecurityOptions(), std::move(log));
    calls_.emplace(service_->channel());
  }

  void Stop() {
    calls_.reset();
    service_.reset();
  }

  SessionCalls& calls() { return *calls_; }
  uint64_t Stored() { return service_->Info().stored_bytes(); }
  uint64_t StoredOf(const std::string& name) { return calls().Get(name).stored_bytes(); }

  // A session of so many points in the unit square.
  std::string SessionWith(size_t count) {
    std::string name = calls().Create(2).name();
    calls().Upload(name, 0, UniformPoints(count, 2, ++seed_));
    return name;
  }

  // The bytes that the last mesh of a session counts.
  static uint64_t MeshBytes(const v1::Session& session) {
    return session.vertex_count() * kPointBytes + session.simplex_count() * 3 * sizeof(uint32_t);
  }

  void ExpectRefused(const grpc::Status& status, const std::string& message) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(DetailsOf(status).reason, "STORAGE_QUOTA_EXCEEDED") << status.error_message();
    EXPECT_FALSE(DetailsOf(status).may_retry);
    EXPECT_THAT(status.error_message(), HasSubstr(message));
    EXPECT_THAT(status.error_message(),
                HasSubstr("may keep at most " + std::to_string(options_.max_stored_bytes_per_tenant)));
    EXPECT_THAT(status.error_message(), HasSubstr("What frees some: DeleteSession, RemovePoints"));
  }

  ServiceOptions options_;
  TestFolder folder_;
  uint64_t seed_ = 0;
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

INSTANTIATE_TEST_SUITE_P(Kept, StorageQuotaTest, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "OnDisk" : "InMemory"; });

TEST_P(StorageQuotaTest, PointsSizesAndMeshesCount) {
  EXPECT_EQ(service_->Info().max_stored_bytes_per_tenant(), kQuota);
  EXPECT_EQ(Stored(), 0u);
  const std::string name = SessionWith(200);
  EXPECT_EQ(StoredOf(name), 200 * kPointBytes);
  calls().Refine(name);
  const v1::Session refined = calls().Get(name);
  EXPECT_GT(MeshBytes(refined), 200 * kPointBytes);
  EXPECT_EQ(refined.stored_bytes(), 200 * kPointBytes + MeshBytes(refined));
  v1::SetSizesRequest sizes;
  sizes.set_name(name);
  sizes.mutable_samples()->mutable_points()->Add(0.5);
  sizes.mutable_samples()->mutable_points()->Add(0.5);
  sizes.mutable_samples()->add_sizes(0.25);
  calls().SetSizes({sizes});
  EXPECT_EQ(StoredOf(name), refined.stored_bytes() + kSizeBytes);
  EXPECT_EQ(Stored(), refined.stored_bytes() + kSizeBytes);
  const std::string other = SessionWith(10);
  EXPECT_EQ(Stored(), refined.stored_bytes() + kSizeBytes + 10 * kPointBytes);
  calls().Delete(name);
  EXPECT_EQ(Stored(), 10 * kPointBytes);
}

TEST_P(StorageQuotaTest, WhatDoesNotFitIsRefusedAndChangesNothing) {
  const std::string name = SessionWith(kQuota / kPointBytes - 10);
  EXPECT_EQ(Stored(), kQuota - 10 * kPointBytes);
  grpc::Status status;
  calls().Upload(name, kQuota / kPointBytes - 10, UniformPoints(11, 2, 7), &status);
  ExpectRefused(status, "your sessions keep " + std::to_string(kQuota - 10 * kPointBytes) +
                            " bytes, and the new points of " + name + " would take " +
                            std::to_string(11 * kPointBytes) + " more");
  v1::SetSizesRequest sizes;
  sizes.set_name(name);
  for (int i = 0; i < 8; ++i) {
    sizes.mutable_samples()->mutable_points()->Add(0.5);
    sizes.mutable_samples()->mutable_points()->Add(0.5);
    sizes.mutable_samples()->add_sizes(0.25);
  }
  calls().SetSizes({sizes}, &status);
  ExpectRefused(status, "would take " + std::to_string(8 * kSizeBytes) + " more");
  EXPECT_EQ(Stored(), kQuota - 10 * kPointBytes);
  EXPECT_EQ(calls().Get(name).revision(), 2u);
  EXPECT_EQ(calls().Get(name).size_count(), 0u);
}

TEST_P(StorageQuotaTest, AMeshThatDoesNotFitLeavesTheSessionAsItWas) {
  const std::string filler = SessionWith(kQuota / kPointBytes - 500);
  const std::string name = SessionWith(400);
  const uint64_t before = Stored();
  const v1::Operation failed = calls().Refine(name);
  EXPECT_EQ(failed.state(), v1::Operation::STATE_FAILED);
  EXPECT_EQ(failed.error().code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(failed.error().message(), HasSubstr("the mesh of " + name + " would take"));
  EXPECT_EQ(Stored(), before);
  EXPECT_EQ(calls().Get(name).vertex_count(), 0u);
  EXPECT_EQ(calls().Get(name).state(), v1::Session::STATE_OPEN);
  calls().Delete(filler);
  EXPECT_EQ(calls().Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
  const v1::Session refined = calls().Get(name);
  EXPECT_EQ(Stored(), 400 * kPointBytes + MeshBytes(refined));
}

// There is nothing to be tried: every mesh has some bytes.
TEST_P(StorageQuotaTest, WithoutAByteLeftAFirstMeshIsRefusedAtOnce) {
  const std::string filler = SessionWith(kQuota / kPointBytes);
  const std::string name = calls().Create(2).name();
  EXPECT_EQ(Stored(), kQuota);
  grpc::Status status;
  calls().Start(name, &status);
  ExpectRefused(status, "the mesh of " + name);
  EXPECT_EQ(calls().Get(name).state(), v1::Session::STATE_OPEN);
  calls().Delete(filler);
  EXPECT_EQ(calls().Refine(name).state(), v1::Operation::STATE_SUCCEEDED);
}

TEST_P(StorageQuotaTest, RemovedPointsAndSizesFreeTheirs) {
  const std::string name = SessionWith(kQuota / kPointBytes);
  v1::RemovePointsRequest remove;
  remove.set_name(name);
  remove.add_points(0);
  remove.add_points(1);
  calls().RemovePoints(remove);
  EXPECT_EQ(Stored(), kQuota - 2 * kPointBytes);
  v1::SetSizesRequest sizes;
  sizes.set_name(name);
  sizes.mutable_samples()->mutable_points()->Add(0.5);
  sizes.mutable_samples()->mutable_points()->Add(0.5);
  sizes.mutable_samples()->add_sizes(0.25);
  calls().SetSizes({sizes});
  EXPECT_EQ(Stored(), kQuota - 2 * kPointBytes + kSizeBytes);
  v1::SetSizesRequest none;
  none.set_name(name);
  calls().SetSizes({none});
  EXPECT_EQ(Stored(), kQuota - 2 * kPointBytes);
}

TEST_P(StorageQuotaTest, AMeshTakesThePlaceOfTheOneBefore) {
  const std::string name = SessionWith(300);
  for (int i = 0; i < 6; ++i) {
    v1::StartRefinementRequest request;
    request.set_name(name);
    request.set_restart(true);
    *request.mutable_parameters() = calls().Get(name).parameters();
    request.mutable_parameters()->set_max_circumradius(i % 2 == 0 ? 0.04 : 0.5);
    ASSERT_EQ(calls().Refine(request).state(), v1::Operation::STATE_SUCCEEDED) << i;
    const v1::Session refined = calls().Get(name);
    EXPECT_EQ(Stored(), 300 * kPointBytes + MeshBytes(refined)) << i;
  }
}

TEST_P(StorageQuotaTest, IsAsItWasAfterARestart) {
  if (!GetParam()) {
    EXPECT_EQ(Stored(), 0u);  // nothing outlives a server without a folder
    return;
  }
  const std::string name = SessionWith(300);
  calls().Refine(name);
  const uint64_t stored = Stored();
  const uint64_t of_session = StoredOf(name);
  Stop();
  Start();
  EXPECT_EQ(Stored(), stored);
  EXPECT_EQ(StoredOf(name), of_session);
  // With a limit below the stored bytes, nothing more is taken, and the stored data stay.
  Stop();
  options_.max_stored_bytes_per_tenant = stored / 2;
  Start();
  grpc::Status status;
  calls().Upload(name, 300, {0.5, 0.25}, &status);
  ExpectRefused(status, "your sessions keep " + std::to_string(stored) + " bytes");
  EXPECT_TRUE(calls().DownloadMesh(name).status.ok());
  calls().Delete(name);
  EXPECT_EQ(Stored(), 0u);
}

}  // namespace
}  // namespace wellspace::server
