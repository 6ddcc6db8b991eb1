// Faces of planar graphs: holes, nesting, seeds, rules, and refusals.
#include "core/features/planar_faces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "core/features/planar_graph.h"
#include "core/features/polygon_seeds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Rings and open lines, and the faces between them.
struct Drawing {
  std::vector<double> points;
  std::vector<uint32_t> ends;
  std::vector<uint8_t> is_open;
  std::vector<uint32_t> groups;  // the next segments are of `group`
  uint32_t group = 0;
  std::vector<FaceSeed> seeds;
  FaceRule rule = FaceRule::kHoles;
  PlanarGraph graph;

  Drawing& Ring(const std::vector<Point<2>>& corners) { return Add(corners, true); }
  Drawing& Line(const std::vector<Point<2>>& corners) { return Add(corners, false); }
  Drawing& Square(double low, double high) { return Ring({{low, low}, {high, low}, {high, high}, {low, high}}); }

  Drawing& Add(const std::vector<Point<2>>& corners, bool is_closed) {
    const auto first = static_cast<uint32_t>(points.size() / 2);
    const auto count = static_cast<uint32_t>(corners.size());
    for (uint32_t i = 0; i < count; ++i) {
      points.insert(points.end(), corners[i].begin(), corners[i].end());
      if (i + 1 < count || is_closed) {
        ends.insert(ends.end(), {first + i, first + (i + 1) % count});
        is_open.push_back(is_closed ? 0 : 1);
        groups.push_back(group);
      }
    }
    return *this;
  }

  Drawing& Group(uint32_t number) {
    group = number;
    return *this;
  }

  // A polygon of the segments from `first` on.
  Drawing& Polygon(uint32_t first, int32_t region) {
    seeds.push_back(
        {.region = region, .first_segment = first, .segment_count = static_cast<uint32_t>(ends.size() / 2) - first});
    return *this;
  }

  absl::StatusOr<PlanarFaces> Find() {
    Features features;
    features.ends = ends;
    features.is_open = is_open;
    features.groups = groups;
    features.faces = rule;
    features.crossings = CrossingRule::kSplit;
    features.seeds = seeds;
    absl::StatusOr<PlanarGraph> made = MakePlanarGraph(points, features, nullptr, 1e-12, 1'000'000, 1, RunContext());
    if (!made.ok()) {
      return made.status();
    }
    graph = *std::move(made);
    return FindFaces(graph, rule, seeds, RunContext());
  }
};

size_t MeshedCount(const PlanarFaces& faces) {
  return static_cast<size_t>(
      std::count_if(faces.faces.begin(), faces.faces.end(), [](const Face& face) { return face.is_meshed; }));
}

// The face that a point lies in, as a seed there tells.
uint32_t FaceAt(Drawing drawing, const Point<2>& p) {
  drawing.seeds = {{.at = p, .region = 99}};
  const auto faces = drawing.Find();
  for (uint32_t face = 0; faces.ok() && face < faces->faces.size(); ++face) {
    if (faces->faces[face].region == 99) {
      return face;
    }
  }
  return PlanarFaces::kOnSegments;
}

TEST(PlanarFacesTest, ARingHasAnInsideAndAnOutside) {
  Drawing drawing = Drawing().Square(0, 1);
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  ASSERT_EQ(faces->faces.size(), 2u);
  EXPECT_FALSE(faces->faces[0].is_meshed);
  EXPECT_TRUE(faces->faces[1].is_meshed);
  for (uint32_t s = 0; s < 4; ++s) {
    EXPECT_NE(faces->left_face[HalfEdgeOf(s, false)], faces->left_face[HalfEdgeOf(s, true)]);
  }
}

TEST(PlanarFacesTest, ASeedMakesAHole) {
  Drawing drawing = Drawing().Square(0, 3).Square(1, 2);
  drawing.seeds = {{.at = {1.5, 1.5}, .is_hole = true}};
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(faces->faces.size(), 3u);
  EXPECT_EQ(MeshedCount(*faces), 1u);
}

TEST(PlanarFacesTest, IslandsInLakesInIslandsByEvenAndOdd) {
  Drawing drawing = Drawing().Square(0, 9).Square(1, 8).Square(2, 7).Square(3, 6);
  drawing.rule = FaceRule::kEvenOdd;
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(faces->faces.size(), 5u);
  EXPECT_TRUE(faces->faces[FaceAt(drawing, {0.5, 5})].is_meshed);
  EXPECT_FALSE(faces->faces[FaceAt(drawing, {1.5, 5})].is_meshed);
  EXPECT_TRUE(faces->faces[FaceAt(drawing, {2.5, 5})].is_meshed);
  EXPECT_FALSE(faces->faces[FaceAt(drawing, {4, 5})].is_meshed);
}

TEST(PlanarFacesTest, TheUnionOfGroupsEachByEvenAndOdd) {
  Drawing drawing = Drawing().Group(7).Square(0, 9).Square(1, 8).Group(3).Square(2, 7).Square(3, 6).Square(4, 5);
  drawing.rule = FaceRule::kUnion;
  EXPECT_TRUE(drawing.Find()->faces[FaceAt(drawing, {0.5, 5})].is_meshed);
  EXPECT_FALSE(drawing.Find()->faces[FaceAt(drawing, {1.5, 5})].is_meshed);
  EXPECT_TRUE(drawing.Find()->faces[FaceAt(drawing, {2.5, 5})].is_meshed);
  EXPECT_FALSE(drawing.Find()->faces[FaceAt(drawing, {3.5, 5})].is_meshed);
  EXPECT_TRUE(drawing.Find()->faces[FaceAt(drawing, {4.5, 4.5})].is_meshed);
  // A group that lies in another makes no hole, and one that fills the hole of another fills it.
  drawing = Drawing().Group(1).Square(0, 9).Square(1, 8).Group(2).Square(1, 8).Group(3).Square(2, 3);
  drawing.rule = FaceRule::kUnion;
  EXPECT_EQ(MeshedCount(*drawing.Find()), 3u);
}

TEST(PlanarFacesTest, TheUnionWantsTheRingsOfEachGroupClosed) {
  // Together they are closed.
  Drawing drawing = Drawing().Group(4).Square(0, 1);
  drawing.groups[2] = 5;
  drawing.rule = FaceRule::kUnion;
  EXPECT_THAT(drawing.Find().status().message(), AllOf(HasSubstr("faces: the rings of group 4 are not closed"),
                                                       HasSubstr("points["), HasSubstr("an end of segments[")));
  drawing.is_open.assign(4, 1);
  drawing.Group(5).Square(2, 3);
  EXPECT_EQ(MeshedCount(*drawing.Find()), 1u);
}

TEST(PlanarFacesTest, ALineInsideARingDoesNotChangeSides) {
  Drawing drawing = Drawing().Square(0, 4).Line({{1, 1}, {2, 2}, {3, 1}});
  drawing.rule = FaceRule::kEvenOdd;
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(faces->faces.size(), 2u);
  EXPECT_EQ(MeshedCount(*faces), 1u);
}

TEST(PlanarFacesTest, PolygonsThatShareASideAreBothInside) {
  Drawing drawing = Drawing().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}}).Ring({{1, 0}, {2, 0}, {2, 1}, {1, 1}});
  drawing.rule = FaceRule::kEvenOdd;
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(MeshedCount(*faces), 2u);
}

TEST(PlanarFacesTest, PointsKnowTheirFace) {
  Drawing drawing = Drawing().Square(0, 3).Square(1, 2);
  drawing.points.insert(drawing.points.end(), {0.5, 1.5, 1.5, 1.5, 7, 7, 1, 2.5});
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  const uint32_t between = faces->point_face[8];
  const uint32_t inner = faces->point_face[9];
  EXPECT_NE(between, inner);
  EXPECT_EQ(faces->point_face[10], 0u);
  EXPECT_EQ(faces->point_face[11], between);  // above a corner
  EXPECT_EQ(faces->point_face[0], PlanarFaces::kOnSegments);
}

TEST(PlanarFacesTest, ASeedOnASegmentIsRefused) {
  for (const Point<2>& at : {Point<2>{0.5, 0}, Point<2>{0, 0.5}, Point<2>{0, 0}, Point<2>{1, 1}, Point<2>{1, 0.25}}) {
    Drawing drawing = Drawing().Square(0, 1);
    drawing.seeds = {{.at = at, .is_hole = true}};
    EXPECT_THAT(drawing.Find().status().message(), AllOf(HasSubstr("seeds[0]"), HasSubstr("lies on")));
  }
}

TEST(PlanarFacesTest, TwoSeedsThatDifferInOneFaceAreRefused) {
  Drawing drawing = Drawing().Square(0, 1);
  drawing.seeds = {{.at = {0.2, 0.2}, .region = 1}, {.at = {0.8, 0.8}, .region = 2}};
  EXPECT_THAT(drawing.Find().status().message(),
              AllOf(HasSubstr("seeds[0]"), HasSubstr("seeds[1]"), HasSubstr("differ")));
}

TEST(PlanarFacesTest, WhatEnclosesNothingIsRefused) {
  Drawing drawing = Drawing().Line({{0, 0}, {1, 0}, {1, 1}});
  EXPECT_THAT(drawing.Find().status().message(), HasSubstr("enclose nothing"));
  Drawing all_holes = Drawing().Square(0, 1);
  all_holes.seeds = {{.at = {0.5, 0.5}, .is_hole = true}};
  EXPECT_THAT(all_holes.Find().status().message(), HasSubstr("no face is left"));
}

TEST(PlanarFacesTest, RingsThatAreNotClosedAreRefusedByEvenAndOdd) {
  // A ring that lacks its last side, closed by a line.
  Drawing drawing;
  drawing.Add({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, false).Line({{0, 1}, {0, 0}});
  drawing.is_open = {0, 0, 0, 1};
  drawing.rule = FaceRule::kEvenOdd;
  EXPECT_THAT(drawing.Find().status().message(), HasSubstr("not closed"));
}

// How many ring segments a ray to the left crosses: an independent count.
int CrossingsLeftOf(const PlanarGraph& graph, const Point<2>& p) {
  int crossings = 0;
  for (const GraphSegment& segment : graph.segments) {
    const Point<2>& a = graph.points[segment.a];
    const Point<2>& b = graph.points[segment.b];
    if ((a[1] > p[1]) != (b[1] > p[1])) {
      const double x = a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
      crossings += x < p[0] ? static_cast<int>(segment.rings) : 0;
    }
  }
  return crossings;
}

// The regions of all bounded faces, ascending.
std::vector<int32_t> RegionsOf(const absl::StatusOr<PlanarFaces>& faces) {
  std::vector<int32_t> regions;
  for (size_t face = 1; faces.ok() && face < faces->faces.size(); ++face) {
    regions.push_back(faces->faces[face].region);
  }
  std::sort(regions.begin(), regions.end());
  return regions;
}

TEST(PolygonSeedsTest, APolygonHasAllFacesThatALineCutsItInto) {
  Drawing drawing = Drawing().Square(0, 10).Polygon(0, 7).Line({{3, 0}, {3, 10}});
  EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{7, 7}));
}

TEST(PolygonSeedsTest, APolygonThatIsPinchedHasBothOfItsParts) {
  Drawing drawing = Drawing().Ring({{0, 0}, {2, 2}, {4, 0}, {4, 4}, {2, 2}, {0, 4}}).Polygon(0, 7);
  EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{7, 7}));
}

TEST(PolygonSeedsTest, AHoleThatTouchesTheRingTwiceIsNotInThePolygonThatItCuts) {
  Drawing drawing = Drawing().Square(0, 10).Ring({{5, 0}, {6, 5}, {5, 10}, {4, 5}}).Polygon(0, 7);
  EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{0, 7, 7}));
}

TEST(PolygonSeedsTest, OfPolygonsThatLieOverEachOtherTheLeastHasTheFace) {
  for (const bool is_inner_first : {false, true}) {
    Drawing drawing;
    if (is_inner_first) {
      drawing.Square(3, 6).Polygon(0, 2).Square(0, 10).Polygon(4, 1);
    } else {
      drawing.Square(0, 10).Polygon(0, 1).Square(3, 6).Polygon(4, 2);
    }
    EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{1, 2}));
    drawing.seeds.push_back({.at = {4, 4}, .region = 9});  // a point comes before polygons
    EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{1, 9}));
  }
}

TEST(PolygonSeedsTest, APolygonThatIsAHoleIsNotMeshed) {
  Drawing drawing = Drawing().Square(0, 10).Line({{0, 0}, {10, 10}}).Square(20, 30);
  drawing.seeds = {{.is_hole = true, .segment_count = 4}};
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(MeshedCount(*faces), 1);
}

TEST(PolygonSeedsTest, NeighboursShareASide) {
  Drawing drawing = Drawing().Square(0, 1).Polygon(0, 1).Ring({{1, 0}, {2, 0}, {2, 1}, {1, 1}}).Polygon(4, 2);
  drawing.rule = FaceRule::kEvenOdd;
  EXPECT_EQ(RegionsOf(drawing.Find()), (std::vector<int32_t>{1, 2}));
}

TEST(PolygonSeedsTest, EqualPolygonsHaveToSayTheSame) {
  Drawing same = Drawing().Square(0, 1).Polygon(0, 1).Square(0, 1).Polygon(4, 1);
  EXPECT_EQ(RegionsOf(same.Find()), (std::vector<int32_t>{1}));
  Drawing other = Drawing().Square(0, 1).Polygon(0, 1).Square(0, 1).Polygon(4, 2);
  EXPECT_THAT(other.Find().status().message(),
              AllOf(HasSubstr("seeds[0]"), HasSubstr("seeds[1]"), HasSubstr("one area"), HasSubstr("differ")));
}

TEST(PolygonSeedsTest, WhatIsNoPolygonIsRefused) {
  Drawing open = Drawing().Line({{0, 0}, {1, 0}, {1, 1}}).Polygon(0, 1).Square(0, 5);
  EXPECT_THAT(open.Find().status().message(),
              AllOf(HasSubstr("seeds[0]"), HasSubstr("points[0]"), HasSubstr("not closed")));
  Drawing beyond = Drawing().Square(0, 5);
  beyond.seeds = {{.first_segment = 2, .segment_count = 3}};
  EXPECT_THAT(beyond.Find().status().message(), AllOf(HasSubstr("seeds[0]"), HasSubstr("segments 2 to 4")));
  Drawing shared = Drawing().Square(0, 5).Polygon(0, 1);
  shared.Polygon(3, 1);
  EXPECT_THAT(shared.Find().status().message(), AllOf(HasSubstr("seeds[1]"), HasSubstr("segments[3]")));
}

// 200 triangles over one side, each in the next, with a polygon each: all bound that side.
TEST(PolygonSeedsTest, ASideOfManyPolygonsIsEachOnesOwn) {
  constexpr int kCount = 200;
  Drawing drawing;
  for (int i = 0; i < kCount; ++i) {
    drawing.Ring({{0, 0}, {1, 0}, {0.5, 1.0 + i}}).Polygon(static_cast<uint32_t>(3 * i), i + 1);
  }
  std::vector<int32_t> all(kCount);
  std::iota(all.begin(), all.end(), 1);
  EXPECT_EQ(RegionsOf(drawing.Find()), all);
}

class PlanarFacesPropertyTest : public test::SeededTest {
 protected:
  PlanarFacesPropertyTest() : SeededTest(0xface) {}
};

TEST_F(PlanarFacesPropertyTest, EvenAndOddIsWhatARayCounts) {
  for (int run = 0; run < 100; ++run) {
    Drawing drawing;
    drawing.rule = FaceRule::kEvenOdd;
    const size_t rings = 1 + random_.Below(5);
    for (size_t i = 0; i < rings; ++i) {
      std::vector<Point<2>> corners(3 + random_.Below(6));
      for (Point<2>& corner : corners) {
        corner = {static_cast<double>(random_.Below(9)), static_cast<double>(random_.Below(9))};
      }
      drawing.Ring(corners);
    }
    // Places that are on no segment of the grid, but for a chance too small to matter.
    std::vector<Point<2>> places;
    for (int i = 0; i < 20; ++i) {
      places.push_back({9 * random_.Unit(), 9 * random_.Unit()});
      drawing.points.insert(drawing.points.end(), places.back().begin(), places.back().end());
    }
    const size_t first = drawing.points.size() / 2 - places.size();
    const auto faces = drawing.Find();
    if (!faces.ok()) {  // all rings were flat
      EXPECT_THAT(faces.status().message(), HasSubstr("face"));
      continue;
    }
    for (size_t i = 0; i < places.size(); ++i) {
      const uint32_t point = drawing.graph.point_of_input[first + i];
      EXPECT_EQ(faces->IsMeshed(faces->point_face[point]), CrossingsLeftOf(drawing.graph, places[i]) % 2 == 1);
    }
  }
}

TEST_F(PlanarFacesPropertyTest, TheUnionHasWhatARayCountsInAnyGroup) {
  for (int run = 0; run < 100; ++run) {
    Drawing drawing;
    drawing.rule = FaceRule::kUnion;
    std::vector<Drawing> alone;
    const size_t groups = 1 + random_.Below(5);
    for (size_t i = 0; i < groups; ++i) {
      alone.emplace_back();
      drawing.Group(static_cast<uint32_t>(random_.Below(1000) * groups + i));
      for (uint64_t ring = 0; ring < 1 + random_.Below(3); ++ring) {
        std::vector<Point<2>> corners(3 + random_.Below(5));
        for (Point<2>& corner : corners) {
          corner = {static_cast<double>(random_.Below(9)), static_cast<double>(random_.Below(9))};
        }
        drawing.Ring(corners);
        alone.back().Ring(corners);
      }
    }
    const size_t first = drawing.points.size() / 2;
    for (int i = 0; i < 20; ++i) {
      drawing.points.insert(drawing.points.end(), {9 * random_.Unit(), 9 * random_.Unit()});
    }
    const auto faces = drawing.Find();
    if (!faces.ok()) {  // all rings were flat
      EXPECT_THAT(faces.status().message(), HasSubstr("face"));
      continue;
    }
    for (size_t i = first; i < first + 20; ++i) {
      bool is_inside = false;
      for (const Drawing& group : alone) {
        Features features;
        features.ends = group.ends;
        features.crossings = CrossingRule::kSplit;
        const PlanarGraph graph = *MakePlanarGraph(group.points, features, nullptr, 1e-12, 1'000'000, 1, RunContext());
        is_inside = is_inside || CrossingsLeftOf(graph, PointAt<2>(drawing.points, i)) % 2 == 1;
      }
      EXPECT_EQ(faces->IsMeshed(faces->point_face[drawing.graph.point_of_input[i]]), is_inside) << "run " << run;
    }
  }
}

TEST(PlanarFacesTest, SeedsThatMeanNothingAreCounted) {
  Drawing drawing = Drawing().Square(0, 9).Square(1, 2);
  drawing.seeds = {{.at = {1.5, 1.5}, .is_hole = true},
                   {.at = {20, 0}, .is_hole = true},
                   {.at = {5, 5}, .region = 3},
                   {.at = {-1, 0}, .region = 4}};
  const auto faces = drawing.Find();
  ASSERT_TRUE(faces.ok()) << faces.status();
  EXPECT_EQ(faces->unused_seeds, 2u);
  EXPECT_EQ(faces->first_unused_seed, 1u);
}

TEST_F(PlanarFacesPropertyTest, APolygonHasWhatARayCountsInItsOwnRings) {
  for (int run = 0; run < 100; ++run) {
    Drawing drawing;
    drawing.Square(-1, 10);
    std::vector<Drawing> alone;
    const size_t polygons = 1 + random_.Below(4);
    for (size_t i = 0; i < polygons; ++i) {
      alone.emplace_back();
      const auto first = static_cast<uint32_t>(drawing.ends.size() / 2);
      for (uint64_t ring = 0; ring < 1 + random_.Below(2); ++ring) {
        std::vector<Point<2>> corners(3 + random_.Below(5));
        for (Point<2>& corner : corners) {
          corner = {static_cast<double>(random_.Below(9)), static_cast<double>(random_.Below(9))};
        }
        drawing.Ring(corners);
        alone.back().Ring(corners);
      }
      drawing.Polygon(first, 0);  // all say the same, so that none is refused
    }
    for (int i = 0; i < 20; ++i) {
      const Point<2> place = {9 * random_.Unit(), 9 * random_.Unit()};
      drawing.points.insert(drawing.points.end(), place.begin(), place.end());
    }
    const size_t first = drawing.points.size() / 2 - 20;
    const auto faces = drawing.Find();
    ASSERT_TRUE(faces.ok()) << faces.status();
    const auto found = FindPolygonsOfFaces(drawing.graph, *faces, drawing.seeds, RunContext());
    ASSERT_TRUE(found.ok()) << found.status();
    for (size_t i = first; i < first + 20; ++i) {
      const Point<2> place = PointAt<2>(drawing.points, i);
      const uint32_t polygon = (*found)[faces->point_face[drawing.graph.point_of_input[i]]];
      std::vector<uint32_t> around;
      for (uint32_t p = 0; p < polygons; ++p) {
        Features features;
        features.ends = alone[p].ends;
        features.crossings = CrossingRule::kSplit;
        const PlanarGraph graph =
            *MakePlanarGraph(alone[p].points, features, nullptr, 1e-12, 1'000'000, 1, RunContext());
        if (CrossingsLeftOf(graph, place) % 2 == 1) {
          around.push_back(p);
        }
      }
      if (around.empty()) {
        EXPECT_EQ(polygon, OddSets::kEmpty);
      } else {
        EXPECT_THAT(around, ::testing::Contains(polygon));
      }
    }
  }
}

}  // namespace
}  // namespace wellspace::core
