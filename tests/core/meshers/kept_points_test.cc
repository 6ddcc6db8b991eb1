// Meshes of surfaces all of whose points are kept as vertices.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "core/meshers/mesher.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/acute_parts.h"
#include "tests/support/canonical.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;
using ::testing::HasSubstr;

MeshParameters Parameters(double min_dihedral = 0) {
  MeshParameters parameters;
  parameters.min_dihedral = min_dihedral;
  parameters.max_vertices = 20'000;
  return parameters;
}

absl::StatusOr<Mesh> Kept(const TestSurface& surface, const MeshParameters& parameters,
                          SolidRule solids = SolidRule::kEvenOdd) {
  SurfaceFeatures features = surface.Features();
  features.solids = solids;
  features.keeps_points = true;
  RunContext context;
  return MeshPoints(parameters, Input(surface.points, features), context);
}

// Checks that each given point is a vertex, and has kept its bits.
void ExpectAllKept(const TestSurface& surface, const Mesh& mesh) {
  ASSERT_EQ(mesh.input_vertex.size(), surface.points.size() / 3);
  for (size_t i = 0; i < mesh.input_vertex.size(); ++i) {
    ASSERT_NE(mesh.input_vertex[i], kNoOutput) << "point " << i;
    ASSERT_EQ(PointAt<3>(mesh.points, mesh.input_vertex[i]), PointAt<3>(surface.points, i)) << "point " << i;
  }
}

struct KeptCase {
  const char* name;
  TestSurface surface;
  double most_vertices;  // times the points
};

class KeptPoints : public ::testing::TestWithParam<KeptCase> {};

TEST_P(KeptPoints, AreVerticesAndTheMeshConforms) {
  const TestSurface& surface = GetParam().surface;
  const absl::StatusOr<Mesh> mesh = Kept(surface, Parameters());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectAllKept(surface, *mesh);
  ExpectConforming(*mesh);
  EXPECT_LE(mesh->statistics.max_radius_edge, 2 * (1 + 1e-9));
  EXPECT_EQ(mesh->statistics.surface->lost_ridges, 0);
  EXPECT_LE(mesh->statistics.surface->deviation_of_facets, 1.25 * kDefaultTolerance * DiagonalOf(surface));
  const double points = static_cast<double>(surface.points.size()) / 3;
  EXPECT_LE(static_cast<double>(mesh->points.size()) / 3, GetParam().most_vertices * points);
}

INSTANTIATE_TEST_SUITE_P(, KeptPoints,
                         ::testing::Values(KeptCase{"sphere", test::Sphere(3), 1.3},
                                           KeptCase{"cube", test::Subdivided(test::Subdivided(test::Cube())), 1.5},
                                           KeptCase{"lshape", test::Subdivided(test::SurfaceOf("lshape")), 6},
                                           KeptCase{"cylinder", test::SurfaceOf("cylinder"), 12}),
                         [](const auto& given) { return std::string(given.param.name); });

TEST(KeptPointsTest, RepairLeavesThemInPlace) {
  const TestSurface sphere = test::Sphere(3);
  const absl::StatusOr<Mesh> mesh = Kept(sphere, Parameters(12));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectAllKept(sphere, *mesh);
  ExpectConforming(*mesh);
}

TEST(KeptPointsTest, WithoutThemCornersOfTrianglesAreNoVertices) {
  const TestSurface sphere = test::Sphere(3);
  const absl::StatusOr<Mesh> mesh = MeshOf(sphere, Parameters());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const auto left_out = std::count(mesh->input_vertex.begin(), mesh->input_vertex.end(), kNoOutput);
  EXPECT_GT(left_out, static_cast<int64_t>(sphere.points.size() / 6));
}

TEST(KeptPointsTest, PointsOfOneKindOfSolidsAreEnough) {
  // The second box is a hole: corners of its outer facets are no vertices.
  const TestSurface boxes = test::Boxes({0, 1, 2}, {0, 1}, {0, 1}, [](int x, int, int) { return x + 1; });
  const SolidSeed hole{.at = {1.5, 0.5, 0.5}, .is_hole = true};
  SurfaceFeatures features = boxes.Features();
  features.solids = SolidRule::kHoles;
  features.seeds = {&hole, 1};
  features.keeps_points = true;
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(Parameters(), Input(boxes.points, features), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (size_t i = 0; i < mesh->input_vertex.size(); ++i) {
    EXPECT_EQ(mesh->input_vertex[i] == kNoOutput, boxes.points[3 * i] == 2) << "point " << i;
  }
}

TEST(KeptPointsTest, EqualPointsAreOneVertex) {
  const TestSurface loose = test::Loose(test::Sphere(2));
  const absl::StatusOr<Mesh> mesh = Kept(loose, Parameters());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectAllKept(loose, *mesh);
  EXPECT_GT(mesh->statistics.duplicates, 0);
}

TEST(KeptPointsTest, PointsInsideAndSizesCountBesides) {
  TestSurface sphere = test::Sphere(2);
  sphere.AddPoint({0.1, 0.2, 0.3});
  MeshParameters parameters = Parameters();
  parameters.surface.edge_length = 0.2;
  const absl::StatusOr<Mesh> mesh = Kept(sphere, parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectAllKept(sphere, *mesh);
  EXPECT_GT(mesh->points.size(), 3 * sphere.points.size());
}

class KeptPointsOrderTest : public test::SeededTest {
 protected:
  KeptPointsOrderTest() : SeededTest(20261130) {}
};

TEST_F(KeptPointsOrderTest, NeitherOrderNorThreadsChangeABit) {
  const TestSurface cube = test::Subdivided(test::Subdivided(test::Cube()));
  const absl::StatusOr<Mesh> mesh = Kept(cube, Parameters(12));
  MeshParameters threads = Parameters(12);
  threads.threads = 2;
  const absl::StatusOr<Mesh> again = Kept(test::Shuffled(cube, random_), threads);
  ASSERT_TRUE(mesh.ok() && again.ok()) << mesh.status() << again.status();
  EXPECT_EQ(test::Hash(test::Canonical(*mesh)), test::Hash(test::Canonical(*again)));
}

std::string ErrorOf(const absl::StatusOr<Mesh>& mesh) { return std::string(mesh.status().message()); }

TEST(KeptPointsTest, RefusalsNameTheOption) {
  EXPECT_THAT(ErrorOf(Kept(test::Wedge(30), Parameters())), HasSubstr("keep_points: the surface is sharp, 30 degrees"));
  EXPECT_THAT(ErrorOf(Kept(test::Cube(), Parameters(), SolidRule::kWinding)),
              HasSubstr("keep_points: what is made of triangles by winding"));
  MeshParameters few = Parameters();
  few.max_vertices = 100;
  const absl::StatusOr<Mesh> mesh = Kept(test::Sphere(3), few);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(ErrorOf(mesh), HasSubstr("keep_points: triangles at meshed solids have 642 points"));
}

}  // namespace
}  // namespace wellspace::core
