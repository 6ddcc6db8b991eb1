// Slivers at surfaces: where vertices on a surface may go, and meshes of domains in space without slivers.
#include "core/sliver/surface_carrier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/features/solids.h"
#include "core/features/surface_complex.h"
#include "core/features/surface_curves.h"
#include "core/meshers/mesher.h"
#include "core/refine/step_rules.h"
#include "core/validate/validate.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"
#include "tests/support/same_mesh.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using test::TestSurface;

// The unit cube in a box, with a vertex in a corner, three on the first curve, one on a patch and one in the solid.
class SurfaceCarrierTest : public ::testing::Test {
 protected:
  static constexpr VertexId kCorner{0}, kFirst{1}, kMiddle{2}, kLast{3}, kOnPatch{4}, kInside{5};

  void SetUp() override {
    domain_.roles()[1].is_meshed = true;
    domain_.criteria() = {.tolerance = 0.01, .facet_radius = 1, .min_size = 0.001};
    ASSERT_TRUE(domain_.BuildIndex(MortonGrid<3>(box_), context_).ok());
    patch_ = domain_.curves().patch_of[0];
    const Triangle triangle = domain_.complex().TriangleAt(0);
    for (int axis = 0; axis < 3; ++axis) {
      on_patch_[axis] = 0.5 * triangle[0][axis] + 0.25 * triangle[1][axis] + 0.25 * triangle[2][axis];
    }
    Add(domain_.complex().points[domain_.curves().corners[0]], {SpacePlace::Kind::kCorner, 0, 0});
    for (const double along : {0.25, 0.5, 0.75}) {
      Add(domain_.PointAt(0, along), {SpacePlace::Kind::kCurve, 0, along});
    }
    Add(on_patch_, {SpacePlace::Kind::kPatch, patch_, 0});
    Add({0.5, 0.5, 0.5}, {SpacePlace::Kind::kSolid, 1, 0.5});
    ASSERT_TRUE(triangulation_.Build(box_, points_, {}, 1, context_).ok());
    carrier_.emplace(domain_, rules_.emplace(structure_, domain_, step_rules_));
  }

  std::optional<Point<3>> Bring(VertexId v, const Point<3>& to) const {
    return carrier_->Bring(triangulation_, carrier_->TrackOf(triangulation_, v), to);
  }

  static SpatialDomain CubeDomain() {
    static const TestSurface cube = test::Cube();
    RunContext context;
    SurfaceComplex complex = *MakeSurfaceComplex(cube.points, {}, cube.Features(), context);
    Solids solids = *FindSolids(complex, context);
    SurfaceCurves curves = *FindCurves(complex, 30, 0, context);
    return {std::move(complex), std::move(solids), std::move(curves)};
  }
  void Add(const Point<3>& p, const SpacePlace& place) {
    points_.push_back(p);
    domain_.AddVertex(place);
  }

  RunContext context_;
  const Box<3> box_{{-1, -1, -1}, {2, 2, 2}};
  SpatialDomain domain_ = CubeDomain();
  uint32_t patch_ = 0;
  Point<3> on_patch_{};
  HugeVector<Point<3>> points_;
  Triangulation<3> triangulation_;
  QueryStructure<3> structure_;
  const MeshCriteria<3> criteria_{.rho = 2};
  const StepRules<3> step_rules_{structure_, criteria_, 0x1p-40};
  std::optional<SpaceRules> rules_;
  std::optional<SurfaceCarrier> carrier_;
};

TEST_F(SurfaceCarrierTest, CornersStay) {
  EXPECT_FALSE(carrier_->MayMove(kCorner));
  for (const VertexId v : {kFirst, kMiddle, kLast, kOnPatch, kInside}) {
    EXPECT_TRUE(carrier_->MayMove(v)) << Index(v);
  }
}

TEST_F(SurfaceCarrierTest, VerticesOnCurvesMoveBetweenTheirNeighbours) {
  const Point<3> near = domain_.PointAt(0, 0.6);
  Point<3> beside = near;
  for (double& x : beside) {
    x += 0.01;
  }
  const std::optional<Point<3>> brought = Bring(kMiddle, beside);
  ASSERT_TRUE(brought.has_value());
  EXPECT_NEAR(domain_.ArcNear(0, 0, domain_.LengthOf(0), *brought), 0.6, 0.02);
  EXPECT_LT(Distance<3>(*brought, domain_.PointAt(0, domain_.ArcNear(0, 0, 1, *brought))), 1e-15);
  EXPECT_FALSE(Bring(kMiddle, domain_.PointAt(0, 0.9)).has_value());
  EXPECT_FALSE(Bring(kMiddle, domain_.PointAt(0, 0.1)).has_value());
}

TEST_F(SurfaceCarrierTest, ItIsKnownWhereAVertexOnACurveHasGone) {
  HugeVector<Point<3>> points = points_;
  points[Index(kMiddle)] = domain_.PointAt(0, 0.375);
  Triangulation<3> moved;
  ASSERT_TRUE(moved.Build(box_, points, {}, 1, context_).ok());
  carrier_->Moved(moved, kMiddle, kFirst);
  EXPECT_EQ(domain_.PlaceOf(kMiddle).along, 0.375);
  EXPECT_EQ(domain_.SubsegmentAt(0, 0.25).to, kMiddle);
  EXPECT_EQ(domain_.SubsegmentAt(0, 0.375).to, kLast);
}

TEST_F(SurfaceCarrierTest, VerticesOnPatchesStayOnThem) {
  const Triangle triangle = domain_.complex().TriangleAt(0);
  for (const double height : {-0.3, -0.01, 0.2}) {
    Point<3> p = on_patch_;
    for (int axis = 0; axis < 3; ++axis) {
      if (triangle[0][axis] == triangle[1][axis] && triangle[0][axis] == triangle[2][axis]) {
        p[axis] += height;
      }
    }
    ASSERT_NE(p, on_patch_);
    const std::optional<Point<3>> brought = Bring(kOnPatch, p);
    ASSERT_TRUE(brought.has_value());
    EXPECT_LT(Distance<3>(*brought, on_patch_), 1e-15) << height;
  }
  // Nearer to another patch than to its own: still on its own.
  const std::optional<Point<3>> brought = Bring(kOnPatch, {0.5, 0.5, 0.5});
  ASSERT_TRUE(brought.has_value());
  EXPECT_EQ(domain_.curves().patch_of[domain_.index().Nearest(*brought)->triangle], patch_);
}

TEST_F(SurfaceCarrierTest, VerticesInSolidsStayInThem) {
  EXPECT_EQ(Bring(kInside, {0.5, 0.25, 0.5}), (Point<3>{0.5, 0.25, 0.5}));
  EXPECT_FALSE(Bring(kInside, {0.5, -0.25, 0.5}).has_value());
  EXPECT_FALSE(Bring(kInside, {0.5, 5, 0.5}).has_value());
}

TEST_F(SurfaceCarrierTest, TetrahedraAreMeshedByTheSolidsOfTheirCircumcentres) {
  Simplex<3> corners = {Point<3>{0.4, 0.4, 0.4}, {0.6, 0.4, 0.4}, {0.4, 0.6, 0.4}, {0.4, 0.4, 0.6}};
  EXPECT_TRUE(carrier_->IsMeshed(corners));
  for (Point<3>& corner : corners) {
    corner[0] += 1;
  }
  EXPECT_FALSE(carrier_->IsMeshed(corners));
}

// Whole meshes.

MeshParameters Bounds(double length, double tolerance) {
  MeshParameters parameters;
  parameters.max_vertices = 20000;
  parameters.surface.edge_length = length;
  parameters.max_circumradius = 0.7 * length;
  parameters.surface.tolerance = tolerance;
  return parameters;
}

Mesh MeshOf(const TestSurface& surface, const MeshParameters& parameters) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = MeshPoints(parameters, Input(surface.points, surface.Features()), context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh{};
}

// Edges of facets that an odd number of facets has.
int OpenEdges(const Mesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, int> facets_at;
  for (size_t f = 0; f < mesh.facets.size(); f += 3) {
    for (size_t k = 0; k < 3; ++k) {
      ++facets_at[std::minmax(mesh.facets[f + k], mesh.facets[f + (k + 1) % 3])];
    }
  }
  return static_cast<int>(
      std::count_if(facets_at.begin(), facets_at.end(), [](const auto& entry) { return entry.second % 2 != 0; }));
}

struct NamedSurface {
  const char* name;
  TestSurface surface;
  MeshParameters parameters;
};

std::vector<NamedSurface> Surfaces() {
  const auto is_inside = [](int i, int j, int /*k*/) { return i == 1 && j == 1 ? 0 : 1; };
  const auto is_l = [](int i, int j, int /*k*/) { return i == 1 && j == 1 ? 0 : 1; };
  return {{"cube", test::Cube(), Bounds(0.2, 0.005)},
          {"plate", test::Boxes({0, 1}, {0, 1}, {0, 0.05}, [](int, int, int) { return 1; }), Bounds(0.15, 0.002)},
          {"L", test::Boxes({0, 1, 2}, {0, 1, 2}, {0, 1}, is_l), Bounds(0.35, 0.005)},
          {"tube", test::Boxes({0, 1, 2, 3}, {0, 1, 2, 3}, {0, 1}, is_inside), Bounds(0.5, 0.005)},
          {"sphere", test::Sphere(3), Bounds(0.35, 0.02)}};
}

TEST(SliversAtSurfacesTest, NoneAreLeftByDefault) {
  for (const auto& [name, surface, parameters] : Surfaces()) {
    SCOPED_TRACE(name);
    MeshParameters plain_parameters = parameters;
    plain_parameters.min_dihedral = 0;
    const Mesh plain = MeshOf(surface, plain_parameters);
    const Mesh mesh = MeshOf(surface, parameters);
    const QualityReport quality = MeasureQuality({3, mesh.points, mesh.simplices});
    ASSERT_LT(MeasureQuality({3, plain.points, plain.simplices}).min_angle_deg, 12);
    EXPECT_NEAR(mesh.statistics.min_angle_before_deg, plain.statistics.min_angle_deg, 1e-9);
    EXPECT_GT(mesh.statistics.slivers, 0u);
    EXPECT_EQ(mesh.statistics.slivers_left, 0u);
    EXPECT_GE(quality.min_angle_deg, 12);
    EXPECT_LE(quality.max_radius_edge, 2 * (1 + 1e-9));
    EXPECT_GE(mesh.statistics.surface->min_facet_angle_deg, 25 - 1e-6);
    EXPECT_EQ(mesh.statistics.surface->lost_ridges, 0u);
    EXPECT_EQ(OpenEdges(mesh), 0);
    EXPECT_LE(mesh.vertex_count(), 1.03 * plain.vertex_count());
    EXPECT_LE(mesh.statistics.surface->deviation_of_facets, parameters.surface.tolerance * 1.25);
    EXPECT_LE(mesh.statistics.surface->deviation_of_surface, parameters.surface.tolerance * 1.25);
    double volume = 0;
    double plain_volume = 0;
    for (size_t r = 0; r < mesh.regions.size(); ++r) {
      volume += mesh.statistics.surface->volumes[r];
      plain_volume += plain.statistics.surface->volumes[r];
    }
    EXPECT_NEAR(volume, plain_volume, 3 * parameters.surface.tolerance);
  }
}

TEST(SliversAtSurfacesTest, NeitherOrdersNorThreadsChangeAnything) {
  const auto [name, surface, parameters] = Surfaces().back();
  const Mesh mesh = MeshOf(surface, parameters);
  MeshParameters two = parameters;
  two.threads = 2;
  test::ExpectSameMesh(MeshOf(surface, two), mesh);
  test::SplitMix64 random(7);
  EXPECT_EQ(test::Canonical(MeshOf(test::Shuffled(surface, random), parameters)), test::Canonical(mesh));
}

TEST(SliversAtSurfacesTest, VerticesOfAnEarlierMeshMoveOnlyIfTheyMay) {
  const TestSurface cube = test::Cube();
  RunContext context;
  MeshParameters parameters = Bounds(0.25, 0.005);
  parameters.min_dihedral = 0;
  const SurfaceFeatures features = cube.Features();
  absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters, Input(cube.points, features), context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> plain = (*mesher)->Extract(1, context);
  ASSERT_TRUE(plain.ok());
  for (const bool keeps : {true, false}) {
    parameters.min_dihedral = keeps ? 5 : 12;
    parameters.keep_vertices = keeps;
    const absl::Status refined = (*mesher)->Refine(parameters, context);
    ASSERT_TRUE(refined.ok()) << refined;
    const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
    ASSERT_TRUE(mesh.ok());
    for (uint32_t v = 0; v < plain->vertex_count() && keeps; ++v) {
      EXPECT_EQ(PointAt<3>(mesh->points, v), PointAt<3>(plain->points, v)) << v;
    }
    EXPECT_EQ(mesh->moved_vertices.empty(), keeps);
    EXPECT_EQ(OpenEdges(*mesh), 0);
  }
}

TEST(SliversAtSurfacesTest, GivenPointsKeepTheirBits) {
  TestSurface cube = test::Cube();
  const uint32_t first = static_cast<uint32_t>(cube.points.size() / 3);
  test::SplitMix64 random(3);
  for (int i = 0; i < 60; ++i) {
    cube.AddPoint({0.1 + 0.8 * random.Unit(), 0.1 + 0.8 * random.Unit(), 0.1 + 0.8 * random.Unit()});
  }
  const Mesh mesh = MeshOf(cube, Bounds(0.3, 0.005));
  for (uint32_t i = first; i < cube.points.size() / 3; ++i) {
    EXPECT_EQ(PointAt<3>(mesh.points, mesh.input_vertex[i]), PointAt<3>(cube.points, i));
  }
  EXPECT_GT(mesh.statistics.sliver_moves, 0u);
  EXPECT_EQ(mesh.statistics.slivers_left, 0u);
}

}  // namespace
}  // namespace wellspace::core
