// Scenes of meshes: what is drawn, cut, ordered and coloured, on meshes of a few simplices whose pictures are known.
#include <cairo.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "client/render/colour_ramp.h"
#include "client/render/painter.h"
#include "client/render/scene.h"
#include "core/meshers/mesher.h"
#include "core/simplex/quality.h"
#include "tests/support/meshes.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::render {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

uint64_t Seed() {
  const char* wanted = std::getenv("WELLSPACE_SEED");
  return wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 20240611;
}

formats::Mesh Square() { return {.dimension = 2, .points = {0, 0, 2, 0, 2, 1, 0, 1}, .simplices = {0, 1, 2, 0, 2, 3}}; }

formats::Mesh Cubes(uint32_t n) {
  const test::TestMesh grid = test::KuhnGrid(3, n);
  return {.dimension = 3, .points = grid.points, .simplices = grid.simplices};
}

double Area(const Facet& facet) {
  const auto& c = facet.corners;
  return std::abs((c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[2][0] - c[0][0]) * (c[1][1] - c[0][1])) / 2;
}

double TotalArea(const Scene& scene) {
  double sum = 0;
  for (const Facet& facet : scene.facets) {
    sum += Area(facet);
  }
  return sum;
}

TEST(SceneTest, PlaneMeshIsDrawnAsItIs) {
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {});
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->facets.size(), 2u);
  EXPECT_EQ(scene->width, 2);
  EXPECT_EQ(scene->height, 1);
  EXPECT_NEAR(TotalArea(*scene), 2, 1e-6);
  EXPECT_NEAR(60 * scene->facets[0].share, std::atan2(1, 2) * 180 / std::numbers::pi, 1e-4);
  EXPECT_EQ(scene->high, 60);
}

// A convex body covers its picture exactly once.
TEST(SceneTest, VisibleFacetsOfAConvexBodyCoverItsShadowOnce) {
  const Plane everything = {.normal = {0, 0, 1}, .offset = 100};
  const absl::StatusOr<Scene> scene = MakeScene(Cubes(3).View(), {.plane = everything, .up = 2});
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->facets.size(), 3u * 2 * 3 * 3);  // three of the six sides, two triangles for each square
  // The direction towards the spectator, as MakeCamera has it: the shadow of the unit cube is the sum of its
  // coordinates.
  const double norm = std::hypot(1, 0.55, 0.4);
  EXPECT_NEAR(TotalArea(*scene), 9 * (1 + 0.55 + 0.4) / norm, 1e-4);
}

TEST(SceneTest, CutKeepsTheSideThatTheNormalDoesNotPointTo) {
  const formats::Mesh cubes = Cubes(4);
  const absl::StatusOr<Scene> half = MakeScene(cubes.View(), {.plane = Plane{{0, 0, 2}, 4}, .up = 2});  // z <= 2
  const absl::StatusOr<Scene> whole = MakeScene(cubes.View(), {.plane = Plane{{0, 0, 2}, 80}, .up = 2});
  ASSERT_TRUE(half.ok() && whole.ok());
  EXPECT_LT(half->height, whole->height);
  EXPECT_EQ(half->facets.size(), 2u * (4 * 4 + 2 * 4 + 2 * 4));
  EXPECT_EQ(whole->facets.size(), 2u * 3 * 4 * 4);
}

// The shadow of a cube of side 3 is 9 times the sum of the direction's coordinates.
TEST(SceneTest, TheCameraIsWhereItIsPut) {
  for (const std::array<double, 3>& camera :
       {std::array<double, 3>{1, 0, 0}, {0, 0, 5}, {0, -2, 0}, {1, 1, 1}, {-3, 0.5, 2}, {1e-30, 0, 0}}) {
    const absl::StatusOr<Scene> scene = MakeScene(Cubes(3).View(), {.only_boundary = true, .camera = camera});
    ASSERT_TRUE(scene.ok()) << scene.status();
    const double norm = std::hypot(camera[0], camera[1], camera[2]);
    const double sum = std::abs(camera[0]) + std::abs(camera[1]) + std::abs(camera[2]);
    EXPECT_NEAR(TotalArea(*scene), 9 * sum / norm, 1e-4);
  }
  // From the side, the axis that points upwards is the height.
  const formats::Mesh mesh = {
      .dimension = 3, .points = {0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 5}, .simplices = {0, 1, 2, 3}};
  const absl::StatusOr<Scene> side =
      MakeScene(mesh.View(), {.only_boundary = true, .camera = std::array<double, 3>{1, 0, 0}, .up = 2});
  ASSERT_TRUE(side.ok()) << side.status();
  EXPECT_NEAR(side->height, 5, 1e-9);
  EXPECT_NEAR(side->width, 2, 1e-9);
}

TEST(SceneTest, CamerasThatCannotBe) {
  const auto refused = [](const formats::Mesh& mesh, const View& view) {
    return std::string(MakeScene(mesh.View(), view).status().message());
  };
  constexpr std::array<double, 3> kFront = {1, 0, 0};
  EXPECT_THAT(refused(Cubes(1), {.camera = std::array<double, 3>{0, 0, 0}}), HasSubstr("camera"));
  EXPECT_THAT(refused(Cubes(1), {.camera = std::array<double, 3>{1e300, 1e300, 1e300}}), testing::IsEmpty());
  EXPECT_THAT(refused(Square(), {.camera = kFront}), HasSubstr("2-D"));
  EXPECT_THAT(refused(Square(), {.only_boundary = true}), HasSubstr("2-D"));
  EXPECT_THAT(refused(Cubes(1), {.plane = Plane{{0, 0, 1}, 1}, .only_boundary = true}), HasSubstr("boundary alone"));
}

using Vector = std::array<double, 3>;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Where the line of sight through (x, y) meets the tetrahedron `corners`, given as (x, y, depth): the depth at which it
// enters, or minus infinity when it misses.
double EntryDepth(const std::array<Vector, 4>& corners, double x, double y) {
  double nearest = -std::numeric_limits<double>::infinity();
  for (int skipped = 0; skipped < 4; ++skipped) {
    const Vector& a = corners[(skipped + 1) % 4];
    const Vector& b = corners[(skipped + 2) % 4];
    const Vector& c = corners[(skipped + 3) % 4];
    const auto area = [](double ux, double uy, double vx, double vy) { return ux * vy - uy * vx; };
    const double whole = area(b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    const double beta = area(x - a[0], y - a[1], c[0] - a[0], c[1] - a[1]) / whole;
    const double gamma = area(b[0] - a[0], b[1] - a[1], x - a[0], y - a[1]) / whole;
    if (beta >= 0 && gamma >= 0 && beta + gamma <= 1) {
      nearest = std::max(nearest, a[2] + beta * (b[2] - a[2]) + gamma * (c[2] - a[2]));
    }
  }
  return nearest;
}

bool Covers(const Facet& facet, double x, double y) {
  bool positive = false;
  bool negative = false;
  for (int i = 0; i < 3; ++i) {
    const auto& a = facet.corners[i];
    const auto& b = facet.corners[(i + 1) % 3];
    const double side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    positive |= side > 0;
    negative |= side < 0;
  }
  return !(positive && negative);
}

// The tetrahedra that a cut across x at 0.5 leaves, in the picture's directions: right, up, towards the eye.
struct Kept {
  // The smallest angle of the one that a line of sight enters first, found among all of them; -1: it meets none.
  double AngleAt(double x, double y) const {
    double nearest = -std::numeric_limits<double>::infinity();
    double expected = -1;
    for (size_t k = 0; k < corners.size(); ++k) {
      const double depth = EntryDepth(corners[k], low_x + x, low_y + y);
      if (depth > nearest) {
        nearest = depth;
        expected = angles[k];
      }
    }
    return expected;
  }

  std::vector<std::array<Vector, 4>> corners;
  std::vector<double> angles;
  double low_x = std::numeric_limits<double>::infinity();
  double low_y = std::numeric_limits<double>::infinity();
};

Kept KeptOf(const core::Mesh& mesh) {
  // From the front, a little from the side (y) and from above (z).
  const double norm = std::hypot(1, 0.55, 0.4);
  const Vector towards = {1 / norm, 0.55 / norm, 0.4 / norm};
  const double side = std::hypot(towards[0], towards[1]);
  const Vector right = {-towards[1] / side, towards[0] / side, 0};
  const Vector up = {towards[1] * right[2] - towards[2] * right[1], towards[2] * right[0] - towards[0] * right[2],
                     towards[0] * right[1] - towards[1] * right[0]};
  Kept kept;
  for (uint64_t simplex = 0; simplex < mesh.simplex_count(); ++simplex) {
    core::Simplex<3> corners;
    std::array<Vector, 4> projected;
    double centroid_x = 0;
    for (int i = 0; i < 4; ++i) {
      std::copy_n(&mesh.points[3 * mesh.simplices[4 * simplex + i]], 3, corners[i].begin());
      projected[i] = {Dot(corners[i], right), Dot(corners[i], up), Dot(corners[i], towards)};
      centroid_x += corners[i][0] / 4;
    }
    if (centroid_x <= 0.5) {
      kept.corners.push_back(projected);
      kept.angles.push_back(core::Angles<3>(corners).min_deg);
      for (const Vector& corner : projected) {
        kept.low_x = std::min(kept.low_x, corner[0]);
        kept.low_y = std::min(kept.low_y, corner[1]);
      }
    }
  }
  return kept;
}

// At every sample, the tetrahedron painted last is the one that a line of sight enters first.
TEST(SceneTest, PaintersOrderShowsWhatIsInFront) {
  const uint64_t seed = Seed();
  SCOPED_TRACE(testing::Message() << "WELLSPACE_SEED=" << seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> cloud;
  for (int i = 0; i < 240; ++i) {
    cloud.push_back(i % 3 == 0 ? uniform(random) : std::pow(uniform(random), 3));
  }
  core::RunContext context;
  core::MeshParameters parameters;
  parameters.dimension = 3;
  const absl::StatusOr<core::Mesh> mesh = core::MeshPoints(parameters, cloud, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const formats::MeshView view = {
      .dimension = 3, .points = mesh->points, .simplices = mesh->simplices, .input_vertices = 0};
  const absl::StatusOr<Scene> scene = MakeScene(view, {.plane = Plane{{1, 0, 0}, 0.5}, .up = 2});
  ASSERT_TRUE(scene.ok()) << scene.status();

  const Kept kept = KeptOf(*mesh);
  int overlaps = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    const double x = uniform(random) * scene->width;
    const double y = uniform(random) * scene->height;
    double painted = -1;
    int covers = 0;
    for (const Facet& facet : scene->facets) {
      if (Covers(facet, x, y)) {
        painted = facet.share * scene->high;
        ++covers;
      }
    }
    // Only where facets overlap does their order matter; the first samples look everywhere.
    if (covers < 2 && sample >= 400) {
      continue;
    }
    overlaps += covers < 2 ? 0 : 1;
    ASSERT_NEAR(painted, kept.AngleAt(x, y), 1e-3) << x << " " << y;
  }
  EXPECT_GT(overlaps, 100);
}

TEST(SceneTest, Errors) {
  const auto message = [](const formats::Mesh& mesh, const View& view) {
    const absl::StatusOr<Scene> scene = MakeScene(mesh.View(), view);
    EXPECT_EQ(scene.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(scene.status().message());
  };
  EXPECT_THAT(message({.dimension = 3, .points = {}, .simplices = {}}, {}), HasSubstr("no simplices"));
  EXPECT_THAT(message({.dimension = 4, .points = std::vector<double>(20), .simplices = {0, 1, 2, 3, 4}}, {}),
              HasSubstr("only 2-D and 3-D meshes can be drawn, and this one is 4-D"));
  EXPECT_THAT(message(Square(), {.plane = Plane{{1, 0, 0}, 0}, .up = 2}), HasSubstr("3-D meshes only"));
  EXPECT_THAT(message(Cubes(1), {.plane = Plane{{0, 0, 0}, 1}, .up = 2}), HasSubstr("normal has a direction"));
  EXPECT_THAT(message(Cubes(1), {.plane = Plane{{1, 0, 0}, -1}, .up = 2}), HasSubstr("cuts off all of the 6"));
  EXPECT_THAT(message(Square(), {.colouring = Colouring::kRegion}), HasSubstr("tells of no regions"));
  EXPECT_THAT(message(Square(), {.only_boundary = true}), HasSubstr("of 3-D meshes, and this one is 2-D"));
  EXPECT_THAT(message(Square(), {.colouring = Colouring::kBoundary}), HasSubstr("expected such a mesh"));
  EXPECT_THAT(message(Cubes(1), {.colouring = Colouring::kBoundary}), HasSubstr("expected such a mesh"));
  formats::Mesh huge = Square();
  huge.points[0] = -1e300;
  EXPECT_THAT(message(huge, {}), HasSubstr("at most 1e150"));
}

// The square of two triangles, each a region of its own, with the diagonal and one side as boundary.
formats::Mesh TwoRegions() {
  formats::Mesh mesh = Square();
  mesh.vertex_origins = {0, 1, 2, 3};
  mesh.vertex_tags = {2, 0, 2, 0};
  mesh.facets = {0, 1, 0, 2};
  mesh.boundary = {{.tag = 1, .name = "south", .facets = 1}, {.tag = 2, .name = "", .facets = 1}};
  mesh.simplex_regions = {7, 3};
  mesh.regions = {{.id = 3, .name = "lake"}, {.id = 7, .name = ""}};
  return mesh;
}

TEST(SceneTest, ColoursOfAFieldAreMeansOfCorners) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const formats::Attribute field = {.name = "heat", .values = {-2, 1, 10, nan}};
  const View view = {.colouring = Colouring::kField, .field = &field};
  const absl::StatusOr<Scene> scene = MakeScene(TwoRegions().View(), view);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_TRUE(scene->categories.empty());
  EXPECT_FALSE(scene->is_angle);
  EXPECT_EQ(scene->legend, "heat");
  EXPECT_EQ(scene->low, -2);
  EXPECT_EQ(scene->high, 10);
  EXPECT_NEAR(scene->facets[0].share, (3.0 + 2) / 12, 1e-6);
  EXPECT_TRUE(std::isnan(scene->facets[1].share)) << "a corner has no value";
}

// The cube's facets at x = 0, where the field is 0, and others.
TEST(SceneTest, ColoursOfAFieldOnACut) {
  const formats::Mesh mesh = Cubes(1);
  formats::Attribute field = {.name = "x", .values = {}};
  for (uint64_t vertex = 0; vertex < mesh.View().vertex_count(); ++vertex) {
    field.values.push_back(mesh.points[3 * vertex] * 1e308);  // whose sums are beyond doubles
  }
  const absl::StatusOr<Scene> scene = MakeScene(
      mesh.View(), {.only_boundary = true, .camera = {{-1, 0, 0}}, .colouring = Colouring::kField, .field = &field});
  ASSERT_TRUE(scene.ok()) << scene.status();
  ASSERT_EQ(scene->facets.size(), 2u);
  EXPECT_EQ(scene->facets[0].share, 0);
  EXPECT_EQ(scene->facets[1].share, 0);
}

TEST(SceneTest, ColoursOfAFieldOfSimplices) {
  formats::Attribute field = {.name = "pressure", .values = {4, -4}};
  View view = {.colouring = Colouring::kField, .field = &field, .is_field_of_simplices = true};
  const absl::StatusOr<Scene> scene = MakeScene(TwoRegions().View(), view);
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->low, -4);
  EXPECT_EQ(scene->facets[0].share, 1);
  EXPECT_EQ(scene->facets[1].share, 0);
  field.values.push_back(0);
  EXPECT_THAT(std::string(MakeScene(TwoRegions().View(), view).status().message()),
              HasSubstr("expected a value of pressure for each of the 2 simplices, got 3"));
  // In space a facet has the number of its tetrahedron.
  const formats::Mesh cube = Cubes(1);
  field.values.assign(cube.View().simplex_count(), 0);
  field.values[0] = 1;
  view.only_boundary = true;
  const absl::StatusOr<Scene> cut = MakeScene(cube.View(), view);
  ASSERT_TRUE(cut.ok()) << cut.status();
  for (const Facet& facet : cut->facets) {
    EXPECT_TRUE(facet.share == 0 || facet.share == 1) << facet.share;
  }
}

TEST(SceneTest, AFieldHasValues) {
  const formats::Attribute one = {.name = "one", .values = std::vector<double>(4, 7.5)};
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {.colouring = Colouring::kField, .field = &one});
  ASSERT_TRUE(scene.ok()) << scene.status();
  EXPECT_EQ(scene->facets[0].share, 0.5);
  const formats::Attribute none = {.name = "none",
                                   .values = std::vector<double>(4, std::numeric_limits<double>::infinity())};
  EXPECT_THAT(
      std::string(MakeScene(Square().View(), {.colouring = Colouring::kField, .field = &none}).status().message()),
      HasSubstr("no vertex has a finite value of none"));
  const formats::Attribute few = {.name = "few", .values = {1, 2, 3}};
  EXPECT_THAT(
      std::string(MakeScene(Square().View(), {.colouring = Colouring::kField, .field = &few}).status().message()),
      HasSubstr("expected a value of few for each of the 4 vertices, got 3"));
}

TEST(SceneTest, TheBoundaryOfAPlaneMeshIsDrawn) {
  const absl::StatusOr<Scene> scene = MakeScene(TwoRegions().View(), {});
  ASSERT_TRUE(scene.ok()) << scene.status();
  const std::array<PicturePoint, 2> south = {{{0, 0}, {2, 0}}};
  const std::array<PicturePoint, 2> diagonal = {{{0, 0}, {2, 1}}};
  EXPECT_THAT(scene->boundary, ::testing::ElementsAre(south, diagonal));
}

TEST(SceneTest, ColoursMeanRegionsWhereThereAreSeveral) {
  const formats::Mesh mesh = TwoRegions();
  for (const std::optional<Colouring> colouring : {std::optional<Colouring>(), std::optional(Colouring::kRegion)}) {
    const absl::StatusOr<Scene> scene = MakeScene(mesh.View(), {.colouring = colouring});
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_THAT(scene->categories, ::testing::ElementsAre("lake", "region 7"));
    EXPECT_EQ(scene->facets[0].category, 1u);
    EXPECT_EQ(scene->facets[1].category, 0u);
  }
  EXPECT_TRUE(MakeScene(mesh.View(), {.colouring = Colouring::kAngle})->categories.empty());
  formats::Mesh one = mesh;
  one.simplex_regions = {};
  one.regions.resize(1);
  EXPECT_TRUE(MakeScene(one.View(), {})->categories.empty());
  EXPECT_THAT(MakeScene(one.View(), {.colouring = Colouring::kRegion})->categories, ::testing::ElementsAre("lake"));
}

TEST(SceneTest, TetrahedraHaveTheColourOfTheirRegion) {
  formats::Mesh cubes = Cubes(2);
  cubes.regions = {{.id = 1, .name = "low"}, {.id = 2, .name = "high"}};
  for (size_t simplex = 0; simplex < cubes.simplices.size() / 4; ++simplex) {
    double z = 0;
    for (int i = 0; i < 4; ++i) {
      z += cubes.points[3 * cubes.simplices[4 * simplex + i] + 2] / 4;
    }
    cubes.simplex_regions.push_back(z < 1 ? 1 : 2);
  }
  // From above, the two layers of the left half: the top is of the upper one alone, each wall of both.
  const absl::StatusOr<Scene> scene = MakeScene(cubes.View(), {.plane = Plane{{0, 0, 1}, 100}, .up = 2});
  ASSERT_TRUE(scene.ok()) << scene.status();
  const auto of_region = [&](uint32_t region) {
    return std::count_if(scene->facets.begin(), scene->facets.end(),
                         [region](const Facet& facet) { return facet.category == region; });
  };
  EXPECT_EQ(of_region(0), 2 * 2 * 2);
  EXPECT_EQ(of_region(1), 2 * 2 * 2 + 2 * 4);
}

// Two cubes on each other: the upper one's facets have a tag, and of the lower one the bottom and those between them.
formats::Mesh TwoSolids() {
  formats::Mesh cubes = Cubes(1);
  const formats::Mesh lower = cubes;
  for (size_t i = 2; i < cubes.points.size(); i += 3) {
    cubes.points[i] += 1;
  }
  const auto below = static_cast<uint32_t>(cubes.points.size() / 3);
  cubes.points.insert(cubes.points.end(), lower.points.begin(), lower.points.end());
  std::vector<uint32_t> number;  // of the lower cube's vertices: those at the top are the upper one's
  for (uint32_t v = 0; v < below; ++v) {
    const auto at = [&](uint32_t u, int axis) { return cubes.points[3 * size_t{u} + axis]; };
    number.push_back(below + v);
    for (uint32_t u = 0; u < below; ++u) {
      if (at(u, 0) == at(below + v, 0) && at(u, 1) == at(below + v, 1) && at(u, 2) == at(below + v, 2)) {
        number.back() = u;
      }
    }
  }
  const size_t upper = cubes.simplices.size() / 4;
  for (const uint32_t v : lower.simplices) {
    cubes.simplices.push_back(number[v]);
  }
  cubes.simplex_regions.assign(upper, 2);
  cubes.simplex_regions.resize(cubes.simplices.size() / 4, 1);
  cubes.regions = {{.id = 1, .name = "base"}, {.id = 2, .name = "top"}};
  cubes.boundary = {{.tag = 4, .name = "sky", .facets = 0}, {.tag = 6, .name = "", .facets = 0}};
  for (const double z : {2.0, 1.0}) {
    for (size_t s = 0; s < 4 * upper; s += 4) {
      for (size_t skip = 0; skip < 4; ++skip) {
        std::vector<uint32_t> row;
        for (size_t k = 0; k < 4; ++k) {
          if (k != skip && cubes.points[3 * size_t{cubes.simplices[s + k]} + 2] == z) {
            row.push_back(cubes.simplices[s + k]);
          }
        }
        if (row.size() == 3) {
          cubes.facets.insert(cubes.facets.end(), row.begin(), row.end());
          ++cubes.boundary[z == 2 ? 0 : 1].facets;
        }
      }
    }
  }
  return cubes;
}

TEST(SceneTest, TheBoundaryAloneHasTheColoursOfItsParts) {
  const formats::Mesh mesh = TwoSolids();
  ASSERT_EQ(mesh.boundary[0].facets, 2);
  ASSERT_EQ(mesh.boundary[1].facets, 2);
  const absl::StatusOr<Scene> scene = MakeScene(mesh.View(), {.only_boundary = true});
  ASSERT_TRUE(scene.ok()) << scene.status();
  // Nothing is cut off: of both cubes two sides are seen, and the top, which alone has a tag; no facets between them.
  const auto count_of = [](const Scene& drawn, uint32_t category) {
    return std::count_if(drawn.facets.begin(), drawn.facets.end(),
                         [category](const Facet& facet) { return facet.category == category; });
  };
  EXPECT_THAT(scene->categories, ::testing::ElementsAre("sky", "tag 6", "no tag"));
  EXPECT_EQ(count_of(*scene, 0), 2);
  EXPECT_EQ(count_of(*scene, 1), 0);
  EXPECT_EQ(count_of(*scene, 2), 2 * 2 * 2);
  // Cut between the cubes, the facets there are seen from above.
  const absl::StatusOr<Scene> cut =
      MakeScene(mesh.View(), {.plane = Plane{{0, 0, 1}, 1}, .colouring = Colouring::kBoundary});
  ASSERT_TRUE(cut.ok()) << cut.status();
  EXPECT_EQ(count_of(*cut, 0), 0);
  EXPECT_EQ(count_of(*cut, 1), 2);
  EXPECT_EQ(count_of(*cut, 2), 2 * 2);
  EXPECT_THAT(MakeScene(mesh.View(), {.only_boundary = true, .colouring = Colouring::kRegion})->categories,
              ::testing::ElementsAre("base", "top"));
}

TEST(ColourRampTest, ColoursOfRegionsDiffer) {
  std::set<std::array<double, 3>> colours;
  for (size_t i = 0; i < 24; ++i) {
    const Colour colour = CategoryColour(i);
    colours.insert({colour.red, colour.green, colour.blue});
  }
  EXPECT_EQ(colours.size(), 24u);
  EXPECT_EQ(CategoryColour(24).red, CategoryColour(0).red);
}

TEST(ColourRampTest, LightnessGrows) {
  double last = -1;
  for (int i = 0; i <= 100; ++i) {
    const Colour colour = RampColour(i / 100.0);
    const double lightness =
        0.2126 * std::pow(colour.red, 2.2) + 0.7152 * std::pow(colour.green, 2.2) + 0.0722 * std::pow(colour.blue, 2.2);
    EXPECT_GT(lightness, last) << i;
    last = lightness;
  }
  EXPECT_EQ(RampColour(-1).red, RampColour(0).red);
  EXPECT_EQ(RampColour(2).red, RampColour(1).red);
}

uint32_t BigEndian(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) {
    value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  }
  return value;
}

// A picture read back.
class Picture {
 public:
  explicit Picture(const std::string& path) : surface_(cairo_image_surface_create_from_png(path.c_str())) {
    EXPECT_EQ(cairo_surface_status(surface_), CAIRO_STATUS_SUCCESS) << path;
  }
  ~Picture() { cairo_surface_destroy(surface_); }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  int height() const { return cairo_image_surface_get_height(surface_); }
  // Red, green and blue.
  uint32_t At(int x, int y) const {
    uint32_t value = 0;
    std::memcpy(&value, cairo_image_surface_get_data(surface_) + y * cairo_image_surface_get_stride(surface_) + 4 * x,
                4);
    return value & 0xffffff;
  }

 private:
  cairo_surface_t* surface_;
};

void ExpectColour(uint32_t pixel, const Colour& expected) {
  EXPECT_NEAR(pixel >> 16 & 255, 255 * expected.red, 2);
  EXPECT_NEAR(pixel >> 8 & 255, 255 * expected.green, 2);
  EXPECT_NEAR(pixel & 255, 255 * expected.blue, 2);
}

TEST(PainterTest, PngIsWhiteOutsideAndColouredByAngleInside) {
  TemporaryFolder folder;
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {});
  const std::string path = folder.Path("square.png");
  ASSERT_TRUE(WritePicture(*scene, 800, PictureFormat::kPng, path).ok());
  EXPECT_EQ(BigEndian(folder.Read("square.png"), 16), 800u);

  const Picture picture(path);
  EXPECT_EQ(picture.At(2, 2), 0xffffffu);
  EXPECT_EQ(picture.At(797, picture.height() - 3), 0xffffffu);
  ExpectColour(picture.At(500, picture.height() / 2 + 60), RampColour(26.565 / 60));
}

TEST(PainterTest, RegionsHaveColoursAndTheBoundaryIsDark) {
  TemporaryFolder folder;
  const absl::StatusOr<Scene> scene = MakeScene(TwoRegions().View(), {});
  const std::string path = folder.Path("regions.png");
  ASSERT_TRUE(WritePicture(*scene, 800, PictureFormat::kPng, path).ok());
  const Picture picture(path);
  const int middle = picture.height() / 2;
  ExpectColour(picture.At(500, middle + 60), CategoryColour(1));
  ExpectColour(picture.At(200, middle - 60), CategoryColour(0));
  // Down the left of the middle, from white through both triangles to white: the diagonal and the southern side are
  // dark, the northern side has no tag.
  std::vector<int> dark;
  for (int y = 0; y < picture.height(); ++y) {
    if ((picture.At(250, y) & 0xff) < 60 && (picture.At(250, y) >> 8 & 0xff) < 60) {
      dark.push_back(y);
    }
  }
  ASSERT_FALSE(dark.empty());
  EXPECT_GT(dark.front(), middle);
  EXPECT_GT(dark.back() - dark.front(), 60);
}

TEST(PainterTest, ManyRegionsWithLongNamesAreNamedAsFarAsThereIsRoom) {
  TemporaryFolder folder;
  formats::Mesh mesh = TwoRegions();
  for (int i = 10; i < 300; ++i) {
    mesh.regions.push_back({.id = i, .name = "Bodensee, \u00dcberlinger See " + std::to_string(i)});
  }
  const absl::StatusOr<Scene> scene = MakeScene(mesh.View(), {});
  EXPECT_TRUE(WritePicture(*scene, kMinWidth, PictureFormat::kPng, folder.Path("many.png")).ok());
  EXPECT_TRUE(WritePicture(*scene, 800, PictureFormat::kSvg, folder.Path("many.svg")).ok());
}

TEST(PainterTest, SizesStayWithinBounds) {
  TemporaryFolder folder;
  for (const double height : {1e-3, 1.0, 1e3}) {
    formats::Mesh strip = Square();
    strip.points[5] = strip.points[7] = height;
    const absl::StatusOr<Scene> scene = MakeScene(strip.View(), {});
    ASSERT_TRUE(WritePicture(*scene, kMinWidth, PictureFormat::kPng, folder.Path("strip.png")).ok());
    const std::string png = folder.Read("strip.png");
    EXPECT_EQ(BigEndian(png, 16), static_cast<uint32_t>(kMinWidth));
    EXPECT_LE(BigEndian(png, 20), 2u * kMinWidth + 100);
  }
}

TEST(PainterTest, Svg) {
  TemporaryFolder folder;
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {});
  ASSERT_TRUE(WritePicture(*scene, 640, PictureFormat::kSvg, folder.Path("square.svg")).ok());
  const std::string svg = folder.Read("square.svg");
  EXPECT_THAT(svg, StartsWith("<?xml"));
  EXPECT_THAT(svg, HasSubstr("width=\"640px\""));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
}

TEST(PainterTest, PdfIsTheSameAtAnyTime) {
  TemporaryFolder folder;
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {});
  ASSERT_TRUE(WritePicture(*scene, 640, PictureFormat::kPdf, folder.Path("square.pdf")).ok());
  const std::string pdf = folder.Read("square.pdf");
  EXPECT_THAT(pdf, StartsWith("%PDF-1."));
  EXPECT_THAT(pdf, HasSubstr("/MediaBox [ 0 0 640 "));
  EXPECT_THAT(pdf, testing::Not(HasSubstr("CreationDate")));
}

TEST(PainterTest, Errors) {
  const absl::StatusOr<Scene> scene = MakeScene(Square().View(), {});
  EXPECT_EQ(WritePicture(*scene, 640, PictureFormat::kPng, "/dev/full").code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(WritePicture(*scene, 640, PictureFormat::kPng, "/none/a.png").code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(PictureFormatOf("a.gif").ok());
  EXPECT_EQ(*PictureFormatOf("a.SVG"), PictureFormat::kSvg);
  EXPECT_EQ(*PictureFormatOf("a.pdf"), PictureFormat::kPdf);
}

}  // namespace
}  // namespace wellspace::render
