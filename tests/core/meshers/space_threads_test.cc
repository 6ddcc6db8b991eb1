// Meshes of surfaces on several threads have the same bits as on one.
#include <gtest/gtest.h>

#include <string>

#include "absl/status/statusor.h"
#include "core/meshers/mesher.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/same_mesh.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;

struct Part {
  const char* file;
  double facet;
  double tolerance;
};

class SpaceThreadsTest : public ::testing::TestWithParam<Part> {};

INSTANTIATE_TEST_SUITE_P(Parts, SpaceThreadsTest,
                         ::testing::Values(Part{"cube", 0.08, 0.01}, Part{"lshape", 0.08, 0.01},
                                           Part{"cylinder", 0.08, 0.005}, Part{"cube_hole", 0.08, 0.01},
                                           Part{"plate", 0.08, 0.01}, Part{"spot", 0.1, 0.01},
                                           Part{"twocubes", 0.08, 0.01}, Part{"wedge10", 0.08, 0.01},
                                           Part{"wedge30", 0.08, 0.01}, Part{"wedge60", 0.08, 0.01},
                                           Part{"wedge90", 0.08, 0.01}),
                         [](const auto& part) { return std::string(part.param.file); });

TEST_P(SpaceThreadsTest, MakeTheSameMesh) {
  const TestSurface surface = test::SurfaceOf(GetParam().file);
  for (const double min_dihedral : {0.0, 12.0}) {
    MeshParameters parameters = Bounds(surface, GetParam().facet, 1.2 * GetParam().facet, GetParam().tolerance);
    parameters.min_dihedral = min_dihedral;
    const absl::StatusOr<Mesh> alone = MeshOf(surface, parameters);
    for (const int threads : {2, 3, 4}) {
      SCOPED_TRACE(threads);
      parameters.threads = threads;
      const absl::StatusOr<Mesh> together = MeshOf(surface, parameters);
      ASSERT_EQ(together.status(), alone.status());
      if (!alone.ok()) {
        continue;
      }
      test::ExpectSameMesh(*together, *alone);
      EXPECT_EQ(together->ridges, alone->ridges);
      const SurfaceStatistics& figures = *together->statistics.surface;
      EXPECT_EQ(figures.deviation_of_facets, alone->statistics.surface->deviation_of_facets);
      EXPECT_EQ(figures.deviation_of_surface, alone->statistics.surface->deviation_of_surface);
    }
  }
}

}  // namespace
}  // namespace wellspace::core
