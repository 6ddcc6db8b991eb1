// Crossings of edges and surfaces: where they are, and which facets they make boundaries.
#include "core/refine/space/crossing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>
#include <vector>

#include "core/features/surface_curves.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

// In place, since the index has addresses of the rest.
struct Indexed {
  SurfaceComplex complex;
  Solids solids;
  SurfaceCurves curves;
  SurfaceIndex index;
};

std::unique_ptr<Indexed> IndexOf(const test::TestSurface& surface) {
  const RunContext context;
  auto indexed = std::make_unique<Indexed>();
  indexed->complex = *MakeSurfaceComplex(surface.points, {}, surface.Features(), context);
  indexed->solids = *FindSolids(indexed->complex, context);
  indexed->curves = *FindCurves(indexed->complex, 30, 0, context);
  const Box<3> box{{-4, -4, -4}, {4, 4, 4}};
  EXPECT_TRUE(indexed->index.Build(indexed->complex, indexed->solids, MortonGrid<3>(box), context).ok());
  return indexed;
}

class CrossingTest : public test::SeededTest {
 protected:
  CrossingTest() : SeededTest(42'701) {}

  Point<3> PointAround(double low, double high) {
    Point<3> p;
    for (double& x : p) {
      x = low + (high - low) * random_.Unit();
    }
    return p;
  }
};

TEST_F(CrossingTest, EdgesCrossASphereWhereItIs) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(4));
  EdgeCrossings crossings(indexed->index, indexed->curves.patch_of);
  for (int round = 0; round < 500; ++round) {
    const Point<3> inside = PointAround(-0.5, 0.5);
    Point<3> outside = PointAround(-1, 1);
    for (double& x : outside) {
      x *= 3 / std::sqrt(NormSq<3>(outside));
    }
    crossings.Find(inside, outside);
    ASSERT_EQ(crossings.all().size(), 1u);
    EXPECT_TRUE(crossings.IsBoundary());
    const Crossing& crossing = crossings.all()[0];
    EXPECT_EQ(crossing.before, 1u);
    EXPECT_EQ(crossing.beyond, 0u);
    EXPECT_EQ(crossing.patch, 0u);
    EXPECT_NEAR(std::sqrt(NormSq<3>(crossing.at)), 1, 0.01);
    // On the edge, and on the surface.
    const Point<3> along = Difference<3>(outside, inside);
    const double off = std::sqrt(NormSq<3>(Cross(along, Difference<3>(crossing.at, inside))) / NormSq<3>(along));
    EXPECT_LT(off, 1e-13);
    EXPECT_LT(indexed->index.Nearest(crossing.at)->distance_sq, 1e-30);
  }
}

TEST_F(CrossingTest, TwoCrossingsOfOnePartAreNoBoundary) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(3));
  EdgeCrossings crossings(indexed->index, indexed->curves.patch_of);
  crossings.Find({-3, 0.1, 0.2}, {3, 0.2, 0.1});
  ASSERT_EQ(crossings.all().size(), 2u);
  EXPECT_FALSE(crossings.IsBoundary());
  EXPECT_LT(crossings.all()[0].at[0], -0.9);
  EXPECT_GT(crossings.all()[1].at[0], 0.9);
  EXPECT_EQ(crossings.NearestTo({-2, 0, 0}), &crossings.all()[0]);
  EXPECT_EQ(crossings.NearestTo({2, 0, 0}), &crossings.all()[1]);
  crossings.Find({2, 0, 0}, {3, 0, 0});
  EXPECT_FALSE(crossings.IsBoundary());
  EXPECT_EQ(crossings.NearestTo({0, 0, 0}), nullptr);
}

TEST_F(CrossingTest, OddMembranesAreABoundary) {
  int odd = 0;
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    EdgeCrossings crossings(indexed->index, indexed->curves.patch_of);
    for (int round = 0; round < 1000; ++round) {
      const Point<3> a = PointAround(0, 1);
      const Point<3> b = PointAround(0, 1);
      crossings.Find(a, b);
      size_t membranes = 0;
      for (const Crossing& crossing : crossings.all()) {
        membranes += crossing.before == crossing.beyond ? 1 : 0;
      }
      const bool parts = indexed->index.SolidAt(a) != indexed->index.SolidAt(b);
      EXPECT_EQ(crossings.IsBoundary(), parts || membranes % 2 != 0) << given.name;
      odd += !parts && membranes % 2 != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(odd, 50);
}

TEST_F(CrossingTest, TheOtherWayTheyAreTheSame) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    EdgeCrossings crossings(indexed->index, indexed->curves.patch_of);
    for (int round = 0; round < 500; ++round) {
      // Of a grid: through corners and along facets.
      Point<3> a;
      Point<3> b;
      for (int axis = 0; axis < 3; ++axis) {
        a[axis] = 0.25 * static_cast<double>(random_.Below(9)) - 0.5;
        b[axis] = 0.25 * static_cast<double>(random_.Below(9)) - 0.5;
      }
      crossings.Find(a, b);
      std::vector<Crossing> forth = crossings.all();
      const bool is_boundary = crossings.IsBoundary();
      crossings.Find(b, a);
      std::vector<Crossing> back = crossings.all();
      EXPECT_EQ(crossings.IsBoundary(), is_boundary);
      std::reverse(back.begin(), back.end());
      for (Crossing& crossing : back) {
        std::swap(crossing.before, crossing.beyond);
      }
      EXPECT_EQ(forth, back) << given.name;
    }
  }
}

TEST_F(CrossingTest, PatchesAreThoseOfTriangles) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Cube());
  ASSERT_EQ(indexed->curves.patch_count, 6u);
  EdgeCrossings crossings(indexed->index, indexed->curves.patch_of);
  std::vector<bool> is_met(6);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double to : {-1.0, 2.0}) {
      Point<3> end = {0.5, 0.5, 0.5};
      end[axis] = to;
      crossings.Find({0.5, 0.5, 0.5}, end);
      ASSERT_EQ(crossings.all().size(), 1u);
      EXPECT_EQ(crossings.all()[0].at[axis], to < 0 ? 0 : 1);
      is_met[crossings.all()[0].patch] = true;
    }
  }
  EXPECT_EQ(std::count(is_met.begin(), is_met.end(), true), 6);
}

}  // namespace
}  // namespace wellspace::core
