// The client library against servers that the test makes up.
#include "client/connection.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/grpcpp.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "wellspace/v1/meshing.grpc.pb.h"

namespace wellspace::client {
namespace {

using ::testing::ElementsAre;

using Stream = grpc::ServerReaderWriter<v1::MeshPointsResponse, v1::MeshPointsRequest>;

CallOptions StoppedBy(const std::stop_source& stop) {
  CallOptions call;
  call.stop = stop.get_token();
  return call;
}

// Answers MeshPoints as the test says.
class FakeServer final : public v1::MeshingService::Service {
 public:
  using Estimator = std::function<grpc::Status(grpc::ServerContext&, grpc::ServerReader<v1::EstimateMeshRequest>&,
                                               v1::EstimateMeshResponse&)>;
  using Behaviour = std::function<grpc::Status(grpc::ServerContext&, Stream&)>;

  explicit FakeServer(Behaviour behaviour, Estimator estimator = nullptr)
      : behaviour_(std::move(behaviour)), estimator_(std::move(estimator)) {
    grpc::ServerBuilder builder;
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~FakeServer() override { server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(30)); }

  grpc::Status MeshPoints(grpc::ServerContext* context, Stream* stream) override {
    return behaviour_(*context, *stream);
  }

  grpc::Status EstimateMesh(grpc::ServerContext* context, grpc::ServerReader<v1::EstimateMeshRequest>* stream,
                            v1::EstimateMeshResponse* response) override {
    return estimator_(*context, *stream, *response);
  }

  grpc::Status GetServerInfo(grpc::ServerContext* /*context*/, const v1::GetServerInfoRequest* /*request*/,
                             v1::GetServerInfoResponse* response) override {
    response->set_version("1.2.3");
    response->add_dimensions(2);
    response->set_max_points(10);
    response->set_max_vertices(20);
    response->set_workers(3);
    response->set_running_jobs(4);
    response->set_queued_jobs(5);
    return grpc::Status::OK;
  }

  client::Client Client() {
    return client::Client(MakeConnection(server_->InProcessChannel(grpc::ChannelArguments())));
  }

 private:
  const Behaviour behaviour_;
  const Estimator estimator_;
  std::unique_ptr<grpc::Server> server_;
};

// The requests that a client sent.
struct Upload {
  v1::MeshParameters parameters;
  std::vector<double> points;
  size_t largest_request = 0;
  bool in_order = true;
};

template <typename Request, typename AnyStream>
Upload ReadUpload(AnyStream& stream) {
  Upload upload;
  Request request;
  for (bool first = true; stream.Read(&request); first = false) {
    upload.in_order = upload.in_order && request.has_parameters() == first;
    upload.largest_request = std::max(upload.largest_request, request.ByteSizeLong());
    if (request.has_parameters()) {
      upload.parameters = request.parameters();
    } else {
      const auto& coordinates = request.points().coordinates();
      upload.points.insert(upload.points.end(), coordinates.begin(), coordinates.end());
    }
  }
  return upload;
}

void WriteProgress(Stream& stream, v1::Phase phase, double fraction) {
  v1::MeshPointsResponse response;
  response.mutable_progress()->set_phase(phase);
  response.mutable_progress()->set_fraction(fraction);
  response.mutable_progress()->set_vertices(7);
  stream.Write(response);
}

v1::MeshPointsResponse MetadataFor(const Upload& upload) {
  v1::MeshPointsResponse response;
  v1::MeshMetadata* metadata = response.mutable_metadata();
  const int dimension = upload.parameters.dimension();
  metadata->set_dimension(dimension);
  *metadata->mutable_domain() = upload.parameters.domain();
  metadata->set_vertex_count(upload.points.size() / dimension);
  metadata->set_input_point_count(0);
  metadata->set_chunk_count(1);
  return response;
}

v1::MeshPointsResponse ChunkFor(const Upload& upload) {
  v1::MeshPointsResponse response;
  response.mutable_chunk()->mutable_points()->Assign(upload.points.begin(), upload.points.end());
  response.mutable_chunk()->set_crc32c(Crc32c(upload.points.data(), upload.points.size() * sizeof(double)));
  return response;
}

MeshOptions UnitSquare() {
  MeshOptions options;
  options.dimension = 2;
  options.domain_low = {0, 0};
  options.domain_high = {1, 1};
  return options;
}

TEST(Connection, SendsEverythingToTheBitInSmallRequests) {
  MeshOptions options = UnitSquare();
  options.rho = 1.5;
  options.margin = 0.125;
  options.max_vertices = 99;
  options.threads = 3;
  std::vector<double> points(2 * 300'001);
  for (size_t i = 0; i < points.size(); ++i) {
    points[i] = std::bit_cast<double>(uint64_t{i} * 0x123456789ABCu);
  }
  points[0] = -0.0;
  points[1] = std::numeric_limits<double>::denorm_min();
  std::promise<Upload> seen;
  FakeServer server([&seen](grpc::ServerContext&, Stream& stream) {
    seen.set_value(ReadUpload<v1::MeshPointsRequest>(stream));
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "seen");
  });
  EXPECT_EQ(server.Client().MeshPoints(options, points).status(), absl::NotFoundError("seen"));
  const Upload upload = seen.get_future().get();
  EXPECT_TRUE(upload.in_order);
  EXPECT_LE(upload.largest_request, 1u << 20);
  EXPECT_EQ(upload.parameters.dimension(), 2);
  EXPECT_EQ(upload.parameters.rho(), 1.5);
  EXPECT_THAT(upload.parameters.domain().low(), ElementsAre(0, 0));
  EXPECT_THAT(upload.parameters.domain().high(), ElementsAre(1, 1));
  EXPECT_EQ(upload.parameters.margin(), 0.125);
  EXPECT_EQ(upload.parameters.max_vertices(), 99u);
  EXPECT_EQ(upload.parameters.threads(), 3);
  ASSERT_EQ(upload.points.size(), points.size());
  EXPECT_TRUE(std::equal(points.begin(), points.end(), upload.points.begin(),
                         [](double a, double b) { return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b); }));
}

TEST(Connection, SendsCriterionAndSizes) {
  MeshOptions options = UnitSquare();
  options.criterion = Criterion::kWellSpaced;
  options.max_circumradius = 0.5;
  options.edge_length = 0.75;
  options.gradation = 0.25;
  options.size_boxes = {{.low = {0, 0.25}, .high = {1, 2}, .max_circumradius = 0.125},
                        {.low = {3}, .high = {}, .max_circumradius = 0}};
  std::promise<Upload> seen;
  FakeServer server([&seen](grpc::ServerContext&, Stream& stream) {
    seen.set_value(ReadUpload<v1::MeshPointsRequest>(stream));
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "");
  });
  EXPECT_FALSE(server.Client().MeshPoints(options, {}).ok());
  const v1::MeshParameters parameters = seen.get_future().get().parameters;
  EXPECT_EQ(parameters.criterion(), v1::CRITERION_WELL_SPACED);
  EXPECT_EQ(parameters.max_circumradius(), 0.5);
  EXPECT_EQ(parameters.edge_length(), 0.75);
  EXPECT_EQ(parameters.gradation(), 0.25);
  ASSERT_EQ(parameters.size_boxes_size(), 2);
  EXPECT_THAT(parameters.size_boxes(0).low(), ElementsAre(0, 0.25));
  EXPECT_THAT(parameters.size_boxes(0).high(), ElementsAre(1, 2));
  EXPECT_EQ(parameters.size_boxes(0).max_circumradius(), 0.125);
  // The server judges, not the client.
  EXPECT_THAT(parameters.size_boxes(1).low(), ElementsAre(3));
  EXPECT_TRUE(parameters.size_boxes(1).high().empty());
}

TEST(Connection, SendsSizesAtPointsInSmallRequests) {
  MeshOptions options = UnitSquare();
  auto samples = std::make_shared<SizeSamples>();
  for (int i = 0; i < 100'001; ++i) {
    samples->points.insert(samples->points.end(), {0.5 * i, 0.25 * i});
    samples->sizes.push_back(i + 1);
  }
  samples->measure = SizeMeasure::kEdgeLength;
  options.size_samples = samples;
  struct Seen {
    SizeSamples samples;
    size_t messages = 0;
    size_t largest = 0;
  };
  std::promise<Seen> seen;
  FakeServer server([&seen](grpc::ServerContext&, Stream& stream) {
    Seen all;
    v1::MeshPointsRequest request;
    while (stream.Read(&request)) {
      const v1::SizeSamples& chunk = request.size_samples();
      all.samples.points.insert(all.samples.points.end(), chunk.points().begin(), chunk.points().end());
      all.samples.sizes.insert(all.samples.sizes.end(), chunk.sizes().begin(), chunk.sizes().end());
      EXPECT_TRUE(!request.has_size_samples() || chunk.measure() == v1::SIZE_MEASURE_EDGE_LENGTH);
      all.messages += request.has_size_samples() ? 1 : 0;
      all.largest = std::max(all.largest, request.ByteSizeLong());
    }
    seen.set_value(std::move(all));
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "");
  });
  EXPECT_FALSE(server.Client().MeshPoints(options, {}).ok());
  const Seen all = seen.get_future().get();
  EXPECT_EQ(all.samples.points, samples->points);
  EXPECT_EQ(all.samples.sizes, samples->sizes);
  EXPECT_GT(all.messages, 1u);
  EXPECT_LE(all.largest, 1u << 20);
}

TEST(Connection, LeavesOutTheDomainWhenThereIsNone) {
  std::promise<Upload> seen;
  FakeServer server([&seen](grpc::ServerContext&, Stream& stream) {
    seen.set_value(ReadUpload<v1::MeshPointsRequest>(stream));
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "");
  });
  EXPECT_FALSE(server.Client().MeshPoints({}, std::vector<double>{1, 2, 3}).ok());
  EXPECT_FALSE(seen.get_future().get().parameters.has_domain());
}

TEST(Connection, ReportsProgressAndReturnsTheMesh) {
  FakeServer server([](grpc::ServerContext&, Stream& stream) {
    WriteProgress(stream, v1::PHASE_WAITING, 0);
    Upload upload = ReadUpload<v1::MeshPointsRequest>(stream);
    upload.points = {0.25, 0.75};
    WriteProgress(stream, v1::PHASE_REFINEMENT, 0.5);
    WriteProgress(stream, v1::PHASE_DONE, 1);
    stream.Write(MetadataFor(upload));
    stream.Write(ChunkFor(upload));
    return grpc::Status::OK;
  });
  std::vector<std::string> phases;
  const absl::StatusOr<Mesh> mesh = server.Client().MeshPoints(UnitSquare(), {}, [&phases](const Progress& progress) {
    phases.push_back(progress.phase);
    EXPECT_EQ(progress.vertices, 7u);
  });
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(phases, ElementsAre("waiting", "refinement", "done"));
  EXPECT_THAT(mesh->points, ElementsAre(0.25, 0.75));
}

TEST(Connection, KeepsTheServersErrorAndItsDetails) {
  google::rpc::ErrorInfo info;
  info.set_reason("ERROR_REASON_INVALID_POINTS");
  google::rpc::Status details;
  details.add_details()->PackFrom(info);
  FakeServer server([&details](grpc::ServerContext&, Stream&) {
    return grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "point 7 is NaN", details.SerializeAsString());
  });
  const absl::Status status = server.Client().MeshPoints(UnitSquare(), {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "point 7 is NaN");
  const auto payload = status.GetPayload("type.googleapis.com/google.rpc.ErrorInfo");
  ASSERT_TRUE(payload.has_value());
  google::rpc::ErrorInfo returned;
  ASSERT_TRUE(returned.ParseFromString(std::string(*payload)));
  EXPECT_EQ(returned.reason(), info.reason());
  EXPECT_EQ(BlamedField(status), "");
}

TEST(Connection, TellsTheFieldThatTheServerBlames) {
  google::rpc::BadRequest bad_request;
  bad_request.add_field_violations()->set_field("parameters.rho");
  google::rpc::Status details;
  details.add_details()->PackFrom(google::rpc::ErrorInfo());
  details.add_details()->PackFrom(bad_request);
  FakeServer server([&details](grpc::ServerContext&, Stream&) {
    return grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "rho is bad", details.SerializeAsString());
  });
  EXPECT_EQ(BlamedField(server.Client().MeshPoints(UnitSquare(), {}).status()), "parameters.rho");
  EXPECT_EQ(BlamedField(absl::OkStatus()), "");
  absl::Status damaged = absl::InvalidArgumentError("");
  damaged.SetPayload("type.googleapis.com/google.rpc.BadRequest", absl::Cord("\xff"));
  EXPECT_EQ(BlamedField(damaged), "");
}

TEST(Connection, AServerThatFailsEarlyEndsTheUpload) {
  FakeServer server([](grpc::ServerContext&, Stream& stream) {
    v1::MeshPointsRequest request;
    stream.Read(&request);
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many points");
  });
  const std::vector<double> points(2 * 4'000'000);
  EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), points).status(), absl::ResourceExhaustedError("too many points"));
}

TEST(Connection, ADamagedChunkIsDataLossAndCancelsTheCall) {
  std::promise<void> refused;
  FakeServer server([&refused](grpc::ServerContext&, Stream& stream) {
    Upload upload = ReadUpload<v1::MeshPointsRequest>(stream);
    upload.points = {0.25, 0.75};
    stream.Write(MetadataFor(upload));
    v1::MeshPointsResponse chunk = ChunkFor(upload);
    chunk.mutable_chunk()->set_points(1, 0.5);
    while (stream.Write(chunk)) {  // until the client has had enough
    }
    refused.set_value();
    return grpc::Status::OK;
  });
  EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), {}).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(refused.get_future().wait_for(std::chrono::minutes(1)), std::future_status::ready);
}

TEST(Connection, AnAnnouncementThatLiesCostsNothing) {
  FakeServer server([](grpc::ServerContext&, Stream& stream) {
    Upload upload = ReadUpload<v1::MeshPointsRequest>(stream);
    v1::MeshPointsResponse metadata = MetadataFor(upload);
    metadata.mutable_metadata()->set_vertex_count(0xFFFFFFFF);
    metadata.mutable_metadata()->set_simplex_count(uint64_t{1} << 40);
    metadata.mutable_metadata()->set_chunk_count(std::numeric_limits<uint64_t>::max());
    stream.Write(metadata);
    return grpc::Status::OK;
  });
  EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), {}).status().code(), absl::StatusCode::kDataLoss);
}

TEST(Connection, AnEndWithoutMeshIsDataLoss) {
  FakeServer server([](grpc::ServerContext&, Stream& stream) {
    ReadUpload<v1::MeshPointsRequest>(stream);
    return grpc::Status::OK;
  });
  EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), {}).status().code(), absl::StatusCode::kDataLoss);
}

// Says that it works, and does so until the call is cancelled.
grpc::Status WorkForever(grpc::ServerContext& context, Stream& stream) {
  while (!context.IsCancelled()) {
    WriteProgress(stream, v1::PHASE_REFINEMENT, 0.5);
  }
  return grpc::Status::CANCELLED;
}

TEST(Connection, StopCancelsTheCall) {
  FakeServer server(WorkForever);
  std::stop_source stop;
  const absl::StatusOr<Mesh> mesh = server.Client().MeshPoints(
      UnitSquare(), {}, [&stop](const Progress&) { stop.request_stop(); }, StoppedBy(stop));
  EXPECT_EQ(mesh.status(), absl::CancelledError("cancelled by the caller"));
}

TEST(Connection, StopBeforeTheStart) {
  FakeServer server(WorkForever);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), {}, nullptr, StoppedBy(stop)).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(Connection, TimeoutEndsTheCall) {
  FakeServer server(WorkForever);
  for (const absl::Duration timeout : {absl::Milliseconds(50), absl::ZeroDuration(), absl::Seconds(-1)}) {
    CallOptions call;
    call.timeout = timeout;
    EXPECT_EQ(server.Client().MeshPoints(UnitSquare(), {}, nullptr, call).status().code(),
              absl::StatusCode::kDeadlineExceeded);
  }
}

TEST(Connection, EstimateSendsTheCloudAndReturnsTheFigures) {
  const std::vector<double> points(2 * 200'001, 0.25);
  std::promise<Upload> seen;
  FakeServer server(WorkForever, [&seen](grpc::ServerContext&, auto& stream, v1::EstimateMeshResponse& response) {
    seen.set_value(ReadUpload<v1::EstimateMeshRequest>(stream));
    response.set_vertices(uint64_t{1} << 40);
    response.set_simplices(2);
    response.set_memory_bytes(3);
    response.set_tree_leaves(4);
    return grpc::Status::OK;
  });
  const absl::StatusOr<MeshEstimate> estimate = server.Client().EstimateMesh(UnitSquare(), points);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->vertices, uint64_t{1} << 40);
  EXPECT_EQ(estimate->simplices, 2u);
  EXPECT_EQ(estimate->memory_bytes, 3u);
  EXPECT_EQ(estimate->tree_leaves, 4u);
  const Upload upload = seen.get_future().get();
  EXPECT_TRUE(upload.in_order);
  EXPECT_EQ(upload.parameters.dimension(), 2);
  EXPECT_EQ(upload.points, points);
}

TEST(Connection, EstimateEndsByErrorStopAndTimeout) {
  const auto refuse = [](grpc::ServerContext&, auto&, v1::EstimateMeshResponse&) {
    return grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "too many points");
  };
  FakeServer strict(WorkForever, refuse);
  EXPECT_EQ(strict.Client().EstimateMesh(UnitSquare(), std::vector<double>(2 * 4'000'000)).status(),
            absl::ResourceExhaustedError("too many points"));

  std::stop_source stop;
  FakeServer endless(WorkForever, [&stop](grpc::ServerContext& context, auto& stream, v1::EstimateMeshResponse&) {
    ReadUpload<v1::EstimateMeshRequest>(stream);
    stop.request_stop();
    while (!context.IsCancelled()) {
    }
    return grpc::Status::CANCELLED;
  });
  EXPECT_EQ(endless.Client().EstimateMesh(UnitSquare(), {}, StoppedBy(stop)).status(),
            absl::CancelledError("cancelled by the caller"));
  CallOptions call;
  call.timeout = absl::Milliseconds(50);
  EXPECT_EQ(endless.Client().EstimateMesh(UnitSquare(), {}, call).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(Connection, GetServerInfo) {
  FakeServer server(WorkForever);
  const absl::StatusOr<ServerInfo> info = server.Client().GetServerInfo();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->version, "1.2.3");
  EXPECT_THAT(info->dimensions, ElementsAre(2));
  EXPECT_EQ(info->max_points, 10u);
  EXPECT_EQ(info->max_vertices, 20u);
  EXPECT_EQ(info->workers, 3);
  EXPECT_EQ(info->running_jobs, 4);
  EXPECT_EQ(info->queued_jobs, 5);
}

TEST(Connect, RefusesWhatIsNoAddress) {
  for (const char* address :
       {"", "localhost", "localhost:", ":7233", "localhost:0", "localhost:65536", "localhost:x"}) {
    EXPECT_EQ(Connect(address).status().code(), absl::StatusCode::kInvalidArgument) << address;
  }
}

TEST(Connect, AServerThatIsNotThereIsUnavailable) {
  // Port 1 is reserved and, in a test's machine, unused.
  absl::StatusOr<Client> client = Connect("127.0.0.1:1");
  ASSERT_TRUE(client.ok());
  EXPECT_EQ(client->GetServerInfo().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(client->MeshPoints(UnitSquare(), std::vector<double>(2 * 400'000)).status().code(),
            absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace wellspace::client
