// Labels of tetrahedra: volumes of solids by those that are not cut, and which are cut.
#include "core/simplex/solid_labels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/features/triangle_crossing.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/vector_product.h"
#include "core/mesher.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::IsEmpty;

// In place, since the index has addresses of the rest.
struct Indexed {
  SurfaceComplex complex;
  Solids solids;
  SurfaceIndex index;
};

constexpr double kLow = -0.5;
constexpr double kHigh = 3.5;  // of a box around the seven complexes

std::unique_ptr<Indexed> IndexOf(const test::TestSurface& surface) {
  const RunContext context;
  auto indexed = std::make_unique<Indexed>();
  indexed->complex = *MakeSurfaceComplex(surface.points, {}, surface.Features(), context);
  indexed->solids = *FindSolids(indexed->complex, context);
  const Box<3> box{{kLow, kLow, kLow}, {kHigh, kHigh, kHigh}};
  for (const Point<3>& p : indexed->complex.points) {
    EXPECT_TRUE(box.Contains(p));
  }
  EXPECT_TRUE(indexed->index.Build(indexed->complex, indexed->solids, MortonGrid<3>(box), context).ok());
  return indexed;
}

double VolumeOf(const Simplex<3>& s) {
  return std::abs(Dot<3>(Difference<3>(s[1], s[0]), Cross(Difference<3>(s[2], s[0]), Difference<3>(s[3], s[0])))) / 6;
}

Simplex<3> SimplexAt(const std::vector<double>& points, const uint32_t* corners) {
  return {PointAt<3>(points, corners[0]), PointAt<3>(points, corners[1]), PointAt<3>(points, corners[2]),
          PointAt<3>(points, corners[3])};
}

struct TestMesh {
  std::vector<double> points;
  std::vector<uint32_t> simplices;
};

// A grid of cubes of which each is six tetrahedra around its diagonal.
TestMesh GridMesh(uint32_t cubes, double low, double side) {
  TestMesh mesh;
  const uint32_t row = cubes + 1;
  for (uint32_t i = 0; i < row * row * row; ++i) {
    mesh.points.insert(mesh.points.end(),
                       {low + side * (i / (row * row)), low + side * (i / row % row), low + side * (i % row)});
  }
  const std::array<uint32_t, 3> steps = {row * row, row, 1};
  for (uint32_t cube = 0; cube < cubes * cubes * cubes; ++cube) {
    const uint32_t corner = cube / (cubes * cubes) * steps[0] + cube / cubes % cubes * steps[1] + cube % cubes;
    std::array<uint32_t, 3> order = {0, 1, 2};
    do {
      uint32_t at = corner;
      mesh.simplices.push_back(at);
      for (const uint32_t axis : order) {
        at += steps[axis];
        mesh.simplices.push_back(at);
      }
    } while (std::next_permutation(order.begin(), order.end()));
  }
  return mesh;
}

class SolidLabelsTest : public test::SeededTest {
 protected:
  SolidLabelsTest() : SeededTest(60'117) {}

  TestMesh CloudMesh(size_t count) {
    std::vector<double> points;
    for (size_t i = 0; i < 3 * count; ++i) {
      points.push_back(kLow + (kHigh - kLow) * random_.Unit());
    }
    MeshParameters parameters;
    parameters.domain_low = {kLow, kLow, kLow};
    parameters.domain_high = {kHigh, kHigh, kHigh};
    RunContext context;
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, points, context);
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    return {{mesh->points.begin(), mesh->points.end()}, {mesh->simplices.begin(), mesh->simplices.end()}};
  }
};

// Sums by label, and of what is cut.
struct Sums {
  std::vector<double> volumes;
  double cut = 0;
};

Sums SumsOf(const TestMesh& mesh, const SolidLabels& labels, uint32_t solids) {
  Sums sums{.volumes = std::vector<double>(solids)};
  for (size_t s = 0; s < labels.solid_of.size(); ++s) {
    const double volume = VolumeOf(SimplexAt(mesh.points, &mesh.simplices[4 * s]));
    sums.volumes[labels.solid_of[s]] += volume;
    sums.cut += std::binary_search(labels.cut.begin(), labels.cut.end(), s) ? volume : 0;
  }
  return sums;
}

TEST_F(SolidLabelsTest, AMeshThatHasTheFacetsOfTheSurfaceIsNotCut) {
  // Corners of these complexes lie on a grid of eighths, and their facets along its planes.
  const TestMesh mesh = GridMesh(32, kLow, 0.125);
  int checked = 0;
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const bool is_on_grid = std::all_of(given.surface.points.begin(), given.surface.points.end(),
                                        [](double x) { return std::floor(8 * x) == 8 * x; });
    if (!is_on_grid) {
      continue;
    }
    ++checked;
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    const SolidLabels labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext());
    EXPECT_THAT(labels.cut, IsEmpty()) << given.name;
    const Sums sums = SumsOf(mesh, labels, indexed->solids.count);
    for (uint32_t solid = 1; solid < indexed->solids.count; ++solid) {
      EXPECT_NEAR(sums.volumes[solid], indexed->solids.volumes[solid], 1e-12) << given.name;
    }
  }
  EXPECT_GE(checked, 3);
}

TEST_F(SolidLabelsTest, VolumesAreThoseOfSolidsButForWhatIsCut) {
  const TestMesh mesh = CloudMesh(4000);
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const std::unique_ptr<Indexed> indexed = IndexOf(given.surface);
    const SolidLabels labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 1, RunContext());
    const Sums sums = SumsOf(mesh, labels, indexed->solids.count);
    EXPECT_TRUE(std::is_sorted(labels.cut.begin(), labels.cut.end()));
    EXPECT_FALSE(labels.cut.empty());
    EXPECT_LT(labels.cut.size(), labels.solid_of.size() / 2);
    double total = 0;
    for (uint32_t solid = 1; solid < indexed->solids.count; ++solid) {
      EXPECT_NEAR(sums.volumes[solid], indexed->solids.volumes[solid], sums.cut) << given.name;
      // Centroids are as often on one side as on the other.
      EXPECT_NEAR(sums.volumes[solid], indexed->solids.volumes[solid], 0.2 * sums.cut + 0.01) << given.name;
      total += indexed->solids.volumes[solid];
    }
    EXPECT_GT(total, 0);
  }
}

TEST_F(SolidLabelsTest, WhatIsNotCutLiesInOneSolid) {
  const TestMesh mesh = CloudMesh(300);
  const test::TestSurface surface =
      test::Joined(test::Sphere(2, {1.5, 1.5, 1.5}, 1.2), test::Sphere(1, {1.5, 1.4, 1.6}, 0.7));
  const std::unique_ptr<Indexed> indexed = IndexOf(surface);
  const SolidLabels labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext());
  std::vector<SurfaceCrossing> crossings;
  for (size_t s = 0; s < labels.solid_of.size(); ++s) {
    const Simplex<3> simplex = SimplexAt(mesh.points, &mesh.simplices[4 * s]);
    // Its edges cross a triangle, or sides of a triangle one of its facets, or it has a corner of one.
    bool is_cut = false;
    for (size_t i = 0; i < 4; ++i) {
      for (size_t k = i + 1; k < 4; ++k) {
        indexed->index.FindCrossings(simplex[i], simplex[k], crossings);
        is_cut = is_cut || !crossings.empty();
      }
      const Triangle facet = {simplex[(i + 1) % 4], simplex[(i + 2) % 4], simplex[(i + 3) % 4]};
      for (const auto& [a, b] : indexed->complex.edges) {
        const Point<3>& p = indexed->complex.points[a];
        const Point<3>& q = indexed->complex.points[b];
        is_cut = is_cut || Crosses(facet, p, MovedSide(facet, p), q, MovedSide(facet, q));
      }
    }
    for (const Point<3>& p : indexed->complex.points) {
      bool is_inside = true;
      for (size_t i = 0; i < 4 && is_inside; ++i) {
        Simplex<3> other = simplex;
        other[i] = p;
        is_inside = Orientation<3>(other).sign == Orientation<3>(simplex).sign;
      }
      is_cut = is_cut || is_inside;
    }
    ASSERT_EQ(std::binary_search(labels.cut.begin(), labels.cut.end(), s), is_cut) << s;
    if (!is_cut) {
      for (const Point<3>& corner : simplex) {
        EXPECT_EQ(indexed->index.SolidAt(corner), labels.solid_of[s]);
      }
    }
  }
}

TEST_F(SolidLabelsTest, ATetrahedronWithAWholeShellInsideIsCut) {
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(1, {1, 1, 1}, 0.01));
  const std::vector<double> points = {0, 0, 0, 3, 0, 0, 0, 3, 0, 1, 1, 3, 3, 3, -0.4};
  const std::vector<uint32_t> simplices = {0, 1, 2, 3, 0, 2, 1, 4};
  const SolidLabels labels = *LabelSimplices(indexed->index, points, simplices, 1, RunContext());
  EXPECT_THAT(labels.cut, ::testing::ElementsAre(0u));
}

TEST_F(SolidLabelsTest, NeitherThreadsNorTheOrderOfCornersChangeLabels) {
  TestMesh mesh = CloudMesh(2000);
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Sphere(3, {1.5, 1.5, 1.5}, 1.2));
  const SolidLabels labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 1, RunContext());
  for (size_t s = 0; s < mesh.simplices.size(); s += 4) {
    std::rotate(mesh.simplices.begin() + s, mesh.simplices.begin() + s + random_.Below(4),
                mesh.simplices.begin() + s + 4);
  }
  const SolidLabels other = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext());
  EXPECT_EQ(labels.solid_of, other.solid_of);
  EXPECT_EQ(labels.cut, other.cut);
}

TEST_F(SolidLabelsTest, ARunThatIsCancelledEnds) {
  const TestMesh mesh = GridMesh(8, 0, 0.25);
  const std::unique_ptr<Indexed> indexed = IndexOf(test::Cube());
  RunContext context;
  context.Cancel();
  EXPECT_EQ(LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
