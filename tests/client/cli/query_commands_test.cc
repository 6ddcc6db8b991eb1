// cells and add.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/client/cli/process.h"
#include "tests/client/cli/session_fixture.h"

namespace wellspace {
namespace {

using client::MakeError;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class QueryCommandsTest : public SessionCommandsTest {};

TEST_F(QueryCommandsTest, CellsAsTextAndAsJson) {
  std::vector<uint32_t> asked;
  double beta = 0;
  const auto answer = [&asked](const auto& request, v1::VoronoiCellBatch& cells, double radius) {
    asked.assign(request.vertices().begin(), request.vertices().end());
    for (const uint32_t vertex : asked) {
      cells.add_vertices(vertex);
      cells.add_clip_radii(radius);
      cells.add_is_clipped(vertex == 7);
      cells.add_node_counts(vertex == 7 ? 2 : 1);
      for (int i = 0; i < (vertex == 7 ? 4 : 2); ++i) {
        cells.add_nodes(i + 0.5);
      }
      cells.add_neighbour_counts(2);
      cells.add_neighbours(vertex + 1);
      cells.add_neighbours(vertex + 2);
    }
  };
  server_.queries.cells = [&](grpc::ServerContext&, const v1::VoronoiCellsRequest& request, auto& writer) {
    v1::VoronoiCellsResponse response;
    answer(request, *response.mutable_cells(), std::numeric_limits<double>::infinity());
    writer.Write(response);
    return grpc::Status::OK;
  };
  server_.queries.clipped = [&](grpc::ServerContext&, const v1::ClippedVoronoiCellsRequest& request, auto& writer) {
    beta = request.beta();
    v1::ClippedVoronoiCellsResponse response;
    answer(request, *response.mutable_cells(), 0.25);
    writer.Write(response);
    return grpc::Status::OK;
  };
  const RunResult text = Run({"cells", "one", "7", "3"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  EXPECT_EQ(text.out, "7 inf 1 0.5,1.5;2.5,3.5 8;9\n3 inf 0 0.5,1.5 4;5\n");
  const RunResult clipped =
      Run({"cells", "one", "--beta", "4", "--vertices", "-", "--output", "json"}, "7, 3\n# no\n1\n");
  ASSERT_EQ(clipped.exit_code, 0) << clipped.err;
  EXPECT_EQ(beta, 4);
  EXPECT_THAT(asked, ElementsAre(7, 3, 1));
  EXPECT_EQ(json::parse(clipped.out.substr(0, clipped.out.find('\n'))),
            json::parse(R"({"vertex": 7, "clip_radius": 0.25,
      "is_clipped": true, "nodes": [[0.5, 1.5], [2.5, 3.5]], "neighbours": [8, 9]})"));
  ASSERT_EQ(Run({"cells", "one", "3", "-o", folder_.Path("cells.txt")}).exit_code, 0);
  EXPECT_EQ(folder_.Read("cells.txt"), "3 inf 0 0.5,1.5 4;5\n");
  const RunResult none = Run({"cells", "one", "--vertices", "-"}, "");
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_THAT(none.out, IsEmpty());
  const RunResult wrong = Run({"cells", "one", "--vertices", "-"}, "1\ntwo\n");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("<stdin>:2: expected the number of a vertex, got \"two\""));
}

TEST_F(QueryCommandsTest, NearestNeighboursAsTextAndAsJson) {
  server_.queries.nearest = [](grpc::ServerContext&, const v1::ApproximateNearestNeighborsRequest& request,
                               auto& writer) {
    EXPECT_THAT(request.vertices(), IsEmpty());
    v1::ApproximateNearestNeighborsResponse response;
    response.add_distances(0.5);
    response.add_distances(0.25);
    writer.Write(response);
    return grpc::Status::OK;
  };
  EXPECT_EQ(Run({"cells", "one", "--nearest"}).out, "0 0.5\n1 0.25\n");
  EXPECT_EQ(Run({"cells", "one", "--nearest", "--output", "json"}).out,
            "{\"vertex\":0,\"distance\":0.5}\n{\"vertex\":1,\"distance\":0.25}\n");
}

TEST_F(QueryCommandsTest, AddPrintsTheVertices) {
  server_.queries.add = [](const v1::AddVerticesRequest& request, v1::AddVerticesResponse& response) {
    EXPECT_THAT(request.points(), ElementsAre(1, 2, 3, 4));
    response.add_vertices(8);
    response.add_vertices(9);
    response.set_revision(6);
    return request.near().empty() || request.near(1) == 5
               ? grpc::Status::OK
               : MakeError(grpc::StatusCode::INVALID_ARGUMENT, "points[1] is outside", "ERROR_REASON_INVALID_POINTS");
  };
  EXPECT_EQ(Run({"add", "one", "-"}, "1,2\n3,4\n").out, "8\n9\n");
  const std::string near = folder_.Write("near", "4 5");
  EXPECT_EQ(json::parse(Run({"add", "one", "-", "--near", near, "--output", "json"}, "1,2\n3,4\n").out),
            json::parse(R"({"vertices": [8, 9], "revision": 6})"));
  const RunResult few = Run({"add", "one", "-", "--near", folder_.Write("few", "4")}, "1,2\n3,4\n");
  EXPECT_EQ(few.exit_code, 2);
  EXPECT_THAT(few.err, HasSubstr("expected a vertex for each of 2 points, got 1"));
  const RunResult outside = Run({"add", "one", "-", "--near", folder_.Write("far", "4 6")}, "1,2\n3,4\n");
  EXPECT_EQ(outside.exit_code, 2);
  EXPECT_THAT(outside.err, HasSubstr("<stdin>:2: points[1] is outside"));
}

// A request has 4 MiB: more points come in several, each of the revision that the one before has made.
TEST_F(QueryCommandsTest, AddsMorePointsThanARequestHas) {
  constexpr size_t kCount = 300'000;
  std::vector<int> sizes;
  std::vector<uint64_t> expected;
  size_t refuse_from = 2 * kCount;
  server_.queries.add = [&](const v1::AddVerticesRequest& request, v1::AddVerticesResponse& response) {
    EXPECT_LE(request.ByteSizeLong(), size_t{4} << 20);
    size_t first = 0;
    for (const int size : sizes) {
      first += size;
    }
    if (first >= refuse_from) {
      return MakeError(grpc::StatusCode::INVALID_ARGUMENT, "points[1] is outside", "ERROR_REASON_INVALID_POINTS");
    }
    sizes.push_back(request.points_size() / 2);
    expected.push_back(request.expected_revision());
    for (int i = 0; i < sizes.back(); ++i) {
      response.add_vertices(static_cast<uint32_t>(first) + i);
      EXPECT_EQ(request.points(2 * i), static_cast<double>(first) + i);
    }
    response.set_revision(10 + sizes.size());
    return grpc::Status::OK;
  };
  std::string cloud;
  std::string numbers;
  for (size_t i = 0; i < kCount; ++i) {
    cloud += std::to_string(i) + ",1\n";
    numbers += std::to_string(i) + "\n";
  }
  const std::string path = folder_.Write("cloud.csv", cloud);
  const RunResult added = Run({"add", "one", path, "--expected-revision", "7"});
  EXPECT_EQ(added.exit_code, 0) << added.err;
  EXPECT_EQ(added.out, numbers);
  EXPECT_EQ(sizes.size(), 2u);
  EXPECT_THAT(expected, ElementsAre(7, 11));
  const size_t first = sizes.at(0);
  sizes.clear();
  refuse_from = first;
  const RunResult refused = Run({"add", "one", path});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err,
              HasSubstr("cloud.csv:" + std::to_string(first + 2) + ": points[" + std::to_string(first + 1) +
                        "] is outside; the first " + std::to_string(first) + " of 300000 points were added before"));
  EXPECT_EQ(std::count(refused.out.begin(), refused.out.end(), '\n'), static_cast<std::ptrdiff_t>(first));
}

}  // namespace
}  // namespace wellspace
