#include "core/features/periodic_sides.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

PlanarGraph GraphOf(std::vector<Point<2>> points, const std::vector<std::pair<uint32_t, uint32_t>>& segments) {
  PlanarGraph graph;
  for (uint32_t p = 0; p < points.size(); ++p) {
    graph.input_of_point.push_back(p);
  }
  graph.points = std::move(points);
  for (const auto& [a, b] : segments) {
    graph.segments.push_back({.a = a, .b = b, .source = static_cast<uint32_t>(graph.segments.size())});
  }
  return graph;
}

absl::StatusOr<PeriodicSides> Find(const PlanarGraph& graph, const std::vector<int>& axes) {
  return PeriodicSides::Find(graph, axes, RunContext());
}

// The unit square, its left and right sides split at 0.5 and 0.75.
PlanarGraph Square() {
  return GraphOf({{0, 0}, {1, 0}, {1, 0.5}, {1, 0.75}, {1, 1}, {0, 1}, {0, 0.75}, {0, 0.5}},
                 {{0, 1}, {1, 2}, {3, 2}, {3, 4}, {5, 4}, {5, 6}, {6, 7}, {0, 7}});
}

TEST(PeriodicSidesTest, NoAxes) {
  const auto sides = Find(Square(), {});
  ASSERT_TRUE(sides.ok());
  EXPECT_FALSE(sides->HasAxes());
  EXPECT_EQ(sides->ImageOf(0), PeriodicSides::kNone);
  EXPECT_EQ(sides->MemoryBytes(), 0);
}

TEST(PeriodicSidesTest, SegmentsHaveImagesBothWays) {
  const auto sides = Find(Square(), {0, 1});
  ASSERT_TRUE(sides.ok()) << sides.status();
  EXPECT_TRUE(sides->HasAxes());
  const std::vector<std::pair<uint32_t, uint32_t>> pairs = {{1, 7}, {2, 6}, {3, 5}, {0, 4}};
  for (const auto& [s, t] : pairs) {
    EXPECT_EQ(sides->ImageOf(s), t);
    EXPECT_EQ(sides->ImageOf(t), s);
    EXPECT_EQ(sides->IsTurned(s), sides->IsTurned(t));
  }
  EXPECT_FALSE(sides->IsTurned(1));  // both upward
  EXPECT_FALSE(sides->IsTurned(2));  // both downward
  EXPECT_TRUE(sides->IsTurned(3));   // up on the right, down on the left
  EXPECT_FALSE(sides->IsTurned(0));
  EXPECT_GT(sides->MemoryBytes(), 0);
}

TEST(PeriodicSidesTest, OneAxisLeavesTheOtherAlone) {
  const auto sides = Find(Square(), {0});
  ASSERT_TRUE(sides.ok());
  EXPECT_EQ(sides->ImageOf(0), PeriodicSides::kNone);
  EXPECT_EQ(sides->ImageOf(1), 7);
}

TEST(PeriodicSidesTest, PointsWithoutImages) {
  PlanarGraph graph = Square();
  graph.points[7] = {0, 0.25};
  EXPECT_EQ(
      Find(graph, {0}).status().message(),
      "periodic_axes: points[7] at (0, 0.25), on the side x = 0, has no image on the side x = 1; expected a point "
      "at (1, 0.25), equal to the bit, or none on either side");
  EXPECT_TRUE(Find(graph, {1}).ok());
  graph = Square();
  graph.points[2] = {1, 0.25};
  EXPECT_THAT(Find(graph, {0}).status().message(), HasSubstr("points[2] at (1, 0.25), on the side x = 1"));
  // One ulp beside its place.
  graph = Square();
  graph.points[3] = {1, 0.75000000000000011};
  EXPECT_THAT(Find(graph, {0}).status().message(),
              HasSubstr("points[6] at (0, 0.75), on the side x = 0, has no image on the side x = 1"));
  // Not an end of a segment along the side.
  graph = Square();
  graph.points.push_back({0, 0.6});
  graph.input_of_point.push_back(PlanarGraph::kNoInput);
  EXPECT_THAT(Find(graph, {0}).status().message(), HasSubstr("the vertex at (0, 0.59999999999999998)"));
}

TEST(PeriodicSidesTest, SegmentsWithoutImages) {
  PlanarGraph graph = Square();
  graph.segments.erase(graph.segments.begin() + 2);
  EXPECT_EQ(Find(graph, {0}).status().message(),
            "periodic_axes: segments[6] from (0, 0.75) to (0, 0.5), on the side x = 0, has no image on the side x = 1; "
            "expected a segment from (1, 0.75) to (1, 0.5) that bounds what is meshed");
  graph = Square();
  graph.segments.erase(graph.segments.begin() + 7);
  EXPECT_THAT(Find(graph, {0}).status().message(), HasSubstr("segments[1] from (1, 0) to (1, 0.5), on the side x = 1"));
  // A turned square touches its bounding box in points.
  graph = GraphOf({{1, 0}, {2, 1}, {1, 2}, {0, 1}}, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
  EXPECT_THAT(Find(graph, {1}).status().message(), HasSubstr("no segment lies on the side y = 0 of the domain"));
}

TEST(PeriodicSidesTest, IsCancelled) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(PeriodicSides::Find(Square(), std::vector<int>{0}, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
