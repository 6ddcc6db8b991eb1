// Sizes at points in MeshPoints and EstimateMesh, over the service.
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"
#include "tests/server/session_calls.h"

namespace wellspace::server {
namespace {

using ::testing::HasSubstr;

v1::SizeSamples Samples(const std::vector<double>& points, const std::vector<double>& sizes) {
  v1::SizeSamples samples;
  samples.mutable_points()->Assign(points.begin(), points.end());
  samples.mutable_sizes()->Assign(sizes.begin(), sizes.end());
  return samples;
}

struct Result {
  grpc::Status status;
  std::vector<double> points;
  std::vector<uint32_t> simplices;
};

class SizeSamplesTest : public ::testing::Test {
 protected:
  explicit SizeSamplesTest(const ServiceOptions& options = {})
      : harness_(core::MeshPoints, options, Transport::kInProcess, core::EstimateMesh) {}

  // Meshes the unit square; each of `chunks` is a message.
  Result MeshWith(const std::vector<v1::SizeSamples>& chunks, std::optional<double> gradation = std::nullopt) {
    grpc::ClientContext context;
    const auto stream = harness_.stub().MeshPoints(&context);
    v1::MeshPointsRequest request;
    *request.mutable_parameters() = UnitCubeParameters(2);
    if (gradation.has_value()) {
      request.mutable_parameters()->set_gradation(*gradation);
    }
    stream->Write(request);
    for (const v1::SizeSamples& chunk : chunks) {
      *request.mutable_size_samples() = chunk;
      stream->Write(request);
    }
    stream->WritesDone();
    Result result;
    v1::MeshPointsResponse response;
    while (stream->Read(&response)) {
      const auto& chunk = response.chunk();
      result.points.insert(result.points.end(), chunk.points().begin(), chunk.points().end());
      result.simplices.insert(result.simplices.end(), chunk.simplices().begin(), chunk.simplices().end());
    }
    result.status = stream->Finish();
    return result;
  }

  void ExpectRefused(const std::vector<v1::SizeSamples>& chunks, const std::string& reason, const std::string& field,
                     const std::string& message) {
    const grpc::Status status = MeshWith(chunks).status;
    EXPECT_EQ(DetailsOf(status).reason, reason) << status.error_message();
    EXPECT_EQ(DetailsOf(status).field, field) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(message));
  }

  ServiceHarness harness_;
};

// As many as would be no message of parameters, in messages of any size.
TEST_F(SizeSamplesTest, ComeInManyMessages) {
  constexpr size_t kCount = 40'000;
  const std::vector<double> points = RandomPoints(kCount, 2);
  std::vector<double> sizes;
  for (size_t i = 0; i < kCount; ++i) {
    sizes.push_back(0.03 + 0.02 * std::sin(6 * points[2 * i]));
  }
  std::vector<v1::SizeSamples> chunks(3);
  for (size_t i = 0; i < kCount; ++i) {
    v1::SizeSamples& chunk = chunks[i < 7 ? 0 : i < 20'000 ? 1 : 2];
    chunk.add_points(points[2 * i]);
    chunk.add_points(points[2 * i + 1]);
    chunk.add_sizes(sizes[i]);
  }
  chunks.emplace_back();  // of none
  const Result result = MeshWith(chunks, 0.5);
  ASSERT_TRUE(result.status.ok()) << result.status.error_message();
  const core::SizeSamples samples{points, sizes};
  EXPECT_EQ(core::ValidateSizing({2, result.points, result.simplices}, {.samples = &samples, .gradation = 0.5}),
            absl::OkStatus());
  // To the bit the mesh that the core makes of all of them.
  core::MeshParameters parameters{.dimension = 2};
  parameters.size_samples = std::make_shared<core::SizeSamples>(samples);
  parameters.gradation = 0.5;
  parameters.domain_low = {0, 0};
  parameters.domain_high = {1, 1};
  core::RunContext context;
  const absl::StatusOr<core::Mesh> expected = core::MeshPoints(parameters, {}, context);
  ASSERT_TRUE(expected.ok()) << expected.status();
  EXPECT_TRUE(std::equal(result.points.begin(), result.points.end(), expected->points.begin(), expected->points.end()));
}

TEST_F(SizeSamplesTest, MayBeLengthsOfEdges) {
  v1::SizeSamples samples = Samples({0.5, 0.5}, {0.05});
  const Result as_radii = MeshWith({samples});
  samples.set_measure(v1::SIZE_MEASURE_EDGE_LENGTH);
  const Result as_lengths = MeshWith({samples});
  const Result scaled = MeshWith({Samples({0.5, 0.5}, {core::CircumradiusOf(0.05, 2)})});
  ASSERT_TRUE(as_radii.status.ok() && as_lengths.status.ok() && scaled.status.ok());
  EXPECT_GT(as_lengths.points.size(), as_radii.points.size());
  EXPECT_EQ(as_lengths.points, scaled.points);
}

TEST_F(SizeSamplesTest, AreSeenByTheEstimate) {
  const auto estimate = [this](const v1::SizeSamples& samples) {
    grpc::ClientContext context;
    v1::EstimateMeshResponse response;
    const auto stream = harness_.stub().EstimateMesh(&context, &response);
    v1::EstimateMeshRequest request;
    *request.mutable_parameters() = UnitCubeParameters(2);
    stream->Write(request);
    *request.mutable_size_samples() = samples;
    stream->Write(request);
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
    return response.vertices();
  };
  EXPECT_GT(estimate(Samples({0.5, 0.5}, {0.001})), 4 * estimate(Samples({0.5, 0.5}, {0.1})));
}

TEST_F(SizeSamplesTest, WrongOnesAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const v1::SizeSamples good = Samples({0.25, 0.5, 0.75, 0.5}, {1, 1});
  ExpectRefused({good, Samples({0.5, 0.5}, {0})}, "INVALID_SIZES", "size_samples.sizes",
                "size_samples.sizes[2]: 0 is not allowed; a number above 0 is");
  ExpectRefused({Samples({0.5, 0.5}, {nan})}, "INVALID_SIZES", "size_samples.sizes", "size_samples.sizes[0]: nan");
  ExpectRefused({good, Samples({0.5, nan}, {1})}, "INVALID_SIZES", "size_samples.points",
                "size_samples.points[2]: coordinate 1 is nan");
  ExpectRefused({good, Samples({0.5}, {1})}, "INVALID_CHUNK_SHAPE", "size_samples.points",
                "the chunk of sizes after sample 2 has 1 coordinates for 1 sizes; expected 2 for each");
  ExpectRefused({Samples({0.5, 0.5}, {})}, "INVALID_CHUNK_SHAPE", "size_samples.points", "after sample 0");
  v1::SizeSamples unknown = good;
  unknown.set_measure(static_cast<v1::SizeMeasure>(9));
  ExpectRefused({unknown}, "INVALID_SIZES", "size_samples.measure", "measure: 9 is not known");
  ExpectRefused({Samples({0.5, 0.5}, {1e-300})}, "DEMANDS_TOO_FINE", "size_samples.sizes[0]",
                "size_samples.sizes[0]: 1e-300 is too fine");
}

TEST_F(SizeSamplesTest, ComeAfterTheParameters) {
  grpc::ClientContext context;
  const auto stream = harness_.stub().MeshPoints(&context);
  v1::MeshPointsRequest request;
  *request.mutable_size_samples() = Samples({0.5, 0.5}, {1});
  stream->Write(request);
  v1::MeshPointsResponse response;
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(DetailsOf(stream->Finish()).reason, "PARAMETERS_MISSING");
}

class FewSizeSamplesTest : public SizeSamplesTest {
 protected:
  FewSizeSamplesTest() : SizeSamplesTest({.max_points = 3}) {}
};

TEST_F(FewSizeSamplesTest, AreAsManyAsPointsMayBe) {
  const v1::SizeSamples two = Samples({0.25, 0.5, 0.75, 0.5}, {1, 1});
  EXPECT_TRUE(MeshWith({two, Samples({0.5, 0.5}, {1})}).status.ok());
  ExpectRefused({two, two}, "TOO_MANY_POINTS", "", "at least 4 samples of sizes; this server accepts at most 3");
}

}  // namespace
}  // namespace wellspace::server
