// Meshes of triangles that bound nothing by themselves: with holes, flipped ones, overlaps, and soups.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/input/surface_report.h"
#include "core/meshers/mesher.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/canonical.h"
#include "tests/support/limited_lender.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

constexpr double kVolumeOfSphere = 4 * std::numbers::pi / 3;

MeshParameters Parameters(double tolerance) {
  MeshParameters parameters;
  parameters.min_dihedral = 0;
  parameters.max_vertices = 50'000;
  parameters.surface.tolerance = tolerance;
  return parameters;
}

absl::StatusOr<Mesh> Wrapped(const test::TestSurface& surface, double resolution, const MeshParameters& parameters) {
  SurfaceFeatures features = surface.Features();
  features.solids = SolidRule::kWinding;
  features.resolution = resolution;
  RunContext context;
  return MeshPoints(parameters, Input(surface.points, features), context);
}

// The material of each box of a grid.
int OfOne(int /*x*/, int /*y*/, int /*z*/) { return 1; }

test::TestSurface Inverted(test::TestSurface surface) {
  for (size_t t = 0; t < surface.triangle_count(); ++t) {
    std::swap(surface.corners[3 * t], surface.corners[3 * t + 1]);
  }
  return surface;
}

class WindingMeshesTest : public test::SeededTest {
 protected:
  WindingMeshesTest() : SeededTest(20261130) {}

  // A share of the triangles turned, doubled, taken out; all over points of their own that are moved by `noise`.
  test::TestSurface Broken(const test::TestSurface& surface, double flipped, double doubled, double missing,
                           double noise) {
    test::TestSurface broken;
    for (size_t t = 0; t < surface.triangle_count(); ++t) {
      std::array<uint32_t, 3> corners;
      for (size_t k = 0; k < 3; ++k) {
        Point<3> p = PointAt<3>(surface.points, surface.corners[3 * t + k]);
        for (double& x : p) {
          x += noise * random_.Gauss();
        }
        corners[k] = broken.AddPoint(p);
      }
      if (random_.Unit() < flipped) {
        std::swap(corners[0], corners[1]);
      }
      if (random_.Unit() >= missing) {
        broken.AddTriangle(corners);
      }
      if (random_.Unit() < doubled) {
        broken.AddTriangle(corners);
      }
    }
    return broken;
  }
};

TEST_F(WindingMeshesTest, ASphereIsASphere) {
  const absl::StatusOr<Mesh> mesh = Wrapped(test::Sphere(4), 0.05, Parameters(0.02));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  EXPECT_NEAR(VolumeOf(*mesh), kVolumeOfSphere, 0.03 * kVolumeOfSphere);
  EXPECT_LE(mesh->statistics.max_radius_edge, 2 * (1 + 1e-9));
  EXPECT_EQ(mesh->statistics.surface->solids, 1);
  EXPECT_EQ(mesh->statistics.surface->flipped_triangles, 0);
}

TEST_F(WindingMeshesTest, SoupsAreClosed) {
  for (const auto& [flipped, doubled, missing, noise] :
       {std::tuple(0.03, 0.0, 0.0, 0.0), {0.0, 0.03, 0.0, 0.0}, {0.0, 0.0, 0.01, 0.0}, {0.03, 0.03, 0.01, 0.002}}) {
    SCOPED_TRACE(testing::Message() << flipped << " " << doubled << " " << missing << " " << noise);
    const test::TestSurface soup = Broken(test::Sphere(4), flipped, doubled, missing, noise);
    const absl::StatusOr<Mesh> mesh = Wrapped(soup, 0.05, Parameters(0.02));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    EXPECT_NEAR(VolumeOf(*mesh), kVolumeOfSphere, 0.06 * kVolumeOfSphere);
    EXPECT_EQ(mesh->statistics.surface->solids, 1);
    for (size_t i = 0; i < mesh->points.size(); i += 3) {
      EXPECT_LT(std::sqrt(NormSq<3>(PointAt<3>(mesh->points, i / 3))), 1.06);
    }
  }
}

TEST_F(WindingMeshesTest, InvertedTrianglesAreTheSame) {
  const test::TestSurface sphere = test::Sphere(3);
  const absl::StatusOr<Mesh> mesh = Wrapped(sphere, 0.08, Parameters(0.05));
  const absl::StatusOr<Mesh> inverted = Wrapped(Inverted(sphere), 0.08, Parameters(0.05));
  ASSERT_TRUE(mesh.ok() && inverted.ok()) << mesh.status() << inverted.status();
  EXPECT_NEAR(VolumeOf(*inverted), VolumeOf(*mesh), 1e-3);
}

TEST_F(WindingMeshesTest, OverlapsAreUnited) {
  const test::TestSurface spheres = test::Joined(test::Sphere(4), test::Sphere(4, {1, 0, 0}));
  EXPECT_FALSE(MeshOf(spheres, Parameters(0.05)).ok());  // by even-odd the overlap would be void
  const absl::StatusOr<Mesh> mesh = Wrapped(spheres, 0.05, Parameters(0.02));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  // Two balls less their lens, of two caps that are 1/2 high.
  const double lens = 2 * std::numbers::pi * 0.25 * (3 - 0.5) / 3;
  const double volume = 2 * kVolumeOfSphere - lens;
  EXPECT_NEAR(VolumeOf(*mesh), volume, 0.04 * volume);
}

TEST_F(WindingMeshesTest, ACavityStaysOne) {
  const test::TestSurface inner = Inverted(test::Sphere(3, {0, 0, 0}, 0.5));
  const absl::StatusOr<Mesh> mesh = Wrapped(test::Joined(test::Sphere(4), inner), 0.05, Parameters(0.02));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  EXPECT_NEAR(VolumeOf(*mesh), kVolumeOfSphere * (1 - 0.125), 0.05 * kVolumeOfSphere);
}

TEST_F(WindingMeshesTest, PointsInsideAreVertices) {
  test::TestSurface sphere = test::Sphere(3);
  const uint32_t inside = sphere.AddPoint({0.1, 0.2, 0.3});
  const absl::StatusOr<Mesh> mesh = Wrapped(sphere, 0.08, Parameters(0.05));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(mesh->input_vertex.size(), sphere.points.size() / 3);
  const uint32_t v = mesh->input_vertex[inside];
  ASSERT_NE(v, kNoOutput);
  EXPECT_EQ(v, 0) << "given points come first";
  EXPECT_EQ(PointAt<3>(mesh->points, v), (Point<3>{0.1, 0.2, 0.3}));
  EXPECT_EQ(std::count(mesh->input_vertex.begin(), mesh->input_vertex.end(), kNoOutput), inside);
}

TEST_F(WindingMeshesTest, OrderDoesNotChangeABit) {
  const test::TestSurface soup = Broken(test::Sphere(3), 0.03, 0.03, 0.01, 0.002);
  const absl::StatusOr<Mesh> mesh = Wrapped(soup, 0.08, Parameters(0.05));
  const absl::StatusOr<Mesh> again = Wrapped(test::Shuffled(soup, random_), 0.08, Parameters(0.05));
  ASSERT_TRUE(mesh.ok() && again.ok()) << mesh.status() << again.status();
  EXPECT_EQ(test::Hash(test::Canonical(*mesh)), test::Hash(test::Canonical(*again)));
}

TEST_F(WindingMeshesTest, WhatSurroundsNothingIsRefused) {
  test::TestSurface sheet;
  sheet.AddPolygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  EXPECT_THAT(std::string(Wrapped(sheet, 0.05, Parameters(0.05)).status().message()), HasSubstr("they bound nothing"));
}

absl::StatusOr<SurfaceReport> Inspected(const test::TestSurface& surface, double resolution) {
  SurfaceFeatures features = surface.Features();
  features.solids = SolidRule::kWinding;
  features.resolution = resolution;
  return InspectSurface(surface.points, features, 1, RunContext());
}

double LostAreaOf(const test::TestSurface& surface) {
  const absl::StatusOr<SurfaceReport> report = Inspected(surface, 0.08);
  EXPECT_TRUE(report.ok()) << report.status();
  return report.ok() ? report->lost_area : -1;
}

TEST_F(WindingMeshesTest, LostPartsAreTold) {
  const test::TestSurface sphere = test::Sphere(3);
  EXPECT_EQ(LostAreaOf(sphere), 0);
  EXPECT_EQ(LostAreaOf(test::Joined(sphere, test::Sphere(3, {1, 0, 0}))), 0) << "of walls in an overlap";
  EXPECT_EQ(LostAreaOf(test::Joined(sphere, Inverted(test::Sphere(3, {0, 0, 0}, 0.5)))), 0) << "of a cavity";

  const test::TestSurface plate = test::Boxes({2, 3}, {-0.5, 0.5}, {0.0, 0.004}, OfOne);
  const double area = 2 + 4 * 0.004;
  EXPECT_NEAR(LostAreaOf(test::Joined(sphere, plate)), area, 0.01 * area);
  const absl::StatusOr<Mesh> mesh = Wrapped(test::Joined(sphere, plate), 0.08, Parameters(0.08));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(mesh->statistics.surface->lost_area, area, 0.01 * area);

  const double turned = LostAreaOf(test::Joined(sphere, Inverted(test::Sphere(3, {3, 0, 0}, 0.5))));
  EXPECT_NEAR(turned, std::numbers::pi, 0.02 * std::numbers::pi);
}

TEST_F(WindingMeshesTest, LostAreaIsTheSameInAnyOrder) {
  const test::TestSurface parts = test::Joined(test::Sphere(3), Inverted(test::Sphere(3, {3, 0, 0}, 0.5)));
  EXPECT_EQ(LostAreaOf(test::Shuffled(parts, random_)), LostAreaOf(parts));
}

TEST_F(WindingMeshesTest, APlateThinnerThanACellAsksForAFinerResolution) {
  const test::TestSurface plate = test::Boxes({0, 1}, {0, 1}, {0.0, 0.004}, OfOne);
  EXPECT_THAT(std::string(Wrapped(plate, 0.1, Parameters(0.05)).status().message()), HasSubstr("a finer resolution"));
}

TEST_F(WindingMeshesTest, ResolutionsOfAllExponentsEnd) {
  const test::TestSurface sphere = test::Sphere(2);
  for (const double resolution : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(std::string(Wrapped(sphere, resolution, Parameters(0.1)).status().message()),
                HasSubstr("resolution: expected a length"));
  }
  for (int exponent = -320; exponent <= 300; exponent += 31) {
    const double resolution = std::pow(10.0, exponent);
    if (resolution == 0) {
      continue;
    }
    const absl::Status status = Wrapped(sphere, resolution, Parameters(0.1)).status();
    EXPECT_THAT(std::string(status.message()), HasSubstr("resolution: ")) << exponent;
    EXPECT_THAT(std::string(status.message()), HasSubstr(exponent < 0 ? "expected at least" : "expected at most"));
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  }
}

// Far from the origin doubles are coarse: corners of a wrap would become one.
TEST_F(WindingMeshesTest, CellsThatDoublesCannotServeAreRefused) {
  test::TestSurface cube = test::Cube();
  for (size_t i = 0; i < cube.points.size(); i += 3) {
    cube.points[i] += 1e11;
  }
  EXPECT_THAT(std::string(Wrapped(cube, 0, Parameters(0.1)).status().message()), HasSubstr("resolution: "));
}

TEST_F(WindingMeshesTest, ASheetOfBothDiagonalsBoundsNothing) {
  test::TestSurface sheet;
  sheet.AddPolygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  sheet.AddPolygon({{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}});
  EXPECT_FALSE(Wrapped(sheet, 0.05, Parameters(0.05)).ok());
}

TEST_F(WindingMeshesTest, ResolutionAndCurvatureAreNotForOthers) {
  const test::TestSurface cube = test::Cube();
  SurfaceFeatures features = cube.Features();
  features.resolution = 0.1;
  RunContext context;
  EXPECT_THAT(std::string(MeshPoints(Parameters(0.1), Input(cube.points, features), context).status().message()),
              HasSubstr("resolution: it is of solids by winding alone"));
  MeshParameters parameters = Parameters(0.1);
  parameters.surface.curvature_elements = 12;
  EXPECT_THAT(std::string(Wrapped(cube, 0.05, parameters).status().message()),
              HasSubstr("surface.curvature_elements: "));
}

TEST_F(WindingMeshesTest, AReportHasNoFaults) {
  const test::TestSurface soup = Broken(test::Sphere(3), 0.03, 0.03, 0.01, 0.002);
  const absl::StatusOr<SurfaceReport> report = Inspected(soup, 0.04);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->faults.empty());
  ASSERT_TRUE(report->volume.has_value());
  EXPECT_NEAR(*report->volume, kVolumeOfSphere, 0.08 * kVolumeOfSphere);
}

TEST_F(WindingMeshesTest, MemoryOfCellsIsAskedForAndMayBeRefused) {
  const test::TestSurface sphere = test::Sphere(2);
  SurfaceFeatures features = sphere.Features();
  features.solids = SolidRule::kWinding;
  features.resolution = 0.01;
  RunContext context;
  test::LimitedLender lender(20'000'000);
  context.SetMemoryLender(&lender);
  EXPECT_EQ(MeshPoints(Parameters(0.1), Input(sphere.points, features), context).status().code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace wellspace::core
