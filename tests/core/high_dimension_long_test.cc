// Whole meshes in 4-D and 6-D, too slow for every run.
#include <gtest/gtest.h>

#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

Mesh ValidMesh(int dimension, const std::vector<double>& cloud) {
  const MeshParameters parameters = test::InUnitBox(dimension);
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  ValidationOptions options;
  options.rho = DefaultRho(dimension);
  options.cloud = cloud;
  EXPECT_EQ(ValidateMesh({dimension, mesh->points, mesh->simplices}, options), absl::OkStatus());
  return *mesh;
}

// A throw-away implementation made 1 857 vertices.
TEST(HighDimensionLongTest, AThousandPointsIn4D) {
  EXPECT_LE(ValidMesh(4, test::MakeCloud("inner", 4, 1000)).vertex_count(), 1.03 * 1857);
}

TEST(HighDimensionLongTest, ThreePointsIn5D) { ValidMesh(5, test::MakeCloud("inner", 5, 3)); }

TEST(HighDimensionLongTest, OnePointIn6D) {
  EXPECT_GT(ValidMesh(6, test::MakeCloud("inner", 6, 1)).simplex_count(), 10'000);
}

}  // namespace
}  // namespace wellspace::core
