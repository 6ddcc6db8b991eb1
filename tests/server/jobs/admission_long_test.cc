// The limit of memory of the real program: 200 clients at once with ten times the work that fits.
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "server/base/options.h"
#include "tests/server/daemon.h"
#include "tests/server/service_harness.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::server {
namespace {

constexpr uint64_t kMaxMemoryBytes = uint64_t{192} << 20;
constexpr int kClients = 200;
// Every tenth client has a large cloud.
constexpr int kLargeEvery = 10;
constexpr size_t kLargePoints = 40'000;
constexpr size_t kSmallPoints = 3'000;

std::vector<double> PointsOfClient(int client) {
  std::mt19937_64 generator(client);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  std::vector<double> points(3 * (client % kLargeEvery == 0 ? kLargePoints : kSmallPoints));
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  return points;
}

uint64_t EstimateOf(v1::MeshingService::Stub& stub, const std::vector<double>& points) {
  grpc::ClientContext context;
  v1::EstimateMeshResponse response;
  const auto writer = stub.EstimateMesh(&context, &response);
  v1::EstimateMeshRequest request;
  *request.mutable_parameters() = UnitCubeParameters();
  writer->Write(request);
  request.mutable_points()->mutable_coordinates()->Assign(points.begin(), points.end());
  writer->Write(request);
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.memory_bytes();
}

// The outcome of a client's request for a mesh.
struct Outcome {
  int refusals = 0;  // that said that it may be asked again
  bool is_meshed = false;
  std::string lost;  // any other error
};

Outcome AskUntilMeshed(const std::string& address, const std::vector<double>& points) {
  // A connection each, as clients have.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto stub =
      v1::MeshingService::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  Outcome outcome;
  while (true) {
    TestCall call(*stub);
    call.Send(UnitCubeParameters());
    call.Send(points);
    call.HalfClose();
    const grpc::Status status = call.Finish();
    if (status.ok()) {
      outcome.is_meshed = call.metadata.size() == 1 && call.chunks.size() == call.metadata[0].chunk_count();
      return outcome;
    }
    if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED || !DetailsOf(status).may_retry) {
      outcome.lost = absl::StrCat("code ", status.error_code(), ": ", status.error_message());
      return outcome;
    }
    ++outcome.refusals;
    absl::SleepFor(absl::Seconds(1));  // the delay of RetryInfo
  }
}

TEST(Admission, TwoHundredClientsWithTenTimesWhatFitsStayUnderTheLimitAndAllGetTheirMesh) {
  Daemon daemon({"--workers", "16", "--max-queued", absl::StrCat(kClients), "--max-jobs-per-tenant",
                 absl::StrCat(kClients), "--max-memory", absl::StrCat(kMaxMemoryBytes), "--log-level", "off"});
  const auto stub =
      v1::MeshingService::NewStub(grpc::CreateChannel(daemon.address(), grpc::InsecureChannelCredentials()));
  const uint64_t wanted = kClients / kLargeEvery * EstimateOf(*stub, PointsOfClient(0)) +
                          (kClients - kClients / kLargeEvery) * EstimateOf(*stub, PointsOfClient(1));
  EXPECT_GE(wanted, 10 * (kMaxMemoryBytes - kProcessMemoryBytes));

  std::vector<Outcome> outcomes(kClients);
  std::vector<std::thread> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] { outcomes[i] = AskUntilMeshed(daemon.address(), PointsOfClient(i)); });
  }
  for (std::thread& client : clients) {
    client.join();
  }
  int refusals = 0;
  for (const Outcome& outcome : outcomes) {
    EXPECT_TRUE(outcome.is_meshed) << outcome.lost;
    refusals += outcome.refusals;
  }
  const uint64_t peak = daemon.process().PeakMemory();
  std::cout << "peak " << (peak >> 20) << " MB of " << (kMaxMemoryBytes >> 20) << ", " << refusals << " refusals, "
            << (wanted >> 20) << " MB wanted\n";
  EXPECT_GT(peak, kMaxMemoryBytes / 2);  // it has used its memory
  EXPECT_LT(peak, kMaxMemoryBytes);
  daemon.Stop();
}

}  // namespace
}  // namespace wellspace::server
