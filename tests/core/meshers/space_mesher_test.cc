// Domains in space: the solids that are meshed, and the fidelity to their surface; seen from outside, by other means.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/vector_product.h"
#include "core/meshers/mesher.h"
#include "core/simplex/quality.h"
#include "tests/core/meshers/space_meshes.h"
#include "tests/support/canonical.h"
#include "tests/support/seeded_test.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;
using ::testing::AllOf;
using ::testing::HasSubstr;

struct Part {
  const char* file;
  double facet;
  double cell;
  double tolerance;
  double volume;  // 0: that of its triangles
  uint64_t most_vertices;
};

void ExpectWellMeshed(const TestSurface& surface, const Part& part) {
  const absl::StatusOr<Mesh> mesh = MeshOf(surface, Bounds(surface, part.facet, part.cell, part.tolerance));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectConforming(*mesh);
  const SurfaceStatistics& figures = *mesh->statistics.surface;
  EXPECT_LE(mesh->statistics.max_radius_edge, 2 * (1 + 1e-9));
  EXPECT_GE(figures.min_facet_angle_deg, 25 - 1e-6);
  EXPECT_EQ(figures.lost_ridges, 0);
  EXPECT_LE(mesh->vertex_count(), part.most_vertices);
}

class Parts : public ::testing::TestWithParam<Part> {};

TEST_P(Parts, AreMeshedWithinTheirBounds) { ExpectWellMeshed(test::SurfaceOf(GetParam().file), GetParam()); }

INSTANTIATE_TEST_SUITE_P(SpaceMesher, Parts,
                         ::testing::Values(Part{"cube", 0.05, 0.06, 0.003, 1, 1225},
                                           Part{"lshape", 0.05, 0.06, 0.003, 3, 792},
                                           Part{"cylinder", 0.05, 0.06, 0.003, 0, 1050},
                                           Part{"cube_hole", 0.05, 0.06, 0.003, 0, 1308},
                                           Part{"plate", 0.05, 0.06, 0.003, 0.02, 3291}),
                         [](const auto& part) { return std::string(part.param.file); });

class SpaceMesherTest : public test::SeededTest {
 protected:
  SpaceMesherTest() : SeededTest(20261129) {}
};

TEST_F(SpaceMesherTest, OrderAndDirectionOfTrianglesDoNotChangeABit) {
  for (const auto& [part, min_dihedral] : {std::pair("cube", 0.0), {"cylinder", 0.0}, {"cylinder", 12.0}}) {
    SCOPED_TRACE(part);
    const TestSurface surface = test::SurfaceOf(part);
    MeshParameters parameters = Bounds(surface, 0.1, 0.2, 0.01);
    parameters.min_dihedral = min_dihedral;
    const absl::StatusOr<Mesh> mesh = MeshOf(surface, parameters);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(mesh->statistics.sliver_moves > 0, min_dihedral > 0);
    TestSurface other = test::Shuffled(surface, random_);
    for (size_t t = 0; t < other.triangle_count(); t += 3) {
      std::swap(other.corners[3 * t], other.corners[3 * t + 1]);
    }
    MeshParameters by_threads = parameters;
    by_threads.threads = 2;
    const absl::StatusOr<Mesh> again = MeshOf(other, by_threads);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(test::Hash(test::Canonical(*mesh)), test::Hash(test::Canonical(*again)));
    EXPECT_GT(again->statistics.surface->flipped_triangles, 0);
  }
}

TEST_F(SpaceMesherTest, SolidsOfMaterialsHaveTheirVolumes) {
  for (const test::NamedComplex& complex : test::SevenComplexes()) {
    SCOPED_TRACE(complex.name);
    const absl::StatusOr<Mesh> mesh =
        MeshOf(complex.surface, Bounds(complex.surface, 0.1, 0.2, 0.01), SolidRule::kHoles);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    const SurfaceStatistics& figures = *mesh->statistics.surface;
    std::vector<double> volumes = figures.volumes;
    std::sort(volumes.begin(), volumes.end());
    ASSERT_EQ(volumes.size(), complex.volumes.size());
    for (size_t i = 0; i < volumes.size(); ++i) {
      EXPECT_NEAR(volumes[i], complex.volumes[i], 1e-12);
    }
    EXPECT_EQ(figures.lost_ridges, 0);
    EXPECT_LE(mesh->statistics.max_radius_edge, 2 * (1 + 1e-9));
  }
}

TEST_F(SpaceMesherTest, SeedsMakeRegionsAndHoles) {
  const TestSurface surface = test::SevenComplexes()[0].surface;  // two cubes side by side
  SurfaceFeatures features = surface.Features();
  features.solids = SolidRule::kHoles;
  const std::vector<SolidSeed> seeds = {{.at = {0.5, 0.5, 0.5}, .region = 7}, {.at = {1.5, 0.5, 0.5}, .is_hole = true}};
  features.seeds = seeds;
  RunContext context;
  const absl::StatusOr<Mesh> mesh =
      MeshPoints(Bounds(surface, 0.2, 0.3, 0.01), Input(surface.points, features), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_NEAR(VolumeOf(*mesh), 1, 1e-12);
  ASSERT_EQ(mesh->regions.size(), 1);
  EXPECT_EQ(mesh->regions[0].id, 7);
  ExpectConforming(*mesh);
}

TEST_F(SpaceMesherTest, KeepsPointsInside) {
  TestSurface surface = test::Cube();
  const uint32_t inside = surface.AddPoint({0.3, 0.4, 0.5});
  const uint32_t outside = surface.AddPoint({1.25, 0.5, 0.5});
  const absl::StatusOr<Mesh> mesh = MeshOf(surface, Bounds(surface, 0.2, 0.3, 0.01));
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_NE(mesh->input_vertex[inside], kNoOutput);
  EXPECT_EQ(PointAt<3>(mesh->points, mesh->input_vertex[inside]), (Point<3>{0.3, 0.4, 0.5}));
  EXPECT_EQ(mesh->input_vertex[outside], kNoOutput);
  EXPECT_EQ(mesh->statistics.surface->unmeshed_points, 1);
  ExpectConforming(*mesh);
}

absl::Status ErrorFor(const TestSurface& surface, MeshParameters parameters = {}) {
  return MeshOf(surface, parameters).status();
}

TEST_F(SpaceMesherTest, RefusesWhatBoundsNothingWithItsPlace) {
  TestSurface open = test::Cube();
  open.corners.resize(open.corners.size() - 3);
  open.markers.pop_back();
  const absl::Status holes = ErrorFor(open);
  EXPECT_EQ(holes.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(holes.message()), AllOf(HasSubstr("open edges"), HasSubstr("at ("), HasSubstr("expected")));
  const absl::Status overlap = ErrorFor(test::SurfaceOf("overlap"));
  EXPECT_EQ(overlap.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(overlap.message()), AllOf(HasSubstr("self intersections"), HasSubstr("triangles")));
}

TEST_F(SpaceMesherTest, RefusesParametersOfOtherDomains) {
  MeshParameters parameters;
  parameters.dimension = 2;
  EXPECT_THAT(std::string(ErrorFor(test::Cube(), parameters).message()), HasSubstr("dimension"));
  parameters = {};
  parameters.pump_weights = true;
  EXPECT_THAT(std::string(ErrorFor(test::Cube(), parameters).message()), HasSubstr("pump_weights"));
  parameters = {};
  parameters.surface.min_facet_angle = 31;
  EXPECT_THAT(std::string(ErrorFor(test::Cube(), parameters).message()), HasSubstr("surface.min_facet_angle: 31"));
  parameters = {};
  parameters.surface.tolerance = -1;
  EXPECT_THAT(std::string(ErrorFor(test::Cube(), parameters).message()), HasSubstr("surface.tolerance: -1"));
}

TEST_F(SpaceMesherTest, EndsWithItsBudgetOfVertices) {
  const TestSurface surface = test::Cube();
  MeshParameters parameters = Bounds(surface, 0.05, 0.06, 0.003);
  parameters.max_vertices = 400;
  const absl::Status status = MeshOf(surface, parameters).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("max_vertices"), HasSubstr("the last vertex was asked for at ("), HasSubstr("by the ")));
}

TEST_F(SpaceMesherTest, RefusesHopelessSizesAtOnce) {
  MeshParameters parameters;
  parameters.max_circumradius = 1e-6;
  const absl::Status status = ErrorFor(test::Cube(), parameters);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("takes at least"));
}

// Data that the first mesh took with it are made again; figures that were measured of it hold.
TEST_F(SpaceMesherTest, TheSecondMeshOfARefinementIsTheFirst) {
  const TestSurface surface = test::SurfaceOf("cylinder");
  const SurfaceFeatures features = surface.Features();
  MeshParameters parameters = Bounds(surface, 0.1, 0.1, 0.01);
  parameters.min_dihedral = 12;
  RunContext context;
  const absl::StatusOr<std::unique_ptr<Mesher>> mesher =
      Mesher::Create(parameters, Input(surface.points, features), context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> first = (*mesher)->Extract(1, context);
  const absl::StatusOr<Mesh> second = (*mesher)->Extract(1, context);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(first->points, second->points);
  EXPECT_EQ(first->simplices, second->simplices);
  EXPECT_EQ(first->facets, second->facets);
  EXPECT_EQ(first->ridges, second->ridges);
  const SurfaceStatistics& figures = *first->statistics.surface;
  EXPECT_GT(figures.deviation_of_facets, 0);
  EXPECT_EQ(figures.deviation_of_facets, second->statistics.surface->deviation_of_facets);
  EXPECT_EQ(figures.deviation_of_surface, second->statistics.surface->deviation_of_surface);
  EXPECT_EQ(figures.volumes, second->statistics.surface->volumes);
}

// A hole is not meshed, and costs no vertex.
TEST_F(SpaceMesherTest, HolesAreNoReasonToRefuseSizes) {
  const TestSurface large = test::Boxes({0, 1}, {0, 1}, {0, 1}, [](int, int, int) { return 1; });
  const TestSurface small = test::Boxes({2, 2.1}, {0, 0.1}, {0, 0.1}, [](int, int, int) { return 1; });
  const TestSurface both = test::Joined(large, small);
  SurfaceFeatures features = both.Features();
  features.solids = SolidRule::kHoles;
  const std::vector<SolidSeed> hole = {{.at = {0.5, 0.5, 0.5}, .is_hole = true}};
  MeshParameters parameters;
  parameters.max_circumradius = 0.0134;
  parameters.max_vertices = 20000;
  RunContext context;
  for (const bool has_hole : {false, true}) {
    features.seeds = has_hole ? std::span<const SolidSeed>(hole) : std::span<const SolidSeed>();
    const absl::StatusOr<std::unique_ptr<Mesher>> mesher =
        Mesher::Create(parameters, Input(both.points, features), context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    EXPECT_EQ((*mesher)->CheckFeasible(parameters).ok(), has_hole);
  }
}

// Without curves the surface has few vertices before the refinement.
TEST_F(SpaceMesherTest, RefusesHopelessFacetsOfASmoothPartAtOnce) {
  const TestSurface surface = test::Cube();
  SurfaceFeatures features = surface.Features();
  features.crease_angle = 180;
  MeshParameters parameters;
  parameters.surface.edge_length = 1e-6;
  parameters.surface.tolerance = 1e-7;
  RunContext context;
  const absl::Status hopeless = MeshPoints(parameters, Input(surface.points, features), context).status();
  EXPECT_EQ(hopeless.code(), absl::StatusCode::kResourceExhausted) << hopeless;
  EXPECT_THAT(std::string(hopeless.message()), AllOf(HasSubstr("edges of facets of at most 1e-06 take at least"),
                                                     HasSubstr("surface.edge_length and max_circumradius of at")));
}

TEST_F(SpaceMesherTest, RefusesWhatWouldLeaveAVertexWithoutTetrahedra) {
  const TestSurface surface = test::SurfaceOf("cube");
  MeshParameters parameters;
  parameters.surface.tolerance = 1e6 * DiagonalOf(surface);
  const absl::Status status = MeshOf(surface, parameters).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("surface.min_size: at ("), HasSubstr("smaller surface.tolerance")));
}

TEST_F(SpaceMesherTest, EndsWhereVerticesWouldFallOnEachOther) {
  const TestSurface surface = test::SurfaceOf("cube");
  const std::vector<SolidSeed> seeds = {{.at = {0.5, 0.5, 0.5}, .max_volume = 1e-300}};
  SurfaceFeatures features = surface.Features();
  features.seeds = seeds;
  RunContext context;
  const absl::Status status = MeshPoints(MeshParameters(), Input(surface.points, features), context).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
}

TEST_F(SpaceMesherTest, StopsWhenCancelled) {
  const TestSurface surface = test::Cube();
  RunContext context;
  context.Cancel();
  EXPECT_EQ(
      MeshPoints(Bounds(surface, 0.1, 0.1, 0.01), Input(surface.points, surface.Features()), context).status().code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
