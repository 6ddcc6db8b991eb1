#include "tests/server/service_harness.h"

#include <algorithm>
#include <chrono>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "absl/time/clock.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "gtest/gtest.h"
#include "server/wire/errors.h"
#include "spdlog/sinks/base_sink.h"

namespace wellspace::server {
namespace {

constexpr std::chrono::minutes kPatience(1);

class LinesSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit LinesSink(std::shared_ptr<LogLines> lines) : lines_(std::move(lines)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    lines_->Add(std::string(message.payload.data(), message.payload.size()));
  }
  void flush_() override {}

  const std::shared_ptr<LogLines> lines_;
};

template <typename T, typename Field>
std::vector<T> Concatenate(const TestCall& call, Field field) {
  std::vector<T> all;
  for (const v1::MeshChunk& chunk : call.chunks) {
    all.insert(all.end(), field(chunk).begin(), field(chunk).end());
  }
  return all;
}

}  // namespace

void Event::Set() {
  std::lock_guard lock(mutex_);
  set_ = true;
  set_changed_.notify_all();
}

bool Event::IsSet() const {
  std::lock_guard lock(mutex_);
  return set_;
}

bool Event::Wait() {
  std::unique_lock lock(mutex_);
  return set_changed_.wait_for(lock, kPatience, [this] { return set_; });
}

core::Mesh MakeFakeMesh(const core::MeshParameters& parameters, std::span<const double> points) {
  const int dimension = parameters.dimension;
  core::Mesh mesh;
  mesh.dimension = dimension;
  mesh.domain_low = parameters.domain_low.empty() ? std::vector<double>(dimension, 0.0) : parameters.domain_low;
  mesh.domain_high = parameters.domain_high.empty() ? std::vector<double>(dimension, 1.0) : parameters.domain_high;
  mesh.points.assign(points.begin(), points.end());
  for (int corner = 0; corner < 1 << dimension; ++corner) {
    for (int axis = 0; axis < dimension; ++axis) {
      mesh.points.push_back((corner >> axis & 1) != 0 ? mesh.domain_high[axis] : mesh.domain_low[axis]);
    }
  }
  const auto vertex_count = static_cast<uint32_t>(mesh.vertex_count());
  for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
    for (int i = 0; i <= dimension; ++i) {
      mesh.simplices.push_back((vertex + i) % vertex_count);
    }
  }
  for (uint32_t vertex = 0; vertex < points.size() / dimension; ++vertex) {
    mesh.input_vertex.push_back(vertex);
  }
  mesh.statistics.input_points = mesh.input_vertex.size();
  mesh.statistics.vertices = mesh.vertex_count();
  mesh.statistics.simplices = mesh.simplex_count();
  mesh.statistics.cuts = 42;
  mesh.statistics.total_seconds = 0.5;
  return mesh;
}

absl::StatusOr<core::Mesh> FakeMesher(const core::MeshParameters& parameters, const core::Input& input,
                                      core::RunContext& /*context*/) {
  return MakeFakeMesh(parameters, input.points);
}

absl::StatusOr<core::MeshEstimate> FakeEstimator(const core::MeshParameters& parameters, const core::Input& input,
                                                 core::RunContext& /*context*/) {
  const uint64_t count = input.points.size() / parameters.dimension;
  return core::MeshEstimate{
      .vertices = count, .simplices = 2 * count, .memory_bytes = 3 * count, .tree_leaves = 4 * count};
}

Mesher EndlessMesher(Event& started) {
  return [&started](const core::MeshParameters&, const core::Input&,
                    core::RunContext& context) -> absl::StatusOr<core::Mesh> {
    context.EnterPhase(core::Phase::kRefinement);
    started.Set();
    while (!context.IsCancelled()) {
      std::this_thread::sleep_for(std::chrono::microseconds(100));  // as often as the core looks
    }
    return context.Check();
  };
}

ErrorDetails DetailsOf(const grpc::Status& status) {
  ErrorDetails details;
  google::rpc::Status message;
  EXPECT_TRUE(message.ParseFromString(status.error_details()));
  for (const google::protobuf::Any& any : message.details()) {
    if (google::rpc::ErrorInfo info; any.UnpackTo(&info)) {
      EXPECT_EQ(info.domain(), "wellspace.v1");
      const std::string prefix = "ERROR_REASON_";
      EXPECT_EQ(info.reason().substr(0, prefix.size()), prefix);
      details.reason = info.reason().substr(prefix.size());
      const auto address = info.metadata().find("address");
      details.address = address == info.metadata().end() ? "" : address->second;
    } else if (google::rpc::BadRequest bad_request; any.UnpackTo(&bad_request)) {
      details.field = bad_request.field_violations(0).field();
    } else if (google::rpc::RetryInfo retry; any.UnpackTo(&retry)) {
      details.may_retry = true;
    }
  }
  return details;
}

ErrorDetails DetailsOf(const absl::Status& status) { return DetailsOf(ToGrpcStatus(status)); }

int PlaceOf(v1::Phase phase) { return phase == v1::PHASE_DONE ? v1::Phase_ARRAYSIZE : phase; }

v1::MeshParameters UnitCubeParameters(int dimension) {
  v1::MeshParameters parameters;
  parameters.set_dimension(dimension);
  for (int axis = 0; axis < dimension; ++axis) {
    parameters.mutable_domain()->add_low(0);
    parameters.mutable_domain()->add_high(1);
  }
  return parameters;
}

std::vector<double> RandomPoints(size_t count, int dimension) {
  std::mt19937_64 generator(11);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  std::vector<double> points(count * dimension);
  for (double& coordinate : points) {
    coordinate = uniform(generator);
  }
  return points;
}

TestCall::TestCall(v1::MeshingService::Stub& stub, std::optional<absl::Duration> timeout, const std::string& token) {
  if (!token.empty()) {
    context_.AddMetadata("authorization", "Bearer " + token);
  }
  if (timeout.has_value()) {
    context_.set_deadline(absl::ToChronoTime(absl::Now() + *timeout));
  }
  stream_ = stub.MeshPoints(&context_);
}

TestCall::~TestCall() {
  if (!finished_) {
    Cancel();
    Finish();
  }
}

bool TestCall::Send(const v1::MeshParameters& parameters) {
  v1::MeshPointsRequest request;
  *request.mutable_parameters() = parameters;
  return stream_->Write(request);
}

bool TestCall::Send(const std::vector<double>& coordinates) {
  v1::MeshPointsRequest request;
  request.mutable_points()->mutable_coordinates()->Assign(coordinates.begin(), coordinates.end());
  return stream_->Write(request);
}

bool TestCall::Read(v1::MeshPointsResponse* response) {
  if (!stream_->Read(response)) {
    return false;
  }
  if (response->has_progress()) {
    EXPECT_TRUE(metadata.empty()) << "progress after the metadata";
    events.push_back(response->progress());
  } else if (response->has_metadata()) {
    metadata.push_back(response->metadata());
  } else {
    EXPECT_EQ(metadata.size(), 1u) << "a chunk before the metadata";
    EXPECT_LE(response->ByteSizeLong(), size_t{kMaxResponseBytes});
    chunks.push_back(response->chunk());
  }
  return true;
}

grpc::Status TestCall::Finish() {
  v1::MeshPointsResponse response;
  while (Read(&response)) {
  }
  finished_ = true;
  return stream_->Finish();
}

std::vector<double> PointsOf(const TestCall& call) {
  return Concatenate<double>(
      call, [](const v1::MeshChunk& chunk) -> const auto& { return chunk.points(); });
}

std::vector<uint32_t> SimplicesOf(const TestCall& call) {
  return Concatenate<uint32_t>(
      call, [](const v1::MeshChunk& chunk) -> const auto& { return chunk.simplices(); });
}

std::vector<uint32_t> InputVerticesOf(const TestCall& call) {
  return Concatenate<uint32_t>(
      call, [](const v1::MeshChunk& chunk) -> const auto& { return chunk.input_vertices(); });
}

void LogLines::Add(std::string line) {
  std::lock_guard lock(mutex_);
  lines_.push_back(std::move(line));
  added_.notify_all();
}

bool LogLines::WaitFor(const std::string& part, size_t count) {
  std::unique_lock lock(mutex_);
  return added_.wait_for(lock, kPatience, [&] {
    return static_cast<size_t>(std::count_if(lines_.begin(), lines_.end(), [&](const std::string& line) {
             return line.find(part) != std::string::npos;
           })) >= count;
  });
}

size_t LogLines::Count(const std::string& part) const {
  std::lock_guard lock(mutex_);
  return std::count_if(lines_.begin(), lines_.end(),
                       [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

ServiceHarness::ServiceHarness(Mesher mesher, const ServiceOptions& options, Transport transport, Estimator estimator,
                               MesherFactory create_mesher, const SecurityOptions& security,
                               std::unique_ptr<SessionLog> session_log) {
  auto logger = std::make_shared<spdlog::logger>("test", std::make_shared<LinesSink>(log_));
  logger->set_level(spdlog::level::debug);
  ServerOptions server_options;
  server_options.service = options;
  server_options.security = security;
  server_options.listen = transport == Transport::kLoopback ? "127.0.0.1:0" : "";
  absl::StatusOr<std::unique_ptr<Server>> server =
      Server::Start(server_options, std::move(logger), std::move(session_log), std::move(mesher), std::move(estimator),
                    std::move(create_mesher));
  if (!server.ok()) {
    throw std::runtime_error(server.status().ToString());
  }
  server_ = *std::move(server);
  // The client is in this process, too, and its memory is no matter of the server's: gRPC's windows stay as they
  // are, and do not grow with how long an answer takes on a busy machine.
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  channel_ = transport == Transport::kLoopback
                 ? grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments)
                 : server_->InProcessChannel().value();
  stub_ = v1::MeshingService::NewStub(channel_);
}

v1::GetServerInfoResponse ServiceHarness::Info() {
  grpc::ClientContext context;
  v1::GetServerInfoResponse response;
  const grpc::Status status = stub_->GetServerInfo(&context, v1::GetServerInfoRequest(), &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

absl::Duration ServiceHarness::TimeUntilIdle() {
  const absl::Time begin = absl::Now();
  while (absl::Now() - begin < absl::Minutes(1)) {
    if (const v1::GetServerInfoResponse info = Info(); info.running_jobs() + info.queued_jobs() == 0) {
      break;
    }
  }
  return absl::Now() - begin;
}

}  // namespace wellspace::server
