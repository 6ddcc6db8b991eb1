// Pairs of triangles that meet: against all pairs, in any order, on any threads, and at what cost.
#include "core/features/triangle_pairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

SurfaceComplex ComplexOf(const test::TestSurface& surface) {
  const SurfaceFeatures features = surface.Features();
  return *MakeSurfaceComplex(surface.points, {}, features, RunContext());
}

TrianglePairs Find(const SurfaceComplex& complex, double least = 0, int threads = 1) {
  const auto pairs = FindTrianglePairs(complex, least, threads, RunContext());
  EXPECT_TRUE(pairs.ok()) << pairs.status();
  return *pairs;
}

std::vector<TrianglePair> AllPairs(const SurfaceComplex& complex, double least) {
  const auto corners_of = [&](uint32_t t) {
    return TriangleCorners{complex.triangles[t], {complex.Corner(t, 0), complex.Corner(t, 1), complex.Corner(t, 2)}};
  };
  std::vector<TrianglePair> pairs;
  for (uint32_t t = 0; t < complex.triangles.size(); ++t) {
    for (uint32_t u = t + 1; u < complex.triangles.size(); ++u) {
      const TriangleContact contact = FindContact(corners_of(t), corners_of(u), least);
      if (contact.kind != TriangleContact::Kind::kNone) {
        pairs.push_back({t, u, contact});
      }
    }
  }
  return pairs;
}

class TrianglePairsTest : public test::SeededTest {
 protected:
  TrianglePairsTest() : SeededTest(20'544) {}

  // Random triangles, some of which share corners, of a size for a few hundred to meet.
  test::TestSurface Random(uint32_t count, double size) {
    test::TestSurface surface;
    for (uint32_t t = 0; t < count; ++t) {
      const Point<3> middle = {random_.Unit(), random_.Unit(), random_.Unit()};
      for (int k = 0; k < 3; ++k) {
        surface.AddPoint({middle[0] + size * random_.Gauss(), middle[1] + size * random_.Gauss(),
                          middle[2] + size * random_.Gauss()});
      }
      const uint32_t shared = t > 0 && random_.Below(2) == 0 ? static_cast<uint32_t>(random_.Below(3 * t)) : 3 * t;
      surface.AddTriangle({shared, 3 * t + 1, 3 * t + 2});
    }
    return surface;
  }
};

TEST_F(TrianglePairsTest, NeedlesAreLostNowhere) {
  // Each with a small triangle around a point near its end: planes of needles are turned by rounding.
  for (const double width : {1e-4, 1e-8, 1e-12}) {
    test::TestSurface surface;
    for (int i = 0; i < 200; ++i) {
      const Point<3> a = {random_.Unit(), random_.Unit(), random_.Unit()};
      const Point<3> b = {random_.Unit(), random_.Unit(), random_.Unit()};
      Point<3> c;
      Point<3> at;
      const double share = random_.Unit();
      for (int axis = 0; axis < 3; ++axis) {
        c[axis] = a[axis] + share * (b[axis] - a[axis]) + width * random_.Gauss();
        at[axis] = a[axis] + 1e-9 * (b[axis] - a[axis]);
      }
      surface.AddTriangle({surface.AddPoint(a), surface.AddPoint(b), surface.AddPoint(c)});
      const auto beside = [&] {
        return surface.AddPoint(
            {at[0] + 1e-9 * random_.Gauss(), at[1] + 1e-9 * random_.Gauss(), at[2] + 1e-9 * random_.Gauss()});
      };
      const uint32_t first = beside();
      const uint32_t second = beside();
      surface.AddTriangle({first, second, beside()});
    }
    const SurfaceComplex complex = ComplexOf(surface);
    EXPECT_TRUE(Find(complex).pairs == AllPairs(complex, 0)) << width;
  }
}

TEST_F(TrianglePairsTest, AreThoseOfAllPairs) {
  for (const double size : {0.01, 0.05, 0.3}) {
    const SurfaceComplex complex = ComplexOf(Random(size > 0.1 ? 60 : 400, size));
    for (const double least : {0.0, 1e-3}) {
      const TrianglePairs found = Find(complex, least);
      EXPECT_FALSE(found.has_more);
      EXPECT_TRUE(found.pairs == AllPairs(complex, least)) << size << " " << least;
      EXPECT_TRUE(Find(complex, least, 4).pairs == found.pairs);
    }
  }
  const SurfaceComplex grid =
      ComplexOf(test::Joined(test::Subdivided(test::Cube()),
                             test::Boxes({0.25, 0.75}, {0.25, 0.75}, {-0.5, 2}, [](int, int, int) { return 1; })));
  EXPECT_TRUE(Find(grid).pairs == AllPairs(grid, 0));
  EXPECT_FALSE(Find(grid).pairs.empty());
}

TEST_F(TrianglePairsTest, CleanComplexesHaveNone) {
  for (const test::NamedComplex& complex : test::SevenComplexes()) {
    EXPECT_TRUE(Find(ComplexOf(complex.surface), 1e-9).pairs.empty()) << complex.name;
    EXPECT_TRUE(Find(ComplexOf(test::Subdivided(test::Subdivided(complex.surface))), 1e-9).pairs.empty());
  }
  EXPECT_TRUE(Find(ComplexOf(test::Sphere(5)), 1e-9).pairs.empty());
}

TEST_F(TrianglePairsTest, NoOrderChangesWhatIsFound) {
  const test::TestSurface surface = test::Joined(test::Sphere(3), test::Sphere(3, {0.7, 0.4, 0.1}));
  const TrianglePairs found = Find(ComplexOf(surface));
  EXPECT_GT(found.pairs.size(), 50u);
  for (int round = 0; round < 3; ++round) {
    EXPECT_TRUE(Find(ComplexOf(test::Shuffled(surface, random_)), 0, 3).pairs == found.pairs);
  }
}

TEST_F(TrianglePairsTest, WhatIsKeptIsBounded) {
  // Slanting triangles that all cross each other: millions of pairs.
  test::TestSurface surface;
  for (int i = 0; i < 2'000; ++i) {
    const Point<3> a = {random_.Gauss(), random_.Gauss(), random_.Gauss()};
    const Point<3> b = {random_.Gauss(), random_.Gauss(), random_.Gauss()};
    surface.AddPolygon(
        {{a[0] - b[0], a[1] - b[1], a[2] - b[2]}, {-a[0] - b[0], -a[1] - b[1], -a[2] - b[2]}, {b[0], b[1], b[2]}});
  }
  const TrianglePairs found = Find(ComplexOf(surface));
  EXPECT_TRUE(found.has_more);
  EXPECT_GT(found.pairs.size(), 100u);
  EXPECT_LT(found.pairs.size(), 100'000u);
  EXPECT_TRUE(Find(ComplexOf(test::Shuffled(surface, random_)), 0, 4).pairs == found.pairs);
}

// Triangles around a common corner, in a plane: each of them reaches to all others there.
test::TestSurface Fan(uint32_t count) {
  test::TestSurface fan;
  fan.AddPoint({0, 0, 0});
  for (uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    fan.AddPoint({std::cos(angle), std::sin(angle), 0.1 * std::sin(3 * angle)});
  }
  for (uint32_t i = 0; i < count; ++i) {
    fan.AddTriangle({0, 1 + i, 1 + (i + 1) % count});
  }
  return fan;
}

// Pages of a book: all have an edge in common.
test::TestSurface Book(uint32_t count) {
  test::TestSurface book;
  book.AddPoint({0, 0, 0});
  book.AddPoint({0, 0, 1});
  for (uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    book.AddTriangle({0, 1, book.AddPoint({std::cos(angle), std::sin(angle), 0.3})});
  }
  return book;
}

// Slanting sheets above each other.
test::TestSurface Pile(uint32_t count) {
  test::TestSurface pile;
  for (uint32_t i = 0; i < count; ++i) {
    const double z = static_cast<double>(i) / count;
    pile.AddPolygon({{0, 0, z}, {1, 0, z + 0.7}, {0.2, 1, z + 0.4}});
  }
  return pile;
}

// Slanting strips side by side: the wall of a cylinder.
test::TestSurface Wall(uint32_t count) {
  test::TestSurface wall;
  for (uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    const double x = std::cos(angle);
    const double y = std::sin(angle);
    wall.AddPoint({x, 0.6 * y, 0.8 * y});
    wall.AddPoint({x + 20, 0.6 * y - 16, 0.8 * y + 12});
  }
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t next = (i + 1) % count;
    wall.AddTriangle({2 * i, 2 * next, 2 * next + 1});
    wall.AddTriangle({2 * i, 2 * next + 1, 2 * i + 1});
  }
  return wall;
}

TEST_F(TrianglePairsTest, FansPilesStripsAndBooksTakeFewComparisons) {
  for (const auto& [name, make] :
       {std::pair("fan", &Fan), std::pair("book", &Book), std::pair("pile", &Pile), std::pair("wall", &Wall)}) {
    uint64_t before = 0;
    for (const uint32_t count : {4'000u, 16'000u}) {
      const SurfaceComplex complex = ComplexOf(make(count));
      const TrianglePairs found = Find(complex);
      EXPECT_TRUE(found.pairs.empty()) << name;
      EXPECT_LT(found.compared_pairs, 200 * complex.triangles.size()) << name;
      if (before > 0) {
        EXPECT_LT(found.compared_pairs, 7 * before) << name;
      }
      before = found.compared_pairs;
    }
  }
}

TEST_F(TrianglePairsTest, ARunThatIsCancelledFindsNothing) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(FindTrianglePairs(ComplexOf(test::Sphere(3)), 0, 2, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
