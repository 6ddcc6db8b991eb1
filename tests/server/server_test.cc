// The services of a server besides MeshPoints, and its addresses.
#include "server/server.h"

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/connection.h"
#include "gmock/gmock.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/message.h"
#include "google/protobuf/text_format.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "server/embedded_server.h"
#include "spdlog/sinks/null_sink.h"
#include "tests/server/raw_call.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::shared_ptr<spdlog::logger> NoLog() {
  return std::make_shared<spdlog::logger>("none", std::make_shared<spdlog::sinks::null_sink_mt>());
}

RawAnswer CheckHealth(const std::shared_ptr<grpc::Channel>& channel, const std::string& service) {
  return CallUnary(channel, "/grpc.health.v1.Health/Check", HealthRequest(service));
}

TEST(Server, HealthSaysServing) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  EXPECT_EQ(CheckHealth(harness.channel(), "").response, kServing);
  EXPECT_EQ(CheckHealth(harness.channel(), "wellspace.v1.MeshingService").response, kServing);
  EXPECT_EQ(CheckHealth(harness.channel(), "unknown").status.error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST(Server, HealthSaysNotServingWhileStopping) {
  Event started;
  Event go_on;
  ServiceHarness harness(
      [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext&) {
        started.Set();
        EXPECT_TRUE(go_on.Wait());
        return MakeFakeMesh(parameters, input.points);
      },
      {}, Transport::kLoopback);
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  std::thread stopper([&harness] { harness.server().Shutdown(absl::Minutes(5)); });
  RawAnswer health;
  do {
    health = CheckHealth(harness.channel(), "wellspace.v1.MeshingService");
  } while (health.status.ok() && health.response == kServing);
  EXPECT_EQ(health.response, kNotServing);
  go_on.Set();
  EXPECT_TRUE(call.Finish().ok());
  stopper.join();
}

// Watches the health of a service.
class WatchHealth final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  WatchHealth(const std::shared_ptr<grpc::Channel>& channel, const std::string& service)
      : stub_(channel), request_(BufferOf(HealthRequest(service))) {
    stub_.PrepareBidiStreamingCall(&context_, "/grpc.health.v1.Health/Watch", grpc::StubOptions(), this);
    StartWriteLast(&request_, grpc::WriteOptions());
    StartRead(&response_);
    StartCall();
  }

  // Waits until the service was said to be serving, and until it was said not to be.
  bool WaitForServing() { return serving_.Wait(); }
  bool WaitForNotServing() { return not_serving_.Wait(); }
  grpc::Status Finish() {
    EXPECT_TRUE(done_.Wait());
    return status_;
  }

  void OnReadDone(bool ok) override {
    if (ok) {
      const std::string health = BytesOf(response_);
      (health == kServing ? serving_ : not_serving_).Set();
      response_.Clear();
      StartRead(&response_);
    }
  }

  void OnDone(const grpc::Status& status) override {
    status_ = status;
    done_.Set();
  }

 private:
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  const grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  grpc::Status status_;
  Event serving_;
  Event not_serving_;
  Event done_;
};

TEST(Server, WatchersOfHealthAreToldThatItStops) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  WatchHealth all(harness.channel(), "");
  WatchHealth one(harness.channel(), "wellspace.v1.MeshingService");
  ASSERT_TRUE(all.WaitForServing());
  ASSERT_TRUE(one.WaitForServing());
  harness.server().Shutdown(absl::ZeroDuration());
  EXPECT_TRUE(all.WaitForNotServing());
  EXPECT_TRUE(one.WaitForNotServing());
  EXPECT_FALSE(all.Finish().ok());
  EXPECT_FALSE(one.Finish().ok());
}

// Asks for all services by reflection. Its messages are not packaged either, but the server's library has them compiled
// in.
class ListServices final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  explicit ListServices(const std::shared_ptr<grpc::Channel>& channel) : stub_(channel) {
    std::unique_ptr<google::protobuf::Message> request = NewMessage("ServerReflectionRequest");
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString("list_services: '*'", request.get()));
    request_ = BufferOf(request->SerializeAsString());
    stub_.PrepareBidiStreamingCall(&context_, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                   grpc::StubOptions(), this);
    StartWrite(&request_);
    StartRead(&response_);
    StartCall();
  }

  // The answer as text.
  std::string Wait() {
    EXPECT_TRUE(done_.Wait());
    EXPECT_TRUE(status_.ok()) << status_.error_message();
    std::unique_ptr<google::protobuf::Message> response = NewMessage("ServerReflectionResponse");
    EXPECT_TRUE(response->ParseFromString(BytesOf(response_)));
    return response->DebugString();
  }

  void OnReadDone(bool ok) override {
    EXPECT_TRUE(ok);
    StartWritesDone();
  }

  void OnDone(const grpc::Status& status) override {
    status_ = status;
    done_.Set();
  }

 private:
  static std::unique_ptr<google::protobuf::Message> NewMessage(const std::string& name) {
    const google::protobuf::Descriptor* descriptor =
        google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName("grpc.reflection.v1alpha." + name);
    return std::unique_ptr<google::protobuf::Message>(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(descriptor)->New());
  }

  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  grpc::Status status_;
  Event done_;
};

TEST(Server, ReflectionListsTheServices) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  ListServices list(harness.channel());
  const std::string services = list.Wait();
  EXPECT_THAT(services, HasSubstr("\"wellspace.v1.MeshingService\""));
  EXPECT_THAT(services, HasSubstr("\"grpc.reflection.v1alpha.ServerReflection\""));
}

TEST(Server, InfoTellsLimitsAndLoad) {
  Event started;
  ServiceOptions options;
  options.workers = 1;
  options.max_queued_jobs = 3;
  options.max_points = 123;
  options.max_vertices = 456;
  ServiceHarness harness(EndlessMesher(started), options);
  v1::GetServerInfoResponse info = harness.Info();
  EXPECT_EQ(info.version(), WELLSPACE_VERSION);
  EXPECT_THAT(info.dimensions(), ElementsAre(2, 3, 4, 5, 6));
  EXPECT_EQ(info.max_points(), 123u);
  EXPECT_EQ(info.max_vertices(), 456u);
  EXPECT_EQ(info.max_request_bytes(), 4u << 20);
  EXPECT_EQ(info.workers(), 1);
  EXPECT_EQ(info.max_queued_jobs(), 3);
  EXPECT_EQ(info.running_jobs(), 0);
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  info = harness.Info();
  EXPECT_EQ(info.running_jobs(), 1);
  EXPECT_EQ(info.queued_jobs(), 0);
}

absl::Status StartOn(const std::string& listen, bool insecure_remote = false) {
  ServerOptions options;
  options.listen = listen;
  options.security.insecure_remote = insecure_remote;
  return Server::Start(options, NoLog()).status();
}

TEST(Server, ListensOnLoopbackAndSaysWhere) {
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  const absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(options, NoLog());
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_THAT((*server)->address(), ::testing::MatchesRegex("127\\.0\\.0\\.1:[1-9][0-9]*"));
  // No other server gets the same port.
  EXPECT_EQ(StartOn((*server)->address()).code(), absl::StatusCode::kUnavailable);
}

TEST(Server, RefusesARemoteListenerUnlessInsecureIsAskedFor) {
  for (const char* listen : {"0.0.0.0:0", "[::]:0", "example.org:0"}) {
    const absl::Status status = StartOn(listen);
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << listen;
    EXPECT_THAT(std::string(status.message()), HasSubstr("--insecure-remote"));
  }
  EXPECT_TRUE(StartOn("0.0.0.0:0", true).ok());
}

TEST(Server, RefusesWhatIsNoAddress) { EXPECT_EQ(StartOn("nonsense").code(), absl::StatusCode::kInvalidArgument); }

TEST(Server, ShutdownTwiceDoesNoHarm) {
  ServiceHarness harness;
  harness.server().Shutdown(absl::ZeroDuration());
  harness.server().Shutdown(absl::Minutes(1));
}

TEST(EmbeddedServer, MeshesForTheClientLibrary) {
  EmbeddedServer server(1);
  client::Client client(client::MakeConnection(server.Channel()));
  client::MeshOptions options;
  options.dimension = 2;
  const std::vector<double> points = {0.25, 0.25, 0.75, 0.25, 0.5, 0.75};
  const absl::StatusOr<client::Mesh> mesh = client.MeshPoints(options, points);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(std::equal(points.begin(), points.end(), mesh->points.begin()));
  EXPECT_EQ(mesh->statistics.input_points, 3u);
}

TEST(EmbeddedServer, ManyOneAfterTheOther) {
  for (int i = 0; i < 20; ++i) {
    EmbeddedServer server(2);
    client::Client client(client::MakeConnection(server.Channel()));
    EXPECT_EQ(client.GetServerInfo()->workers, 2);
  }
}

}  // namespace
}  // namespace wellspace::server
