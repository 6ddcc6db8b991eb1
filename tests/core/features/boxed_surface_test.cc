// Triangles cut at the sides of a box: what is left, what the sides become, and that no order changes a bit.
#include "core/features/boxed_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/features/solids.h"
#include "core/features/triangle_pairs.h"
#include "tests/support/lender_with_a_turn.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

constexpr Box<3> kBox{{0, 0, 0}, {1, 1, 1}};
constexpr double kReach = 1e-13;

BoxedSurface Boxed(const test::TestSurface& surface, const Box<3>& box = kBox, double weld = 0) {
  const SurfaceFeatures features = surface.Features();
  const RunContext context;
  const SurfaceComplex complex = *MakeSurfaceComplex(surface.points, {}, features, context);
  return *CutAtBox(complex, box, weld, std::max(weld, kReach), 0, context);
}

// Checks that triangles of the complex meet in common corners and edges alone, and lie in the box.
void ExpectSound(const BoxedSurface& boxed, const Box<3>& box = kBox) {
  ASSERT_FALSE(boxed.do_meet);
  const RunContext context;
  const TrianglePairs found = *FindTrianglePairs(boxed.complex, kReach, 1, context);
  for (const TrianglePair& pair : found.pairs) {
    ADD_FAILURE() << "triangles " << pair.one << " and " << pair.other << " meet or are near at (" << pair.contact.at[0]
                  << ", " << pair.contact.at[1] << ", " << pair.contact.at[2] << "), " << pair.contact.distance;
  }
  for (const std::array<uint32_t, 3>& triangle : boxed.complex.triangles) {
    for (const uint32_t corner : triangle) {
      EXPECT_TRUE(box.Contains(boxed.complex.points[corner]));
    }
  }
}

std::vector<double> VolumesOf(const BoxedSurface& boxed) {
  const RunContext context;
  const Solids solids = *FindSolids(boxed.complex, context);
  std::vector<double> volumes(solids.volumes.begin() + 1, solids.volumes.end());
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

class BoxedSurfaceTest : public test::SeededTest {
 protected:
  BoxedSurfaceTest() : SeededTest(20'912) {}
};

TEST_F(BoxedSurfaceTest, ASheetThatEndsAtTheSidesPartsTheBox) {
  const BoxedSurface boxed = Boxed(test::Sheet(0, 1, 3, [](double, double) { return 0.25; }));
  ExpectSound(boxed);
  EXPECT_EQ(boxed.cut_triangles, 0u);
  EXPECT_EQ(boxed.outside_triangles, 0u);
  const std::vector<double> volumes = VolumesOf(boxed);
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.25, 1e-15);
  EXPECT_NEAR(volumes[1], 0.75, 1e-15);
}

TEST_F(BoxedSurfaceTest, ASheetThatSticksOutIsCut) {
  const test::TestSurface sheet =
      test::Sheet(-0.37, 1.4, 5, [](double x, double y) { return 0.3 + 0.2 * x + 0.1 * y; });
  const BoxedSurface boxed = Boxed(sheet);
  ExpectSound(boxed);
  EXPECT_GT(boxed.cut_triangles, 0u);
  const std::vector<double> volumes = VolumesOf(boxed);
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.45, 1e-14);
  EXPECT_NEAR(volumes[1], 0.55, 1e-14);
  // On the planes of sides, to the bit: a crossing is nowhere near a side without being on it.
  for (const Point<3>& p : boxed.complex.points) {
    for (int side = 0; side < 6; ++side) {
      const double distance = kBox.DistanceToFace(p, side);
      EXPECT_TRUE(distance == 0 || distance > 1e-6) << distance;
    }
  }
}

TEST_F(BoxedSurfaceTest, OneLargeTriangleCutsAllSides) {
  test::TestSurface surface;
  // x + y + z = 1.5 far beyond the box: it cuts a hexagon out of it.
  surface.AddPolygon({{101.5, -50, -50}, {-50, 101.5, -50}, {-50, -50, 101.5}}, 3);
  const BoxedSurface boxed = Boxed(surface);
  ExpectSound(boxed);
  EXPECT_EQ(boxed.cut_triangles, 1u);
  const std::vector<double> volumes = VolumesOf(boxed);
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.5, 1e-15);
  EXPECT_NEAR(volumes[1], 0.5, 1e-15);
}

TEST_F(BoxedSurfaceTest, ATriangleInASideTakesItsPlace) {
  test::TestSurface surface;
  surface.AddPolygon({{0.2, 0.2, 0}, {0.8, 0.2, 0}, {0.5, 0.8, 0}}, 4);
  surface.AddPolygon({{0.5, 2, 1}, {0.5, 0.5, 1}, {2, 0.5, 1}}, 5);  // reaches beyond the side
  const BoxedSurface boxed = Boxed(surface);
  ExpectSound(boxed);
  EXPECT_EQ(VolumesOf(boxed).size(), 1u);
  double area = 0;
  double area_of_part = 0;
  for (uint32_t t = 0; t < boxed.complex.triangles.size(); ++t) {
    const Triangle triangle = boxed.complex.TriangleAt(t);
    const double own = 0.5 * std::sqrt(NormSq<3>(NormalOf(triangle)));
    area += own;
    area_of_part += boxed.complex.markers[t] == 4 ? own : 0;
  }
  EXPECT_NEAR(area, 6, 1e-14);
  EXPECT_NEAR(area_of_part, 0.18, 1e-15);
}

TEST_F(BoxedSurfaceTest, WhatIsOutsideIsDropped) {
  test::TestSurface surface = test::Sheet(0, 1, 2, [](double, double) { return 0.5; });
  surface.AddPolygon({{2, 2, 2}, {3, 2, 2}, {2, 3, 2}});
  surface.AddPolygon({{1, 0.1, 0.1}, {1, 0.9, 0.1}, {2, 0.5, 0.1}});      // touches a side from outside
  surface.AddPolygon({{1.7, 0.5, 0.5}, {0.5, 1.7, 0.5}, {1.5, 1.5, 0}});  // beyond an edge of the box
  const BoxedSurface boxed = Boxed(surface);
  ExpectSound(boxed);
  EXPECT_EQ(boxed.outside_triangles, 3u);
  EXPECT_EQ(
      std::count(boxed.complex.point_of_input.begin(), boxed.complex.point_of_input.end(), SurfaceComplex::kNoPoint),
      7);
  EXPECT_TRUE(Boxed(test::Sphere(1, {5, 5, 5})).complex.triangles.empty());
}

TEST_F(BoxedSurfaceTest, WeldingMovesPointsOntoSides) {
  const test::TestSurface sheet = test::Sheet(1e-7, 1 - 1e-7, 2, [](double, double) { return 0.5; });
  EXPECT_EQ(VolumesOf(Boxed(sheet)).size(), 1u) << "a membrane that ends before the sides";
  const BoxedSurface boxed = Boxed(sheet, kBox, 1e-6);
  ExpectSound(boxed);
  EXPECT_EQ(boxed.moved_points, 8u);
  EXPECT_EQ(VolumesOf(boxed), (std::vector<double>{0.5, 0.5}));
}

TEST_F(BoxedSurfaceTest, TrianglesThatMeetInASideLeaveTheSidesOut) {
  test::TestSurface crossed;
  crossed.AddPolygon({{0, 0.1, 0.1}, {0, 0.9, 0.9}, {0.5, 0.5, 0.5}});
  crossed.AddPolygon({{0, 0.1, 0.9}, {0, 0.9, 0.1}, {0.5, 0.5, 0.4}});
  const BoxedSurface boxed = Boxed(crossed);
  EXPECT_TRUE(boxed.do_meet);
  EXPECT_EQ(boxed.complex.triangles.size(), 2u);
  EXPECT_FALSE(FindTrianglePairs(boxed.complex, kReach, 1, RunContext())->pairs.empty());
}

TEST_F(BoxedSurfaceTest, NoOrderChangesABit) {
  const test::TestSurface surface =
      test::Joined(test::Sheet(-0.3, 1.3, 9, [](double x, double y) { return 0.3 + 0.1 * std::sin(3 * x + y); }),
                   test::Sphere(2, {0.9, 0.8, 0.9}, 0.31));
  const BoxedSurface first = Boxed(surface);
  ExpectSound(first);
  for (int run = 0; run < 5; ++run) {
    const BoxedSurface other = Boxed(test::Shuffled(surface, random_));
    EXPECT_EQ(other.complex.points, first.complex.points);
    EXPECT_EQ(other.complex.triangles, first.complex.triangles);
    EXPECT_EQ(other.complex.markers, first.complex.markers);
    EXPECT_EQ(other.cut_triangles, first.cut_triangles);
  }
}

TEST_F(BoxedSurfaceTest, PlanesByChancePartBoxes) {
  for (int run = 0; run < 100; ++run) {
    SCOPED_TRACE(run);
    Box<3> box;
    for (int axis = 0; axis < 3; ++axis) {
      box.low[axis] = 10 * random_.Unit() - 5;
      box.high[axis] = box.low[axis] + 0.5 + random_.Unit();
    }
    // Through a point of the box, turned anyhow, and far larger than it.
    Point<3> through;
    Point<3> u;
    Point<3> v;
    for (int axis = 0; axis < 3; ++axis) {
      through[axis] = box.low[axis] + (0.2 + 0.6 * random_.Unit()) * (box.high[axis] - box.low[axis]);
      u[axis] = 20 * random_.Gauss();
      v[axis] = 20 * random_.Gauss();
    }
    test::TestSurface surface;
    const auto at = [&](double a, double b) {
      Point<3> p;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = through[axis] + a * u[axis] + b * v[axis];
      }
      return p;
    };
    surface.AddPolygon({at(-9, -9), at(9, -9), at(9, 9), at(-9, 9)});
    const BoxedSurface boxed = Boxed(run % 2 == 0 ? surface : test::Subdivided(test::Subdivided(surface)), box);
    ExpectSound(boxed, box);
    const std::vector<double> volumes = VolumesOf(boxed);
    ASSERT_EQ(volumes.size(), 2u);
    double volume = 1;
    for (int axis = 0; axis < 3; ++axis) {
      volume *= box.high[axis] - box.low[axis];
    }
    EXPECT_NEAR(volumes[0] + volumes[1], volume, 1e-13 * volume);
  }
}

// Triangles of a lattice, which lie in sides, along edges, and over each other.
TEST_F(BoxedSurfaceTest, WhatMeetsInASideMeetsInSpace) {
  int sound = 0;
  for (int run = 0; run < 4000; ++run) {
    SCOPED_TRACE(run);
    test::TestSurface surface;
    for (int i = 0; i < 12; ++i) {
      Point<3> p;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = static_cast<double>(random_.Below(5));
      }
      surface.AddPoint(p);
    }
    for (uint64_t i = 0; i < 1 + random_.Below(4); ++i) {
      surface.AddTriangle({static_cast<uint32_t>(random_.Below(12)), static_cast<uint32_t>(random_.Below(12)),
                           static_cast<uint32_t>(random_.Below(12))});
    }
    const Box<3> box{{1, 1, 1}, {3, 4, 3}};
    const BoxedSurface boxed = Boxed(surface, box);
    if (boxed.complex.triangles.empty()) {
      continue;
    }
    const bool do_meet = !FindTrianglePairs(boxed.complex, kReach, 1, RunContext())->pairs.empty();
    ASSERT_TRUE(!boxed.do_meet || do_meet);
    if (!do_meet && boxed.complex.conflict_count == 0) {
      double sum = 0;
      for (const double volume : VolumesOf(boxed)) {
        sum += volume;
      }
      ASSERT_NEAR(sum, 12, 1e-12);
      ++sound;
    }
  }
  EXPECT_GT(sound, 400);
}

TEST_F(BoxedSurfaceTest, IsCancelled) {
  const test::TestSurface sheet = test::Sheet(0, 1, 3, [](double, double) { return 0.25; });
  RunContext context;
  const SurfaceComplex complex = *MakeSurfaceComplex(sheet.points, {}, sheet.Features(), context);
  context.Cancel();
  EXPECT_EQ(CutAtBox(complex, kBox, 0, kReach, 0, context).status().code(), absl::StatusCode::kCancelled);
}

// Before the work, and again wherever memory is asked for: the loops behind that look at the context.
TEST_F(BoxedSurfaceTest, IsStoppedWhileItWorks) {
  const test::TestSurface sheet = test::Sheet(-0.3, 1.3, 4, [](double x, double) { return 0.25 + 0.1 * x; });
  const RunContext context;
  const SurfaceComplex complex = *MakeSurfaceComplex(sheet.points, {}, sheet.Features(), context);
  for (const bool cancels : {false, true}) {
    for (int turn = 0;; ++turn) {
      SCOPED_TRACE(turn);
      RunContext stopped;
      test::LenderWithATurn lender(stopped, turn, cancels);
      const absl::Status status = CutAtBox(complex, kBox, 0, kReach, 0, stopped).status();
      if (lender.asked() <= turn) {
        EXPECT_TRUE(status.ok()) << status;
        EXPECT_GE(turn, 3);
        break;
      }
      EXPECT_EQ(status.code(), cancels ? absl::StatusCode::kCancelled : absl::StatusCode::kResourceExhausted);
    }
  }
}

}  // namespace
}  // namespace wellspace::core
