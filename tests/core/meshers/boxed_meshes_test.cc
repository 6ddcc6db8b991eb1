// Meshes of a box that sheets of triangles part: regions, their volumes, tags of sides, curves on the sides.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/input/surface_report.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate_boxed.h"
#include "core/validate/validate_fidelity.h"
#include "core/validate/validate_solid.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/canonical.h"
#include "tests/support/limited_lender.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;

constexpr Box<3> kBox{{0, 0, 0}, {1, 1, 1}};

MeshParameters Parameters() {
  MeshParameters parameters;
  parameters.max_vertices = 50'000;
  parameters.edge_length = 0.3;
  return parameters;
}

SurfaceFeatures InBox(const test::TestSurface& surface, const Box<3>& box = kBox) {
  SurfaceFeatures features = surface.Features();
  features.solids = SolidRule::kBox;
  features.box = box;
  return features;
}

absl::StatusOr<Mesh> MeshIn(const test::TestSurface& surface, const SurfaceFeatures& features,
                            const MeshParameters& parameters = Parameters()) {
  RunContext context;
  return MeshPoints(parameters, Input(surface.points, features), context);
}

std::map<std::string, uint64_t> PartsOf(const Mesh& mesh) {
  std::map<std::string, uint64_t> parts;
  for (const BoundaryPart& part : mesh.boundary) {
    parts[part.name] = part.facets;
  }
  return parts;
}

// Checks the mesh of a box by all means: by itself, and against its surface. Returns the volumes of its regions.
std::vector<double> ExpectFaithful(const Mesh& mesh, const test::TestSurface& surface,
                                   const SurfaceFeatures& features) {
  std::vector<int32_t> tags;
  for (const BoundaryPart& part : mesh.boundary) {
    tags.insert(tags.end(), part.facets, part.tag);
  }
  const MeshView view{.dimension = 3, .points = mesh.points, .simplices = mesh.simplices};
  SolidParts parts;
  parts.domain.boundary = {.facets = mesh.facets, .tags = tags};
  parts.domain.regions = mesh.simplex_regions;
  parts.ridges = mesh.ridges;
  const absl::StatusOr<SolidMeshReport> alone = ValidateSolidMesh(view, parts, 2, RunContext());
  EXPECT_TRUE(alone.ok()) << alone.status();
  const double diagonal = Distance<3>(features.box->low, features.box->high);
  const absl::StatusOr<FidelityReport> report = CompareWithSurface(
      view, parts, {.points = surface.points, .features = features}, {.tolerance = 1.3e-3 * diagonal}, RunContext());
  EXPECT_TRUE(report.ok()) << report.status();
  if (report.ok()) {
    EXPECT_TRUE(report->verdict.ok()) << report->verdict;
    EXPECT_EQ(report->lost_curves, 0);
  }
  EXPECT_EQ(mesh.statistics.surface->lost_ridges, 0u);
  EXPECT_LE(mesh.statistics.max_radius_edge, 2 * (1 + 1e-9));
  EXPECT_GE(mesh.statistics.surface->min_angle_outside_deg, 12 * (1 - 1e-9));
  if (mesh.statistics.surface->tube_simplices == 0 && !features.keeps_points) {
    EXPECT_GE(mesh.statistics.surface->min_facet_angle_deg, 25 * (1 - 1e-9));
  }
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    EXPECT_TRUE(features.box->Contains(PointAt<3>(mesh.points, i)));
  }
  return mesh.statistics.surface->volumes;
}

std::vector<double> Sorted(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values;
}

class BoxedMeshesTest : public test::SeededTest {
 protected:
  BoxedMeshesTest() : SeededTest(20'913) {}
};

TEST_F(BoxedMeshesTest, AFlatSheetPartsTheBox) {
  const test::TestSurface surface = test::Sheet(0, 1, 3, [](double, double) { return 0.3; });
  const SurfaceFeatures features = InBox(surface);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  const std::vector<double> volumes = Sorted(ExpectFaithful(*mesh, surface, features));
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.3, 1e-12);
  EXPECT_NEAR(volumes[1], 0.7, 1e-12);
  const std::map<std::string, uint64_t> parts = PartsOf(*mesh);
  EXPECT_EQ(parts.size(), 7u);
  for (const char* name : {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax", "marker_7"}) {
    EXPECT_GT(parts.contains(name) ? parts.at(name) : 0, 0u) << name;
  }
}

TEST_F(BoxedMeshesTest, ATiltedSheetThatSticksOut) {
  const test::TestSurface surface =
      test::Sheet(-0.41, 1.3, 5, [](double x, double y) { return 0.2 + 0.3 * x + 0.2 * y; });
  const SurfaceFeatures features = InBox(surface);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = Sorted(ExpectFaithful(*mesh, surface, features));
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.45, 1e-12);
  EXPECT_NEAR(volumes[1], 0.55, 1e-12);
  EXPECT_GT(mesh->statistics.surface->cut_triangles, 0u);
}

TEST_F(BoxedMeshesTest, TwoHorizonsMakeThreeRegions) {
  test::TestSurface surface;
  surface.AddSheet(-0.2, 1.2, 4, 1, [](double x, double) { return 0.3 + 0.1 * x; });
  surface.AddSheet(-0.1, 1.15, 3, 2, [](double, double y) { return 0.75 - 0.15 * y; });
  const Box<3> box{{0, 0, 0}, {1, 1, 1}};
  const SurfaceFeatures features = InBox(surface, box);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = Sorted(ExpectFaithful(*mesh, surface, features));
  ASSERT_EQ(volumes.size(), 3u);
  EXPECT_NEAR(volumes[0], 0.325, 1e-12);
  EXPECT_NEAR(volumes[1], 0.325, 1e-12);
  EXPECT_NEAR(volumes[2], 0.35, 1e-12);
}

TEST_F(BoxedMeshesTest, SeedsNameRegionsAndHoles) {
  test::TestSurface surface = test::Sheet(0, 1, 1, [](double, double) { return 0.25; });
  surface.AddSheet(0, 1, 1, 8, [](double, double) { return 0.75; });
  SurfaceFeatures features = InBox(surface);
  const std::vector<SolidSeed> seeds = {{.at = {0.5, 0.5, 0.1}, .region = 4}, {.at = {0.5, 0.5, 0.9}, .is_hole = true}};
  features.seeds = seeds;
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = Sorted(ExpectFaithful(*mesh, surface, features));
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0], 0.25, 1e-12);
  EXPECT_NEAR(volumes[1], 0.5, 1e-12);
  EXPECT_FALSE(PartsOf(*mesh).contains("zmax"));
}

TEST_F(BoxedMeshesTest, ADomeOnTheBottom) {
  const test::TestSurface surface = test::Sphere(3, {0.5, 0.5, 0.05}, 0.35);
  const SurfaceFeatures features = InBox(surface);
  MeshParameters parameters = Parameters();
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features, parameters);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = Sorted(ExpectFaithful(*mesh, surface, features));
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0] + volumes[1], 1, 1e-12);
  EXPECT_NEAR(volumes[0], 0.108, 0.004);  // of a ball cut 0.05 below its middle: 0.1066
  EXPECT_GT(mesh->statistics.surface->outside_triangles, 0u);
}

TEST_F(BoxedMeshesTest, ASheetThatEndsInsideIsAMembrane) {
  test::TestSurface surface;
  surface.AddPolygon({{-1, 0.4, 0.5}, {0.6, 0.3, 0.5}, {0.6, 0.8, 0.5}, {-1, 0.8, 0.5}}, 9);
  const SurfaceFeatures features = InBox(surface);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = ExpectFaithful(*mesh, surface, features);
  ASSERT_EQ(volumes.size(), 1u);
  EXPECT_NEAR(volumes[0], 1, 1e-12);
  EXPECT_GT(PartsOf(*mesh).at("marker_9"), 0u);
}

TEST_F(BoxedMeshesTest, TrianglesInASideHaveTheirMarkers) {
  test::TestSurface surface;
  surface.AddPolygon({{0.25, 0.25, 0}, {0.75, 0.25, 0}, {0.75, 0.75, 0}, {0.25, 0.75, 0}}, 5);
  const SurfaceFeatures features = InBox(surface);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectFaithful(*mesh, surface, features);
  size_t f = 0;
  double area = 0;
  for (const BoundaryPart& part : mesh->boundary) {
    for (uint64_t i = 0; i < part.facets; ++i, ++f) {
      const Triangle facet = {PointAt<3>(mesh->points, mesh->facets[3 * f]),
                              PointAt<3>(mesh->points, mesh->facets[3 * f + 1]),
                              PointAt<3>(mesh->points, mesh->facets[3 * f + 2])};
      area += part.name == "marker_5" ? 0.5 * std::sqrt(NormSq<3>(NormalOf(facet))) : 0;
    }
  }
  EXPECT_NEAR(area, 0.25, 1e-12);
}

TEST_F(BoxedMeshesTest, ANegativeZeroThatIsLedOntoASideIsThere) {
  test::TestSurface surface;
  surface.AddPolygon({{0.25, 0.25, -0.0}, {0.75, 0.25, -0.0}, {0.75, 0.75, -0.0}, {0.25, 0.75, -0.0}}, 5);
  SurfaceFeatures features = InBox(surface, {{0, 0, -1e-5}, {1, 1, 1}});
  features.weld = 1e-4;
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (size_t at = 2; at < mesh->points.size(); at += 3) {
    EXPECT_TRUE(mesh->points[at] == -1e-5 || mesh->points[at] > 1e-3) << mesh->points[at];
  }
}

// Side triangles, which are not given, are the fewer ones then.
TEST_F(BoxedMeshesTest, TrianglesInASideThatLookInwardsAreToldByGivenOnes) {
  test::TestSurface surface;
  surface.AddSheet(0, 1, 12, 5, [](double, double) { return 0.0; });
  for (const bool inwards : {false, true}) {
    SurfaceFeatures features = InBox(surface);
    const absl::StatusOr<SurfaceReport> report = InspectSurface(surface.points, features, 1, RunContext());
    ASSERT_TRUE(report.ok()) << report.status();
    for (const uint32_t triangle : report->flipped_at.triangles) {
      EXPECT_LT(triangle, surface.corners.size() / 3);
    }
    for (size_t i = 0; !inwards && i < surface.corners.size(); i += 3) {
      std::swap(surface.corners[i], surface.corners[i + 1]);
    }
  }
}

TEST_F(BoxedMeshesTest, ABoxFarFromTheOriginWithOddSides) {
  const Box<3> box{{1000.1, -50.3, 7.7}, {1001.3, -49.6, 8.6}};
  test::TestSurface surface;
  surface.AddPolygon({{990, -60, 8.1}, {1010, -60, 8.3}, {1010, -40, 8.4}, {990, -40, 8.2}}, 3);
  const SurfaceFeatures features = InBox(surface, box);
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const std::vector<double> volumes = ExpectFaithful(*mesh, surface, features);
  ASSERT_EQ(volumes.size(), 2u);
  EXPECT_NEAR(volumes[0] + volumes[1], 1.2 * 0.7 * 0.9, 1e-11);
}

TEST_F(BoxedMeshesTest, TheCheckFindsFaults) {
  const test::TestSurface surface = test::Sheet(-0.2, 1.2, 4, [](double, double) { return 0.3; });
  const SurfaceFeatures features = InBox(surface);
  const Mesh mesh = *MeshIn(surface, features);
  std::vector<int32_t> tags;
  for (const BoundaryPart& part : mesh.boundary) {
    tags.insert(tags.end(), part.facets, part.tag);
  }
  const MeshView view{.dimension = 3, .points = mesh.points, .simplices = mesh.simplices};
  SolidParts parts;
  parts.domain.boundary = {.facets = mesh.facets, .tags = tags};
  for (const BoundaryPart& part : mesh.boundary) {
    parts.domain.boundary.names.emplace(part.tag, part.name);
  }
  const auto check = [&](const test::TestSurface& of, const Box<3>& box) {
    return std::string(ValidateBoxedMesh(view, parts, {.points = of.points, .features = InBox(of, box)},
                                         {.tolerance = 2e-3}, RunContext())
                           .message());
  };
  EXPECT_EQ(check(surface, kBox), "");
  EXPECT_THAT(check(surface, {{0, 0, 0}, {1, 1, 0.9}}), HasSubstr("is outside of the box"));
  EXPECT_THAT(check(surface, {{0, 0, 0}, {1, 1, 1.1}}), HasSubstr("the tetrahedra have a volume of"));
  const test::TestSurface higher = test::Sheet(-0.2, 1.2, 4, [](double, double) { return 0.31; });
  EXPECT_THAT(check(higher, kBox), HasSubstr("away from all triangles"));
  test::TestSurface more = surface;
  more.AddSheet(-0.2, 1.2, 1, 9, [](double, double) { return 0.6; });
  EXPECT_THAT(check(more, kBox), HasSubstr("away from all facets"));
  // A facet of the sheet with the name of a side, one in a side with the name of another one, and of the sheet.
  const size_t of_sheet = mesh.facet_count() - 1;  // markers above 0 keep their numbers: 7 is the last tag
  for (const auto& [facet, tag, said] : {std::tuple(of_sheet, 1, "is not in that side"),
                                         {size_t{0}, 2, "is not in that side"},
                                         {size_t{0}, 7, "no triangle is at its middle"}}) {
    const int32_t before = std::exchange(tags[facet], tag);
    EXPECT_THAT(check(surface, kBox), HasSubstr(said));
    tags[facet] = before;
  }
  // Without the facets in a side.
  parts.domain.boundary.facets = std::span(mesh.facets).subspan(3 * mesh.boundary[0].facets);
  parts.domain.boundary.tags = std::span(tags).subspan(mesh.boundary[0].facets);
  EXPECT_THAT(check(surface, kBox), HasSubstr("facets in the side xmin of the box have an area of 0"));
}

TEST_F(BoxedMeshesTest, NeitherOrderNorThreadsChangeABit) {
  test::TestSurface surface =
      test::Sheet(-0.2, 1.2, 4, [](double x, double y) { return 0.5 + 0.1 * std::sin(4 * x + y); });
  const Mesh first = *MeshIn(surface, InBox(surface));
  for (int run = 0; run < 2; ++run) {
    const test::TestSurface shuffled = test::Shuffled(surface, random_);
    MeshParameters parameters = Parameters();
    parameters.threads = 1 + run;
    const Mesh other = *MeshIn(shuffled, InBox(shuffled), parameters);
    EXPECT_TRUE(test::Canonical(other) == test::Canonical(first));
  }
}

TEST_F(BoxedMeshesTest, PointsInTheBoxAreVertices) {
  test::TestSurface surface = test::Sheet(-0.2, 1.2, 2, [](double, double) { return 0.5; });
  const uint32_t inside = surface.AddPoint({0.3, 0.4, 0.2});
  const uint32_t outside = surface.AddPoint({1.3, 0.4, 0.2});
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, InBox(surface));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_NE(mesh->input_vertex[inside], kNoOutput);
  EXPECT_EQ(PointAt<3>(mesh->points, mesh->input_vertex[inside]), (Point<3>{0.3, 0.4, 0.2}));
  EXPECT_EQ(mesh->input_vertex[outside], kNoOutput);
  EXPECT_EQ(mesh->input_vertex[0], kNoOutput);
}

TEST_F(BoxedMeshesTest, PointsOfTheSurfaceAreKept) {
  const test::TestSurface surface = test::Sheet(-0.21, 1.23, 6, [](double, double) { return 0.5; });
  SurfaceFeatures features = InBox(surface);
  features.keeps_points = true;
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectFaithful(*mesh, surface, features);
  for (uint32_t i = 0; i < surface.points.size() / 3; ++i) {
    const Point<3> p = PointAt<3>(surface.points, i);
    EXPECT_EQ(mesh->input_vertex[i] != kNoOutput, kBox.Contains(p)) << i;
  }
}

std::string ErrorOf(const test::TestSurface& surface, const SurfaceFeatures& features) {
  const absl::StatusOr<Mesh> mesh = MeshIn(surface, features);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
  return std::string(mesh.status().message());
}

TEST_F(BoxedMeshesTest, BadInputIsRefused) {
  const test::TestSurface sheet = test::Sheet(0, 1, 2, [](double, double) { return 0.5; });
  SurfaceFeatures features = InBox(sheet);
  features.box.reset();
  EXPECT_THAT(ErrorOf(sheet, features), HasSubstr("box: solids by box need one"));
  features = InBox(sheet);
  features.solids = SolidRule::kHoles;
  EXPECT_THAT(ErrorOf(sheet, features), HasSubstr("box: it is of solids by box alone"));
  EXPECT_THAT(ErrorOf(sheet, InBox(sheet, {{0, 0, 0}, {1, 1, 0}})), HasSubstr("extent along axis 2"));
  EXPECT_THAT(ErrorOf(sheet, InBox(sheet, {{5, 5, 5}, {6, 6, 6}})), HasSubstr("none of the 8 has a part"));
  EXPECT_THAT(ErrorOf(sheet, InBox(sheet, {{0, 0, 0.5}, {1e-4, 1e-4, 0.5001}})), HasSubstr("beyond it along axis 0"));
  test::TestSurface marked = sheet;
  marked.markers[3] = std::numeric_limits<int32_t>::min();
  EXPECT_THAT(ErrorOf(marked, InBox(marked)), HasSubstr("markers[3]: -2147483648 is that of a side"));
  // A point a hair inside, and one a hair outside.
  for (const double hair : {-0x1p-50, 0x1p-50}) {
    test::TestSurface near = sheet;
    near.points[0] = hair;
    EXPECT_THAT(ErrorOf(near, InBox(near)), HasSubstr("from the low side of axis 0 of the box"));
    SurfaceFeatures welded = InBox(near);
    welded.weld = 1e-9;
    EXPECT_TRUE(MeshIn(near, welded).ok());
  }
  // Sheets that cross in a side, and a sheet whose edge crosses a triangle in a side.
  test::TestSurface crossed = test::Sheet(0, 1, 2, [](double x, double) { return 0.3 + 0.4 * x; });
  crossed.AddSheet(0, 1, 2, 8, [](double x, double) { return 0.7 - 0.4 * x; });
  EXPECT_THAT(ErrorOf(crossed, InBox(crossed)), HasSubstr("self intersections"));
  test::TestSurface lying = sheet;
  lying.AddPolygon({{0, 0.2, 0.2}, {0, 0.8, 0.2}, {0, 0.5, 0.8}}, 3);
  EXPECT_THAT(ErrorOf(lying, InBox(lying)), HasSubstr("self intersections"));
  test::TestSurface covered;  // the edge of a sheet in the middle of a triangle in a side
  covered.AddPolygon({{0, 0.1, 0.1}, {0, 0.9, 0.1}, {0, 0.5, 0.9}}, 3);
  covered.AddPolygon({{0, 0.4, 0.3}, {0, 0.6, 0.3}, {0.5, 0.5, 0.3}}, 4);
  EXPECT_THAT(ErrorOf(covered, InBox(covered)), HasSubstr("self intersections"));
  test::TestSurface flat = test::Sheet(-0.5, 1.5, 1, [](double x, double) { return 0.03 * x - 0.01; });
  EXPECT_THAT(ErrorOf(flat, InBox(flat)), HasSubstr("degrees at"));
}

TEST_F(BoxedMeshesTest, MemoryIsAskedForAndTheRunCancelled) {
  const test::TestSurface surface = test::Sheet(-0.2, 1.2, 60, [](double, double) { return 0.5; });
  RunContext context;
  test::LimitedLender lender(1 << 20);
  context.SetMemoryLender(&lender);
  EXPECT_EQ(MeshPoints(Parameters(), Input(surface.points, InBox(surface)), context).status().code(),
            absl::StatusCode::kResourceExhausted);
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(MeshPoints(Parameters(), Input(surface.points, InBox(surface)), cancelled).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
