// DownloadMesh: its messages, resuming, and changes that do not disturb it.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/raw_call.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

std::string Serialized(const std::vector<v1::MeshChunk>& chunks) {
  std::string bytes;
  for (const v1::MeshChunk& chunk : chunks) {
    bytes += chunk.SerializeAsString();
  }
  return bytes;
}

template <typename T, typename Field>
core::HugeVector<T> Concatenate(const std::vector<v1::MeshChunk>& chunks, Field field) {
  core::HugeVector<T> all;
  for (const v1::MeshChunk& chunk : chunks) {
    all.insert(all.end(), field(chunk).begin(), field(chunk).end());
  }
  return all;
}

core::HugeVector<double> PointsOf(const std::vector<v1::MeshChunk>& chunks) {
  return Concatenate<double>(
      chunks, [](const v1::MeshChunk& chunk) -> const auto& { return chunk.points(); });
}

core::HugeVector<uint32_t> SimplicesOf(const std::vector<v1::MeshChunk>& chunks) {
  return Concatenate<uint32_t>(
      chunks, [](const v1::MeshChunk& chunk) -> const auto& { return chunk.simplices(); });
}

// Of this process, in which the server is. Unit: bytes.
uint64_t ResidentBytes() {
  std::ifstream statm("/proc/self/statm");
  uint64_t total = 0;
  uint64_t resident = 0;
  statm >> total >> resident;
  return resident * 4096;
}

class DownloadOver : public ::testing::TestWithParam<Transport> {
 protected:
  std::unique_ptr<ServiceHarness> Start(core::Mesh mesh, const ServiceOptions& options = {}) const {
    return std::make_unique<ServiceHarness>(FakeMesher, options, GetParam(), FakeEstimator,
                                            FixedMesher(std::move(mesh)));
  }
};

INSTANTIATE_TEST_SUITE_P(Transports, DownloadOver, ::testing::Values(Transport::kInProcess, Transport::kLoopback),
                         [](const auto& test) {
                           return test.param == Transport::kInProcess ? "InProcess" : "Loopback";
                         });

TEST_P(DownloadOver, BringsMetadataThenChunks) {
  const core::Mesh mesh = MakeLargeMesh(300'000);
  const auto harness = Start(mesh);
  SessionClient client(harness->channel());
  const v1::Operation operation = client.Refine();
  const Download download = client.DownloadMesh();
  ASSERT_TRUE(download.status.ok()) << download.status.error_message();
  ASSERT_EQ(download.metadata.size(), 1u);
  EXPECT_EQ(download.metadata[0].vertex_count(), mesh.vertex_count());
  EXPECT_EQ(download.metadata[0].simplex_count(), mesh.simplex_count());
  EXPECT_EQ(download.metadata[0].chunk_count(), download.chunks.size());
  EXPECT_EQ(download.metadata[0].revision(), operation.mesh_revision());
  for (size_t i = 0; i < download.chunks.size(); ++i) {
    EXPECT_EQ(download.chunks[i].index(), i);
  }
  EXPECT_EQ(PointsOf(download.chunks), mesh.points);
  EXPECT_EQ(SimplicesOf(download.chunks), mesh.simplices);
  EXPECT_TRUE(harness->log().WaitFor("method=DownloadMesh"));
}

TEST_P(DownloadOver, GoesOnAtAnyChunkWithTheSameBytes) {
  const auto harness = Start(MakeLargeMesh(300'000));
  SessionClient client(harness->channel());
  client.Refine();
  const Download whole = client.DownloadMesh();
  ASSERT_TRUE(whole.status.ok());
  ASSERT_GE(whole.chunks.size(), 5u);
  for (uint64_t next = 0; next <= whole.chunks.size(); ++next) {
    const Download rest = client.DownloadMesh(whole.metadata[0].revision(), next);
    ASSERT_TRUE(rest.status.ok()) << rest.status.error_message();
    ASSERT_EQ(rest.metadata.size(), 1u);
    EXPECT_EQ(rest.metadata[0].SerializeAsString(), whole.metadata[0].SerializeAsString());
    EXPECT_EQ(Serialized(rest.chunks),
              Serialized({whole.chunks.begin() + static_cast<int64_t>(next), whole.chunks.end()}));
  }
}

TEST_P(DownloadOver, BreaksOffAtRandomChunksAndGoesOnWithTheSameBytes) {
  const core::Mesh mesh = MakeLargeMesh(10'000'000);
  const auto harness = Start(mesh);
  SessionClient client(harness->channel());
  client.Refine();
  std::mt19937 generator(17);
  core::HugeVector<double> points;
  core::HugeVector<uint32_t> simplices;
  uint64_t next = 0;
  uint64_t count = 1;
  uint64_t revision = 0;
  int downloads = 0;
  while (next < count) {
    const Download part = client.DownloadMesh(revision, next, 1 + generator() % 40);
    ASSERT_EQ(part.metadata.size(), 1u) << part.status.error_message();
    count = part.metadata[0].chunk_count();
    revision = part.metadata[0].revision();
    for (const v1::MeshChunk& chunk : part.chunks) {
      ASSERT_EQ(chunk.index(), next++);
      if (chunk.points().empty()) {
        ASSERT_EQ(chunk.crc32c(), Crc32c(chunk.simplices().data(), chunk.simplices_size() * sizeof(uint32_t)));
      }
      points.insert(points.end(), chunk.points().begin(), chunk.points().end());
      simplices.insert(simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
    }
    ++downloads;
  }
  EXPECT_GE(downloads, 4);
  EXPECT_TRUE(points == mesh.points);
  EXPECT_TRUE(simplices == mesh.simplices);
}

TEST_P(DownloadOver, ReadersThatStopReadingAreDroppedAndCostNoMemory) {
  constexpr int kReaders = 8;
  [[maybe_unused]] constexpr uint64_t kBytesPerReader = 8 << 20;  // of gRPC and of the client's own message
  ServiceOptions options;
  options.stall_limit = absl::Seconds(2);
  const auto harness = Start(MakeLargeMesh(10'000'000), options);
  SessionClient client(harness->channel());
  client.Refine();
  [[maybe_unused]] const uint64_t before = ResidentBytes();
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::DownloadMeshResponse>>> streams;
  v1::DownloadMeshRequest request;
  request.set_name(client.name());
  v1::DownloadMeshResponse response;
  for (int i = 0; i < kReaders; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(client.calls().sessions().DownloadMesh(contexts.back().get(), request));
    ASSERT_TRUE(streams.back()->Read(&response));
    ASSERT_TRUE(response.has_metadata());
  }
  ASSERT_TRUE(harness->log().WaitFor("code=DEADLINE_EXCEEDED", kReaders));
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LT(ResidentBytes(), before + kReaders * kBytesPerReader);
#endif
  for (const auto& stream : streams) {
    while (stream->Read(&response)) {
    }
    const grpc::Status status = stream->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_THAT(status.error_message(), HasSubstr("READER_STALLED"));
  }
  EXPECT_TRUE(client.DownloadMesh(0, 100).status.ok()) << "others are served as ever";
}

TEST_P(DownloadOver, ASlowReaderGetsItAll) {
  // Of the 200 MB. Both ends are in this process, and gRPC's window, which is filled at either, grows with what is
  // read.
  [[maybe_unused]] constexpr uint64_t kBytesPerReader = 64 << 20;
  ServiceOptions options;
  options.stall_limit = absl::Seconds(1);
  const core::Mesh mesh = MakeLargeMesh(10'000'000);
  const auto harness = Start(mesh, options);
  SessionClient client(harness->channel());
  client.Refine();
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(client.name());
  const auto stream = client.calls().sessions().DownloadMesh(&context, request);
  v1::DownloadMeshResponse response;
  ASSERT_TRUE(stream->Read(&response));
  [[maybe_unused]] const uint64_t before = ResidentBytes();
  const absl::Time begin = absl::Now();
  uint64_t simplices = 0;
  while (stream->Read(&response)) {
    simplices += response.chunk().simplices_size() / 4;
    if (absl::Now() - begin <= 2 * options.stall_limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));  // this makes it slow
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
      ASSERT_LT(ResidentBytes(), before + kBytesPerReader);
#endif
    }
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_GT(absl::Now() - begin, options.stall_limit);
  EXPECT_EQ(simplices, mesh.simplex_count());
}

TEST_P(DownloadOver, IsOfTheMeshThatWasWhenItBegan) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  SessionClient client(harness.channel());
  client.Upload(UniformPoints(5000, 3, 1));
  client.Refine();
  const Download before = client.DownloadMesh();
  ASSERT_TRUE(before.status.ok());
  ASSERT_GE(before.chunks.size(), 3u);

  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(client.name());
  const auto stream = client.calls().sessions().DownloadMesh(&context, request);
  std::vector<v1::MeshChunk> chunks;
  v1::DownloadMeshResponse response;
  ASSERT_TRUE(stream->Read(&response));
  ASSERT_TRUE(stream->Read(&response));
  chunks.push_back(response.chunk());

  client.Upload(UniformPoints(1000, 3, 2));
  EXPECT_EQ(Serialized(client.DownloadMesh().chunks), Serialized(before.chunks))
      << "points alone do not change the mesh";
  client.Refine();
  const Download after = client.DownloadMesh();
  ASSERT_TRUE(after.status.ok());
  EXPECT_GT(after.metadata.at(0).revision(), before.metadata.at(0).revision());
  EXPECT_GT(after.metadata.at(0).vertex_count(), before.metadata.at(0).vertex_count());
  client.calls().Delete(client.name());

  while (stream->Read(&response)) {
    chunks.push_back(response.chunk());
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(Serialized(chunks), Serialized(before.chunks));
}

TEST_P(DownloadOver, CannotGoOnInAnotherMesh) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  SessionClient client(harness.channel());
  client.Upload(UniformPoints(100, 3, 1));
  const uint64_t first = client.Refine().mesh_revision();
  client.Upload(UniformPoints(10, 3, 2));
  const uint64_t second = client.Refine().mesh_revision();
  EXPECT_TRUE(client.DownloadMesh(second).status.ok());
  const grpc::Status status = client.DownloadMesh(first, 1).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(DetailsOf(status).reason, "REVISION_MISMATCH");
  EXPECT_EQ(DetailsOf(status).field, "revision");
}

TEST(Download, OfAMomentAgoDoesNotHoldUpTheServersEnd) {
  absl::Duration longest;
  for (int i = 0; i < 10; ++i) {
    auto harness = std::make_unique<ServiceHarness>(FakeMesher, ServiceOptions(), Transport::kLoopback, FakeEstimator,
                                                    FixedMesher(MakeLargeMesh(300'000)));
    {
      SessionClient client(harness->channel());
      client.Refine();
      EXPECT_TRUE(client.DownloadMesh().status.ok());
    }
    const absl::Time begin = absl::Now();
    harness.reset();
    longest = std::max(longest, absl::Now() - begin);
  }
  EXPECT_LT(longest, absl::Seconds(8));
}

TEST(DownloadFailsWith, MeshNotReady) {
  ServiceHarness harness;
  SessionClient client(harness.channel());
  const grpc::Status status = client.DownloadMesh().status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(DetailsOf(status).reason, "MESH_NOT_READY");
}

TEST(DownloadFailsWith, ChunkOutOfRange) {
  ServiceHarness harness(FakeMesher, {}, Transport::kInProcess, FakeEstimator, FixedMesher(MakeLargeMesh(600)));
  SessionClient client(harness.channel());
  client.Refine();
  const uint64_t count = client.DownloadMesh().metadata.at(0).chunk_count();
  EXPECT_TRUE(client.DownloadMesh(0, count).status.ok());
  const grpc::Status status = client.DownloadMesh(0, count + 1).status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(DetailsOf(status).reason, "CHUNK_OUT_OF_RANGE");
  EXPECT_EQ(DetailsOf(status).field, "next_chunk");
}

TEST(DownloadFailsWith, SessionNotFound) {
  ServiceHarness harness;
  SessionClient client(harness.channel());
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name("sessions/of-another");
  const auto stream = client.calls().sessions().DownloadMesh(&context, request);
  v1::DownloadMeshResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(DetailsOf(stream->Finish()).reason, "SESSION_NOT_FOUND");
}

TEST(DownloadFailsWith, MalformedRequest) {
  ServiceHarness harness;
  const grpc::Status status =
      CallUnary(harness.channel(), "/wellspace.v1.SessionService/DownloadMesh", "\x0A\x7F half a message").status;
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  EXPECT_EQ(DetailsOf(status).reason, "MALFORMED_REQUEST");
}

}  // namespace
}  // namespace wellspace::server
