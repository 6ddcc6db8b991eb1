// Meshes of surfaces against these, by the checks that know nothing of the mesher: complexes of materials, parts of
// boxes by chance, turned and thin ones, spheres.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate_fidelity.h"
#include "core/validate/validate_solid.h"
#include "tests/support/acute_parts.h"
#include "tests/support/seeded_test.h"
#include "tests/support/solid_meshes.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;

constexpr double kTolerance = 0.003;  // of the diagonal

double DiagonalOf(const TestSurface& surface) {
  double sum_sq = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> grid = GridAround(surface, axis);
    const double side = (grid.back() - grid.front()) / 2;  // it is twice as wide
    sum_sq += side * side;
  }
  return std::sqrt(sum_sq);
}

// With edges of facets of that share of the diagonal.
absl::StatusOr<Mesh> MeshOf(const TestSurface& surface, const SurfaceFeatures& features, double edge) {
  const double diagonal = DiagonalOf(surface);
  MeshParameters parameters;
  parameters.min_dihedral = 0;
  parameters.max_vertices = 20000;
  parameters.surface.edge_length = edge * diagonal;
  parameters.surface.tolerance = kTolerance * diagonal;
  RunContext context;
  return MeshPoints(parameters, Input(surface.points, features), context);
}

// A mesh as the checks see it.
struct CheckedMesh {
  explicit CheckedMesh(const Mesh& mesh) : view{.dimension = 3, .points = mesh.points, .simplices = mesh.simplices} {
    for (const BoundaryPart& part : mesh.boundary) {
      tags.insert(tags.end(), part.facets, part.tag);
    }
    parts.domain.boundary = {.facets = mesh.facets, .tags = tags};
    parts.domain.regions = mesh.simplex_regions;
    parts.ridges = mesh.ridges;
  }
  absl::StatusOr<FidelityReport> ComparedWith(const TestSurface& surface, const SurfaceFeatures& features) const {
    return CompareWithSurface(view, parts, {.points = surface.points, .features = features},
                              {.tolerance = 1.25 * kTolerance * DiagonalOf(surface)}, RunContext());
  }

  MeshView view;
  std::vector<int32_t> tags;
  SolidParts parts;
};

// Meshes the inside of `surface`, and holds the mesh to it. Returns the volume that its tetrahedra have.
double ExpectFaithful(const TestSurface& surface, SolidRule rule, double edge) {
  SurfaceFeatures features = surface.Features();
  features.solids = rule;
  const absl::StatusOr<Mesh> mesh = MeshOf(surface, features, edge);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  if (!mesh.ok()) {
    return 0;
  }
  const CheckedMesh checked(*mesh);
  const absl::StatusOr<SolidMeshReport> alone = ValidateSolidMesh(checked.view, checked.parts, 2, RunContext());
  EXPECT_TRUE(alone.ok()) << alone.status();
  if (!alone.ok()) {
    return 0;
  }
  const absl::StatusOr<FidelityReport> report = checked.ComparedWith(surface, features);
  EXPECT_TRUE(report.ok()) << report.status();
  if (report.ok()) {
    EXPECT_TRUE(report->verdict.ok()) << report->verdict;
    EXPECT_EQ(report->lost_curves, 0);
  }
  double volume = 0;
  for (const auto& [region, of_region] : alone->volumes) {
    volume += of_region;
  }
  return volume;
}

// The sum of the boxes of all materials.
double VolumeOf(const test::VoxelPart& part, int materials) {
  double volume = 0;
  for (int material = 1; material <= materials; ++material) {
    volume += part.VolumeOf(material);
  }
  return volume;
}

// Turned about each axis.
TestSurface Turned(TestSurface surface, test::SplitMix64& random) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const double angle = 2 * std::numbers::pi * random.Unit();
    const size_t other = (axis + 1) % 3;
    for (size_t i = 0; i < surface.points.size(); i += 3) {
      const double x = surface.points[i + axis];
      const double y = surface.points[i + other];
      surface.points[i + axis] = std::cos(angle) * x - std::sin(angle) * y;
      surface.points[i + other] = std::sin(angle) * x + std::cos(angle) * y;
    }
  }
  return surface;
}

class SpaceFidelityTest : public test::SeededTest {
 protected:
  SpaceFidelityTest() : SeededTest(60'121) {}
};

TEST_F(SpaceFidelityTest, TheSevenComplexes) {
  for (const test::NamedComplex& given : test::SevenComplexes()) {
    SCOPED_TRACE(given.name);
    double volume = 0;
    for (const double of_solid : given.volumes) {
      volume += of_solid;
    }
    EXPECT_NEAR(ExpectFaithful(given.surface, SolidRule::kHoles, 0.12), volume, 1e-12);
  }
}

// Of one material by even and odd: boxes that touch in edges, corners, with cavities and holes.
TEST_F(SpaceFidelityTest, PartsOfBoxesByChance) {
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    const test::VoxelPart part = test::RandomVoxelPart(1 + i % 3, 1, random_);
    EXPECT_NEAR(ExpectFaithful(part.Surface(), SolidRule::kEvenOdd, 0.15), part.VolumeOf(1), 1e-11);
  }
}

TEST_F(SpaceFidelityTest, TurnedPartsOfSeveralMaterials) {
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    const test::VoxelPart part = test::RandomVoxelPart(2, 1 + i % 3, random_);
    EXPECT_NEAR(ExpectFaithful(Turned(part.Surface(), random_), SolidRule::kHoles, 0.15), VolumeOf(part, 3), 1e-11);
  }
}

TEST_F(SpaceFidelityTest, ThinParts) {
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(i);
    test::VoxelPart part = test::RandomVoxelPart(2, 1, random_);
    for (std::vector<double>& along : part.grid) {
      double at = 0;
      for (double& x : along) {
        x = at;
        at += random_.Below(2) == 0 ? 0.05 + 0.05 * random_.Unit() : 1.0;
      }
    }
    EXPECT_NEAR(ExpectFaithful(part.Surface(), SolidRule::kEvenOdd, 0.3), part.VolumeOf(1), 1e-11);
  }
}

TEST_F(SpaceFidelityTest, SpheresInSpheres) {
  const TestSurface spheres = test::Joined(test::Sphere(2), test::Sphere(2, {0.1, 0, 0}, 0.5));
  const double shell = ExpectFaithful(spheres, SolidRule::kEvenOdd, 0.15);
  const double whole = ExpectFaithful(spheres, SolidRule::kHoles, 0.15);
  EXPECT_NEAR(whole - shell, 0.125 * whole, 0.01 * whole);
}

// A mesh without the points of its surface is as faithful, but not one that keeps them.
TEST_F(SpaceFidelityTest, KeptPointsAreVertices) {
  const TestSurface sphere = test::Sphere(2);
  SurfaceFeatures features = sphere.Features();
  for (const bool keeps_points : {true, false}) {
    features.keeps_points = keeps_points;
    const absl::StatusOr<Mesh> mesh = MeshOf(sphere, features, 0.3);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    features.keeps_points = true;
    const absl::StatusOr<FidelityReport> report = CheckedMesh(*mesh).ComparedWith(sphere, features);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_EQ(report->verdict.ok(), keeps_points) << report->verdict;
    if (!keeps_points) {
      EXPECT_NE(report->verdict.message().find("of the surface is no vertex"), std::string::npos) << report->verdict;
    }
  }
}

TEST_F(SpaceFidelityTest, AcuteParts) {
  for (const double degrees : {70.0, 50.0, 35.0, 22.0, 12.0, 7.0}) {
    for (const TestSurface& part : {test::Wedge(degrees), test::AcuteTetrahedron(degrees)}) {
      SCOPED_TRACE(degrees);
      EXPECT_NEAR(ExpectFaithful(Turned(part, random_), SolidRule::kEvenOdd, 0.1), test::VolumeWithin(part), 1e-12);
    }
  }
  for (const double height : {0.3, 0.6, 1.5}) {
    const TestSurface cone = test::Cone(48, height);
    EXPECT_NEAR(ExpectFaithful(Turned(cone, random_), SolidRule::kEvenOdd, 0.1), test::VolumeWithin(cone), 0.02);
  }
}

}  // namespace
}  // namespace wellspace::core
