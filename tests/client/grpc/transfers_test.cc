// Uploads and downloads that break off and go on.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr char kSession[] = "sessions/one";

// The points of a session, and the calls that came for it.
struct Uploads {
  std::vector<double> points;
  int breaks_left = 0;  // after so many messages
  uint64_t lost = 0;    // points that it does not admit
  int busy_left = 0;    // calls that find another upload under way
  int calls = 0;
  int checks = 0;       // of the points there
  uint64_t resent = 0;  // numbers that came although they were there
  size_t largest_request = 0;
  std::vector<std::string> names = {};
  std::vector<uint64_t> expected_revisions = {};
};

// A session's points, as a server keeps them.
class FakeCloud {
 public:
  explicit FakeCloud(FakeServer& server, int dimension = 2, Uploads uploads = {})
      : dimension_(dimension), uploads_(std::move(uploads)) {
    server.sessions.get = [this](const v1::GetSessionRequest& request, v1::GetSessionResponse& response) {
      response.mutable_session()->set_name(request.name());
      response.mutable_session()->mutable_parameters()->set_dimension(dimension_);
      response.mutable_session()->set_committed_points(CommittedPoints());
      return grpc::Status::OK;
    };
    server.sessions.upload = [this](grpc::ServerContext&, auto& reader, v1::UploadPointsResponse& response) {
      Begin();
      v1::UploadPointsRequest request;
      for (bool first = true; reader.Read(&request); first = false) {
        if (grpc::Status status = Take(request, first); !status.ok()) {
          return status;
        }
      }
      std::lock_guard lock(mutex_);
      response.set_committed_points(uploads_.points.size() / dimension_ - uploads_.lost);
      response.set_revision(7);
      return grpc::Status::OK;
    };
  }

  Uploads uploads() const {
    std::lock_guard lock(mutex_);
    return uploads_;
  }
  void Lose(uint64_t points) {
    std::lock_guard lock(mutex_);
    uploads_.lost = points;
  }

 private:
  uint64_t CommittedPoints() const {
    std::lock_guard lock(mutex_);
    return uploads_.points.size() / dimension_;
  }
  void Begin() {
    std::lock_guard lock(mutex_);
    ++uploads_.calls;
  }
  grpc::Status Take(const v1::UploadPointsRequest& request, bool first) {
    std::lock_guard lock(mutex_);
    if (first) {
      uploads_.names.push_back(request.name());
      uploads_.expected_revisions.push_back(request.expected_revision());
      if (uploads_.calls > 1 && uploads_.busy_left > 0) {
        --uploads_.busy_left;
        return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "busy", "ERROR_REASON_SESSION_BUSY");
      }
      if (request.has_checked_crc32c()) {
        ++uploads_.checks;
        const size_t size = (request.point_offset() - request.checked_from()) * dimension_ * sizeof(double);
        if (request.checked_crc32c() != Crc32c(uploads_.points.data() + request.checked_from() * dimension_, size)) {
          return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "other points", "ERROR_REASON_UPLOAD_MISMATCH");
        }
      }
    }
    uploads_.largest_request = std::max(uploads_.largest_request, request.ByteSizeLong());
    const uint64_t committed = uploads_.points.size() / dimension_;
    if (request.point_offset() > committed) {
      return MakeError(grpc::StatusCode::OUT_OF_RANGE, "a gap", "ERROR_REASON_UPLOAD_GAP");
    }
    const auto& coordinates = request.points().coordinates();
    const uint64_t known = (committed - request.point_offset()) * dimension_;
    if (known < static_cast<uint64_t>(coordinates.size())) {
      uploads_.resent += known;
      uploads_.points.insert(uploads_.points.end(), coordinates.begin() + known, coordinates.end());
    }
    if (uploads_.breaks_left > 0 && !coordinates.empty()) {
      --uploads_.breaks_left;
      return Broken();
    }
    return grpc::Status::OK;
  }

  const int dimension_;
  mutable std::mutex mutex_;
  Uploads uploads_;  // guarded by mutex_
};

std::vector<double> Numbers(size_t count) {
  std::vector<double> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0.5);
  return numbers;
}

TEST(Upload, SendsAllPointsInSmallRequests) {
  FakeServer server;
  FakeCloud cloud(server);
  const std::vector<double> points = Numbers(2 * 200'001);
  SpanSource source(2, points);
  uint64_t told = 0;
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<Uploaded> uploaded = server.Client().UploadPoints(
      kSession, source, std::nullopt, [&told](uint64_t sent) { told = sent; }, call);
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  EXPECT_EQ(uploaded->committed_points, 200'001u);
  EXPECT_EQ(uploaded->revision, 7u);
  EXPECT_EQ(told, 200'001u);
  const Uploads uploads = cloud.uploads();
  EXPECT_EQ(uploads.points, points);
  EXPECT_LE(uploads.largest_request, 1u << 20);
  EXPECT_THAT(uploads.names, ElementsAre(kSession));
  EXPECT_THAT(uploads.expected_revisions, ElementsAre(3));
}

TEST(Upload, GoesOnAtTheCommittedPointsHoweverOftenItBreaks) {
  FakeServer server;
  FakeCloud cloud(server, 2,
                  {.points = {-1, -1},  // of an earlier upload
                   .breaks_left = 5});  // more than attempts in a row
  const std::vector<double> points = Numbers(2 * 500'000);
  SpanSource source(2, points);
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<Uploaded> uploaded = server.Client().UploadPoints(kSession, source, std::nullopt, nullptr, call);
  ASSERT_TRUE(uploaded.ok()) << uploaded.status();
  const Uploads uploads = cloud.uploads();
  EXPECT_EQ(uploads.calls, 6);
  EXPECT_EQ(uploads.resent, 0u);
  EXPECT_EQ(uploads.points[0], -1);
  EXPECT_EQ(std::vector<double>(uploads.points.begin() + 2, uploads.points.end()), points);
  EXPECT_THAT(uploads.expected_revisions, ElementsAre(3, 0, 0, 0, 0, 0));
}

TEST(Upload, ARepetitionWithTheSameOffsetSendsOnlyWhatIsMissing) {
  FakeServer server;
  FakeCloud cloud(server, 2, {.points = {0.5, 1.5, 2.5, 3.5}});
  const std::vector<double> points = Numbers(6);
  SpanSource source(2, points);
  ASSERT_TRUE(server.Client().UploadPoints(kSession, source, 0).ok());
  EXPECT_EQ(cloud.uploads().points, points);
  EXPECT_EQ(cloud.uploads().resent, 0u);
  ASSERT_TRUE(server.Client().UploadPoints(kSession, source, 0).ok());
  EXPECT_EQ(cloud.uploads().points, points);
}

TEST(Upload, WhatIsThereHasToBeOfTheSameSource) {
  FakeServer server;
  FakeCloud cloud(server, 2, {.points = {9, 9, 0.5, 1.5, 2.5, 3.5}});  // the first of another upload
  const std::vector<double> points = Numbers(6);
  SpanSource source(2, points);
  ASSERT_TRUE(server.Client().UploadPoints(kSession, source, 1).ok());
  EXPECT_EQ(cloud.uploads().checks, 1);
  const Uploads uploads = cloud.uploads();
  EXPECT_EQ(std::vector<double>(uploads.points.begin() + 2, uploads.points.end()), points);
  const std::vector<double> few = Numbers(4);
  SpanSource shorter(2, few);
  EXPECT_TRUE(server.Client().UploadPoints(kSession, shorter, 1).ok()) << "all is there, and more";

  std::vector<double> other = points;
  other[3] = 7;
  for (const size_t size : {other.size(), size_t{4}}) {
    SpanSource another(2, std::span(other).first(size));
    const absl::Status mismatch = server.Client().UploadPoints(kSession, another, 1).status();
    EXPECT_EQ(mismatch.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(ReasonOf(mismatch), "ERROR_REASON_UPLOAD_MISMATCH");
  }
  EXPECT_EQ(cloud.uploads().points.size(), 8u);
}

TEST(Upload, GoesOnWhenTheServerHasSeenThatTheLastAttemptBroke) {
  FakeServer server;
  FakeCloud cloud(server, 2, {.points = {}, .breaks_left = 1, .busy_left = 1});
  const std::vector<double> points = Numbers(2 * 200'000);
  SpanSource source(2, points);
  ASSERT_TRUE(server.Client().UploadPoints(kSession, source).ok());
  EXPECT_EQ(cloud.uploads().points, points);
  EXPECT_EQ(cloud.uploads().calls, 3);
  EXPECT_EQ(cloud.uploads().checks, 1);
}

TEST(Upload, BesideAnotherUploadIsRefusedAtOnce) {
  FakeServer server;
  std::atomic<int> calls = 0;
  FakeCloud cloud(server);
  server.sessions.upload = [&calls](grpc::ServerContext&, auto&, auto&) {
    ++calls;
    return MakeError(grpc::StatusCode::FAILED_PRECONDITION, "busy", "ERROR_REASON_SESSION_BUSY");
  };
  const std::vector<double> points = Numbers(6);
  SpanSource source(2, points);
  EXPECT_EQ(ReasonOf(server.Client().UploadPoints(kSession, source).status()), "ERROR_REASON_SESSION_BUSY");
  EXPECT_EQ(calls, 1);
}

TEST(Upload, ErrorsOfTheServerAndOfTheSource) {
  FakeServer server;
  FakeCloud cloud(server);
  const std::vector<double> points = Numbers(6);
  SpanSource source(2, points);
  const absl::Status gap = server.Client().UploadPoints(kSession, source, 5).status();
  EXPECT_EQ(gap.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(ReasonOf(gap), "ERROR_REASON_UPLOAD_GAP");

  SpanSource solid(3, points);
  const absl::Status dimension = server.Client().UploadPoints(kSession, solid).status();
  EXPECT_EQ(dimension.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(dimension.message()), HasSubstr("the points are 3-D; expected 2-D"));

  class Unreadable final : public PointSource {
    int dimension() const override { return 2; }
    absl::Status Seek(uint64_t) override { return absl::OkStatus(); }
    absl::StatusOr<uint64_t> Read(std::span<double>) override { return absl::UnavailableError("disk"); }
  } unreadable;
  EXPECT_EQ(server.Client().UploadPoints(kSession, unreadable).status(), absl::UnavailableError("disk"));
  EXPECT_LE(cloud.uploads().calls, 2);  // not tried again; one that breaks off at once may not have begun

  cloud.Lose(1);
  EXPECT_EQ(server.Client().UploadPoints(kSession, source).status().code(), absl::StatusCode::kDataLoss);
}

TEST(Upload, GivesUpAfterAttemptsWithoutProgress) {
  FakeServer server;
  FakeCloud cloud(server);
  std::atomic<int> calls = 0;
  server.sessions.upload = [&calls](grpc::ServerContext&, auto&, auto&) {
    ++calls;
    return Broken();
  };
  const std::vector<double> points = Numbers(6);
  SpanSource source(2, points);
  EXPECT_EQ(server.Client().UploadPoints(kSession, source).status(), absl::UnavailableError("Socket closed"));
  EXPECT_EQ(calls, QuickRetries().max_first_attempts);
}

// A session's mesh of one simplex per chunk, as a server keeps it.
class FakeMesh {
 public:
  explicit FakeMesh(FakeServer& server) : server_(server) {
    metadata.set_dimension(2);
    for (int axis = 0; axis < 2; ++axis) {
      metadata.mutable_domain()->add_low(0);
      metadata.mutable_domain()->add_high(1);
    }
    metadata.set_vertex_count(4);
    metadata.set_simplex_count(2);
    metadata.set_input_point_count(1);
    metadata.set_chunk_count(4);
    metadata.set_revision(5);
    chunks.resize(4);
    chunks[0].mutable_points()->Add(kPoints.begin(), kPoints.end());
    chunks[0].set_crc32c(Crc32c(kPoints.data(), sizeof(double) * kPoints.size()));
    for (int i = 0; i < 2; ++i) {
      chunks[1 + i].mutable_simplices()->Add(kSimplices.begin() + 3 * i, kSimplices.begin() + 3 * i + 3);
      chunks[1 + i].set_crc32c(Crc32c(kSimplices.data() + 3 * i, 3 * sizeof(uint32_t)));
    }
    chunks[3].add_input_vertices(0);
    const uint32_t zero = 0;
    chunks[3].set_crc32c(Crc32c(&zero, sizeof(zero)));
    for (int i = 0; i < 4; ++i) {
      chunks[i].set_index(i);
    }
    server.sessions.download = [this](grpc::ServerContext&, const v1::DownloadMeshRequest& request, auto& writer) {
      requests.push_back(request);
      v1::DownloadMeshResponse response;
      *response.mutable_metadata() = metadata;
      writer.Write(response);
      for (uint64_t i = request.next_chunk(); i < chunks.size(); ++i) {
        if (i >= breaks_before) {
          breaks_before = i + 1;
          return end;
        }
        *response.mutable_chunk() = chunks[i];
        writer.Write(response);
      }
      if (breaks_before == chunks.size()) {
        return end;
      }
      return grpc::Status::OK;
    };
  }
  // The client may be done with a call that is still being answered.
  ~FakeMesh() { server_.Shutdown(); }
  FakeMesh(const FakeMesh&) = delete;
  FakeMesh& operator=(const FakeMesh&) = delete;

  static inline const std::vector<double> kPoints = {0, 0, 1, 0, 0, 1, 1, 1};
  static inline const std::vector<uint32_t> kSimplices = {0, 1, 2, 1, 3, 2};
  v1::MeshMetadata metadata;
  std::vector<v1::MeshChunk> chunks;
  uint64_t breaks_before = UINT64_MAX;  // this chunk, then every further one
  grpc::Status end = Broken();
  std::vector<v1::DownloadMeshRequest> requests;

 private:
  FakeServer& server_;
};

// The mesh as the only part of itself, in whose middle the connection breaks.
TEST(Download, OfAPartAsksForItAndGoesOn) {
  FakeServer server;
  FakeMesh mesh(server);
  mesh.metadata.set_input_point_count(0);
  v1::MeshPartInfo& info = *mesh.metadata.mutable_part();
  info.set_parts(1);
  info.set_own_vertex_count(4);
  info.set_own_simplex_count(2);
  info.set_whole_vertex_count(4);
  info.set_whole_simplex_count(2);
  mesh.metadata.set_chunk_count(8);
  mesh.metadata.set_revision(5);
  mesh.chunks.resize(8);
  mesh.chunks[3].clear_input_vertices();
  const std::vector<uint32_t> numbers = {0, 1, 2, 3};
  const std::vector<uint32_t> owners = {0, 0, 0, 0};
  const auto fill = [&mesh](int chunk, google::protobuf::RepeatedField<uint32_t>& field, std::vector<uint32_t> values,
                            int count) {
    field.Assign(values.begin(), values.begin() + count);
    mesh.chunks[chunk].set_crc32c(Crc32c(values.data(), count * sizeof(uint32_t)));
    mesh.chunks[chunk].set_index(chunk);
  };
  fill(3, *mesh.chunks[3].mutable_vertex_ids(), numbers, 4);
  fill(4, *mesh.chunks[4].mutable_vertex_owners(), owners, 4);
  fill(5, *mesh.chunks[5].mutable_vertex_rows(), numbers, 4);
  fill(6, *mesh.chunks[6].mutable_simplex_ids(), numbers, 2);
  fill(7, *mesh.chunks[7].mutable_simplex_owners(), owners, 2);
  mesh.breaks_before = 5;
  MeshCollector sink;
  const absl::Status status =
      server.Client().DownloadPart(kSession, {.parts = 1, .part = 0, .ghost_layers = 3, .contiguous = true}, sink);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(sink.mesh().part->vertex_ids, numbers);
  EXPECT_THAT(sink.mesh().part->simplex_owners, ElementsAre(0, 0));
  ASSERT_GE(mesh.requests.size(), 2u);
  for (const v1::DownloadMeshRequest& request : mesh.requests) {
    EXPECT_EQ(request.partition().parts(), 1u);
    EXPECT_EQ(request.partition().ghost_layers(), 3u);
    EXPECT_TRUE(request.partition().contiguous() && request.with_boundary());
  }
  EXPECT_FALSE(mesh.requests[0].has_revision());
  EXPECT_EQ(mesh.requests[1].revision(), 5u);
  EXPECT_EQ(mesh.requests[1].next_chunk(), 5u);
}

TEST(Download, ReturnsTheMesh) {
  FakeServer server;
  FakeMesh mesh(server);
  MeshCollector sink;
  std::vector<uint64_t> done;
  const absl::Status status = server.Client().DownloadMesh(kSession, sink, 5, [&done](uint64_t chunks, uint64_t total) {
    done.push_back(chunks);
    EXPECT_EQ(total, 4u);
  });
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(sink.mesh().points, FakeMesh::kPoints);
  EXPECT_EQ(sink.mesh().simplices, FakeMesh::kSimplices);
  EXPECT_THAT(done, ElementsAre(0, 1, 2, 3, 4));
  ASSERT_EQ(mesh.requests.size(), 1u);
  EXPECT_EQ(mesh.requests[0].name(), kSession);
  EXPECT_EQ(mesh.requests[0].revision(), 5u);
}

TEST(Download, GoesOnAtTheNextChunkOfTheSameRevision) {
  // The third is a status that a server sends ahead of a message that is not read: it has no details. The last is
  // gRPC's own, where a proxy breaks off.
  for (const grpc::Status& end :
       {Broken(), MakeError(grpc::StatusCode::DEADLINE_EXCEEDED, "the reader stalled", "ERROR_REASON_READER_STALLED"),
        grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "READER_STALLED: the client has not taken a message"),
        grpc::Status(grpc::StatusCode::UNKNOWN, "Stream removed")}) {
    FakeServer server;
    FakeMesh mesh(server);
    mesh.breaks_before = 0;
    mesh.end = end;
    MeshCollector sink;
    const absl::Status status = server.Client().DownloadMesh(kSession, sink);
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_EQ(sink.mesh().points, FakeMesh::kPoints);
    EXPECT_EQ(sink.mesh().simplices, FakeMesh::kSimplices);
    EXPECT_EQ(sink.mesh().input_vertex, std::vector<uint32_t>{0});
    // Broken before chunks 0 to 3, and once more after the last, which costs no further call.
    ASSERT_EQ(mesh.requests.size(), 5u);
    EXPECT_EQ(mesh.requests[0].revision(), 0u);
    for (size_t i = 1; i < 5; ++i) {
      EXPECT_EQ(mesh.requests[i].revision(), 5u);
      EXPECT_EQ(mesh.requests[i].next_chunk(), i - 1);
    }
  }
}

TEST(Download, AMeshThatHasChangedMeanwhileIsAnError) {
  FakeServer server;
  FakeMesh mesh(server);
  mesh.breaks_before = 2;
  const auto download = server.sessions.download;
  server.sessions.download = [&](grpc::ServerContext& context, const v1::DownloadMeshRequest& request, auto& writer) {
    return mesh.requests.empty()
               ? download(context, request, writer)
               : MakeError(grpc::StatusCode::FAILED_PRECONDITION, "at revision 9", "ERROR_REASON_REVISION_MISMATCH");
  };
  MeshCollector sink;
  const absl::Status status = server.Client().DownloadMesh(kSession, sink);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(status), "ERROR_REASON_REVISION_MISMATCH");
}

TEST(Download, ASinkThatFailsEndsIt) {
  FakeServer server;
  FakeMesh mesh(server);
  class FullDisk final : public MeshSink {
    absl::Status Begin(const MeshHeader&) override { return absl::OkStatus(); }
    absl::Status AddPoints(std::span<const double>) override { return absl::OkStatus(); }
    absl::Status AddWeights(std::span<const double>) override { return absl::OkStatus(); }
    absl::Status AddSimplices(std::span<const uint32_t>) override { return absl::UnavailableError("disk full"); }
    absl::Status AddInputVertices(std::span<const uint32_t>) override { return absl::OkStatus(); }
    absl::Status Finish() override { return absl::OkStatus(); }
  } sink;
  EXPECT_EQ(server.Client().DownloadMesh(kSession, sink), absl::UnavailableError("disk full"));
  EXPECT_EQ(mesh.requests.size(), 1u);
}

TEST(Download, DamageIsDataLoss) {
  FakeServer server;
  FakeMesh mesh(server);
  mesh.chunks[1].set_simplices(0, 3);
  MeshCollector sink;
  EXPECT_EQ(server.Client().DownloadMesh(kSession, sink).code(), absl::StatusCode::kDataLoss);
}

TEST(Download, StopsWhenItIsAskedTo) {
  FakeServer server;
  FakeMesh mesh(server);
  server.sessions.download = [](grpc::ServerContext& context, const auto&, auto& writer) {
    v1::DownloadMeshResponse response;
    while (!context.IsCancelled()) {
      writer.Write(response);
    }
    return grpc::Status::CANCELLED;
  };
  std::stop_source stop;
  MeshCollector sink;
  const absl::Status status = server.Client().DownloadMesh(
      kSession, sink, 0, [&stop](uint64_t, uint64_t) { stop.request_stop(); },
      {.timeout = absl::InfiniteDuration(), .stop = stop.get_token(), .request_id = "", .expected_revision = 0});
  EXPECT_EQ(status, absl::CancelledError("cancelled by the caller"));
}

}  // namespace
}  // namespace wellspace::client
