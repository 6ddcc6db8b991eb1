// Segments become a planar graph: what is dropped, what is split, what is refused, and in which words.
#include "core/features/planar_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kSeparation = 1e-9;

struct Input {
  std::vector<double> points;
  std::vector<uint32_t> ends;
  std::vector<int32_t> markers{};
  CrossingRule crossings = CrossingRule::kRefuse;

  absl::StatusOr<PlanarGraph> Make(const Box<2>* box = nullptr, int threads = 1) const {
    Features features;
    features.ends = ends;
    features.markers = markers;
    features.crossings = crossings;
    return MakePlanarGraph(points, features, box, kSeparation, threads, RunContext());
  }
};

std::set<std::pair<uint32_t, uint32_t>> PairsOf(const PlanarGraph& graph) {
  std::set<std::pair<uint32_t, uint32_t>> pairs;
  for (const GraphSegment& segment : graph.segments) {
    pairs.insert(std::minmax(segment.a, segment.b));
  }
  return pairs;
}

TEST(PlanarGraphTest, WhatIsAGraphStaysAsItIs) {
  const auto graph = Input{.points = {0, 0, 1, 0, 0, 1, 5, 5}, .ends = {0, 1, 1, 2, 2, 0}, .markers = {7, 8, 9}}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->points.size(), 4u);
  ASSERT_EQ(graph->segments.size(), 3u);
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 1}, {1, 2}, {0, 2}}));
  EXPECT_EQ(graph->segments[1].marker, 8);
  EXPECT_EQ(graph->counts.crossings + graph->counts.touching_vertices + graph->counts.duplicate_segments, 0u);
}

TEST(PlanarGraphTest, EqualPointsAreOneAndSegmentsFollow) {
  const auto graph = Input{.points = {0, 0, 1, 0, 0, 0, 1, 1}, .ends = {0, 1, 2, 3, 0, 2}}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->points.size(), 3u);
  EXPECT_EQ(graph->point_of_input, (std::vector<uint32_t>{0, 1, 0, 2}));
  EXPECT_EQ(graph->counts.equal_points, 1u);
  EXPECT_EQ(graph->counts.empty_segments, 1u);
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 1}, {0, 2}}));
}

TEST(PlanarGraphTest, TheSameSegmentTwiceIsOne) {
  const auto graph = Input{.points = {0, 0, 1, 0}, .ends = {0, 1, 1, 0}}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  ASSERT_EQ(graph->segments.size(), 1u);
  EXPECT_EQ(graph->segments[0].rings, 2u);
  EXPECT_EQ(graph->counts.duplicate_segments, 1u);
}

TEST(PlanarGraphTest, TwoMarkersOnOneSegmentAreRefused) {
  const auto graph = Input{.points = {0, 0, 1, 0, 3, 0}, .ends = {0, 2, 1, 2}, .markers = {4, 5}}.Make();
  EXPECT_EQ(graph.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(graph.status().message(),
              AllOf(HasSubstr("segments[0] and segments[1]"), HasSubstr("markers 4 and 5"), HasSubstr("(1, 0)")));
}

TEST(PlanarGraphTest, AnEndThatIsNoPointIsRefused) {
  const auto graph = Input{.points = {0, 0, 1, 0}, .ends = {0, 1, 1, 2}}.Make();
  EXPECT_THAT(graph.status().message(), AllOf(HasSubstr("segments[1]"), HasSubstr("its end 2"), HasSubstr("0 to 1")));
}

TEST(PlanarGraphTest, AVertexOnASegmentSplitsIt) {
  const auto graph = Input{.points = {0, 0, 4, 0, 1, 0, 1, 3}, .ends = {0, 1, 2, 3}}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 2}, {1, 2}, {2, 3}}));
  EXPECT_EQ(graph->counts.touching_vertices, 1u);
  EXPECT_EQ(graph->points.size(), 4u);
}

TEST(PlanarGraphTest, SegmentsThatOverlapShareWhatTheyHaveInCommon) {
  const auto graph = Input{.points = {0, 0, 3, 0, 1, 0, 5, 0}, .ends = {0, 1, 2, 3}}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 2}, {1, 2}, {1, 3}}));
}

TEST(PlanarGraphTest, ACrossingIsRefusedWithBothSegmentsAndThePlace) {
  const auto graph = Input{.points = {0, 0, 2, 2, 0, 2, 2, 0}, .ends = {0, 1, 2, 3}}.Make();
  EXPECT_EQ(graph.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(graph.status().message(),
              AllOf(HasSubstr("segments[0] and segments[1] cross at (1, 1)"), HasSubstr("split there")));
}

TEST(PlanarGraphTest, ManyCrossingsAreCountedAndTenNamed) {
  Input input;
  for (int i = 0; i < 5; ++i) {
    for (const double end : {0.0, 6.0}) {
      input.points.insert(input.points.end(), {end, 1.0 + i});
      input.points.insert(input.points.end(), {1.0 + i, end});
    }
    const auto first = static_cast<uint32_t>(4 * i);
    input.ends.insert(input.ends.end(), {first, first + 2, first + 1, first + 3});
  }
  const auto graph = input.Make();
  EXPECT_THAT(graph.status().message(), HasSubstr("and 15 more"));
}

TEST(PlanarGraphTest, ACrossingBecomesAVertexIfThatIsAskedFor) {
  const auto graph =
      Input{.points = {0, 0, 2, 2, 0, 2, 2, 0}, .ends = {0, 1, 2, 3}, .crossings = CrossingRule::kSplit}.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  ASSERT_EQ(graph->points.size(), 5u);
  EXPECT_EQ(graph->points[4], (Point<2>{1, 1}));
  EXPECT_EQ(graph->input_of_point[4], PlanarGraph::kNoInput);
  EXPECT_EQ(graph->segments.size(), 4u);
  EXPECT_EQ(graph->counts.crossings, 1u);
}

TEST(PlanarGraphTest, AVertexTooCloseToASegmentIsRefusedOrLedThrough) {
  Input input{.points = {0, 0, 2, 0, 1, 1e-12, 1, 1}, .ends = {0, 1, 2, 3}};
  const auto refused = input.Make();
  EXPECT_THAT(refused.status().message(), AllOf(HasSubstr("points[2] at (1, "), HasSubstr("1e-12 from segments[0]"),
                                                HasSubstr("1e-09"), HasSubstr("make it an end of the segment")));
  for (const CrossingRule rule : {CrossingRule::kSnap, CrossingRule::kSplit}) {
    input.crossings = rule;
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 2}, {1, 2}, {2, 3}}));
    EXPECT_EQ(graph->counts.near_vertices, 1u);
  }
}

TEST(PlanarGraphTest, WhereSegmentsAreLedThroughPointsCrossingsAreRefusedAlone) {
  // More near points than an error names, and one crossing.
  Input input{.points = {0, 0, 100, 0, 50.5, -1, 50.5, 1}, .ends = {0, 1, 2, 3}, .crossings = CrossingRule::kSnap};
  for (int i = 1; i < 100; ++i) {
    input.points.insert(input.points.end(), {static_cast<double>(i), 1e-12});
  }
  const absl::Status refused = input.Make().status();
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("cross at (50.5, "), Not(HasSubstr("points["))));
  input.ends.resize(2);
  const auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->counts.near_vertices, 99u);
}

TEST(PlanarGraphTest, TheBoxBelongsToTheGraph) {
  const Box<2> box{{0, 0}, {2, 1}};
  const auto graph = Input{.points = {0.5, 0, 1, 0.5, 0, 0}, .ends = {0, 1}}.Make(&box);
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->points.size(), 6u);  // three corners are new
  EXPECT_EQ(graph->segments.size(), 6u);
  int sides = 0;
  for (const GraphSegment& segment : graph->segments) {
    sides += segment.IsBoxSide() ? 1 : 0;
  }
  EXPECT_EQ(sides, 5);
}

// No two segments cross, and no point is on one, by a look at all pairs.
void ExpectPlanar(const PlanarGraph& graph) {
  const auto side = [&](uint32_t a, uint32_t b, uint32_t p) {
    return Orientation<2>({graph.points[a], graph.points[b], graph.points[p]}).sign;
  };
  for (const GraphSegment& s : graph.segments) {
    for (uint32_t p = 0; p < graph.points.size(); ++p) {
      if (p != s.a && p != s.b && side(s.a, s.b, p) == Sign::kZero) {
        const auto [low, high] = std::minmax(graph.points[s.a], graph.points[s.b]);
        EXPECT_FALSE(low < graph.points[p] && graph.points[p] < high);
      }
    }
    for (const GraphSegment& t : graph.segments) {
      const bool share = s.a == t.a || s.a == t.b || s.b == t.a || s.b == t.b;
      EXPECT_FALSE(!share && side(s.a, s.b, t.a) * side(s.a, s.b, t.b) == Sign::kNegative &&
                   side(t.a, t.b, s.a) * side(t.a, t.b, s.b) == Sign::kNegative);
    }
  }
}

class PlanarGraphPropertyTest : public test::SeededTest {
 protected:
  PlanarGraphPropertyTest() : SeededTest(0x5e6) {}
};

TEST_F(PlanarGraphPropertyTest, RandomSegmentsOnASmallGridBecomeAGraph) {
  for (int run = 0; run < 200; ++run) {
    Input input;
    input.crossings = CrossingRule::kSplit;
    const uint64_t size = 2 + random_.Next() % 8;
    const size_t count = 1 + random_.Next() % 40;
    for (size_t i = 0; i < 2 * count; ++i) {
      input.points.push_back(static_cast<double>(random_.Next() % size));
      input.points.push_back(static_cast<double>(random_.Next() % size));
      input.ends.push_back(static_cast<uint32_t>(i));
    }
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    ExpectPlanar(*graph);
    for (size_t i = 0; i < 2 * count; ++i) {
      EXPECT_EQ(graph->points[graph->point_of_input[i]], (Point<2>{input.points[2 * i], input.points[2 * i + 1]}));
    }
  }
}

TEST_F(PlanarGraphPropertyTest, ThreadsMakeTheSameGraphAndTheSameError) {
  Input input;
  for (uint32_t i = 0; i < 1600; i += 2) {
    const Point<2> p = {random_.Unit(), random_.Unit()};
    const Point<2> q = {p[0] + 0.1 * random_.Unit(), p[1] + 0.1 * random_.Unit()};
    input.points.insert(input.points.end(), {p[0], p[1], q[0], q[1]});
    input.ends.insert(input.ends.end(), {i, i + 1});
  }
  const absl::Status refused = input.Make().status();
  EXPECT_FALSE(refused.ok());
  input.crossings = CrossingRule::kSplit;
  const auto alone = input.Make();
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_GT(alone->counts.crossings, 100u);
  for (const int threads : {2, 3, 4}) {
    input.crossings = CrossingRule::kRefuse;
    EXPECT_EQ(input.Make(nullptr, threads).status(), refused);
    input.crossings = CrossingRule::kSplit;
    const auto together = input.Make(nullptr, threads);
    ASSERT_TRUE(together.ok()) << together.status();
    EXPECT_EQ(together->points, alone->points);
    EXPECT_EQ(PairsOf(*together), PairsOf(*alone));
  }
}

}  // namespace
}  // namespace wellspace::core
