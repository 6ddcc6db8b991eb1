// Creases at which patches meet at small angles: all of them are edges of the mesh, whose volume is exact, and the cost
// follows from the angle.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/vector_product.h"
#include "core/meshers/mesher.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/acute_parts.h"
#include "tests/support/canonical.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;
using test::Wedge;
using ::testing::AllOf;
using ::testing::HasSubstr;

double VolumeOfWedge(double degrees) { return 0.5 * std::sin(degrees * std::numbers::pi / 180); }

// Most vertices, and most exempt tetrahedra, of the mesh of a wedge.
struct WedgeBounds {
  double degrees;
  uint64_t vertices;
  uint64_t exempt;
};

class Wedges : public ::testing::TestWithParam<WedgeBounds> {};

TEST_P(Wedges, KeepTheirCreasesAndVolumes) {
  const TestSurface wedge = Wedge(GetParam().degrees);
  MeshParameters parameters = Bounds(wedge, 0.05, 0.06, 0.003);
  const absl::StatusOr<Mesh> mesh = MeshOf(wedge, parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  const SurfaceStatistics& figures = *mesh->statistics.surface;
  EXPECT_NEAR(VolumeOf(*mesh), VolumeOfWedge(GetParam().degrees), 1e-12);
  EXPECT_EQ(figures.lost_ridges, 0);
  EXPECT_GT(figures.acute_curves, 0);
  EXPECT_GT(figures.tube_simplices, 0);
  EXPECT_LE(figures.exempt_simplices, GetParam().exempt);
  EXPECT_LE(mesh->vertex_count(), GetParam().vertices);
}

INSTANTIATE_TEST_SUITE_P(AcuteMeshes, Wedges,
                         ::testing::Values(WedgeBounds{60, 855, 2}, WedgeBounds{45, 850, 2}, WedgeBounds{30, 650, 2},
                                           WedgeBounds{20, 655, 20}, WedgeBounds{15, 729, 130},
                                           WedgeBounds{10, 1106, 201}, WedgeBounds{5, 3522, 429}),
                         [](const auto& bounds) {
                           return "Of" + std::to_string(static_cast<int>(bounds.param.degrees)) + "Degrees";
                         });

class AcuteMeshesTest : public test::SeededTest {
 protected:
  AcuteMeshesTest() : SeededTest(20261130) {}
};

TEST_F(AcuteMeshesTest, AreKeptAtCornersOfManyAndAroundLoops) {
  for (const TestSurface& part : {test::AcuteTetrahedron(10), test::AcuteTetrahedron(40), test::Cone(64, 0.5)}) {
    const absl::StatusOr<Mesh> mesh = MeshOf(part, Bounds(part, 0.05, 0.06, 0.003));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    EXPECT_EQ(mesh->statistics.surface->lost_ridges, 0);
    EXPECT_GT(mesh->statistics.surface->acute_curves, 0);
    const double volume = test::VolumeWithin(part);
    EXPECT_NEAR(VolumeOf(*mesh), volume, part.triangle_count() == 4 ? 1e-12 : 0.02 * volume);
  }
}

TEST_F(AcuteMeshesTest, DoNotDependOnTheOrderOfTriangles) {
  const TestSurface wedge = Wedge(25);
  MeshParameters parameters = Bounds(wedge, 0.1, 0.2, 0.01);
  parameters.min_dihedral = 12;
  const absl::StatusOr<Mesh> mesh = MeshOf(wedge, parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  parameters.threads = 2;
  for (int round = 0; round < 3; ++round) {
    const absl::StatusOr<Mesh> again = MeshOf(test::Shuffled(wedge, random_), parameters);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(test::Hash(test::Canonical(*mesh)), test::Hash(test::Canonical(*again)));
  }
}

TEST_F(AcuteMeshesTest, SliversInTubesAreNotCounted) {
  const TestSurface wedge = Wedge(10);
  MeshParameters parameters = Bounds(wedge, 0.05, 0.06, 0.003);
  parameters.min_dihedral = 12;
  const absl::StatusOr<Mesh> mesh = MeshOf(wedge, parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  EXPECT_NEAR(VolumeOf(*mesh), VolumeOfWedge(10), 1e-12);
  const SurfaceStatistics& figures = *mesh->statistics.surface;
  EXPECT_EQ(figures.lost_ridges, 0);
  EXPECT_LE(mesh->statistics.min_angle_deg, figures.min_angle_outside_deg);
  if (mesh->statistics.slivers_left == 0) {
    EXPECT_GE(figures.min_angle_outside_deg, 12 - 1e-9);
  }
}

// Points that mirror each other are four on a circle: no tetrahedron without a volume is left between them.
TEST_F(AcuteMeshesTest, HaveNoFlatTetrahedra) {
  const auto least_angle = [](const TestSurface& part) {
    const absl::StatusOr<Mesh> mesh = MeshOf(part, MeshParameters());
    EXPECT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    return mesh->statistics.min_angle_deg;
  };
  EXPECT_GE(least_angle(Wedge(5)), 5 - 0.01);
  for (const double degrees : {8.0, 10.0, 20.0, 30.0, 45.0, 60.0, 70.0}) {
    EXPECT_GE(least_angle(Wedge(degrees)), std::min(12.0, degrees) - 0.01) << degrees;
    TestSurface turned = Wedge(degrees);
    const double c = std::cos(1 + random_.Unit());
    const double s = std::sin(1 + random_.Unit());
    for (size_t i = 0; i < turned.points.size(); i += 3) {  // hardly by a rotation: no face is along an axis
      const Point<3> p = PointAt<3>(turned.points, i / 3);
      turned.points[i] = c * p[0] - s * p[1] + 0.1 * p[2];
      turned.points[i + 1] = s * p[0] + c * p[1];
      turned.points[i + 2] = p[2] - 0.2 * p[1];
    }
    EXPECT_GE(least_angle(turned), 4) << degrees;
  }
  // Wherever the part is, and however large: coordinates are rounded relatively.
  for (const auto& [scale, offset] : {std::pair(0x1p20, 0.0), {1e-3, 0.0}, {100.0, 5e6}, {1.0, 1e4}}) {
    TestSurface moved = Wedge(45);
    for (double& x : moved.points) {
      x = scale * x + offset;
    }
    EXPECT_GE(least_angle(moved), 11.5) << scale << " " << offset;
  }
  EXPECT_GE(least_angle(test::AcuteTetrahedron(10)), 5);
  EXPECT_GE(least_angle(test::AcuteTetrahedron(40)), 5);
  EXPECT_GE(least_angle(test::LensBar(24)), 1);
  // Around the rim of a cone, where a crease bends, four are nearly on a plane.
  for (const auto& [sides, height] : {std::pair(64, 0.5), {64, 0.7}, {64, 1.5}, {64, 2.0}, {64, 3.0}, {100, 2.0}}) {
    EXPECT_GE(least_angle(test::Cone(sides, height)), 11.9) << sides << " " << height;
  }
  EXPECT_GE(least_angle(test::Wing(40)), 1);
}

TEST_F(AcuteMeshesTest, AreRefusedBelowFiveDegreesWithPlaceAndAngle) {
  const absl::Status status = MeshOf(Wedge(3), Bounds(Wedge(3), 0.1, 0.2, 0.01)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("patches meet at 3 degrees at ("), HasSubstr("at least 5 degrees")));
}

// Nothing goes between a crease and what stands around it: that is as near as the patch bends there, also where no edge
// length is asked for.
TEST_F(AcuteMeshesTest, AreAsNearToBentPatchesAsTheTolerance) {
  for (const int sides : {24, 48, 200}) {
    for (const double share : {1e-3, 4e-3}) {
      const TestSurface bar = test::LensBar(sides);
      MeshParameters parameters;
      parameters.surface.tolerance = share * DiagonalOf(bar);
      const absl::StatusOr<Mesh> mesh = MeshOf(bar, parameters);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      const SurfaceStatistics& figures = *mesh->statistics.surface;
      EXPECT_LE(figures.deviation_of_surface, 1.25 * parameters.surface.tolerance) << sides << " " << share;
      EXPECT_EQ(figures.lost_ridges, 0);
      EXPECT_LE(mesh->vertex_count(), 1000);
    }
  }
}

// The tip of a slim cone is as a corner: points stand around it, and a vertex is in it.
TEST_F(AcuteMeshesTest, TipsOfConesAreKept) {
  for (const double height : {2.0, 5.0, 20.0}) {
    const TestSurface cone = test::Cone(64, height);
    const absl::StatusOr<Mesh> mesh = MeshOf(cone, MeshParameters());
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    double highest = 0;
    for (size_t i = 2; i < mesh->points.size(); i += 3) {
      highest = std::max(highest, mesh->points[i]);
    }
    EXPECT_EQ(highest, height);
    EXPECT_LE(mesh->statistics.surface->deviation_of_surface, 1.25e-3 * DiagonalOf(cone));
    EXPECT_NEAR(VolumeOf(*mesh), test::VolumeWithin(cone), 0.02 * test::VolumeWithin(cone));
  }
  const absl::Status status = MeshOf(test::Cone(64, 30), MeshParameters()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), HasSubstr("two sides of a cone meet at 3.8"));
}

TEST_F(AcuteMeshesTest, TheBackOfAWingIsKept) {
  const TestSurface wing = test::Wing(40);
  const absl::StatusOr<Mesh> mesh = MeshOf(wing, MeshParameters());
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  EXPECT_EQ(mesh->statistics.surface->acute_curves, 1);
  EXPECT_EQ(mesh->statistics.surface->lost_ridges, 0);
  EXPECT_LE(mesh->vertex_count(), 1500);
}

// Where three acute curves leave a corner at angles by chance, spacings grow fast, and no two subsegments are as long.
TEST_F(AcuteMeshesTest, AreKeptAtTetrahedraByChance) {
  for (int found = 0; found < 24;) {
    TestSurface surface;
    for (int i = 0; i < 4; ++i) {
      surface.AddPoint({random_.Unit(), random_.Unit(), random_.Unit()});
    }
    for (const std::array<uint32_t, 3>& triangle :
         {std::array<uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
      surface.AddTriangle(triangle);
    }
    if (const double least = test::LeastAngleOfTetrahedron(surface); least < 8 || least > 40) {
      continue;
    }
    ++found;
    MeshParameters parameters;
    parameters.min_dihedral = 0;
    SurfaceFeatures features = surface.Features();
    features.crease_angle = 1;
    RunContext context;
    const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, Input(surface.points, features), context);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    EXPECT_EQ(mesh->statistics.surface->lost_ridges, 0);
    EXPECT_NEAR(VolumeOf(*mesh), test::VolumeWithin(surface), 1e-12);
    EXPECT_LE(mesh->vertex_count(), 800);
  }
}

TEST_F(AcuteMeshesTest, EndWithTheirBudgetOfVertices) {
  MeshParameters parameters = Bounds(Wedge(30), 1e-4, 1, 0.003);
  parameters.max_vertices = 500;
  const absl::Status status = MeshOf(Wedge(30), parameters).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_vertices = 500"));
}

}  // namespace
}  // namespace wellspace::core
