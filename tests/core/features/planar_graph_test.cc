// Segments become a planar graph: those that are dropped, split or refused, and the words of the errors.
#include "core/features/planar_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "tests/support/clouds.h"
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
  uint64_t max_vertices = 10'000'000;
  double snap_distance = 0;

  absl::StatusOr<PlanarGraph> Make(const Box<2>* box = nullptr, int threads = 1,
                                   const RunContext& context = RunContext()) const {
    Features features;
    features.ends = ends;
    features.markers = markers;
    features.crossings = crossings;
    features.snap_distance = snap_distance;
    return MakePlanarGraph(points, features, box, kSeparation, max_vertices, threads, context);
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
  EXPECT_THAT(graph.status().message(), AllOf(HasSubstr("segments[0] and segments[1] cross at (1, 1)"),
                                              HasSubstr("or be split there by the rule of crossings \"split\"")));
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

TEST(PlanarGraphTest, ANeedleThatNoDoubleSeparatesIsClosed) {
  // Two segments with a common end: the shorter one ends beside the other.
  const Input input{.points = {0, 0, 2, 0, 1, 1e-12}, .ends = {0, 1, 2, 0}};
  const auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 2}, {1, 2}}));
  EXPECT_EQ(graph->counts.near_vertices, 1u);
  EXPECT_EQ(graph->counts.duplicate_segments, 1u);
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

TEST(PlanarGraphTest, SegmentsAreLedThroughPointsWithinTheSnapDistance) {
  Input input{.points = {0, 0, 2, 0, 1, 0.01, 1, 1, 0.5, 0.02}, .ends = {0, 1, 2, 3}};
  input.snap_distance = 0.0149;  // not looked at where nothing is led
  EXPECT_EQ(PairsOf(*input.Make()), (std::set<std::pair<uint32_t, uint32_t>>{{0, 1}, {2, 3}}));
  for (const CrossingRule rule : {CrossingRule::kSnap, CrossingRule::kSplit}) {
    input.crossings = rule;
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    // That leads it near to the other point, and not as near as that: 0.015.
    EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 2}, {1, 2}, {2, 3}}));
    EXPECT_EQ(graph->counts.near_vertices, 1u);
    EXPECT_EQ(graph->points.size(), 5u);
  }
  input.snap_distance = 0.025;
  EXPECT_EQ(PairsOf(*input.Make()), (std::set<std::pair<uint32_t, uint32_t>>{{0, 4}, {2, 4}, {1, 2}, {2, 3}}));
}

TEST(PlanarGraphTest, ACrossingBecomesAPointWithinTheSnapDistance) {
  Input input{.points = {0, 0, 2, 0, 1, -1, 1, 1, 1.01, 0.005},
              .ends = {0, 1, 2, 3},
              .crossings = CrossingRule::kSplit,
              .snap_distance = 0.02};
  const auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(PairsOf(*graph), (std::set<std::pair<uint32_t, uint32_t>>{{0, 4}, {1, 4}, {2, 4}, {3, 4}}));
  EXPECT_EQ(graph->points.size(), 5u);
}

TEST(PlanarGraphTest, CornersThatDoublesCannotServeAreOne) {
  // The triangles have a corner in common, but for its last bits.
  const Input input{.points = {0, 0, 2, 0, 1, 1, 1, 1 + 1e-12, 2, 2, 0, 2},
                    .ends = {0, 1, 1, 2, 2, 0, 3, 4, 4, 5, 5, 3}};
  const auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->points.size(), 5u);
  EXPECT_EQ(graph->point_of_input, (std::vector<uint32_t>{0, 1, 2, 2, 3, 4}));
  EXPECT_EQ(graph->counts.merged_points, 1u);
  EXPECT_EQ(graph->counts.equal_points, 0u);
  EXPECT_EQ(graph->segments.size(), 6u);
}

TEST(PlanarGraphTest, AVertexOnASegmentStaysOnItWhereTwinsMoveThat) {
  // The end of the segment moves to its twin, and the vertex on it is beside it by that.
  const Input input{.points = {0, 0, 3, 3 + 1e-12, 1, 1, 1, 2, 3, 3, 4, 0}, .ends = {0, 1, 2, 3, 4, 5, 5, 4}};
  const auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->counts.merged_points, 1u);
  EXPECT_TRUE(PairsOf(*graph).contains({0, 2})) << "led through the vertex";
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

// Places and segments, whatever their numbers are.
using Places = std::pair<std::set<Point<2>>, std::set<std::array<Point<2>, 2>>>;

Places PlacesOf(const PlanarGraph& graph) {
  Places places;
  places.first.insert(graph.points.begin(), graph.points.end());
  for (const GraphSegment& segment : graph.segments) {
    places.second.insert({graph.points[segment.a], graph.points[segment.b]});
  }
  return places;
}

// The same with segments in another order, some of them the other way round, and points in another order.
Input Shuffled(const Input& input, test::SplitMix64& random) {
  const size_t segments = input.ends.size() / 2;
  const size_t points = input.points.size() / 2;
  const auto shuffled = [&](size_t count) {
    std::vector<uint32_t> order(count);
    for (uint32_t i = 0; i < count; ++i) {
      order[i] = i;
      std::swap(order[i], order[random.Below(i + 1)]);
    }
    return order;
  };
  Input other = input;
  const std::vector<uint32_t> point_at = shuffled(points);
  for (size_t i = 0; i < points; ++i) {
    std::copy_n(input.points.begin() + 2 * static_cast<std::ptrdiff_t>(i), 2,
                other.points.begin() + 2 * static_cast<std::ptrdiff_t>(point_at[i]));
  }
  const std::vector<uint32_t> segment_at = shuffled(segments);
  for (size_t i = 0; i < segments; ++i) {
    const size_t flip = random.Below(2);
    other.ends[2 * segment_at[i] + flip] = point_at[input.ends[2 * i]];
    other.ends[2 * segment_at[i] + 1 - flip] = point_at[input.ends[2 * i + 1]];
  }
  return other;
}

// Segments that cross: at any angles, through one place, bent over each other, and with others that lie on them.
Input CrossingSegments(test::SplitMix64& random) {
  Input input{.points = {}, .ends = {}, .crossings = CrossingRule::kSplit};
  const size_t count = 2 + random.Below(25);
  const uint64_t kind = random.Below(4);
  for (uint32_t i = 0; i < count; ++i) {
    Point<2> p = {random.Unit(), random.Unit()};
    Point<2> q = {random.Unit(), random.Unit()};
    if (kind == 1) {  // near to one place
      q = {0.3 + 0.2 * (0.3 - p[0]), 0.7 + 0.2 * (0.7 - p[1])};
    } else if (kind == 2) {  // hardly an angle
      p = {1e-3 * p[0], 1e-7 * p[1]};
      q = {1 + 1e-3 * q[0], 1e-7 * q[1]};
    } else if (kind == 3) {  // on a grid
      p = {std::floor(5 * p[0]), std::floor(5 * p[1])};
      q = {std::floor(5 * q[0]), std::floor(5 * q[1])};
    }
    input.points.insert(input.points.end(), {p[0], p[1], q[0], q[1]});
    input.ends.insert(input.ends.end(), {2 * i, 2 * i + 1});
  }
  return input;
}

TEST_F(PlanarGraphPropertyTest, CrossingsAreTheSameInAnyOrder) {
  int crossings = 0;
  for (int run = 0; run < 100; ++run) {
    const Input input = CrossingSegments(random_);
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    crossings += static_cast<int>(graph->counts.crossings);
    for (int other = 0; other < 4; ++other) {
      const auto shuffled = Shuffled(input, random_).Make(nullptr, 1 + other % 2);
      ASSERT_TRUE(shuffled.ok()) << shuffled.status();
      ASSERT_EQ(PlacesOf(*shuffled), PlacesOf(*graph)) << "run " << run;
      EXPECT_EQ(shuffled->counts.crossings, graph->counts.crossings);
      EXPECT_EQ(shuffled->counts.touching_vertices, graph->counts.touching_vertices);
    }
  }
  EXPECT_GT(crossings, 1000);
}

TEST_F(PlanarGraphPropertyTest, WhatIsSnappedIsTheSameInAnyOrder) {
  uint64_t led = 0;
  for (int run = 0; run < 100; ++run) {
    Input input = CrossingSegments(random_);
    input.snap_distance = 1e-3 * static_cast<double>(1 + random_.Below(20));
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    led += graph->counts.near_vertices;
    for (int other = 0; other < 4; ++other) {
      const auto shuffled = Shuffled(input, random_).Make(nullptr, 1 + other % 2);
      ASSERT_TRUE(shuffled.ok()) << shuffled.status();
      ASSERT_EQ(PlacesOf(*shuffled), PlacesOf(*graph)) << "run " << run;
      EXPECT_EQ(shuffled->counts.near_vertices, graph->counts.near_vertices);
    }
  }
  EXPECT_GT(led, 100u);
}

TEST_F(PlanarGraphPropertyTest, SegmentsOnACommonLineShareWhatTheyHaveInCommon) {
  for (int run = 0; run < 200; ++run) {
    // On a line that no axis is parallel to, at whole places; by hand: which parts there are, and how many lie on each.
    const Point<2> along = {static_cast<double>(1 + random_.Below(5)), static_cast<double>(random_.Below(9)) - 4};
    Input input;
    std::vector<uint32_t> rings(40);
    std::set<uint64_t> ends;
    for (uint32_t i = 0; i < 1 + random_.Below(30); ++i) {
      const uint64_t from = random_.Below(39);
      const uint64_t to = from + 1 + random_.Below(39 - from);
      for (const uint64_t at : {from, to}) {
        const auto place = static_cast<double>(at);
        input.points.insert(input.points.end(), {place * along[0], place * along[1]});
        ends.insert(at);
      }
      input.ends.insert(input.ends.end(), {2 * i, 2 * i + 1});
      for (uint64_t at = from; at < to; ++at) {
        ++rings[at];
      }
    }
    const auto graph = input.Make(nullptr, 1);
    ASSERT_TRUE(graph.ok()) << graph.status();
    size_t parts = 0;
    for (auto end = ends.begin(); std::next(end) != ends.end(); ++end) {
      parts += rings[*end] > 0 ? 1 : 0;
    }
    EXPECT_EQ(graph->segments.size(), parts);
    for (const GraphSegment& segment : graph->segments) {
      EXPECT_EQ(segment.rings, rings[static_cast<size_t>(graph->points[segment.a][0] / along[0])]);
    }
    EXPECT_TRUE(std::is_sorted(graph->segments.begin(), graph->segments.end(), [&](const auto& s, const auto& t) {
      return std::tie(s.source, graph->points[s.a]) < std::tie(t.source, graph->points[t.a]);
    }));
  }
}

// So many pairs of n features may be compared: far less than n^2.
uint64_t MostPairsOf(uint64_t n) { return static_cast<uint64_t>(40.0 * static_cast<double>(n) * std::log2(n)); }

// A fan of segments from (0.5, 0.5), with lengths from 0.1 to 0.5.
Input Fan(uint32_t count) {
  Input input{.points = {0.5, 0.5}, .ends = {}};
  for (uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const double length = 0.1 + 0.4 * (i % 7) / 6;
    input.points.insert(input.points.end(), {0.5 + length * std::cos(angle), 0.5 + length * std::sin(angle)});
    input.ends.insert(input.ends.end(), {0, i + 1});
  }
  return input;
}

constexpr uint32_t kMany = 100'000;

TEST(PlanarGraphTest, SegmentsWithACommonEndAreNotComparedInPairs) {
  Input input = Fan(kMany);
  auto graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_EQ(graph->segments.size(), kMany);
  EXPECT_LT(graph->counts.compared_pairs, MostPairsOf(kMany));

  // One that leads through the end that they have in common.
  constexpr uint32_t kFewer = 10'000;
  input = Fan(kFewer);
  input.points.insert(input.points.end(), {0, 0.0078125, 1, 0.9921875});
  input.ends.insert(input.ends.end(), {kFewer + 1, kFewer + 2});
  input.crossings = CrossingRule::kSplit;
  graph = input.Make();
  ASSERT_TRUE(graph.ok()) << graph.status();
  EXPECT_LT(graph->counts.compared_pairs, 4 * MostPairsOf(kFewer));
}

TEST(PlanarGraphTest, SegmentsThatOverlapAreNotComparedInPairs) {
  // Each lies on half of the others; on an axis, and on no axis.
  for (const double slope : {0.0, 3.0}) {
    Input input;
    for (uint32_t i = 0; i < kMany; ++i) {
      const double from = i;
      const double to = from + kMany / 2;
      input.points.insert(input.points.end(), {from, slope * from, to, slope * to});
      input.ends.insert(input.ends.end(), {2 * i, 2 * i + 1});
    }
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    EXPECT_EQ(graph->segments.size(), kMany + kMany / 2 - 1);
    EXPECT_EQ(graph->segments[kMany / 2].rings, kMany / 2);
    EXPECT_LT(graph->counts.compared_pairs, 4 * MostPairsOf(kMany));
  }
}

TEST(PlanarGraphTest, SegmentsSideBySideAreNotComparedInPairs) {
  // Nested rings: on each of their sides, all run side by side. Then the same, turned.
  for (const double turn : {0.0, 0.3}) {
    constexpr uint32_t kRings = 10'000;
    Input input;
    for (uint32_t i = 0; i < kRings; ++i) {
      const double r = 0.1 + 0.4 * i / kRings;
      for (uint32_t k = 0; k < 4; ++k) {
        const double angle = turn + std::numbers::pi / 4 * (2 * k + 1);
        input.points.insert(input.points.end(), {r * std::cos(angle), r * std::sin(angle)});
        input.ends.insert(input.ends.end(), {4 * i + k, 4 * i + (k + 1) % 4});
      }
    }
    const auto graph = input.Make();
    ASSERT_TRUE(graph.ok()) << graph.status();
    EXPECT_EQ(graph->segments.size(), 4 * kRings);
    EXPECT_LT(graph->counts.compared_pairs, MostPairsOf(4 * kRings));
  }
}

TEST(PlanarGraphTest, MoreCrossingsThanVerticesAreRefusedWhenTheyAreCounted) {
  test::SplitMix64 random(7);
  Input input{.points = {}, .ends = {}, .crossings = CrossingRule::kSplit, .max_vertices = 10'000};
  for (uint32_t i = 0; i < 2000; ++i) {
    input.points.insert(input.points.end(), {random.Unit(), random.Unit(), random.Unit(), random.Unit()});
    input.ends.insert(input.ends.end(), {2 * i, 2 * i + 1});
  }
  const absl::Status refused = input.Make().status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), AllOf(HasSubstr("pairs of them cross"), HasSubstr("max_vertices = 10000")));
}

TEST(PlanarGraphTest, ARunThatIsCancelledMakesNoGraph) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(Fan(1000).Make(nullptr, 2, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
