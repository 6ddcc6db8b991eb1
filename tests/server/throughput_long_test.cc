// The overhead of the service: over gRPC alone, to carry bytes; over the core alone, to make a mesh. Ratios of one run,
// never seconds.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "grpcpp/generic/async_generic_service.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "tests/server/scripted_mesher.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

absl::Duration TimeOf(const std::function<void()>& work) {
  const absl::Time begin = absl::Now();
  work();
  return absl::Now() - begin;
}

// The quotient of the shortest times of two pieces of work that are done in turn, `rounds` times each.
double Ratio(int rounds, const std::function<void()>& one, const std::function<void()>& other) {
  absl::Duration best_one = absl::InfiniteDuration();
  absl::Duration best_other = absl::InfiniteDuration();
  for (int i = 0; i < rounds; ++i) {
    best_one = std::min(best_one, TimeOf(one));
    best_other = std::min(best_other, TimeOf(other));
  }
  std::printf("best of %d: %.3f s and %.3f s\n", rounds, absl::ToDoubleSeconds(best_one),
              absl::ToDoubleSeconds(best_other));
  return absl::FDivDuration(best_one, best_other);
}

// A server that answers every call with the same bytes again and again, and does nothing else.
class BareServer {
 public:
  BareServer(uint64_t message_bytes, uint64_t message_count)
      : service_(std::string(message_bytes, 'x'), message_count) {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterCallbackGenericService(&service_);
    server_ = builder.BuildAndStart();
    channel_ = grpc::CreateChannel("127.0.0.1:" + std::to_string(port), grpc::InsecureChannelCredentials());
  }

  std::shared_ptr<grpc::Channel> channel() { return channel_; }

 private:
  class Reactor final : public grpc::ServerGenericBidiReactor {
   public:
    Reactor(const grpc::ByteBuffer& message, uint64_t count) : message_(message), left_(count) { WriteNext(); }

    void OnWriteDone(bool ok) override {
      if (ok) {
        WriteNext();
      } else {
        Finish(grpc::Status::CANCELLED);
      }
    }
    void OnDone() override { delete this; }

   private:
    void WriteNext() {
      if (left_-- > 0) {
        StartWrite(&message_);
      } else {
        Finish(grpc::Status::OK);
      }
    }

    const grpc::ByteBuffer message_;
    uint64_t left_;
  };

  class Service final : public grpc::CallbackGenericService {
   public:
    Service(const std::string& message, uint64_t count) : count_(count) {
      const grpc::Slice slice(message);
      message_ = grpc::ByteBuffer(&slice, 1);
    }

    grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
      return new Reactor(message_, count_);
    }

   private:
    grpc::ByteBuffer message_;
    const uint64_t count_;
  };

  Service service_;
  std::unique_ptr<grpc::Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

// Reads a stream of bytes and does nothing with them; their number.
uint64_t ReadBytes(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, "/bare/Read", &queue);
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  stream->StartCall(nullptr);
  EXPECT_TRUE(done());
  stream->WritesDone(nullptr);
  EXPECT_TRUE(done());
  uint64_t bytes = 0;
  grpc::ByteBuffer message;
  stream->Read(&message, nullptr);
  while (done()) {
    bytes += message.Length();
    stream->Read(&message, nullptr);
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  EXPECT_TRUE(done() && status.ok()) << status.error_message();
  return bytes;
}

// Reads a mesh, every chunk a message whose checksum is checked; the bytes of its arrays.
uint64_t ReadMesh(SessionClient& client) {
  grpc::ClientContext context;
  v1::DownloadMeshRequest request;
  request.set_name(client.name());
  const auto stream = client.calls().sessions().DownloadMesh(&context, request);
  uint64_t bytes = 0;
  v1::DownloadMeshResponse response;
  while (stream->Read(&response)) {
    const v1::MeshChunk& chunk = response.chunk();
    const auto check = [&](const auto& values) {
      const uint64_t size = values.size() * sizeof(values[0]);
      EXPECT_TRUE(size == 0 || Crc32c(values.data(), size) == chunk.crc32c());
      bytes += size;
    };
    check(chunk.points());
    check(chunk.simplices());
    check(chunk.input_vertices());
  }
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return bytes;
}

TEST(Throughput, OfADownloadIsAtLeastSixtyPercentOfABareStream) {
  const core::Mesh mesh = MakeLargeMesh(10'000'000);
  const uint64_t mesh_bytes = mesh.points.size() * sizeof(double) + mesh.simplices.size() * sizeof(uint32_t);
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback, FakeEstimator, FixedMesher(mesh));
  SessionClient client(harness.channel());
  client.Refine();
  BareServer bare(kMaxResponseBytes, mesh_bytes / kMaxResponseBytes);
  const double ratio = Ratio(
      40, [&] { EXPECT_NEAR(ReadBytes(bare.channel()), mesh_bytes, kMaxResponseBytes); },
      [&] { EXPECT_EQ(ReadMesh(client), mesh_bytes); });
  std::printf("DownloadMesh has %.0f %% of the throughput of a bare stream\n", 100 * ratio);
  EXPECT_GE(ratio, 0.6);
}

// The core alone, and the same cloud through a session: uploaded, refined, downloaded. In 2-D, where a mesh of that
// size takes the core least time.
TEST(Throughput, OfARemoteMeshIsThatOfTheCoreButFifteenPercent) {
  constexpr uint64_t kVertices = 1'000'000;
  const std::vector<double> points = UniformPoints(50'000, 2, 8);
  core::MeshParameters parameters;
  parameters.dimension = 2;
  parameters.domain_low = {0, 0};
  parameters.domain_high = {1, 1};
  parameters.max_circumradius = 0.0008;
  v1::MeshParameters message = UnitCubeParameters(2);
  message.set_max_circumradius(parameters.max_circumradius);
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  const double ratio = Ratio(
      5,
      [&] {
        SessionClient client(harness.channel(), message);
        client.Upload(points);
        client.Refine();
        EXPECT_GE(client.Get().vertex_count(), kVertices);
        ReadMesh(client);
      },
      [&] {
        core::RunContext context;
        const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, points, context);
        ASSERT_TRUE(mesh.ok()) << mesh.status();
        EXPECT_GE(mesh->vertex_count(), kVertices);
      });
  std::printf("a remote mesh takes %.1f %% more time than the core alone\n", 100 * (ratio - 1));
  EXPECT_LE(ratio, 1.15);
}

}  // namespace
}  // namespace wellspace::server
