// The boundary of solids: which facets, which way round, with which tags.
#include "core/simplex/solid_boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "core/geometry/vector_product.h"
#include "core/simplex/solid_labels.h"
#include "tests/support/seeded_test.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::IndexedSurface;
using test::TestSurface;
using test::Tetrahedra;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct Bounded {
  Tetrahedra mesh;
  HugeVector<uint32_t> solid_of;
  std::vector<int32_t> region_of;
  SolidBoundary boundary;

  int32_t TagOf(size_t facet) const {
    for (const BoundaryPart& part : boundary.parts) {
      if (facet < part.facets) {
        return part.tag;
      }
      facet -= part.facets;
    }
    return kNoTag;
  }
  Triangle At(size_t facet) const {
    Triangle corners;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = PointAt<3>(mesh.points, boundary.facets[3 * facet + k]);
    }
    return corners;
  }
  size_t facet_count() const { return boundary.facets.size() / 3; }
};

Point<3> AreaOf(const Triangle& t) {
  Point<3> area = Cross(Difference<3>(t[1], t[0]), Difference<3>(t[2], t[0]));
  for (double& x : area) {
    x /= 2;
  }
  return area;
}

// `is_meshed`: by solid; all bounded ones if there is none.
Bounded BoundaryOf(const Tetrahedra& mesh, const IndexedSurface& surface, std::vector<int32_t> region_of = {},
                   int threads = 1) {
  Bounded bounded{.mesh = mesh, .solid_of = {}, .region_of = std::move(region_of), .boundary = {}};
  if (bounded.region_of.empty()) {
    bounded.region_of.resize(surface.solids.count);
    std::iota(bounded.region_of.begin(), bounded.region_of.end(), 0);
  }
  bounded.solid_of = *LabelSimplices(surface.index, mesh.points, mesh.simplices, threads, RunContext());
  bounded.boundary = *FindSolidBoundary({.points = mesh.points,
                                         .simplices = mesh.simplices,
                                         .solid_of = bounded.solid_of,
                                         .region_of = bounded.region_of},
                                        surface.index, threads, RunContext());
  return bounded;
}

// The areas of parts by tag.
std::map<int32_t, double> AreasOf(const Bounded& bounded) {
  std::map<int32_t, double> areas;
  for (size_t f = 0; f < bounded.facet_count(); ++f) {
    areas[bounded.TagOf(f)] += std::sqrt(NormSq<3>(AreaOf(bounded.At(f))));
  }
  return areas;
}

std::map<int32_t, double> AreasOf(const TestSurface& surface) {
  std::map<int32_t, double> areas;
  for (size_t t = 0; t < surface.triangle_count(); ++t) {
    Triangle corners;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = PointAt<3>(surface.points, surface.corners[3 * t + k]);
    }
    areas[surface.markers[t]] += std::sqrt(NormSq<3>(AreaOf(corners)));
  }
  return areas;
}

// The facets of a mesh that has those of `surface` are those triangles: by marker of the same area, and around each
// solid its volume by divergence.
void ExpectBoundaryOf(const TestSurface& surface, const Bounded& bounded, const IndexedSurface& indexed) {
  for (const auto& [marker, area] : AreasOf(surface)) {
    EXPECT_NEAR(AreasOf(bounded)[marker], area, 1e-10) << marker;
  }
  EXPECT_EQ(AreasOf(bounded).size(), AreasOf(surface).size());
  // Each facet as its tetrahedra have it, with the corner across from it.
  std::map<std::array<uint32_t, 3>, std::vector<std::pair<uint32_t, uint32_t>>> at;
  for (size_t s = 0; s < bounded.mesh.simplices.size(); ++s) {
    const size_t first = s - s % 4;
    std::array<uint32_t, 3> key;
    for (size_t k = 0, to = 0; k < 4; ++k) {
      if (first + k != s) {
        key[to++] = bounded.mesh.simplices[first + k];
      }
    }
    std::sort(key.begin(), key.end());
    at[key].emplace_back(bounded.solid_of[s / 4], bounded.mesh.simplices[s]);
  }
  std::vector<double> volumes(indexed.solids.count);
  for (size_t f = 0; f < bounded.facet_count(); ++f) {
    std::array<uint32_t, 3> key = {bounded.boundary.facets[3 * f], bounded.boundary.facets[3 * f + 1],
                                   bounded.boundary.facets[3 * f + 2]};
    std::sort(key.begin(), key.end());
    ASSERT_EQ(at[key].size(), 2);
    const Triangle corners = bounded.At(f);
    const Point<3> area = AreaOf(corners);
    for (const auto& [solid, apex] : at[key]) {
      const double side = Dot<3>(area, Difference<3>(PointAt<3>(bounded.mesh.points, apex), corners[0]));
      volumes[solid] += (side < 0 ? 1 : -1) * Dot<3>(area, corners[0]) / 3;
    }
    // The lower region's side comes first, and sees it clockwise.
    const auto [low, high] = std::minmax(at[key][0].first, at[key][1].first);
    const uint32_t owner = bounded.region_of[low] != 0 ? low : high;
    const bool owns_first = at[key][0].first == owner;
    if (low != high) {
      EXPECT_LT(
          Dot<3>(area, Difference<3>(PointAt<3>(bounded.mesh.points, at[key][owns_first ? 0 : 1].second), corners[0])),
          0);
    }
  }
  for (uint32_t solid = 1; solid < indexed.solids.count; ++solid) {
    EXPECT_NEAR(volumes[solid], indexed.solids.volumes[solid], 1e-12);
  }
}

class SolidBoundaryTest : public test::SeededTest {
 protected:
  SolidBoundaryTest() : SeededTest(60'118) {}
};

TEST_F(SolidBoundaryTest, OfTheSevenComplexesItIsTheSurface) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    SCOPED_TRACE(given.name);
    const std::unique_ptr<IndexedSurface> indexed = IndexOf(given.surface);
    ExpectBoundaryOf(given.surface, BoundaryOf(GridMeshAround(given.surface), *indexed), *indexed);
  }
}

TEST_F(SolidBoundaryTest, OfPartsOfBoxesByChanceItIsTheSurface) {
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(i);
    const TestSurface surface = test::RandomVoxelPart(2 + i % 3, 1 + i % 4, random_).Surface();
    const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
    ExpectBoundaryOf(surface, BoundaryOf(GridMeshAround(surface), *indexed, {}, 1 + i % 2), *indexed);
  }
}

TEST_F(SolidBoundaryTest, WhatIsNotMeshedHasNoBoundaryOfItsOwn) {
  const TestSurface surface = test::Boxes({0, 1, 2}, {0, 1}, {0, 1}, [](int i, int, int) { return i + 1; });
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
  const Tetrahedra mesh = GridMeshAround(surface);
  const Bounded bounded = BoundaryOf(mesh, *indexed, {0, 0, 4});
  EXPECT_THAT(AreasOf(bounded), ElementsAre(::testing::Pair(2, 5), ::testing::Pair(12, 1)));
  EXPECT_THAT(BoundaryOf(mesh, *indexed, {0, 0, 0}).boundary.facets, IsEmpty());
  // With the higher solid in the lower region that is on the inner side of the common facets.
  const Bounded turned = BoundaryOf(mesh, *indexed, {0, 7, 4});
  for (size_t f = 0; f < turned.facet_count(); ++f) {
    if (turned.TagOf(f) == 12) {
      EXPECT_LT(AreaOf(turned.At(f))[0], 0);
    }
  }
}

TEST_F(SolidBoundaryTest, OfWhatIsMeshedAloneItIsTheSame) {
  const TestSurface surface = test::RandomVoxelPart(3, 2, random_).Surface();
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
  const Tetrahedra mesh = GridMeshAround(surface);
  const Bounded whole = BoundaryOf(mesh, *indexed);
  Tetrahedra inside{.points = mesh.points, .simplices = {}};
  for (size_t s = 0; s < whole.solid_of.size(); ++s) {
    if (whole.region_of[whole.solid_of[s]] != 0) {
      inside.simplices.insert(inside.simplices.end(), &mesh.simplices[4 * s], &mesh.simplices[4 * s] + 4);
    }
  }
  ASSERT_LT(inside.simplices.size(), mesh.simplices.size());
  const Bounded alone = BoundaryOf(inside, *indexed);
  EXPECT_EQ(alone.boundary.facets, whole.boundary.facets);
  EXPECT_EQ(alone.boundary.parts, whole.boundary.parts);
  EXPECT_EQ(alone.boundary.vertex_tags, whole.boundary.vertex_tags);
}

TEST_F(SolidBoundaryTest, NeitherTheOrderOfTheSurfaceNorThreadsChangeABit) {
  const TestSurface surface = test::RandomVoxelPart(4, 3, random_).Surface();
  const Tetrahedra mesh = GridMeshAround(surface);
  const Bounded bounded = BoundaryOf(mesh, *IndexOf(surface));
  const Bounded other = BoundaryOf(mesh, *IndexOf(test::Shuffled(surface, random_)), {}, 2);
  EXPECT_EQ(other.boundary.facets, bounded.boundary.facets);
  EXPECT_EQ(other.boundary.parts, bounded.boundary.parts);
  EXPECT_EQ(other.boundary.vertex_tags, bounded.boundary.vertex_tags);
}

// A mesh that the surface knows nothing of: facets are off the triangles, and the nearest ones have their tags.
TEST_F(SolidBoundaryTest, FacetsBesideTheSurfaceHaveTheTagOfTheNearestTriangle) {
  TestSurface surface = test::Sphere(3);
  for (size_t t = 0; t < surface.triangle_count(); ++t) {
    double z = 0;
    for (size_t k = 0; k < 3; ++k) {
      z += surface.points[3 * size_t{surface.corners[3 * t + k]} + 2];
    }
    surface.markers[t] = z > 0 ? 5 : -3;
  }
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
  std::vector<double> grid;
  for (double x = -1.51; x < 1.6; x += 0.11) {
    grid.push_back(x);
  }
  const Bounded bounded = BoundaryOf(test::GridMesh(grid, grid, grid), *indexed);
  EXPECT_THAT(bounded.boundary.parts, ElementsAre(BoundaryPart{1, "marker_-3", bounded.boundary.parts[0].facets},
                                                  BoundaryPart{5, "marker_5", bounded.boundary.parts[1].facets}));
  for (size_t f = 0; f < bounded.facet_count(); ++f) {
    const Triangle t = bounded.At(f);
    Point<3> middle;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = (t[0][axis] + t[1][axis] + t[2][axis]) / 3;
    }
    double least = 100;
    int32_t marker = 0;
    for (uint32_t k = 0; k < indexed->complex.triangles.size(); ++k) {
      const double distance_sq = DistanceSq<3>(middle, NearestPoint(indexed->complex.TriangleAt(k), middle));
      if (distance_sq < least - 1e-9) {
        least = distance_sq;
        marker = indexed->complex.markers[k];
      }
    }
    if (std::abs(middle[2]) > 1e-6) {
      EXPECT_EQ(bounded.TagOf(f), marker == 5 ? 5 : 1) << f;
    }
  }
}

// Where a facet near a crease is nearer to the other patch, its vertices tell.
TEST_F(SolidBoundaryTest, AFacetHasTheMarkerThatAllItsVerticesAreOn) {
  // A thin wedge: the middles of facets of the upper side are hardly farther from the lower one.
  TestSurface surface;
  const uint32_t a = surface.AddPoint({0, 0, 0});
  const uint32_t b = surface.AddPoint({0, 1, 0});
  const uint32_t c = surface.AddPoint({1, 0, 0});
  const uint32_t d = surface.AddPoint({1, 0, 1e-3});
  surface.AddTriangle({a, b, c}, 1);
  surface.AddTriangle({a, d, b}, 2);
  surface.AddTriangle({a, c, d}, 3);
  surface.AddTriangle({b, d, c}, 4);
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
  Tetrahedra mesh{.points = surface.points, .simplices = {0, 1, 2, 3}};
  ASSERT_NE(mesh.VolumeOf(0), 0);
  if (mesh.VolumeOf(0) < 0) {
    std::swap(mesh.simplices[0], mesh.simplices[1]);
  }
  const std::vector<uint32_t> solid_of = {1};
  const std::vector<int32_t> region_of = {0, 1};
  const SolidBoundary boundary =
      *FindSolidBoundary({mesh.points, mesh.simplices, solid_of, region_of}, indexed->index, 1, RunContext());
  ASSERT_EQ(boundary.parts.size(), 4);
  for (int32_t tag = 1; tag <= 4; ++tag) {
    EXPECT_EQ(boundary.parts[tag - 1].facets, 1);
    std::vector<uint32_t> vertices(&boundary.facets[3 * (tag - 1)], &boundary.facets[3 * (tag - 1)] + 3);
    std::vector<uint32_t> corners(&surface.corners[3 * (tag - 1)], &surface.corners[3 * (tag - 1)] + 3);
    EXPECT_THAT(vertices, ::testing::UnorderedElementsAreArray(corners));
  }
  EXPECT_THAT(boundary.vertex_tags, ElementsAre(1, 1, 1, 2));
}

TEST_F(SolidBoundaryTest, ARunThatIsCancelledEnds) {
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(test::Cube());
  const Tetrahedra mesh = GridMeshAround(test::Cube());
  const HugeVector<uint32_t> solid_of = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 1, RunContext());
  const std::vector<int32_t> region_of = {0, 1};
  RunContext context;
  context.Cancel();
  EXPECT_EQ(
      FindSolidBoundary({mesh.points, mesh.simplices, solid_of, region_of}, indexed->index, 2, context).status().code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
