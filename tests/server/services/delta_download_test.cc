// DownloadMesh with since_revision: differences that come, requests that are refused, and differences that are gone.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/sessions/mesh_deltas.h"
#include "server/store/durable_log.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"
#include "tests/server/store/store_support.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

class DeltaDownloadTest : public ::testing::Test {
 protected:
  // A server over the folder of the test, as often as it is called.
  void Start(const ServiceOptions& options = {}) {
    calls_.reset();
    service_.reset();
    service_.emplace(FakeMesher, options, Transport::kInProcess, FakeEstimator, core::Mesher::Create, SecurityOptions(),
                     OpenDurableLog({.folder = folder_.path()}).value());
    calls_.emplace(service_->channel());
  }

  // A session in the plane, refined and downloaded.
  std::string Downloaded(size_t points = 300) {
    std::string name = calls_->Create(2).name();
    calls_->Upload(name, 0, UniformPoints(points, 2, 1));
    calls_->Refine(name);
    (void)calls_->DownloadMesh(name);
    return name;
  }

  // Adds a point; returns the revision of the mesh.
  uint64_t Add(const std::string& name) {
    calls_->Upload(name, calls_->Get(name).committed_points(), UniformPoints(1, 2, ++seed_));
    return calls_->Refine(name).mesh_revision();
  }

  uint64_t RevisionOf(const std::string& name) { return calls_->DownloadMesh(name).metadata.at(0).revision(); }

  Download Since(const std::string& name, uint64_t since, uint64_t revision = 0, uint64_t next_chunk = 0,
                 bool with_boundary = false) {
    v1::DownloadMeshRequest request;
    request.set_name(name);
    request.set_since_revision(since);
    if (revision != 0) {
      request.set_revision(revision);
    }
    request.set_next_chunk(next_chunk);
    request.set_with_boundary(with_boundary);
    return calls_->DownloadMesh(request);
  }

  void ExpectNotKept(const std::string& name, uint64_t since, const std::string& message) {
    const Download download = Since(name, since);
    EXPECT_EQ(download.status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
    EXPECT_EQ(DetailsOf(download.status).reason, "DELTA_NOT_KEPT");
    EXPECT_EQ(DetailsOf(download.status).field, "since_revision");
    EXPECT_THAT(download.status.error_message(), HasSubstr(message));
    EXPECT_THAT(download.metadata, SizeIs(0));
  }

  TestFolder folder_;
  uint64_t seed_ = 10;
  std::optional<ServiceHarness> service_;
  std::optional<SessionCalls> calls_;
};

TEST_F(DeltaDownloadTest, BringsMetadataThenPartsOfEachDifference) {
  Start();
  const std::string name = Downloaded();
  const uint64_t first = RevisionOf(name);
  const uint64_t second = Add(name);
  const uint64_t third = Add(name);
  for (const bool with_boundary : {false, true}) {
    const Download download = Since(name, first, 0, 0, with_boundary);
    ASSERT_TRUE(download.status.ok()) << download.status.error_message();
    ASSERT_THAT(download.metadata, SizeIs(2));
    EXPECT_THAT(download.chunks, SizeIs(0));
    EXPECT_THAT(download.deltas, SizeIs(with_boundary ? 4 : 2));
    EXPECT_EQ(download.metadata[0].delta().base_revision(), first);
    EXPECT_EQ(download.metadata[0].revision(), second);
    EXPECT_EQ(download.metadata[1].delta().base_revision(), second);
    EXPECT_EQ(download.metadata[1].revision(), third);
    EXPECT_EQ(download.metadata[1].boundary_size() > 0, with_boundary);
  }
}

TEST_F(DeltaDownloadTest, GoesOnAtAnyPart) {
  Start();
  const std::string name = Downloaded();
  const uint64_t first = RevisionOf(name);
  const uint64_t second = Add(name);
  const Download whole = Since(name, first, 0, 0, true);
  for (uint64_t next = 0; next <= 2; ++next) {
    const Download rest = Since(name, first, second, next, true);
    ASSERT_TRUE(rest.status.ok());
    ASSERT_THAT(rest.deltas, SizeIs(2 - next));
    for (size_t i = 0; i < rest.deltas.size(); ++i) {
      EXPECT_EQ(rest.deltas[i].SerializeAsString(), whole.deltas[next + i].SerializeAsString());
    }
  }
  EXPECT_EQ(DetailsOf(Since(name, first, 0, 3, true).status).reason, "CHUNK_OUT_OF_RANGE");
  EXPECT_EQ(DetailsOf(Since(name, first, second + 1).status).reason, "REVISION_MISMATCH");
}

TEST_F(DeltaDownloadTest, OfAMeshThatHasNotChangedIsMetadataAlone) {
  Start();
  const std::string name = Downloaded();
  const uint64_t revision = RevisionOf(name);
  const Download download = Since(name, revision);
  ASSERT_TRUE(download.status.ok());
  ASSERT_THAT(download.metadata, SizeIs(1));
  EXPECT_EQ(download.metadata[0].revision(), revision);
  EXPECT_EQ(download.metadata[0].delta().base_revision(), revision);
  EXPECT_FALSE(download.metadata[0].delta().has_checksums());
  EXPECT_EQ(download.metadata[0].chunk_count(), 0);
  EXPECT_THAT(download.deltas, SizeIs(0));
}

TEST_F(DeltaDownloadTest, RefusesRevisionsThatThereAreNot) {
  Start();
  const std::string name = Downloaded();
  const uint64_t revision = RevisionOf(name);
  // A negative number, cast, is one of the future, too.
  for (const uint64_t since : {revision + 1, static_cast<uint64_t>(-1)}) {
    const Download download = Since(name, since);
    EXPECT_EQ(download.status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
    EXPECT_EQ(DetailsOf(download.status).reason, "INVALID_REQUEST");
    EXPECT_EQ(DetailsOf(download.status).field, "since_revision");
    EXPECT_THAT(download.status.error_message(), HasSubstr("since_revision is " + std::to_string(since)));
  }
  Add(name);
  ExpectNotKept(name, revision - 1, "it is since revisions " + std::to_string(revision));
}

TEST_F(DeltaDownloadTest, OfAMeshThatNoClientHasIsNotMade) {
  Start();
  const std::string name = calls_->Create(2).name();
  calls_->Upload(name, 0, UniformPoints(300, 2, 1));
  const uint64_t first = calls_->Refine(name).mesh_revision();
  Add(name);
  ExpectNotKept(name, first, "nor is anything since other meshes");
  // That call was about the last mesh: differences after it are kept.
  const uint64_t second = RevisionOf(name);
  Add(name);
  EXPECT_TRUE(Since(name, second).status.ok());
}

TEST_F(DeltaDownloadTest, OfAMeshThatIsMadeAnewIsNotMade) {
  Start();
  const std::string name = Downloaded();
  const uint64_t first = RevisionOf(name);
  v1::StartRefinementRequest restart;
  restart.set_name(name);
  restart.set_restart(true);
  calls_->Refine(restart);
  ExpectNotKept(name, first, "Download the whole mesh");
}

TEST_F(DeltaDownloadTest, TheOldestAreGone) {
  Start();
  const std::string name = Downloaded(1000);
  const uint64_t first = RevisionOf(name);
  size_t steps = 0;
  while (steps <= MeshDeltas::kMost && Since(name, first).status.ok()) {
    Add(name);
    ++steps;
  }
  EXPECT_GT(steps, 10u) << "as many as have no more bytes than the mesh";
  ExpectNotKept(name, first, "it is since revisions ");
}

TEST_F(DeltaDownloadTest, AreGoneWithTheProcess) {
  Start();
  const std::string name = Downloaded();
  const uint64_t first = RevisionOf(name);
  const uint64_t second = Add(name);
  EXPECT_TRUE(Since(name, first).status.ok());
  Start();
  ExpectNotKept(name, first, "nor is anything since other meshes");
  EXPECT_TRUE(Since(name, second).status.ok()) << "it has not changed";
  Add(name);
  EXPECT_TRUE(Since(name, second).status.ok()) << "the first mesh of the new process was asked for";
}

TEST_F(DeltaDownloadTest, LimitedMemoryIsNoHindrance) {
  Start({.max_memory_bytes = uint64_t{1} << 30});
  const std::string name = Downloaded();
  const uint64_t first = RevisionOf(name);
  Add(name);
  EXPECT_TRUE(Since(name, first).status.ok());
}

}  // namespace
}  // namespace wellspace::server
