// Sizes at points on their way to a session.
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/client/grpc/fake_server.h"

namespace wellspace::client {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

constexpr char kSession[] = "sessions/one";
constexpr size_t kSizes = 300'000;

// A session's sizes, as a server takes them: at the end of a call.
class FakeSizes {
 public:
  // `breaks`: calls that break off after a message.
  FakeSizes(FakeServer& server, int breaks) : breaks_left_(breaks) {
    server.sessions.set_sizes = [this](grpc::ServerContext&, auto& reader, v1::SetSizesResponse& response) {
      std::lock_guard lock(mutex_);
      points.clear();
      sizes.clear();
      v1::SetSizesRequest request;
      for (int messages = 0; reader.Read(&request); ++messages) {
        EXPECT_LE(request.ByteSizeLong(), 1u << 20);
        EXPECT_EQ(request.name(), kSession);
        if (messages == 0) {
          revisions.push_back(request.expected_revision());
        }
        if (messages == 1 && breaks_left_ > 0) {
          --breaks_left_;
          return grpc::Status(grpc::StatusCode::UNAVAILABLE, "the connection broke");
        }
        mesh_revision = request.vertex_sizes().mesh_revision();
        measures.push_back(request.has_samples() ? request.samples().measure() : request.vertex_sizes().measure());
        points.insert(points.end(), request.samples().points().begin(), request.samples().points().end());
        const auto& more = request.has_samples() ? request.samples().sizes() : request.vertex_sizes().sizes();
        sizes.insert(sizes.end(), more.begin(), more.end());
      }
      response.set_size_count(sizes.size());
      response.set_revision(9);
      return grpc::Status::OK;
    };
  }

  std::vector<double> points;
  std::vector<double> sizes;
  std::vector<uint64_t> revisions;
  std::vector<v1::SizeMeasure> measures;
  uint64_t mesh_revision = 0;

 private:
  std::mutex mutex_;
  int breaks_left_ = 0;
};

std::vector<double> Numbers(size_t count) {
  std::vector<double> numbers;
  for (size_t i = 0; i < count; ++i) {
    numbers.push_back(0.5 + static_cast<double>(i));
  }
  return numbers;
}

TEST(SetSizes, AreRepeatedAsAWholeWhenTheyBreakOff) {
  FakeServer server;
  FakeSizes held(server, 1);
  const SizeSamples samples = {
      .points = Numbers(3 * kSizes), .sizes = Numbers(kSizes), .measure = SizeMeasure::kEdgeLength};
  CallOptions call;
  call.expected_revision = 3;
  const absl::StatusOr<SizesSet> set = server.Client().SetSizes(kSession, samples, call);
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->size_count, kSizes);
  EXPECT_EQ(set->revision, 9u);
  EXPECT_EQ(held.points, samples.points);
  EXPECT_EQ(held.sizes, samples.sizes);
  EXPECT_THAT(held.measures, Each(v1::SIZE_MEASURE_EDGE_LENGTH));
  EXPECT_THAT(held.revisions, ElementsAre(3, 3));
}

TEST(SetSizes, OfVertices) {
  FakeServer server;
  FakeSizes held(server, 0);
  const VertexSizes sizes = {.sizes = Numbers(kSizes), .measure = SizeMeasure::kCircumradius, .mesh_revision = 5};
  const absl::StatusOr<SizesSet> set = server.Client().SetVertexSizes(kSession, sizes);
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(held.sizes, sizes.sizes);
  EXPECT_EQ(held.mesh_revision, 5u);
  EXPECT_THAT(held.measures, Each(v1::SIZE_MEASURE_CIRCUMRADIUS));
}

TEST(SetSizes, NoneTakeThoseOfTheSessionBack) {
  FakeServer server;
  FakeSizes held(server, 0);
  const absl::StatusOr<SizesSet> set = server.Client().SetSizes(kSession, {});
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->size_count, 0u);
  EXPECT_EQ(held.revisions.size(), 1u);
}

TEST(SetSizes, OtherShapesAreTheServersToRefuse) {
  FakeServer server;
  FakeSizes held(server, 0);
  const SizeSamples samples = {.points = {1, 2, 3, 4, 5}, .sizes = {1, 2}};
  ASSERT_TRUE(server.Client().SetSizes(kSession, samples).ok());
  EXPECT_EQ(held.points, samples.points);
}

}  // namespace
}  // namespace wellspace::client
