// Sizes that a surface itself asks for, by its curvature and its thickness; against radii and thicknesses that are
// known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/vector_product.h"
#include "core/input/mesh_parameters.h"
#include "core/meshers/mesher.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/canonical.h"
#include "tests/support/limited_lender.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

// Sizes grow by 0.3 of the way from the middle of a piece, which is at most as long as the edge that is asked for.
constexpr double kGrown = 1.25;

MeshParameters ParametersWith(double curvature_elements, double thickness_layers) {
  MeshParameters parameters;
  parameters.min_dihedral = 0;
  parameters.max_vertices = 200'000;
  parameters.surface.tolerance = 0.1;  // asks for little
  parameters.surface.min_size = 0.001;
  parameters.surface.curvature_elements = curvature_elements;
  parameters.surface.thickness_layers = thickness_layers;
  return parameters;
}

double RadiusOf(const std::array<Point<3>, 3>& p) {
  const double a = Distance<3>(p[0], p[1]);
  const double b = Distance<3>(p[1], p[2]);
  const double c = Distance<3>(p[2], p[0]);
  return a * b * c / (2 * std::sqrt(NormSq<3>(Cross(Difference<3>(p[1], p[0]), Difference<3>(p[2], p[0])))));
}

// The largest circumradius of facets of which `counts` is true for all corners.
template <typename Counts>
double LargestFacet(const Mesh& mesh, const Counts& counts) {
  double largest = 0;
  for (size_t f = 0; f < mesh.facet_count(); ++f) {
    std::array<Point<3>, 3> corners;
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = PointAt<3>(mesh.points, mesh.facets[3 * f + k]);
    }
    if (std::all_of(corners.begin(), corners.end(), counts)) {
      largest = std::max(largest, RadiusOf(corners));
    }
  }
  return largest;
}
bool Always(const Point<3>& /*p*/) { return true; }

// A prism with `sides` sides, of that radius and height: a cylinder whose sides are as long as it is high.
test::TestSurface Cylinder(int sides, double radius, double height) {
  test::TestSurface surface;
  std::vector<std::array<Point<3>, 2>> ring;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    const Point<3> low = {radius * std::cos(angle), radius * std::sin(angle), 0};
    ring.push_back({low, {low[0], low[1], height}});
  }
  std::vector<uint32_t> bottom;
  std::vector<uint32_t> top;
  for (const auto& [low, high] : ring) {
    bottom.push_back(surface.AddPoint(low));
    top.push_back(surface.AddPoint(high));
  }
  for (int i = 0; i < sides; ++i) {
    const int next = (i + 1) % sides;
    surface.AddTriangle({bottom[i], bottom[next], top[next]});
    surface.AddTriangle({bottom[i], top[next], top[i]});
    if (i > 0 && next > 0) {
      surface.AddTriangle({bottom[0], bottom[next], bottom[i]});
      surface.AddTriangle({top[0], top[i], top[next]});
    }
  }
  return surface;
}

class SurfaceSizesTest : public test::SeededTest {
 protected:
  SurfaceSizesTest() : SeededTest(20261130) {}
};

TEST_F(SurfaceSizesTest, ASphereHasSoManyEdgesOnACircle) {
  const test::TestSurface sphere = test::Sphere(4);
  for (const double elements : {12.0, 24.0}) {
    const absl::StatusOr<Mesh> mesh = MeshOf(sphere, ParametersWith(elements, 0));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    const double asked = kRadiusPerEdge * 2 * std::numbers::pi / elements;
    EXPECT_LE(LargestFacet(*mesh, Always), kGrown * asked);
    // 0.87 of the squared edge for each vertex would be even triangles of just that edge.
    const double edge = 2 * std::numbers::pi / elements;
    EXPECT_GE(mesh->facet_count() / 2, 4 * std::numbers::pi / (0.87 * edge * edge));
    EXPECT_LE(mesh->facet_count() / 2, 3.5 * 4 * std::numbers::pi / (0.87 * edge * edge));
  }
}

TEST_F(SurfaceSizesTest, ACylinderIsFineWhereItIsCurvedAlone) {
  const test::TestSurface cylinder = Cylinder(64, 0.25, 4);
  const absl::StatusOr<Mesh> mesh = MeshOf(cylinder, ParametersWith(16, 0));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  const double asked = kRadiusPerEdge * 2 * std::numbers::pi * 0.25 / 16;
  EXPECT_LE(LargestFacet(*mesh, [](const Point<3>& p) { return std::hypot(p[0], p[1]) > 0.2499; }), kGrown * asked);
  // Twice the radius is half as fine along the whole height.
  const absl::StatusOr<Mesh> wider = MeshOf(Cylinder(64, 0.5, 4), ParametersWith(16, 0));
  ASSERT_TRUE(wider.ok()) << wider.status();
  EXPECT_LT(1.5 * wider->facet_count(), mesh->facet_count());
}

TEST_F(SurfaceSizesTest, APlateHasLayersAcrossIt) {
  const double thickness = 0.1;
  const test::TestSurface plate = test::Boxes({0, 1}, {0, 1}, {0, thickness}, [](int, int, int) { return 1; });
  uint64_t one_layer = 0;
  for (const double layers : {1.0, 2.0}) {
    const absl::StatusOr<Mesh> mesh = MeshOf(plate, ParametersWith(0, layers));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ExpectConforming(*mesh);
    EXPECT_LE(LargestFacet(*mesh, Always), kGrown * kRadiusPerEdge * thickness / layers);
    EXPECT_GT(mesh->vertex_count(), 3 * one_layer);  // four times as many on each side
    one_layer = mesh->vertex_count();
  }
}

// Of a block without thin places nothing is asked: beside its edges the next side is at a right angle, and faces
// nothing.
TEST_F(SurfaceSizesTest, ACubeIsAsThickAsItIsWide) {
  MeshParameters parameters = ParametersWith(0, 2);
  const absl::StatusOr<Mesh> mesh = MeshOf(test::Cube(), parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_LE(LargestFacet(*mesh, Always), kGrown * kRadiusPerEdge * 0.5);
  EXPECT_LT(mesh->vertex_count(), 120);
}

// Each solid of a complex has its own thickness.
TEST_F(SurfaceSizesTest, ThinMaterialsAreFine) {
  const test::TestSurface layers = test::Boxes({0, 1}, {0, 1}, {0, 0.1, 1}, [](int, int, int k) { return k + 1; });
  const absl::StatusOr<Mesh> mesh = MeshOf(layers, ParametersWith(0, 1), SolidRule::kHoles);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const double asked = kRadiusPerEdge * 0.1;
  EXPECT_LE(LargestFacet(*mesh, [](const Point<3>& p) { return p[2] <= 0.1; }), kGrown * asked);
  EXPECT_GT(LargestFacet(*mesh, [](const Point<3>& p) { return p[2] == 1; }), 2 * asked);
}

TEST_F(SurfaceSizesTest, OrderAndDirectionOfTrianglesDoNotChangeABit) {
  const test::TestSurface surface = Cylinder(24, 0.3, 1);
  const absl::StatusOr<Mesh> mesh = MeshOf(surface, ParametersWith(16, 1.5));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  test::TestSurface other = test::Shuffled(surface, random_);
  for (size_t t = 0; t < other.triangle_count(); t += 2) {
    std::swap(other.corners[3 * t], other.corners[3 * t + 1]);
  }
  MeshParameters by_threads = ParametersWith(16, 1.5);
  by_threads.threads = 2;
  const absl::StatusOr<Mesh> again = MeshOf(other, by_threads);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(test::Hash(test::Canonical(*mesh)), test::Hash(test::Canonical(*again)));
}

TEST_F(SurfaceSizesTest, SamplesThatAreGivenHoldAsWell) {
  const test::TestSurface sphere = test::Sphere(3);
  MeshParameters parameters = ParametersWith(8, 0);
  const absl::StatusOr<Mesh> without = MeshOf(sphere, parameters);
  auto samples = std::make_shared<SizeSamples>();
  samples->points = {0, 0, 1};
  samples->sizes = {0.02};
  samples->measure = SizeMeasure::kEdgeLength;
  parameters.size_samples = samples;
  const absl::StatusOr<Mesh> with = MeshOf(sphere, parameters);
  ASSERT_TRUE(without.ok() && with.ok()) << without.status() << with.status();
  const auto is_near = [](const Point<3>& p) { return Distance<3>(p, {0, 0, 1}) < 0.05; };
  EXPECT_LE(LargestFacet(*with, is_near), CircumradiusOf(0.02, 3) + 0.3 * 0.05 + 0.001);
  EXPECT_LE(LargestFacet(*with, Always), kGrown * kRadiusPerEdge * 2 * std::numbers::pi / 8);
  EXPECT_GT(with->vertex_count(), without->vertex_count());
}

TEST_F(SurfaceSizesTest, HopelessDemandsAreRefusedAtOnceWithWhatFits) {
  const test::TestSurface sphere = test::Sphere(3);
  const test::TestSurface cube = test::Cube();
  for (const bool is_curvature : {true, false}) {
    MeshParameters parameters = ParametersWith(is_curvature ? 1e5 : 0, is_curvature ? 0 : 1e5);
    parameters.max_vertices = 1000;
    parameters.surface.min_size = 1e-9;
    const absl::Status status = MeshOf(is_curvature ? sphere : cube, parameters).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
    EXPECT_TRUE(status.GetPayload(std::string(kDemandsTooFine)).has_value());
    EXPECT_THAT(std::string(status.message()),
                HasSubstr(is_curvature ? "surface.curvature_elements: 100000" : "surface.thickness_layers: 100000"));
    EXPECT_THAT(std::string(status.message()), HasSubstr("expected at most"));
  }
}

TEST_F(SurfaceSizesTest, NumbersOfAllExponentsEnd) {
  const test::TestSurface surface = Cylinder(16, 0.3, 1);
  for (int exponent = -320; exponent <= 300; exponent += 31) {
    const double demand = std::pow(10.0, exponent);
    for (const bool is_curvature : {true, false}) {
      MeshParameters parameters = ParametersWith(is_curvature ? demand : 0, is_curvature ? 0 : demand);
      parameters.max_vertices = 3000;
      const absl::Status status = MeshOf(surface, parameters).status();
      EXPECT_TRUE(status.ok() || status.code() == absl::StatusCode::kResourceExhausted) << exponent << ": " << status;
    }
  }
}

// However small a radius is that counts, pieces are no smaller than doubles can tell apart.
TEST_F(SurfaceSizesTest, LeastSizesOfAllExponentsEnd) {
  test::TestSurface cube = test::Cube();
  for (double& x : cube.points) {
    x += 3;
  }
  for (int exponent = -320; exponent <= 300; exponent += 62) {
    MeshParameters parameters = ParametersWith(0, 1e308);
    parameters.surface.min_size = std::pow(10.0, exponent);
    parameters.max_vertices = 3000;
    const absl::Status status = MeshOf(cube, parameters).status();
    if (exponent > 0) {  // nothing can be added
      EXPECT_THAT(std::string(status.message()), HasSubstr("surface.min_size: at ("));
    } else {
      EXPECT_TRUE(status.ok() || status.code() == absl::StatusCode::kResourceExhausted) << exponent << ": " << status;
    }
    EXPECT_EQ(std::string(status.message()).find("nan"), std::string::npos) << status;
  }
}

TEST_F(SurfaceSizesTest, NumbersThatAreNoneAreNamed) {
  for (const double demand : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(std::string(MeshOf(test::Cube(), ParametersWith(demand, 0)).status().message()),
                HasSubstr("surface.curvature_elements: "));
    EXPECT_THAT(std::string(MeshOf(test::Cube(), ParametersWith(0, demand)).status().message()),
                HasSubstr("surface.thickness_layers: "));
  }
}

TEST_F(SurfaceSizesTest, TheEstimateKnowsOfThem) {
  for (const auto& [surface, parameters] :
       {std::pair(test::Sphere(4), ParametersWith(32, 0)), {test::Sphere(3), ParametersWith(0, 6)}}) {
    RunContext context;
    const absl::StatusOr<MeshEstimate> estimate =
        EstimateMesh(parameters, Input(surface.points, surface.Features()), context);
    const absl::StatusOr<Mesh> mesh = MeshOf(surface, parameters);
    ASSERT_TRUE(estimate.ok() && mesh.ok()) << estimate.status() << mesh.status();
    EXPECT_GE(estimate->vertices, mesh->vertex_count());
    EXPECT_LE(estimate->vertices, 8 * mesh->vertex_count());
  }
}

TEST_F(SurfaceSizesTest, MemoryOfSamplesIsAskedForAndMayBeRefused) {
  const test::TestSurface sphere = test::Sphere(5);  // so small triangles that each has a sample
  uint64_t most_without = 0;
  {
    RunContext context;
    const absl::StatusOr<std::unique_ptr<Mesher>> mesher =
        Mesher::Create(ParametersWith(0, 0), Input(sphere.points, sphere.Features()), context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    most_without = (*mesher)->memory_bytes();
  }
  RunContext context;
  test::LimitedLender lender(most_without + sphere.triangle_count() * sizeof(Point<3>));
  const MeshParameters parameters = ParametersWith(16, 0);
  const absl::StatusOr<std::unique_ptr<Mesher>> mesher =
      Mesher::Create(parameters, Input(sphere.points, sphere.Features()), context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  context.SetMemoryLender(&lender);
  EXPECT_EQ((*mesher)->Refine(parameters, context).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_GT(lender.most, lender.limit);
}

}  // namespace
}  // namespace wellspace::core
