// Solids of complexes: materials, membranes, nested shells, shells that touch in points, and their volumes.
#include "core/features/solids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/features/angle_order.h"
#include "core/geometry/exact_measure.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;

struct Found {
  SurfaceComplex complex;
  Solids solids;
};

Found Find(const test::TestSurface& surface) {
  const SurfaceFeatures features = surface.Features();
  const RunContext context;
  Found found;
  found.complex = *MakeSurfaceComplex(surface.points, {}, features, context);
  found.solids = *FindSolids(found.complex, context);
  return found;
}

std::vector<double> Volumes(const Solids& solids) {
  std::vector<double> volumes(solids.volumes.begin() + 1, solids.volumes.end());
  std::sort(volumes.begin(), volumes.end());
  return volumes;
}

class SolidsTest : public test::SeededTest {
 protected:
  SolidsTest() : SeededTest(20'545) {}
};

TEST_F(SolidsTest, TheSevenComplexesHaveTheirVolumes) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const Found found = Find(given.surface);
    const std::vector<double> volumes = Volumes(found.solids);
    ASSERT_EQ(volumes.size(), given.volumes.size()) << given.name;
    for (size_t i = 0; i < volumes.size(); ++i) {
      EXPECT_NEAR(volumes[i], given.volumes[i], 1e-12 * given.volumes[i]) << given.name;
    }
    const bool has_fin = std::string_view(given.name).substr(0, 3) == "fin";
    EXPECT_EQ(found.solids.membranes, has_fin ? 2u : 0u) << given.name;
  }
}

TEST_F(SolidsTest, SubdividedAndFarFromTheOriginTheyAreTheSame) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    test::TestSurface surface = test::Subdivided(test::Subdivided(given.surface));
    for (double& x : surface.points) {
      x = 0.25 * x + 1024;  // rounded by up to 2^-43 of the size
    }
    const std::vector<double> volumes = Volumes(Find(surface).solids);
    ASSERT_EQ(volumes.size(), given.volumes.size()) << given.name;
    for (size_t i = 0; i < volumes.size(); ++i) {
      EXPECT_NEAR(volumes[i], given.volumes[i] / 64, 1e-10 * given.volumes[i]) << given.name;
    }
  }
}

TEST_F(SolidsTest, WhichWayTrianglesGoDoesNotMatter) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const Found found = Find(given.surface);
    test::TestSurface turned = given.surface;
    for (size_t t = 0; t < turned.triangle_count(); ++t) {
      if (random_.Below(2) == 0) {
        std::swap(turned.corners[3 * t], turned.corners[3 * t + 1]);
      }
    }
    const Found other = Find(turned);
    EXPECT_EQ(other.solids.is_odd, found.solids.is_odd);
    ASSERT_EQ(other.solids.count, found.solids.count);
    for (uint32_t solid = 1; solid < found.solids.count; ++solid) {
      EXPECT_NEAR(other.solids.volumes[solid], found.solids.volumes[solid], 1e-14) << given.name;
    }
  }
}

TEST_F(SolidsTest, NoOrderChangesABit) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const test::TestSurface surface = test::Joined(given.surface, test::Sphere(2, {0.5, 0.5, 0.5}, 4));
    const Found found = Find(surface);
    for (int round = 0; round < 3; ++round) {
      const Found other = Find(test::Shuffled(surface, random_));
      EXPECT_EQ(other.solids.solid_of, found.solids.solid_of);
      EXPECT_EQ(other.solids.volumes, found.solids.volumes);
      EXPECT_EQ(other.solids.is_odd, found.solids.is_odd);
    }
  }
}

TEST_F(SolidsTest, NestedShells) {
  test::TestSurface surface = test::Cube();
  std::vector<double> expected;
  double inner = 1;
  for (const double side : {0.5, 0.25, 0.125}) {
    const std::vector<double> range = {0.5 - 0.5 * side, 0.5 + 0.5 * side};
    surface = test::Joined(surface, test::Boxes(range, range, range, [](int, int, int) { return 1; }));
    expected.push_back(inner - side * side * side);
    inner = side * side * side;
  }
  expected.push_back(inner);
  const Found found = Find(test::Shuffled(surface, random_));
  EXPECT_EQ(found.solids.shells, 4u);
  EXPECT_THAT(found.solids.is_odd, ElementsAre(false, true, false, true, false));
  for (uint32_t solid = 1; solid <= 4; ++solid) {
    EXPECT_EQ(found.solids.volumes[solid], expected[solid - 1]);
  }
}

TEST_F(SolidsTest, ShellsSideBySideAreAllOutside) {
  test::TestSurface surface;
  for (int i = 0; i < 60; ++i) {
    const double x = 3 * (i % 4);
    const double y = 3 * (i / 4 % 4);
    surface = test::Joined(surface, test::Sphere(1, {x, y, 3.0 * (i / 16)}));
  }
  const Found found = Find(surface);
  EXPECT_EQ(found.solids.count, 61u);
  EXPECT_EQ(found.solids.shells, 60u);
  EXPECT_EQ(std::count(found.solids.is_odd.begin(), found.solids.is_odd.end(), true), 60);
}

TEST_F(SolidsTest, ShellsThatTouchInAPoint) {
  // Inside, a pyramid whose tip is a corner of the cube; outside, another one at the same corner. In every direction.
  for (int turn = 0; turn < 8; ++turn) {
    const auto at = [&](double x, double y, double z) {
      const auto flip = [&](int axis, double value) { return ((turn >> axis) & 1) != 0 ? 1 - value : value; };
      return Point<3>{flip(0, x), flip(1, y), flip(2, z)};
    };
    test::TestSurface surface = test::Cube();
    const auto add = [&](const std::array<Point<3>, 4>& corners) {
      std::array<uint32_t, 4> names;
      for (size_t i = 0; i < 4; ++i) {
        names[i] = surface.AddPoint(corners[i]);
      }
      for (const std::array<size_t, 3>& face : {std::array<size_t, 3>{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}) {
        surface.AddTriangle({names[face[0]], names[face[1]], names[face[2]]});
      }
    };
    add({at(0, 0, 0), at(0.5, 0.25, 0.25), at(0.25, 0.5, 0.25), at(0.25, 0.25, 0.5)});
    add({at(0, 0, 0), at(-0.5, -0.25, -0.25), at(-0.25, -0.5, -0.25), at(-0.25, -0.25, -0.5)});
    const Found found = Find(test::Shuffled(surface, random_));
    EXPECT_EQ(found.solids.shells, 3u);
    ASSERT_EQ(found.solids.count, 4u) << turn;
    const std::vector<double> volumes = Volumes(found.solids);
    EXPECT_NEAR(volumes[0], volumes[1], 1e-15);
    EXPECT_NEAR(volumes[2], 1 - volumes[0], 1e-15) << turn;
    EXPECT_EQ(std::count(found.solids.is_odd.begin(), found.solids.is_odd.end(), true), 2) << turn;
  }
}

TEST_F(SolidsTest, FlatShellsAreMembranes) {
  // In planes along every two axes, inside a cube and outside.
  test::TestSurface surface = test::Cube();
  surface.AddPolygon({{.5, .2, .2}, {.5, .8, .2}, {.5, .8, .8}, {.5, .2, .8}});
  surface.AddPolygon({{.1, .25, .1}, {.4, .25, .1}, {.4, .25, .4}, {.1, .25, .4}});
  surface.AddPolygon({{2, 0, 3}, {3, 0, 3}, {3, 1, 3}, {2, 1, 3}});
  const Found found = Find(test::Shuffled(surface, random_));
  EXPECT_EQ(found.solids.count, 2u);
  EXPECT_EQ(found.solids.membranes, 6u);
  EXPECT_EQ(found.solids.volumes[1], 1);
}

TEST_F(SolidsTest, AnOpenSurfaceBoundsNothing) {
  test::TestSurface surface = test::Sphere(2);
  surface.corners.resize(surface.corners.size() - 3);
  surface.markers.pop_back();
  const Found found = Find(surface);
  EXPECT_EQ(found.solids.count, 1u);
  EXPECT_EQ(found.solids.membranes, surface.triangle_count());
}

// The solid that holds a point is decided twice: by the first triangle below it, and by their number.
TEST_F(SolidsTest, SolidsOfPointsAreThoseOfRays) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const Found found = Find(given.surface);
    for (int round = 0; round < 500; ++round) {
      const Point<3> from = {2.2 * random_.Unit() - 0.1, 1.2 * random_.Unit() - 0.1, 1.2 * random_.Unit() - 0.1};
      // Up along the third axis and down: both first triangles have to say the same solid.
      std::array<uint32_t, 2> solid = {0, 0};
      std::array<double, 2> nearest = {1e9, 1e9};
      for (uint32_t t = 0; t < found.complex.triangles.size(); ++t) {
        const auto flat = [](const Point<3>& p) { return Point<2>{p[0], p[1]}; };
        const std::array<Point<3>, 3> c = {found.complex.Corner(t, 0), found.complex.Corner(t, 1),
                                           found.complex.Corner(t, 2)};
        const Sign turn = Orientation<2>({flat(c[0]), flat(c[1]), flat(c[2])}).sign;
        bool is_over = turn != Sign::kZero;
        for (size_t k = 0; k < 3; ++k) {
          is_over = is_over && Orientation<2>({flat(c[k]), flat(c[(k + 1) % 3]), flat(from)}).sign == turn;
        }
        if (!is_over) {
          continue;
        }
        const bool is_above = Orientation<3>({c[0], c[1], c[2], from}).sign == -turn;
        const double height = std::abs((c[0][2] + c[1][2] + c[2][2]) / 3 - from[2]);  // facets here are level
        if (height < nearest[is_above ? 1 : 0]) {
          nearest[is_above ? 1 : 0] = height;
          solid[is_above ? 1 : 0] = found.solids.solid_of[HalfFacetOf(t, is_above == (turn == Sign::kPositive))];
        }
      }
      ASSERT_EQ(solid[0], solid[1]) << given.name;
      const bool is_in_cube = from[0] > 0 && from[0] < (given.volumes == std::vector<double>{1, 1} ? 2 : 1) &&
                              from[1] > 0 && from[1] < 1 && from[2] > 0 && from[2] < 1;
      if (std::string_view(given.name) != "checker") {
        ASSERT_EQ(solid[0] != 0, is_in_cube) << given.name;
      }
    }
  }
}

TEST_F(SolidsTest, AnglesAroundALineAreOrderedExactly) {
  // Points of a grid, by the angle that doubles find, which is sure where it is not equal.
  for (int round = 0; round < 2'000; ++round) {
    const auto draw = [&] {
      return Point<3>{static_cast<double>(random_.Below(5)), static_cast<double>(random_.Below(5)),
                      static_cast<double>(random_.Below(5))};
    };
    const Point<3> a = draw();
    const Point<3> b = draw();
    const std::array<Point<3>, 3> p = {draw(), draw(), draw()};
    if (std::any_of(p.begin(), p.end(), [&](const Point<3>& x) { return AreCollinear(a, b, x); })) {
      continue;
    }
    const auto angle = [&](const Point<3>& x) {
      const Point<3> along = Difference<3>(b, a);
      const auto cross = [](const Point<3>& u, const Point<3>& v) {
        return Point<3>{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
      };
      const Point<3> one = cross(along, Difference<3>(p[0], a));
      const Point<3> other = cross(along, Difference<3>(x, a));
      const double turned =
          std::atan2(Dot<3>(cross(one, other), along) / std::sqrt(NormSq<3>(along)), Dot<3>(one, other));
      return turned < -1e-9 ? turned + 6.283185307179586 : std::max(turned, 0.0);
    };
    const AngleOrder order(a, b, p[0]);
    const double gap = angle(p[2]) - angle(p[1]);
    EXPECT_EQ(order(p[1], p[2]), gap > 1e-9) << round;
    EXPECT_EQ(order(p[2], p[1]), gap < -1e-9) << round;
    EXPECT_FALSE(order(p[0], p[0]));
  }
}

TEST_F(SolidsTest, ARunThatIsCancelledFindsNothing) {
  const test::TestSurface sphere = test::Sphere(2);
  const SurfaceFeatures features = sphere.Features();
  const SurfaceComplex complex = *MakeSurfaceComplex(sphere.points, {}, features, RunContext());
  RunContext context;
  context.Cancel();
  EXPECT_EQ(FindSolids(complex, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
