// MeshPoints, message by message, through the service's own code and gRPC.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "absl/time/clock.h"
#include "core/validate/validate.h"
#include "gmock/gmock.h"
#include "grpcpp/generic/generic_stub.h"
#include "gtest/gtest.h"
#include "proto/checksum.h"
#include "server/wire/errors.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

std::vector<uint64_t> BitsOf(const std::vector<double>& values) {
  std::vector<uint64_t> bits;
  for (const double value : values) {
    bits.push_back(std::bit_cast<uint64_t>(value));
  }
  return bits;
}

// Sends the parameters and `points` in chunks of `chunk_points` and reads the answer.
grpc::Status Mesh(TestCall& call, const v1::MeshParameters& parameters, const std::vector<double>& points,
                  size_t chunk_points) {
  bool sent = call.Send(parameters);
  const size_t step = chunk_points * parameters.dimension();
  for (size_t begin = 0; sent && begin < points.size(); begin += step) {
    sent =
        call.Send(std::vector<double>(points.begin() + begin, points.begin() + std::min(points.size(), begin + step)));
  }
  if (sent) {
    call.HalfClose();
  }
  return call.Finish();
}

// The answer to a call that succeeded keeps the guarantees of the proto.
void ExpectWellFormed(const TestCall& call) {
  ASSERT_EQ(call.metadata.size(), 1u);
  const v1::MeshMetadata& metadata = call.metadata.front();
  ASSERT_EQ(call.chunks.size(), metadata.chunk_count());
  for (uint64_t i = 0; i < call.chunks.size(); ++i) {
    EXPECT_EQ(call.chunks[i].index(), i);
  }
  EXPECT_EQ(PointsOf(call).size(), metadata.vertex_count() * metadata.dimension());
  EXPECT_EQ(SimplicesOf(call).size(), metadata.simplex_count() * (metadata.dimension() + 1));
  EXPECT_EQ(InputVerticesOf(call).size(), metadata.input_point_count());
  ASSERT_FALSE(call.events.empty());
  EXPECT_EQ(call.events.back().phase(), v1::PHASE_DONE);
  EXPECT_EQ(call.events.back().fraction(), 1);
  for (size_t i = 1; i < call.events.size(); ++i) {
    EXPECT_EQ(call.events[i].sequence(), i);
    EXPECT_GE(PlaceOf(call.events[i].phase()), PlaceOf(call.events[i - 1].phase()));
    EXPECT_GE(call.events[i].vertices(), call.events[i - 1].vertices());
    EXPECT_GE(call.events[i].fraction(), call.events[i - 1].fraction());
  }
}

class MeshPointsOver : public ::testing::TestWithParam<Transport> {};

INSTANTIATE_TEST_SUITE_P(Transports, MeshPointsOver, ::testing::Values(Transport::kInProcess, Transport::kLoopback),
                         [](const auto& test) {
                           return test.param == Transport::kInProcess ? "InProcess" : "Loopback";
                         });

TEST_P(MeshPointsOver, TheCoreMakesAValidMesh) {
  ServiceHarness harness(core::MeshPoints, {}, GetParam());
  for (const int dimension : {2, 3}) {
    const std::vector<double> points = RandomPoints(200, dimension);
    TestCall call(harness.stub());
    const grpc::Status status = Mesh(call, UnitCubeParameters(dimension), points, 50);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ExpectWellFormed(call);
    const std::vector<double> vertices = PointsOf(call);
    const std::vector<uint32_t> simplices = SimplicesOf(call);
    const core::MeshView view{.dimension = dimension, .points = vertices, .simplices = simplices};
    const absl::Status valid = core::ValidateMesh(view, {.rho = core::DefaultRho(dimension), .cloud = points});
    EXPECT_TRUE(valid.ok()) << valid;
  }
}

TEST_P(MeshPointsOver, DoublesSurviveToTheBit) {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> points = {-0.0,          0.0,           Limits::denorm_min(), -Limits::denorm_min(),
                                      Limits::min(), Limits::max(), Limits::lowest(),     Limits::epsilon(),
                                      0.1,           1.0 / 3,       std::nextafter(1, 2), 4.9406564584124654e-322};
  ServiceHarness harness(FakeMesher, {}, GetParam());
  TestCall call(harness.stub());
  ASSERT_TRUE(Mesh(call, UnitCubeParameters(2), points, 1).ok());
  ExpectWellFormed(call);
  std::vector<double> returned = PointsOf(call);
  returned.resize(points.size());
  EXPECT_EQ(BitsOf(returned), BitsOf(points));
}

TEST_P(MeshPointsOver, ChunkSizesDoNotMatter) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  const std::vector<double> points = RandomPoints(1000, 3);
  for (const size_t chunk_points : {1, 2, 7, 333, 1000, 5000}) {
    TestCall call(harness.stub());
    ASSERT_TRUE(Mesh(call, UnitCubeParameters(), points, chunk_points).ok());
    ExpectWellFormed(call);
    const std::vector<double> returned = PointsOf(call);
    EXPECT_TRUE(std::equal(points.begin(), points.end(), returned.begin())) << chunk_points;
  }
}

TEST_P(MeshPointsOver, LargeMeshComesInManyChunks) {
  ServiceHarness harness(FakeMesher, {}, GetParam());
  const std::vector<double> points = RandomPoints(300'000, 3);
  TestCall call(harness.stub());
  ASSERT_TRUE(Mesh(call, UnitCubeParameters(), points, 40'000).ok());
  ExpectWellFormed(call);
  EXPECT_GE(call.chunks.size(), 12u);
  for (const v1::MeshChunk& chunk : call.chunks) {
    const uint32_t checksum =
        !chunk.points().empty()      ? Crc32c(chunk.points().data(), chunk.points_size() * sizeof(double))
        : !chunk.simplices().empty() ? Crc32c(chunk.simplices().data(), chunk.simplices_size() * sizeof(uint32_t))
                                     : Crc32c(chunk.input_vertices().data(), chunk.input_vertices_size() * 4);
    EXPECT_EQ(chunk.crc32c(), checksum);
  }
  EXPECT_TRUE(harness.log().WaitFor("code=OK"));
  EXPECT_TRUE(harness.log().WaitFor("points=300000 vertices=300008"));
}

TEST_P(MeshPointsOver, EmptyCloudWithDomain) {
  ServiceHarness harness(core::MeshPoints, {}, GetParam());
  TestCall call(harness.stub());
  const grpc::Status status = Mesh(call, UnitCubeParameters(), {}, 1);
  ASSERT_TRUE(status.ok()) << status.error_message();
  ExpectWellFormed(call);
  EXPECT_GE(call.metadata[0].vertex_count(), 8u);
  EXPECT_EQ(call.metadata[0].input_point_count(), 0u);
}

TEST_P(MeshPointsOver, TwoClientsAtOnce) {
  ServiceOptions options;
  options.workers = 2;
  // Each waits for the other: they are indeed served at the same time.
  Event first;
  Event second;
  ServiceHarness harness(
      [&](const core::MeshParameters& parameters, const core::Input& input, core::RunContext&) {
        Event& own = input.points.size() == 30 ? first : second;
        Event& others = input.points.size() == 30 ? second : first;
        own.Set();
        EXPECT_TRUE(others.Wait());
        return MakeFakeMesh(parameters, input.points);
      },
      options, GetParam());
  std::vector<std::thread> clients;
  for (const size_t count : {10, 20}) {
    clients.emplace_back([&harness, count] {
      TestCall call(harness.stub());
      EXPECT_TRUE(Mesh(call, UnitCubeParameters(), RandomPoints(count, 3), 3).ok());
      ExpectWellFormed(call);
      EXPECT_EQ(call.metadata.at(0).input_point_count(), count);
    });
  }
  for (std::thread& client : clients) {
    client.join();
  }
}

// Each reason of errors.proto, as a client meets it.
class MeshPointsFails : public ::testing::Test {
 protected:
  static ServiceOptions Limits() {
    ServiceOptions options;
    options.max_points = 100;
    return options;
  }

  // Expects that `call`, whose requests are sent, ends with this.
  static void Expect(TestCall& call, grpc::StatusCode code, const std::string& reason, const std::string& field = "") {
    const grpc::Status status = call.Finish();
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    const ErrorDetails details = DetailsOf(status);
    EXPECT_EQ(details.reason, reason);
    EXPECT_EQ(details.field, field);
    EXPECT_FALSE(status.error_message().empty());
    EXPECT_TRUE(call.metadata.empty());
  }

  ServiceHarness harness_{core::MeshPoints, Limits(), Transport::kLoopback};
  TestCall call_{harness_.stub()};
};

TEST_F(MeshPointsFails, PointsBeforeParameters) {
  call_.Send({1, 2, 3});
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "PARAMETERS_MISSING", "parameters");
}

TEST_F(MeshPointsFails, NothingSent) {
  call_.HalfClose();
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "PARAMETERS_MISSING", "parameters");
}

TEST_F(MeshPointsFails, ParametersTwice) {
  call_.Send(UnitCubeParameters());
  call_.Send(UnitCubeParameters());
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "PARAMETERS_REPEATED", "parameters");
}

TEST_F(MeshPointsFails, InvalidParameters) {
  call_.Send(UnitCubeParameters(7));
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_PARAMETERS", "parameters.dimension");
}

TEST_F(MeshPointsFails, ChunkOfNoWholePoints) {
  call_.Send(UnitCubeParameters());
  call_.Send({0.1, 0.2, 0.3, 0.4});
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_CHUNK_SHAPE", "points.coordinates");
}

TEST_F(MeshPointsFails, TooManyPoints) {
  call_.Send(UnitCubeParameters());
  call_.Send(RandomPoints(101, 3));
  Expect(call_, grpc::StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_POINTS");
}

TEST_F(MeshPointsFails, PointThatIsNoNumber) {
  call_.Send(UnitCubeParameters());
  call_.Send({0.1, 0.2, 0.3, 0.4, std::nan(""), 0.5});
  call_.HalfClose();
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points.coordinates");
}

TEST_F(MeshPointsFails, PointOutsideTheDomain) {
  call_.Send(UnitCubeParameters());
  call_.Send({0.1, 0.2, 0.3, 0.4, 2, 0.5});
  call_.HalfClose();
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points.coordinates");
}

TEST_F(MeshPointsFails, NoPointsAndNoDomain) {
  v1::MeshParameters parameters;
  parameters.set_dimension(3);
  call_.Send(parameters);
  call_.HalfClose();
  Expect(call_, grpc::StatusCode::INVALID_ARGUMENT, "INVALID_POINTS", "points.coordinates");
}

TEST_F(MeshPointsFails, MeshAboveMaxVertices) {
  v1::MeshParameters parameters = UnitCubeParameters();
  parameters.set_max_vertices(20);
  call_.Send(parameters);
  call_.Send(RandomPoints(50, 3));
  call_.HalfClose();
  Expect(call_, grpc::StatusCode::RESOURCE_EXHAUSTED, "MESH_TOO_LARGE");
}

TEST_F(MeshPointsFails, AMessageAboveTheLimitIsRefusedByGrpc) {
  call_.Send(UnitCubeParameters());
  call_.Send(std::vector<double>(kMaxRequestBytes / sizeof(double) / 3 * 3 + 3));
  call_.HalfClose();
  const grpc::Status status = call_.Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
}

TEST(MeshPointsFailsWith, EmptyRequest) {
  ServiceHarness harness;
  grpc::ClientContext context;
  const auto stream = harness.stub().MeshPoints(&context);
  ASSERT_TRUE(stream->Write(v1::MeshPointsRequest()));
  v1::MeshPointsResponse response;
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(DetailsOf(status).reason, "EMPTY_REQUEST");
}

// gRPC itself would take such a request for the end of the stream, and the points before it for the whole cloud.
TEST(MeshPointsFailsWith, MalformedRequest) {
  ServiceHarness harness;
  for (const char* method : {"MeshPoints", "EstimateMesh"}) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    grpc::GenericStub stub(harness.channel());
    const auto stream = stub.PrepareCall(&context, std::string("/wellspace.v1.MeshingService/") + method, &queue);
    const auto done = [&queue] {
      void* tag = nullptr;
      bool ok = false;
      return queue.Next(&tag, &ok) && ok;
    };
    const auto write = [&](const std::string& bytes) {
      const grpc::Slice slice(bytes);
      stream->Write(grpc::ByteBuffer(&slice, 1), nullptr);
      return done();
    };
    v1::MeshPointsRequest parameters;
    *parameters.mutable_parameters() = UnitCubeParameters();
    stream->StartCall(nullptr);
    ASSERT_TRUE(done());
    ASSERT_TRUE(write(parameters.SerializeAsString()));
    if (write("\x12\x7F half a message")) {
      stream->WritesDone(nullptr);
      done();
    }
    grpc::ByteBuffer response;
    do {
      stream->Read(&response, nullptr);
    } while (done());
    grpc::Status status;
    stream->Finish(&status, nullptr);
    ASSERT_TRUE(done());
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
    EXPECT_EQ(DetailsOf(status).reason, "MALFORMED_REQUEST");
    EXPECT_THAT(status.error_message(), HasSubstr(std::string(method) + "Request"));
  }
}

TEST(MeshPointsFailsWith, QueueFull) {
  Event started;
  ServiceOptions options;
  options.max_queued_jobs = 0;
  ServiceHarness harness(EndlessMesher(started), options);
  TestCall first(harness.stub());
  first.Send(UnitCubeParameters());
  first.HalfClose();
  ASSERT_TRUE(started.Wait());
  TestCall second(harness.stub());
  const grpc::Status status = Mesh(second, UnitCubeParameters(), {}, 1);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "QUEUE_FULL");
  EXPECT_TRUE(DetailsOf(status).may_retry);
}

TEST(MeshPointsFailsWith, OutOfMemory) {
  ServiceHarness harness([](const auto&, auto, auto&) -> absl::StatusOr<core::Mesh> { throw std::bad_alloc(); });
  TestCall call(harness.stub());
  const grpc::Status status = Mesh(call, UnitCubeParameters(), {}, 1);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(DetailsOf(status).reason, "OUT_OF_MEMORY");
}

TEST(MeshPointsFailsWith, InternalForAnException) {
  ServiceHarness harness(
      [](const auto&, auto, auto&) -> absl::StatusOr<core::Mesh> { throw std::logic_error("a bug"); });
  TestCall call(harness.stub());
  const grpc::Status status = Mesh(call, UnitCubeParameters(), {}, 1);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INTERNAL);
  EXPECT_EQ(DetailsOf(status).reason, "INTERNAL");
  EXPECT_THAT(status.error_message(), HasSubstr("a bug"));
  // The server lives on, and its worker is free again.
  EXPECT_LT(harness.TimeUntilIdle(), absl::Minutes(1));
}

TEST(MeshPointsProgress, HeartbeatsWhileReceivingAndWaiting) {
  Event started;
  ServiceOptions options;
  ServiceHarness harness(EndlessMesher(started), options);
  TestCall first(harness.stub());
  first.Send(UnitCubeParameters());
  first.HalfClose();
  ASSERT_TRUE(started.Wait());

  TestCall second(harness.stub());
  second.Send(UnitCubeParameters());
  v1::MeshPointsResponse response;
  ASSERT_TRUE(second.Read(&response));  // while receiving
  EXPECT_EQ(response.progress().phase(), v1::PHASE_WAITING);
  second.HalfClose();
  const absl::Time begin = absl::Now();
  ASSERT_TRUE(second.Read(&response));  // while waiting for a worker
  EXPECT_EQ(response.progress().phase(), v1::PHASE_WAITING);
  EXPECT_EQ(response.progress().sequence(), 1u);
  EXPECT_LT(absl::Now() - begin, absl::Seconds(2));
  EXPECT_EQ(harness.Info().queued_jobs(), 1);
}

}  // namespace
}  // namespace wellspace::server
