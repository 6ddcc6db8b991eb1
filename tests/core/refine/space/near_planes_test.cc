// What the planes of triangles nearby tell of segments: never that one crosses nothing that does.
#include "core/refine/space/near_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

class NearPlanesTest : public test::SeededTest {
 protected:
  NearPlanesTest() : SeededTest(20261204) {}

  void SetUp() override {
    ASSERT_TRUE(index_.Build(complex_, solids_, MortonGrid<3>(Box<3>{{-4, -4, -4}, {4, 4, 4}}), context_).ok());
  }

  const test::TestSurface sphere_ = test::Sphere(4);
  const RunContext context_;
  const SurfaceComplex complex_ = *MakeSurfaceComplex(sphere_.points, {}, sphere_.Features(), context_);
  const Solids solids_ = *FindSolids(complex_, context_);
  SurfaceIndex index_;
};

TEST_F(NearPlanesTest, AllThatIsCrossedIsAmongTheRest) {
  size_t most = 0;
  for (const double half : {0.05, 0.1, 0.2, 0.25}) {
    for (int round = 0; round < 30; ++round) {
      // A box around a point of the sphere, and points in it.
      Point<3> at = {random_.Gauss(), random_.Gauss(), random_.Gauss()};
      const double length = std::sqrt(NormSq<3>(at));
      for (double& x : at) {
        x /= length;
      }
      const Box<3> box = CubeAround<3>(at, half);
      NearPlanes planes;
      if (!planes.Take(index_, box, 0, NearPlanes::kMostForAll)) {
        continue;
      }
      most = std::max(most, planes.triangles().size());
      std::vector<Point<3>> points;
      for (int i = 0; i < 12; ++i) {
        Point<3>& p = points.emplace_back(at);
        for (double& x : p) {
          x += half * (2 * random_.Unit() - 1);
        }
        planes.Add(p);
      }
      std::vector<SurfaceCrossing> crossings;
      std::vector<SurfaceCrossing> among;
      for (size_t i = 0; i < points.size(); ++i) {
        for (size_t j = 0; j < points.size(); ++j) {
          index_.FindCrossings(points[i], points[j], crossings);
          index_.FindCrossingsAmong(points[i], points[j], planes.Between(i, j), among);
          ASSERT_EQ(among, crossings);
        }
        const size_t beside = planes.FirstBeside(i);
        EXPECT_EQ(index_.SolidAt(points[beside]), index_.SolidAt(points[i]));
      }
      const std::vector<uint32_t> amid(planes.AmidAll().begin(), planes.AmidAll().end());
      for (const SurfaceCrossing& crossing : crossings) {
        EXPECT_TRUE(std::binary_search(amid.begin(), amid.end(), crossing.triangle));
      }
    }
  }
  EXPECT_GT(most, 128) << "more than the bits of two words";
}

}  // namespace
}  // namespace wellspace::core
