// Triangulations of points and segments in the plane: hulls, segments that are edges, segments that meet.
#include "core/features/plane_triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class PlaneTriangulationTest : public test::SeededTest {
 protected:
  PlaneTriangulationTest() : SeededTest(20'911) {}
};

struct Drawing {
  std::vector<Point<2>> points;
  std::vector<SegmentEnds> segments;
};

PlaneTriangulation Triangulated(const Drawing& drawing) {
  const RunContext context;
  return *TriangulatePlane(drawing.points, drawing.segments, context);
}

double AreaOf(const Drawing& drawing, const std::array<uint32_t, 3>& t) {
  return 0.5 * Cross(Difference<2>(drawing.points[t[1]], drawing.points[t[0]]),
                     Difference<2>(drawing.points[t[2]], drawing.points[t[0]]));
}

// Checks that the triangles cover `area` once, and have all points and segments.
void ExpectCovers(const Drawing& drawing, double area) {
  const PlaneTriangulation made = Triangulated(drawing);
  ASSERT_FALSE(made.do_meet);
  double sum = 0;
  std::set<uint32_t> used;
  std::set<SegmentEnds> edges;
  std::set<SegmentEnds> sides;  // in one direction
  for (const std::array<uint32_t, 3>& t : made.triangles) {
    ASSERT_EQ(Orientation<2>({drawing.points[t[0]], drawing.points[t[1]], drawing.points[t[2]]}).sign, Sign::kPositive);
    sum += AreaOf(drawing, t);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = t[k];
      const uint32_t b = t[(k + 1) % 3];
      used.insert(a);
      edges.insert({std::min(a, b), std::max(a, b)});
      EXPECT_TRUE(sides.insert({a, b}).second) << "two triangles on one side of an edge";
    }
  }
  EXPECT_NEAR(sum, area, 1e-12 * area);
  EXPECT_EQ(used.size(), drawing.points.size());
  for (const SegmentEnds& segment : drawing.segments) {
    EXPECT_TRUE(edges.contains(segment)) << segment[0] << " " << segment[1];
  }
  for (const std::array<uint32_t, 3>& t : made.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = t[k];
      const uint32_t b = t[(k + 1) % 3];
      const bool is_segment = std::any_of(drawing.segments.begin(), drawing.segments.end(), [&](const SegmentEnds& s) {
        return (s[0] == a && s[1] == b) || (s[0] == b && s[1] == a);
      });
      const auto beyond = std::find_if(made.triangles.begin(), made.triangles.end(), [&](const auto& u) {
        return (u[0] == b && u[1] == a) || (u[1] == b && u[2] == a) || (u[2] == b && u[0] == a);
      });
      if (!is_segment && beyond != made.triangles.end()) {
        const uint32_t across = (*beyond)[0] ^ (*beyond)[1] ^ (*beyond)[2] ^ a ^ b;
        EXPECT_NE(
            InSphere<2>({drawing.points[t[0]], drawing.points[t[1]], drawing.points[t[2]]}, drawing.points[across])
                .sign,
            Sign::kPositive);
      }
    }
  }
  // Of a hull whose sides are covered: triangles = 2 n - 2 - those on the hull.
  const auto open = std::count_if(sides.begin(), sides.end(), [&](const SegmentEnds& side) {
    return !sides.contains({side[1], side[0]});
  });
  EXPECT_EQ(made.triangles.size() + 2 + static_cast<size_t>(open), 2 * drawing.points.size());
}

// Draws points of the unit square on a lattice, of `steps` a side, with its corners, and segments that meet nothing.
Drawing Drawn(test::SplitMix64& random, int steps, int points, int tries) {
  std::set<Point<2>> places = {{0, 0}, {0, 1}, {1, 0}, {1, 1}};
  for (int i = 0; i < points; ++i) {
    places.insert({static_cast<double>(random.Below(static_cast<uint64_t>(steps) + 1)) / steps,
                   static_cast<double>(random.Below(static_cast<uint64_t>(steps) + 1)) / steps});
  }
  Drawing drawing;
  drawing.points.assign(places.begin(), places.end());
  const auto turn = [&](uint32_t a, uint32_t b, uint32_t c) {
    return Orientation<2>({drawing.points[a], drawing.points[b], drawing.points[c]}).sign;
  };
  for (int i = 0; i < tries; ++i) {
    const auto one = static_cast<uint32_t>(random.Below(places.size()));
    const auto other = static_cast<uint32_t>(random.Below(places.size()));
    const auto [a, b] = std::minmax(one, other);
    bool is_apart = a != b;
    for (uint32_t p = a + 1; p < b; ++p) {
      is_apart = is_apart && turn(a, b, p) != Sign::kZero;  // points ascend: it would be between
    }
    for (const auto& [c, d] : drawing.segments) {
      const bool is_common = a == c || a == d || b == c || b == d;
      is_apart = is_apart && !(a == c && b == d) &&
                 (is_common || !(turn(a, b, c) != turn(a, b, d) && turn(c, d, a) != turn(c, d, b)));
    }
    if (is_apart) {
      drawing.segments.push_back({a, b});
    }
  }
  return drawing;
}

TEST_F(PlaneTriangulationTest, FewPoints) {
  EXPECT_TRUE(Triangulated({}).triangles.empty());
  EXPECT_TRUE(Triangulated({{{0, 0}, {1, 1}, {2, 2}}, {{0, 1}, {1, 2}}}).triangles.empty()) << "on a line";
  ExpectCovers({{{0, 0}, {0, 1}, {1, 0}}, {}}, 0.5);
  ExpectCovers({{{0, 0}, {0, 1}, {1, 0}, {1, 1}}, {{0, 3}}}, 1);
  ExpectCovers({{{0, 0}, {0, 1}, {1, 0}, {1, 1}}, {{1, 2}}}, 1);
}

TEST_F(PlaneTriangulationTest, SegmentsByChanceAreEdges) {
  for (int run = 0; run < 300; ++run) {
    SCOPED_TRACE(run);
    ExpectCovers(Drawn(random_, run % 3 == 0 ? 7 : 1000, 1 + run / 4, 3 * run), 1);
  }
}

TEST_F(PlaneTriangulationTest, TheOrderOfSegmentsChangesNothing) {
  Drawing drawing = Drawn(random_, 30, 60, 200);
  const PlaneTriangulation first = Triangulated(drawing);
  std::reverse(drawing.segments.begin(), drawing.segments.end());
  for (SegmentEnds& ends : drawing.segments) {
    std::swap(ends[0], ends[1]);
  }
  EXPECT_EQ(Triangulated(drawing).triangles, first.triangles);
}

TEST_F(PlaneTriangulationTest, SegmentsThatMeetAreSeen) {
  const Drawing square{{{0, 0}, {0, 1}, {1, 0}, {1, 1}}, {}};
  Drawing crossed = square;
  crossed.segments = {{0, 3}, {1, 2}};
  EXPECT_TRUE(Triangulated(crossed).do_meet);
  EXPECT_TRUE(Triangulated(crossed).triangles.empty());
  EXPECT_TRUE(Triangulated({{{0, 0}, {1, 1}, {2, 2}}, {{0, 2}}}).do_meet) << "a point on a segment";
  EXPECT_TRUE(Triangulated({{{0, 0}, {1, 1}, {2, 2}}, {{0, 1}, {0, 2}}}).do_meet) << "one over another";
  EXPECT_TRUE(Triangulated({{{0, 0}, {1, 1}, {2, 2}, {3, 3}}, {{0, 2}, {1, 3}}}).do_meet);
  for (int run = 0; run < 200; ++run) {
    SCOPED_TRACE(run);
    Drawing drawing = Drawn(random_, 1000, 20, 100);
    if (drawing.segments.empty()) {
      continue;
    }
    // Across the middle of one of them.
    const auto [a, b] = drawing.segments[random_.Below(drawing.segments.size())];
    const Point<2> p = drawing.points[a];
    const Point<2> q = drawing.points[b];
    const double share = 0.5 + 1e-3 * random_.Unit();
    const Point<2> middle = {p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])};
    const double size = 1e-6;
    const std::array<Point<2>, 2> ends = {Point<2>{middle[0] - size * (q[1] - p[1]), middle[1] + size * (q[0] - p[0])},
                                          Point<2>{middle[0] + size * (q[1] - p[1]), middle[1] - size * (q[0] - p[0])}};
    Drawing more = drawing;
    more.points.insert(more.points.end(), ends.begin(), ends.end());
    std::sort(more.points.begin(), more.points.end());
    const auto number = [&](const Point<2>& of) {
      return static_cast<uint32_t>(std::lower_bound(more.points.begin(), more.points.end(), of) - more.points.begin());
    };
    for (SegmentEnds& segment : more.segments) {
      segment = {number(drawing.points[segment[0]]), number(drawing.points[segment[1]])};
    }
    more.segments.push_back({number(ends[0]), number(ends[1])});
    EXPECT_TRUE(Triangulated(more).do_meet);
  }
}

TEST_F(PlaneTriangulationTest, IsCancelled) {
  RunContext context;
  context.Cancel();
  const Drawing drawing = Drawn(random_, 1000, 20, 20);
  EXPECT_EQ(TriangulatePlane(drawing.points, drawing.segments, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
