// The simplex of a point against the definition, and barycentric coordinates.
#include "core/simplex/locator.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "core/features/features.h"
#include "core/mesh/mesh_locator.h"
#include "core/meshers/mesher.h"
#include "gtest/gtest.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

std::vector<double> RandomPoints(int dimension, size_t count, uint64_t seed) {
  test::SplitMix64 random(seed);
  std::vector<double> points(count * dimension);
  std::ranges::generate(points, [&] { return random.Unit(); });
  return points;
}

Mesh MeshOf(int dimension, size_t count, double scale = 1) {
  RunContext context;
  MeshParameters parameters{.dimension = dimension};
  std::vector<double> points = RandomPoints(dimension, count, 7);
  for (double& x : points) {
    x *= scale;
  }
  return MeshPoints(parameters, points, context).value();
}

std::unique_ptr<MeshLocator> LocatorOf(const Mesh& mesh) {
  Mesh copy;
  copy.dimension = mesh.dimension;
  copy.points = mesh.points;
  copy.simplices = mesh.simplices;
  return MeshLocator::Create(std::move(copy), RunContext()).value();
}

template <int D>
Point<D> At(std::span<const double> rows, size_t i) {
  Point<D> p;
  std::copy_n(&rows[i * D], D, p.begin());
  return p;
}

// The first simplex that has `x`, by a look at each with exact signs.
template <int D>
uint32_t FirstWith(const Mesh& mesh, const Point<D>& x) {
  for (size_t s = 0; s < mesh.simplex_count(); ++s) {
    Simplex<D> corners;
    for (int i = 0; i <= D; ++i) {
      corners[i] = At<D>(mesh.points, mesh.simplices[s * (D + 1) + i]);
    }
    bool has = true;
    for (int i = 0; i <= D && has; ++i) {
      Simplex<D> with = corners;
      with[i] = x;
      has = Orientation<D>(with).sign != Sign::kNegative;
    }
    if (has) {
      return static_cast<uint32_t>(s);
    }
  }
  return kNoSimplex;
}

// Places inside, on faces of all dimensions, and outside.
template <int D>
std::vector<double> Places(const Mesh& mesh, size_t count) {
  std::vector<double> places = RandomPoints(D, count, 3);
  for (size_t i = 0; i < places.size(); ++i) {
    const size_t axis = i % D;
    places[i] = mesh.domain_low[axis] +
                (1.2 * places[i] - 0.1) * (mesh.domain_high[axis] - mesh.domain_low[axis]);  // a part is outside
  }
  test::SplitMix64 random(5);
  for (size_t k = 0; k < count; ++k) {
    // Means of some corners of a simplex, of which many are on a face exactly.
    const size_t s = random.Below(mesh.simplex_count());
    const size_t corners = random.Below(2) == 0 ? 1 : 2;
    Point<D> mean{};
    for (size_t i = 0; i < corners; ++i) {
      const Point<D> p = At<D>(mesh.points, mesh.simplices[s * (D + 1) + random.Below(D + 1)]);
      for (int axis = 0; axis < D; ++axis) {
        mean[axis] += p[axis] / static_cast<double>(corners);
      }
    }
    places.insert(places.end(), mean.begin(), mean.end());
  }
  return places;
}

template <int D>
void ExpectLocated(const Mesh& mesh, const std::vector<double>& places) {
  const absl::StatusOr<LocatedPoints> located = LocatorOf(mesh)->Locate(places, RunContext());
  ASSERT_TRUE(located.ok()) << located.status();
  size_t inside = 0;
  const double size = mesh.domain_high[0] - mesh.domain_low[0];
  for (size_t i = 0; i < places.size() / D; ++i) {
    const Point<D> x = At<D>(places, i);
    const uint32_t simplex = located->simplices[i];
    ASSERT_EQ(simplex, FirstWith<D>(mesh, x)) << i;
    const double* coordinates = &located->coordinates[i * (D + 1)];
    if (simplex == kNoSimplex) {
      EXPECT_EQ(std::accumulate(coordinates, coordinates + D + 1, 0.0), 0) << i;
      continue;
    }
    ++inside;
    EXPECT_NEAR(std::accumulate(coordinates, coordinates + D + 1, 0.0), 1, 1e-14) << i;
    Point<D> mean{};
    for (int k = 0; k <= D; ++k) {
      const uint32_t vertex = located->vertices[i * (D + 1) + k];
      EXPECT_EQ(vertex, mesh.simplices[size_t{simplex} * (D + 1) + k]);
      EXPECT_GE(coordinates[k], 0);
      for (int axis = 0; axis < D; ++axis) {
        mean[axis] += coordinates[k] * mesh.points[size_t{vertex} * D + axis];
      }
    }
    for (int axis = 0; axis < D; ++axis) {
      EXPECT_NEAR(mean[axis] / size, x[axis] / size, 1e-12) << i;
    }
  }
  EXPECT_GT(inside, places.size() / D / 4);
}

TEST(Locator, FindsTheFirstSimplexThatHasAPoint) {
  const Mesh plane = MeshOf(2, 300);
  ExpectLocated<2>(plane, Places<2>(plane, 500));
  const Mesh space = MeshOf(3, 100);
  ExpectLocated<3>(space, Places<3>(space, 300));
  const Mesh four = MeshOf(4, 10);
  ExpectLocated<4>(four, Places<4>(four, 60));
  const Mesh five = MeshOf(5, 3);
  ExpectLocated<5>(five, Places<5>(five, 20));
}

TEST(Locator, VerticesHaveOneCoordinateThatIsOne) {
  const Mesh mesh = MeshOf(3, 100);
  const LocatedPoints located =
      LocatorOf(mesh)->Locate(std::vector(mesh.points.begin(), mesh.points.end()), RunContext()).value();
  for (uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    for (size_t k = 4 * size_t{v}; k < 4 * size_t{v} + 4; ++k) {
      EXPECT_EQ(located.coordinates[k], located.vertices[k] == v ? 1 : 0);
    }
  }
}

TEST(Locator, LengthsMayBeOfAnySize) {
  for (const double scale : {0x1p-900, 0x1p-340, 0x1p340, 0x1p900}) {
    const Mesh mesh = MeshOf(3, 30, scale);
    ExpectLocated<3>(mesh, Places<3>(mesh, 50));
  }
}

TEST(Locator, HolesHaveNoSimplex) {
  const std::vector<double> points = {0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 3, 1, 3, 3, 1, 3};
  const std::vector<uint32_t> ends = {0, 1, 1, 2, 2, 3, 3, 0, 4, 5, 5, 6, 6, 7, 7, 4};
  FaceSeed hole;
  hole.at = {2, 2};
  hole.is_hole = true;
  const std::vector<FaceSeed> seeds = {hole};
  Features features;
  features.ends = ends;
  features.seeds = seeds;
  features.faces = FaceRule::kHoles;
  RunContext context;
  const Mesh mesh = MeshPoints({.dimension = 2, .max_circumradius = 0.3}, {points, features}, context).value();
  std::vector<double> places = Places<2>(mesh, 400);
  ExpectLocated<2>(mesh, places);
  const LocatedPoints located = LocatorOf(mesh)->Locate(std::vector<double>{2, 2, 1, 2, 5, 5}, RunContext()).value();
  EXPECT_EQ(located.simplices[0], kNoSimplex);
  EXPECT_NE(located.simplices[1], kNoSimplex) << "on the boundary of the hole";
  EXPECT_EQ(located.simplices[2], kNoSimplex);
}

TEST(Locator, NumbersThatAreNoneAreRefused) {
  const std::unique_ptr<MeshLocator> locator = LocatorOf(MeshOf(2, 10));
  const auto located = locator->Locate(std::vector<double>{0, 0, 1, std::nan("")}, RunContext());
  EXPECT_EQ(located.status().message(), "points[1]: coordinate 1 is nan; a finite number is needed");
  EXPECT_TRUE(locator->Locate({}, RunContext()).value().simplices.empty());
}

TEST(Locator, AMeshOfNothingHasNoPoint) {
  Mesh mesh;
  mesh.dimension = 3;
  EXPECT_EQ(LocatorOf(mesh)->Locate(std::vector<double>{0, 0, 0}, RunContext())->simplices[0], kNoSimplex);
  mesh.dimension = 7;
  EXPECT_EQ(MeshLocator::Create(std::move(mesh), RunContext()).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(Locator, CanBeCancelled) {
  RunContext context;
  context.Cancel();
  EXPECT_EQ(MeshLocator::Create(MeshOf(2, 10), context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
