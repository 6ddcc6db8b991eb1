// The observability of a server: the line of each call, metrics, channelz.
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <regex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "gmock/gmock.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "prometheus/text_serializer.h"
#include "server/server.h"
#include "server/store/memory_files.h"
#include "server/store/memory_records.h"
#include "tests/server/http_get.h"
#include "tests/server/raw_call.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kSecret[] = "swordfish";

// All metrics, in the format of Prometheus.
std::string Scrape(ServiceHarness& harness) {
  std::string text;
  for (const auto& collectable : harness.server().observability().metrics().Collectables()) {
    text += prometheus::TextSerializer().Serialize(collectable->Collect());
  }
  return text;
}

// The value of a series; -1 if there is none.
double ValueOf(const std::string& metrics, const std::string& series) {
  const std::string start = absl::StrCat("\n", series, " ");
  const size_t found = absl::StrCat("\n", metrics).find(start);
  return found == std::string::npos ? -1 : std::stod(metrics.substr(found + start.size() - 1));
}

std::string Labels(const std::string& type, const std::string& service, const std::string& method,
                   const std::string& code = "") {
  return absl::StrCat("{", code.empty() ? "" : absl::StrCat("grpc_code=\"", code, "\","), "grpc_method=\"", method,
                      "\",grpc_service=\"", service, "\",grpc_type=\"", type, "\"}");
}

std::string MeshPointsLabels(const std::string& code = "") {
  return Labels("bidi_stream", "wellspace.v1.MeshingService", "MeshPoints", code);
}

TEST(CallMetrics, CountACallWithItsMessagesAndItsTime) {
  ServiceHarness harness;
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.Send(std::vector<double>(3 * 5));
  call.Send(std::vector<double>(3 * 2));
  call.HalfClose();
  ASSERT_TRUE(call.Finish().ok());
  const std::string metrics = Scrape(harness);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_started_total" + MeshPointsLabels()), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + MeshPointsLabels("OK")), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_msg_received_total" + MeshPointsLabels()), 3);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_msg_sent_total" + MeshPointsLabels()),
            static_cast<double>(call.events.size() + call.metadata.size() + call.chunks.size()));
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handling_seconds_count" + MeshPointsLabels()), 1);
  EXPECT_EQ(ValueOf(metrics, "wellspace_points_received_total"), 7);
  EXPECT_EQ(ValueOf(metrics, "wellspace_vertices_made_total"), 7 + 8);
}

TEST(CallMetrics, CountErrorsByCodeAndCallsOfAllServices) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  TestCall call(harness.stub());
  call.HalfClose();
  ASSERT_EQ(call.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  harness.Info();
  ASSERT_EQ(CallUnary(harness.channel(), "/grpc.health.v1.Health/Check", HealthRequest("")).response, kServing);
  ASSERT_FALSE(CallUnary(harness.channel(), "/grpc.health.v1.Health/Check", HealthRequest("unheard")).status.ok());
  const std::string metrics = Scrape(harness);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + MeshPointsLabels("InvalidArgument")), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + MeshPointsLabels("OK")), 0);
  const std::string service = "wellspace.v1.MeshingService";
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + Labels("unary", service, "GetServerInfo", "OK")), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_msg_received_total" + Labels("unary", service, "GetServerInfo")), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_msg_sent_total" + Labels("unary", service, "GetServerInfo")), 1);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_started_total" + Labels("client_stream", service, "EstimateMesh")), 0);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + Labels("unary", "grpc.health.v1.Health", "Check", "OK")), 1);
  EXPECT_EQ(
      ValueOf(metrics, "grpc_server_handled_total" + Labels("unary", "grpc.health.v1.Health", "Check", "NotFound")), 1);
}

TEST(CallMetrics, ACancelledCallIsHandled) {
  Event started;
  ServiceHarness harness(EndlessMesher(started));
  TestCall call(harness.stub());
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  std::string metrics = Scrape(harness);
  EXPECT_EQ(ValueOf(metrics, "wellspace_jobs_running"), 1);
  EXPECT_EQ(ValueOf(metrics, "wellspace_calls_in_flight"), 1);
  call.Cancel();
  ASSERT_TRUE(harness.log().WaitFor("code=CANCELLED"));
  harness.TimeUntilIdle();
  metrics = Scrape(harness);
  EXPECT_EQ(ValueOf(metrics, "grpc_server_handled_total" + MeshPointsLabels("Canceled")), 1);
  EXPECT_EQ(ValueOf(metrics, "wellspace_jobs_running"), 0);
}

// A probe that watches and is stopped: no fault of the server, for whom an alert would ring.
TEST(CallMetrics, ACancelledWatchOfHealthIsNoFault) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  {
    grpc::GenericStub stub(harness.channel());
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    void* tag = nullptr;
    bool ok = false;
    const auto call = stub.PrepareCall(&context, "/grpc.health.v1.Health/Watch", &queue);
    call->StartCall(nullptr);
    ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
    call->WriteLast(BufferOf(HealthRequest("")), grpc::WriteOptions(), nullptr);
    ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
    grpc::ByteBuffer response;
    call->Read(&response, nullptr);
    ASSERT_TRUE(queue.Next(&tag, &ok) && ok);
    context.TryCancel();
    grpc::Status status;
    call->Finish(&status, nullptr);
    ASSERT_TRUE(queue.Next(&tag, &ok));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(harness.log().WaitFor("service=grpc.health.v1.Health method=Watch code=CANCELLED"));
  const std::string metrics = Scrape(harness);
  const auto handled = [&metrics](const std::string& code) {
    return ValueOf(metrics,
                   "grpc_server_handled_total" + Labels("server_stream", "grpc.health.v1.Health", "Watch", code));
  };
  EXPECT_EQ(handled("Canceled"), 1);
  EXPECT_EQ(handled("Unknown"), 0);
}

TEST(CallMetrics, WhatClientsSendMakesNoSeries) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  const auto count = [](const std::string& metrics) { return std::count(metrics.begin(), metrics.end(), '\n'); };
  const auto lines = count(Scrape(harness));
  for (const char* path : {"/wellspace.v1.MeshingService/Nonsense", "/no.Service/Nonsense", "/Nonsense"}) {
    EXPECT_EQ(CallUnary(harness.channel(), path, "").status.error_code(), grpc::StatusCode::UNIMPLEMENTED) << path;
  }
  const std::string metrics = Scrape(harness);
  EXPECT_EQ(
      ValueOf(metrics, "grpc_server_handled_total" + Labels("bidi_stream", "unknown", "unknown", "Unimplemented")), 3);
  EXPECT_EQ(count(metrics), lines);
  EXPECT_THAT(metrics, Not(HasSubstr("Nonsense")));
  EXPECT_TRUE(harness.log().WaitFor("service=no.Service method=Nonsense"));
}

TEST(Metrics, TellOfSessionsAndWhatIsMadeInThem) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  {
    SessionCalls calls(harness.channel());
    const std::string name = calls.Create(2).name();
    calls.Create(2);
    calls.Upload(name, 0, UniformPoints(5, 2, /*seed=*/1));
    const v1::Operation operation = calls.Refine(name);
    const std::string metrics = Scrape(harness);
    EXPECT_EQ(ValueOf(metrics, "wellspace_sessions"), 2);
    EXPECT_EQ(ValueOf(metrics, "wellspace_points_received_total"), 5);
    EXPECT_EQ(ValueOf(metrics, "wellspace_vertices_made_total"), static_cast<double>(operation.progress().vertices()));
    EXPECT_GT(ValueOf(metrics, "wellspace_simplices_made_total"), 0);
    EXPECT_TRUE(
        harness.log().WaitFor(absl::StrCat("event=refinement operation=", operation.name(), " tenant=default")));
    EXPECT_TRUE(harness.log().WaitFor(absl::StrCat("session=", name, " points=5")));

    grpc::ClientContext context;
    v1::VoronoiCellsRequest request;
    request.set_name(name);
    v1::VoronoiCellsResponse response;
    const auto stream = v1::QueryService::NewStub(harness.channel())->VoronoiCells(&context, request);
    while (stream->Read(&response)) {
    }
    EXPECT_TRUE(stream->Finish().ok());
    EXPECT_EQ(ValueOf(Scrape(harness), "wellspace_cells_served_total"),
              static_cast<double>(operation.progress().vertices()));
    calls.Delete(name);
  }
  EXPECT_EQ(ValueOf(Scrape(harness), "wellspace_sessions"), 1);
}

TEST(Metrics, TellOfTheProcess) {
  ServiceHarness harness;
  const std::string metrics = Scrape(harness);
  EXPECT_GT(ValueOf(metrics, "process_resident_memory_bytes"), 1e6);
  EXPECT_GT(ValueOf(metrics, "process_cpu_seconds_total"), 0);
  EXPECT_GT(ValueOf(metrics, "process_open_fds"), 2);
  EXPECT_GE(ValueOf(metrics, "process_max_fds"), ValueOf(metrics, "process_open_fds"));
  const double now = absl::ToDoubleSeconds(absl::Now() - absl::UnixEpoch());
  EXPECT_LE(ValueOf(metrics, "process_start_time_seconds"), now + 1);
  EXPECT_GE(ValueOf(metrics, "process_start_time_seconds"), now - 86'400);
  EXPECT_EQ(ValueOf(metrics, absl::StrCat("wellspace_build_info{version=\"", WELLSPACE_VERSION, "\"}")), 1);
}

// GetServerInfo with metadata; the answer's request id.
std::string RequestIdOfInfo(ServiceHarness& harness, const std::vector<std::pair<std::string, std::string>>& metadata) {
  grpc::ClientContext context;
  for (const auto& [key, value] : metadata) {
    context.AddMetadata(key, value);
  }
  v1::GetServerInfoResponse response;
  EXPECT_TRUE(harness.stub().GetServerInfo(&context, v1::GetServerInfoRequest(), &response).ok());
  const auto trailing = context.GetServerTrailingMetadata().find("x-request-id");
  return trailing == context.GetServerTrailingMetadata().end()
             ? ""
             : std::string(trailing->second.data(), trailing->second.size());
}

TEST(CallLog, HasOneLineForEachCallWithAllThatIdentifiesIt) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  const std::string trace = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
  EXPECT_EQ(RequestIdOfInfo(harness, {{"x-request-id", "Solver_7.1-a"}, {"traceparent", trace}}), "Solver_7.1-a");
  EXPECT_TRUE(harness.log().WaitFor("event=call request_id=Solver_7.1-a tenant=default peer=ipv4:127.0.0.1:"));
  EXPECT_TRUE(harness.log().WaitFor("service=wellspace.v1.MeshingService method=GetServerInfo code=OK seconds=0.0"));
  EXPECT_TRUE(harness.log().WaitFor("traceparent=" + trace));
  EXPECT_EQ(harness.log().Count("event=call"), 1u);
  TestCall call(harness.stub());
  call.HalfClose();
  EXPECT_FALSE(call.Finish().ok());
  EXPECT_TRUE(harness.log().WaitFor("code=INVALID_ARGUMENT"));
  EXPECT_TRUE(harness.log().WaitFor("points=0 vertices=0 message=\""));
  EXPECT_EQ(harness.log().Count("event=call"), 2u);
}

TEST(CallLog, MakesRequestIdsWhereClientsSendNoneOrNonsense) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  const std::string first = RequestIdOfInfo(harness, {});
  const std::string second = RequestIdOfInfo(harness, {{"x-request-id", "a b=c"}});
  const std::string third = RequestIdOfInfo(harness, {{"x-request-id", std::string(65, 'a')}});
  const std::regex made("[0-9a-f]{8}-[0-9]+");
  for (const std::string& id : {first, second, third}) {
    EXPECT_TRUE(std::regex_match(id, made)) << id;
    EXPECT_TRUE(harness.log().WaitFor("request_id=" + id));
  }
  EXPECT_NE(first, second);
  EXPECT_NE(second, third);
}

TEST(CallLog, NeitherLogNorMetricsHaveSecretsOrOtherMetadata) {
  ServiceHarness harness(FakeMesher, {}, Transport::kLoopback);
  RequestIdOfInfo(harness, {{"authorization", absl::StrCat("Bearer ", kSecret)},
                            {"cookie", kSecret},
                            {"x-api-key", kSecret},
                            {"traceparent", kSecret}});
  ASSERT_TRUE(harness.log().WaitFor("method=GetServerInfo"));
  EXPECT_EQ(harness.log().Count(kSecret), 0u);
  EXPECT_THAT(Scrape(harness), Not(HasSubstr(kSecret)));
}

TEST(Channelz, IsServedOnTheAdminListenerOnly) {
  ServerOptions options;
  options.listen = "127.0.0.1:0";
  options.observability.admin_listen = "127.0.0.1:0";
  // The first server makes channelz known to gRPC; the second is built after that.
  std::vector<std::unique_ptr<Server>> servers;
  for (int i = 0; i < 2; ++i) {
    absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(options, std::make_shared<spdlog::logger>("none"));
    ASSERT_TRUE(server.ok()) << server.status();
    servers.push_back(*std::move(server));
  }
  for (const auto& server : servers) {
    const auto ask = [](const std::string& address) {
      return CallUnary(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()),
                       "/grpc.channelz.v1.Channelz/GetServers", "");
    };
    EXPECT_EQ(ask(server->address()).status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
    const RawAnswer answer = ask(server->observability().admin_address());
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    EXPECT_THAT(answer.response, HasSubstr("listener ipv4:127.0.0.1"));
  }
}

TEST(Channelz, IsRefusedWhereOtherMachinesCouldSeeIt) {
  ServerOptions options;
  options.observability.admin_listen = "0.0.0.0:0";
  const absl::Status status = Server::Start(options, std::make_shared<spdlog::logger>("none")).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("0.0.0.0:0"), HasSubstr("127.0.0.1")));
}

TEST(HttpListener, SaysWhyItCannotListen) {
  const auto start = [](const std::string& listen) {
    ServerOptions options;
    options.observability.metrics_listen = listen;
    return Server::Start(options, std::make_shared<spdlog::logger>("none"));
  };
  EXPECT_EQ(start("nonsense").status().code(), absl::StatusCode::kInvalidArgument);
  const absl::StatusOr<std::unique_ptr<Server>> first = start("localhost:0");
  ASSERT_TRUE(first.ok()) << first.status();
  const std::string address = (*first)->observability().metrics_address();
  const absl::Status taken = start(address).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(taken.message(), HasSubstr(address));
}

// A server whose metrics are served at address().
class MetricsEndpointTest : public ::testing::Test {
 protected:
  MetricsEndpointTest() {
    ServerOptions options;
    options.observability.metrics_listen = "127.0.0.1:0";
    server_ = *Server::Start(options, std::make_shared<spdlog::logger>("none"));
  }

  std::string address() const { return server_->observability().metrics_address(); }

 private:
  std::unique_ptr<Server> server_;
};

TEST_F(MetricsEndpointTest, ServesMetricsAndNothingElse) {
  const std::string response = HttpGet(address(), "/metrics");
  EXPECT_THAT(response, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(response, HasSubstr("\r\nContent-Type: text/plain; version=0.0.4"));
  EXPECT_THAT(response, HasSubstr("\nwellspace_calls_in_flight 0\n"));
  EXPECT_THAT(HttpGet(address(), "/"), StartsWith("HTTP/1.1 404 "));
}

TEST_F(MetricsEndpointTest, IsAliveAndReadyWhileItServes) {
  EXPECT_THAT(HttpGet(address(), "/livez"), AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), EndsWith("\r\n\r\nalive\n")));
  EXPECT_THAT(HttpGet(address(), "/readyz"), AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), EndsWith("\r\n\r\nready\n")));
}

// Records that come when the test says so.
class SlowRecords final : public MemoryRecords {
 public:
  SlowRecords(Event& asked, Event& go_on) : asked_(asked), go_on_(go_on) {}

  absl::StatusOr<StoredSessions> Load() override {
    asked_.Set();
    EXPECT_TRUE(go_on_.Wait());
    return MemoryRecords::Load();
  }

 private:
  Event& asked_;
  Event& go_on_;
};

// A port that was free a moment ago.
std::string FreeAddress() {
  ServerOptions options;
  options.observability.metrics_listen = "127.0.0.1:0";
  return (*Server::Start(options, std::make_shared<spdlog::logger>("none")))->observability().metrics_address();
}

TEST(Probes, AServerThatRestoresIsAliveAndNotReady) {
  ServerOptions options;
  options.observability.metrics_listen = FreeAddress();
  Event asked;
  Event go_on;
  absl::StatusOr<std::unique_ptr<Server>> server = absl::UnknownError("not started");
  std::thread starter([&] {
    server = Server::Start(
        options, std::make_shared<spdlog::logger>("none"),
        std::make_unique<SessionLog>(std::make_unique<SlowRecords>(asked, go_on), std::make_unique<MemoryFiles>()));
  });
  EXPECT_TRUE(asked.Wait());
  const std::string& address = options.observability.metrics_listen;
  EXPECT_THAT(HttpGet(address, "/livez"), StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(HttpGet(address, "/readyz"), AllOf(StartsWith("HTTP/1.1 503 "), HasSubstr("restoring sessions")));
  EXPECT_THAT(HttpGet(address, "/metrics"), HasSubstr("\nwellspace_sessions 0\n"));
  go_on.Set();
  starter.join();
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_THAT(HttpGet(address, "/readyz"), StartsWith("HTTP/1.1 200 OK\r\n"));
}

TEST(Probes, AServerThatStopsIsAliveAndNotReadyAtOnce) {
  Event started;
  Event go_on;
  ServerOptions options;
  options.observability.metrics_listen = "127.0.0.1:0";
  const absl::StatusOr<std::unique_ptr<Server>> server =
      Server::Start(options, std::make_shared<spdlog::logger>("none"), nullptr,
                    [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext&) {
                      started.Set();
                      EXPECT_TRUE(go_on.Wait());
                      return MakeFakeMesh(parameters, input.points);
                    });
  ASSERT_TRUE(server.ok()) << server.status();
  const absl::StatusOr<std::shared_ptr<grpc::Channel>> channel = (*server)->InProcessChannel();
  ASSERT_TRUE(channel.ok()) << channel.status();
  const std::unique_ptr<v1::MeshingService::Stub> stub = v1::MeshingService::NewStub(*channel);
  TestCall call(*stub);
  call.Send(UnitCubeParameters());
  call.HalfClose();
  ASSERT_TRUE(started.Wait());
  std::thread stopper([&server] { (*server)->Shutdown(absl::Minutes(5)); });
  const std::string address = (*server)->observability().metrics_address();
  std::string ready;
  do {  // the thread that stops it has to be scheduled first; the call holds the server until then
    ready = HttpGet(address, "/readyz");
  } while (absl::StartsWith(ready, "HTTP/1.1 200 "));
  EXPECT_THAT(ready, AllOf(StartsWith("HTTP/1.1 503 "), HasSubstr("stopping")));
  EXPECT_THAT(HttpGet(address, "/livez"), StartsWith("HTTP/1.1 200 OK\r\n"));
  go_on.Set();
  EXPECT_TRUE(call.Finish().ok());
  stopper.join();
}

}  // namespace
}  // namespace wellspace::server
