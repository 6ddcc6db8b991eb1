#include "client/formats/middle_nodes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/formats/random_mesh.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Edge = std::pair<uint32_t, uint32_t>;

std::vector<Edge> EdgesOf(const MiddleNodes& middles) {
  std::vector<Edge> edges;
  const absl::Status status = middles.ForEachEdge([&](uint32_t low, uint32_t high) {
    edges.emplace_back(low, high);
    return absl::OkStatus();
  });
  EXPECT_TRUE(status.ok());
  return edges;
}

// Edges of every pair of corners, which a set orders as nodes are to be ordered.
std::set<Edge> AllEdges(std::span<const uint32_t> elements, size_t corners) {
  std::set<Edge> edges;
  for (; !elements.empty(); elements = elements.subspan(corners)) {
    for (size_t i = 0; i < corners; ++i) {
      for (size_t j = 0; j < i; ++j) {
        edges.insert(std::minmax(elements[i], elements[j]));
      }
    }
  }
  return edges;
}

// Also of simplices with a vertex twice, and facets that no simplex has.
TEST(MiddleNodesTest, EachEdgeHasOneNodeInTheOrderOfItsEnds) {
  for (const int dimension : {2, 3}) {
    Mesh mesh = RandomMesh(dimension, 60, 200);
    mesh.facets = RandomMesh(dimension - 1, 60, 40).simplices;
    std::set<Edge> expected = AllEdges(mesh.simplices, dimension + 1);
    expected.merge(AllEdges(mesh.facets, dimension));
    const absl::StatusOr<MiddleNodes> middles = MiddleNodes::Of(mesh.View(), {});
    ASSERT_TRUE(middles.ok()) << middles.status();
    EXPECT_EQ(middles->count(), expected.size());
    EXPECT_EQ(EdgesOf(*middles), std::vector<Edge>(expected.begin(), expected.end()));
    uint32_t node = 60;
    for (const auto& [low, high] : expected) {
      EXPECT_EQ(middles->NodeOf(low, high), node);
      EXPECT_EQ(middles->NodeOf(high, low), node++);
    }
  }
}

TEST(MiddleNodesTest, NoSimplicesHaveNone) {
  const Mesh mesh{.dimension = 3, .points = {1, 2, 3}, .simplices = {}};
  const absl::StatusOr<MiddleNodes> middles = MiddleNodes::Of(mesh.View(), {});
  ASSERT_TRUE(middles.ok());
  EXPECT_EQ(middles->count(), 0);
  const Mesh nothing{.dimension = 2, .points = {}, .simplices = {}};
  const absl::StatusOr<MiddleNodes> empty = MiddleNodes::Of(nothing.View(), {});
  ASSERT_TRUE(empty.ok());
  EXPECT_EQ(empty->count(), 0);
}

TEST(MiddleNodesTest, AnErrorEndsTheWalk) {
  const Mesh mesh{.dimension = 2, .points = {0, 0, 1, 0, 0, 1}, .simplices = {0, 1, 2}};
  const absl::StatusOr<MiddleNodes> middles = MiddleNodes::Of(mesh.View(), {});
  ASSERT_TRUE(middles.ok());
  EXPECT_THAT(EdgesOf(*middles), ElementsAre(Edge(0, 1), Edge(0, 2), Edge(1, 2)));
  int calls = 0;
  const absl::Status status = middles->ForEachEdge(
      [&](uint32_t, uint32_t) { return ++calls == 2 ? absl::DataLossError("enough") : absl::OkStatus(); });
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(calls, 2);
}

TEST(MiddleNodesTest, RefusesVerticesThatAreNotThereAndStops) {
  Mesh mesh = RandomMesh(3, 10, 10);
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(MiddleNodes::Of(mesh.View(), source.get_token()).status().code(), absl::StatusCode::kCancelled);
  mesh.simplices[7] = 10;
  EXPECT_THAT(std::string(MiddleNodes::Of(mesh.View(), {}).status().message()),
              HasSubstr("a mesh of 10 vertices has an element of vertex 10"));
  mesh.simplices[7] = 9;
  mesh.facets = {0, 11, 1};
  EXPECT_THAT(std::string(MiddleNodes::Of(mesh.View(), {}).status().message()), HasSubstr("element of vertex 11"));
}

}  // namespace
}  // namespace wellspace::formats
