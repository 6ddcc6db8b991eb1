// The index over triangles: solids of points against a look at all triangles, crossings, nearest points, memory.
#include "core/tree/surface_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/features/triangle_crossing.h"
#include "tests/core/tree/solid_oracle.h"
#include "tests/support/amount.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

// A surface with its index; in place, since that has addresses of the rest.
struct Indexed {
  SurfaceComplex complex;
  Solids solids;
  Box<3> box{};
  SurfaceIndex index;
};

std::unique_ptr<Indexed> IndexOf(const test::TestSurface& surface) {
  const RunContext context;
  auto indexed = std::make_unique<Indexed>();
  indexed->complex = *MakeSurfaceComplex(surface.points, {}, surface.Features(), context);
  indexed->solids = *FindSolids(indexed->complex, context);
  indexed->box = {indexed->complex.points[0], indexed->complex.points[0]};
  for (const Point<3>& p : indexed->complex.points) {
    indexed->box.Include({p, p});
  }
  const double margin = 0.1 * indexed->box.LongestSide();
  for (int axis = 0; axis < 3; ++axis) {
    indexed->box.low[axis] -= margin;
    indexed->box.high[axis] += margin;
  }
  const absl::Status built =
      indexed->index.Build(indexed->complex, indexed->solids, MortonGrid<3>(indexed->box), context);
  EXPECT_TRUE(built.ok()) << built;
  return indexed;
}

// Turned, so that no plane is along an axis.
test::TestSurface Turned(test::TestSurface surface) {
  for (size_t i = 0; i < surface.points.size(); i += 3) {
    const double x = surface.points[i];
    const double y = surface.points[i + 1];
    const double z = surface.points[i + 2];
    surface.points[i] = 0.6 * x - 0.8 * y + 0.1 * z;
    surface.points[i + 1] = 0.8 * x + 0.6 * y - 0.2 * z;
    surface.points[i + 2] = 0.04 * x + 0.22 * y + z;
  }
  return surface;
}

// Needles and a fan of many: a prism over a polygon of 600 corners.
test::TestSurface Prism() {
  constexpr uint32_t kSides = 600;
  test::TestSurface surface;
  std::array<uint32_t, 2> middles;
  std::array<std::vector<uint32_t>, 2> rims;
  for (const uint32_t top : {0u, 1u}) {
    middles[top] = surface.AddPoint({0, 0, 0.25 * top});
    for (uint32_t i = 0; i < kSides; ++i) {
      const double angle = 2 * M_PI * i / kSides;
      rims[top].push_back(surface.AddPoint({std::cos(angle), std::sin(angle), 0.25 * top}));
    }
  }
  for (uint32_t i = 0; i < kSides; ++i) {
    const uint32_t next = (i + 1) % kSides;
    surface.AddTriangle({middles[0], rims[0][next], rims[0][i]});
    surface.AddTriangle({middles[1], rims[1][i], rims[1][next]});
    surface.AddTriangle({rims[0][i], rims[0][next], rims[1][next]});
    surface.AddTriangle({rims[0][i], rims[1][next], rims[1][i]});
  }
  return surface;
}

std::vector<test::NamedComplex> Surfaces() {
  std::vector<test::NamedComplex> surfaces = test::SevenComplexes();
  surfaces.push_back({"turned layers", Turned(surfaces[2].surface), {}});
  surfaces.push_back({"turned junctions", Turned(surfaces[3].surface), {}});
  surfaces.push_back({"sphere", test::Sphere(2), {}});
  surfaces.push_back({"nested spheres", test::Joined(test::Sphere(1), test::Sphere(2, {0.1, 0, 0}, 0.5)), {}});
  surfaces.push_back({"prism", Prism(), {}});
  return surfaces;
}

class SurfaceIndexTest : public test::SeededTest {
 protected:
  SurfaceIndexTest() : SeededTest(51'203) {}

  Point<3> PointIn(const Box<3>& box) {
    Point<3> p;
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] = box.low[axis] + random_.Unit() * (box.high[axis] - box.low[axis]);
    }
    return p;
  }

  // Half of them are anywhere; of the others some are corners, middles of edges and points of them, and some are within
  // 1e-12 of these.
  Point<3> SomePoint(const Indexed& indexed) {
    if (random_.Below(2) == 0) {
      return PointIn(indexed.box);
    }
    const auto [a, b] = indexed.complex.edges[random_.Below(indexed.complex.edges.size())];
    const Point<3>& from = indexed.complex.points[a];
    const Point<3>& to = indexed.complex.points[b];
    Point<3> p = from;
    const uint64_t where = random_.Below(4);
    const double share = where < 2 ? 0.0 : where == 2 ? 0.5 : random_.Unit();
    for (int axis = 0; axis < 3; ++axis) {
      p[axis] += share * (to[axis] - from[axis]);
    }
    if (random_.Below(4) != 0) {
      for (double& x : p) {
        x += 1e-12 * random_.Unit() * (2 * random_.Unit() - 1);
      }
    } else if (random_.Below(2) == 0) {
      const size_t axis = random_.Below(3);
      p[axis] = std::nextafter(p[axis], random_.Below(2) == 0 ? 1e9 : -1e9);
    }
    return p;
  }
};

TEST_F(SurfaceIndexTest, SolidsOfPointsAreThoseOfBruteForce) {
  const std::vector<test::NamedComplex> surfaces = Surfaces();
  const auto count = test::Amount("WELLSPACE_SOLID_POINTS", 36'000) / static_cast<int>(surfaces.size());
  for (const test::NamedComplex& given : surfaces) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    const test::SolidOracle oracle(indexed->complex, indexed->solids);
    std::vector<bool> is_met(indexed->solids.count);
    for (int i = 0; i < count; ++i) {
      const Point<3> p = SomePoint(*indexed);
      const uint32_t expected = oracle.SolidAt(p);
      is_met[expected] = true;
      ASSERT_EQ(indexed->index.SolidAt(p), expected)
          << given.name << " " << ::testing::PrintToString(p) << " number " << i;
    }
    EXPECT_EQ(std::count(is_met.begin(), is_met.end(), true), indexed->solids.count) << given.name;
  }
}

TEST_F(SurfaceIndexTest, SolidsAlsoFromNodesFartherDown) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(3));
  for (int i = 0; i < 2000; ++i) {
    const Point<3> p = SomePoint(*indexed);
    // The child whose closed cube holds the point, by the middles of the cubes alone.
    const MortonGrid<3> grid(indexed->box);
    Point<3> low = grid.root_low();
    double side = grid.root_side();
    const uint32_t expected = indexed->index.SolidAt(p);
    for (IndexNode node = 0;;) {
      ASSERT_EQ(indexed->index.SolidAt(p, node), expected);
      if (indexed->index.IsLeaf(node)) {
        break;
      }
      side *= 0.5;
      uint32_t child = 0;
      for (int axis = 0; axis < 3; ++axis) {
        if (p[axis] >= low[axis] + side) {
          low[axis] += side;
          child |= 1u << axis;
        }
      }
      node = indexed->index.Child(node, child);
    }
  }
}

TEST_F(SurfaceIndexTest, CrossingsLeadFromSolidToSolid) {
  size_t crossed = 0;
  for (const test::NamedComplex& given : Surfaces()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    std::vector<SurfaceCrossing> crossings;
    for (int i = 0; i < 300; ++i) {
      const Point<3> a = SomePoint(*indexed);
      const Point<3> b = SomePoint(*indexed);
      indexed->index.FindCrossings(a, b, crossings);
      crossed += crossings.size();
      uint32_t solid = indexed->index.SolidAt(a);
      for (const SurfaceCrossing& crossing : crossings) {
        ASSERT_EQ(indexed->solids.solid_of[crossing.before], solid) << given.name;
        solid = indexed->solids.solid_of[crossing.before ^ 1];
      }
      ASSERT_EQ(indexed->index.SolidAt(b), solid) << given.name;
      // None is missing.
      size_t all = 0;
      for (uint32_t t = 0; t < indexed->complex.triangles.size(); ++t) {
        const Triangle triangle = indexed->index.TriangleAt(t);
        all += Crosses(triangle, a, MovedSide(triangle, a), b, MovedSide(triangle, b)) ? 1 : 0;
      }
      ASSERT_EQ(crossings.size(), all) << given.name;
    }
  }
  EXPECT_GT(crossed, 3000u);
}

TEST_F(SurfaceIndexTest, NearestPointsAreThoseOfBruteForce) {
  for (const test::NamedComplex& given : Surfaces()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    for (int i = 0; i < 300; ++i) {
      const Point<3> p = SomePoint(*indexed);
      SurfacePoint expected{.distance_sq = std::numeric_limits<double>::infinity()};
      for (uint32_t t = 0; t < indexed->complex.triangles.size(); ++t) {
        const Point<3> at = NearestPoint(InOrder(indexed->index.TriangleAt(t)), p);
        if (DistanceSq<3>(at, p) < expected.distance_sq) {
          expected = {at, t, DistanceSq<3>(at, p)};
        }
      }
      const std::optional<SurfacePoint> found = indexed->index.Nearest(p);
      ASSERT_TRUE(found.has_value());
      EXPECT_EQ(found->triangle, expected.triangle) << given.name;
      EXPECT_EQ(found->at, expected.at) << given.name;
      EXPECT_FALSE(indexed->index.Nearest(p, expected.distance_sq).has_value() && expected.distance_sq > 0);
      EXPECT_TRUE(indexed->index.Nearest(p, 1.001 * expected.distance_sq + 1e-30).has_value());
    }
  }
}

TEST_F(SurfaceIndexTest, NearestOfSomeTrianglesIsThatOfBruteForce) {
  for (const test::NamedComplex& given : Surfaces()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    const auto triangles = static_cast<uint32_t>(indexed->complex.triangles.size());
    for (int i = 0; i < 200; ++i) {
      const Point<3> p = SomePoint(*indexed);
      const auto step = static_cast<uint32_t>(2 + i % 5);
      const auto counts = [&](uint32_t t) { return t % step == 1; };
      SurfacePoint expected{.distance_sq = std::numeric_limits<double>::infinity()};
      for (uint32_t t = 1; t < triangles; t += step) {
        const Point<3> at = NearestPoint(indexed->index.InOrderAt(t), p);
        if (const double distance_sq = DistanceSq<3>(at, p); distance_sq < expected.distance_sq) {
          expected = {at, t, distance_sq};
        }
      }
      const std::optional<SurfacePoint> found = indexed->index.NearestOf(counts, p);
      ASSERT_TRUE(found.has_value()) << given.name;
      EXPECT_EQ(found->at, expected.at) << given.name;
      EXPECT_EQ(found->triangle, expected.triangle) << given.name;
      EXPECT_FALSE(indexed->index.NearestOf([](uint32_t) { return false; }, p).has_value());
    }
  }
}

TEST_F(SurfaceIndexTest, WhatIsWithinIsThatOfBruteForceWhereverOneBegins) {
  for (const test::NamedComplex& given : Surfaces()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    SurfaceIndex for_distances;
    ASSERT_TRUE(for_distances.BuildForDistances(indexed->complex, MortonGrid<3>(indexed->box), RunContext()).ok());
    const auto triangles = static_cast<uint32_t>(indexed->complex.triangles.size());
    for (int i = 0; i < 300; ++i) {
      const Point<3> p = SomePoint(*indexed);
      const auto distance_sq_of = [&](uint32_t t) {
        EXPECT_EQ(indexed->index.InOrderAt(t), InOrder(indexed->index.TriangleAt(t)));
        return DistanceSq<3>(NearestPoint(indexed->index.InOrderAt(t), p), p);
      };
      double least_sq = std::numeric_limits<double>::infinity();
      for (uint32_t t = 0; t < triangles; ++t) {
        least_sq = std::min(least_sq, distance_sq_of(t));
      }
      const SurfacePoint nearest = *indexed->index.Nearest(p);
      const SurfacePoint other = *for_distances.Nearest(p);
      EXPECT_EQ(other.at, nearest.at);
      EXPECT_EQ(other.triangle, nearest.triangle);
      for (const double share : {0.5, 0.999, 1.0, 1.001, 4.0}) {
        const auto first = std::min(static_cast<uint32_t>(random_.Unit() * triangles), triangles - 1);
        uint32_t near = first;
        ASSERT_EQ(indexed->index.IsWithin(p, share * least_sq, near), least_sq <= share * least_sq) << given.name;
        EXPECT_TRUE(near == first || distance_sq_of(near) <= share * least_sq);
        near = first;
        EXPECT_EQ(for_distances.IsWithin(p, share * least_sq, near), least_sq <= share * least_sq);
      }
    }
  }
}

TEST_F(SurfaceIndexTest, NoTriangleNearABoxIsMissing) {
  const std::unique_ptr<Indexed> indexed = IndexOf(Turned(test::Sphere(3)));
  std::vector<uint32_t> near;
  for (int i = 0; i < 300; ++i) {
    const Point<3> p = SomePoint(*indexed);
    const Box<3> box = CubeAround<3>(p, random_.Unit() * random_.Unit());
    indexed->index.FindNear(box, near);
    EXPECT_TRUE(std::is_sorted(near.begin(), near.end()));
    for (uint32_t t = 0; t < indexed->complex.triangles.size(); ++t) {
      const Triangle triangle = indexed->index.TriangleAt(t);
      // Some of its points.
      for (int k = 0; k < 20; ++k) {
        double u = random_.Unit();
        double v = random_.Unit();
        if (u + v > 1) {
          u = 1 - u;
          v = 1 - v;
        }
        Point<3> at;
        for (int axis = 0; axis < 3; ++axis) {
          at[axis] = triangle[0][axis] + u * (triangle[1][axis] - triangle[0][axis]) +
                     v * (triangle[2][axis] - triangle[0][axis]);
        }
        if (box.Contains(at)) {
          EXPECT_TRUE(std::binary_search(near.begin(), near.end(), t));
        }
      }
    }
    for (const uint32_t t : near) {
      const Point<3> at = NearestPoint(InOrder(indexed->index.TriangleAt(t)), p);
      EXPECT_LE(DistanceSq<3>(at, p), 3.001 * 0.25 * std::pow(box.LongestSide(), 2));
    }
  }
}

TEST_F(SurfaceIndexTest, NoOrderChangesABitOfTheAnswers) {
  const test::TestSurface surface = Turned(test::SevenComplexes()[4].surface);
  const std::unique_ptr<Indexed> one = IndexOf(surface);
  const std::unique_ptr<Indexed> other = IndexOf(test::Shuffled(surface, random_));
  EXPECT_EQ(one->index.node_count(), other->index.node_count());
  EXPECT_EQ(one->index.entry_count(), other->index.entry_count());
  for (int i = 0; i < 2000; ++i) {
    const Point<3> p = SomePoint(*one);
    EXPECT_EQ(one->index.SolidAt(p), other->index.SolidAt(p));
    EXPECT_EQ(one->index.Nearest(p)->at, other->index.Nearest(p)->at);
  }
}

TEST_F(SurfaceIndexTest, BeyondTheBoxIsTheUnboundedSolid) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Cube());
  EXPECT_EQ(indexed->index.SolidAt({1e9, 0.5, 0.5}), 0u);
  EXPECT_EQ(indexed->index.SolidAt({-1e300, 0.5, 0.5}), 0u);
  EXPECT_EQ(indexed->index.SolidAt({0.5, 0.5, 0.5}), 1u);
  // On its faces points are moved towards higher coordinates.
  EXPECT_EQ(indexed->index.SolidAt({0, 0, 0}), 1u);
  EXPECT_EQ(indexed->index.SolidAt({1, 1, 1}), 0u);
  EXPECT_EQ(indexed->index.SolidAt({0, 1, 0}), 0u);
}

TEST_F(SurfaceIndexTest, MemoryIsAsSaidForAllThatKeepsTogether) {
  // Sheets that are hardly apart, fans, and needles: no split parts them for long.
  test::TestSurface sheets;
  for (int i = 0; i < 3000; ++i) {
    const double z = 1e-13 * i;
    sheets.AddTriangle({sheets.AddPoint({0, 0, z}), sheets.AddPoint({1, 0.1, z + 0.3}), sheets.AddPoint({0.1, 1, z})});
  }
  for (const test::TestSurface& surface : {sheets, Prism(), test::Sphere(4)}) {
    const std::unique_ptr<Indexed> indexed = IndexOf(surface);
    const uint64_t triangles = indexed->complex.triangles.size();
    EXPECT_LE(indexed->index.MemoryBytes(), SurfaceIndex::Bytes(triangles));
    EXPECT_LE(indexed->index.entry_count(),
              SurfaceIndex::kEntriesAnyway + SurfaceIndex::kEntriesPerTriangle * triangles);
    EXPECT_LE(indexed->index.node_count(), SurfaceIndex::kNodesAnyway + SurfaceIndex::kNodesPerTriangle * triangles);
  }
}

TEST_F(SurfaceIndexTest, ARunThatIsCancelledEnds) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(2));
  RunContext context;
  context.Cancel();
  SurfaceIndex index;
  EXPECT_EQ(index.Build(indexed->complex, indexed->solids, MortonGrid<3>(indexed->box), context).code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
