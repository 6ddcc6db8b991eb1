// Labels of tetrahedra: volumes of solids, and orders that labels do not depend on.
#include "core/simplex/solid_labels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/support/seeded_test.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::IndexedSurface;
using test::Tetrahedra;

std::vector<double> VolumesBy(const HugeVector<uint32_t>& labels, const Tetrahedra& mesh, uint32_t solids) {
  std::vector<double> volumes(solids);
  for (size_t s = 0; s < labels.size(); ++s) {
    volumes[labels[s]] += mesh.VolumeOf(s);
  }
  return volumes;
}

class SolidLabelsTest : public test::SeededTest {
 protected:
  SolidLabelsTest() : SeededTest(60'117) {}
};

TEST_F(SolidLabelsTest, VolumesAreThoseOfSolidsWhereTheMeshHasTheFacetsOfTheSurface) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    const Tetrahedra mesh = GridMeshAround(given.surface);
    const std::unique_ptr<IndexedSurface> indexed = IndexOf(given.surface);
    const HugeVector<uint32_t> labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext());
    std::vector<double> volumes = VolumesBy(labels, mesh, indexed->solids.count);
    volumes.erase(volumes.begin());
    std::sort(volumes.begin(), volumes.end());
    ASSERT_EQ(volumes.size(), given.volumes.size()) << given.name;
    for (size_t i = 0; i < volumes.size(); ++i) {
      EXPECT_NEAR(volumes[i], given.volumes[i], 1e-12) << given.name;
    }
  }
}

// The six tetrahedra of a cube have its centre for a circumcentre, so that the sphere is one of cubes.
TEST_F(SolidLabelsTest, ASphereIsTheCubesOfAGridWhoseCentresItHas) {
  std::vector<double> grid;
  for (int i = -12; i <= 12; ++i) {
    grid.push_back(i * 0.125);
  }
  const Tetrahedra mesh = test::GridMesh(grid, grid, grid);
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(test::Sphere(3));
  const HugeVector<uint32_t> labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext());
  const std::vector<double> volumes = VolumesBy(labels, mesh, indexed->solids.count);
  size_t cubes = 0;
  for (int i = -12; i < 12; ++i) {
    for (int j = -12; j < 12; ++j) {
      for (int k = -12; k < 12; ++k) {
        cubes += indexed->index.SolidAt({(i + 0.5) * 0.125, (j + 0.5) * 0.125, (k + 0.5) * 0.125}) == 1 ? 1 : 0;
      }
    }
  }
  EXPECT_NEAR(volumes[1], static_cast<double>(cubes) * 0.125 * 0.125 * 0.125, 1e-9);
  EXPECT_NEAR(volumes[1], indexed->solids.volumes[1], 0.03 * indexed->solids.volumes[1]);
}

TEST_F(SolidLabelsTest, NeitherThreadsNorTheOrderOfCornersChangeLabels) {
  const test::TestSurface surface = test::Sphere(3, {1.5, 1.5, 1.5}, 1.2);
  std::vector<double> grid = {0};
  while (grid.back() < 3) {
    grid.push_back(grid.back() + 0.05 + 0.2 * random_.Unit());
  }
  Tetrahedra mesh = test::GridMesh(grid, grid, grid);
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(surface);
  const HugeVector<uint32_t> labels = *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 1, RunContext());
  for (size_t s = 0; s < mesh.simplices.size(); s += 4) {
    std::rotate(mesh.simplices.begin() + s, mesh.simplices.begin() + s + random_.Below(4),
                mesh.simplices.begin() + s + 4);
  }
  EXPECT_EQ(labels, *LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, RunContext()));
  EXPECT_EQ(LabelledPoint(mesh.At(7)), LabelledPoint({mesh.At(7)[2], mesh.At(7)[0], mesh.At(7)[3], mesh.At(7)[1]}));
}

TEST_F(SolidLabelsTest, ARunThatIsCancelledEnds) {
  const Tetrahedra mesh = GridMeshAround(test::Cube());
  const std::unique_ptr<IndexedSurface> indexed = IndexOf(test::Cube());
  RunContext context;
  context.Cancel();
  EXPECT_EQ(LabelSimplices(indexed->index, mesh.points, mesh.simplices, 2, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
