// The mesh against CGAL: the Delaunay triangulation of the mesh's vertices has to be the mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/cgal_oracle.h"
#include "tests/support/clouds.h"
#include "tests/support/parameters.h"

namespace wellspace::core {
namespace {

using test::CgalDelaunay;
using test::CgalInSphere;
using test::CgalOrientation;
using test::MakeCloud;
using test::TestMesh;

using SimplexSet = std::vector<std::vector<uint32_t>>;

template <int D>
Point<D> VertexOf(const MeshView& mesh, uint32_t v) {
  Point<D> p;
  std::copy_n(mesh.points.begin() + static_cast<std::ptrdiff_t>(v) * D, D, p.begin());
  return p;
}

// The simplices of a triangulation, each ascending, sorted; those first whose circumsphere passes through no vertex of
// a neighbour. In a Delaunay triangulation these `strict` ones are in every Delaunay triangulation of the vertices.
struct Classified {
  SimplexSet strict;
  SimplexSet tied;
  size_t violations = 0;  // neighbours strictly inside, by CGAL's predicate
};

template <int D>
Classified Classify(const MeshView& mesh) {
  const size_t corners = D + 1;
  const size_t count = mesh.simplices.size() / corners;
  std::map<std::vector<uint32_t>, std::vector<std::pair<size_t, uint32_t>>> facets;  // to simplex and apex
  for (size_t s = 0; s < count; ++s) {
    for (size_t skip = 0; skip < corners; ++skip) {
      std::vector<uint32_t> facet(mesh.simplices.begin() + static_cast<std::ptrdiff_t>(s * corners),
                                  mesh.simplices.begin() + static_cast<std::ptrdiff_t>((s + 1) * corners));
      const uint32_t apex = facet[skip];
      facet.erase(facet.begin() + static_cast<std::ptrdiff_t>(skip));
      std::sort(facet.begin(), facet.end());
      facets[facet].emplace_back(s, apex);
    }
  }
  Classified classified;
  std::vector<bool> tied(count, false);
  for (const auto& [facet, sides] : facets) {
    if (sides.size() != 2) {
      continue;
    }
    for (const int side : {0, 1}) {
      const size_t s = sides[side].first;
      Simplex<D> simplex;
      for (size_t i = 0; i < corners; ++i) {
        simplex[i] = VertexOf<D>(mesh, mesh.simplices[s * corners + i]);
      }
      const Sign sign = CgalInSphere<D>(simplex, VertexOf<D>(mesh, sides[1 - side].second));
      classified.violations += sign == Sign::kPositive ? 1 : 0;
      tied[s] = tied[s] || sign == Sign::kZero;
    }
  }
  for (size_t s = 0; s < count; ++s) {
    std::vector<uint32_t> simplex(mesh.simplices.begin() + static_cast<std::ptrdiff_t>(s * corners),
                                  mesh.simplices.begin() + static_cast<std::ptrdiff_t>((s + 1) * corners));
    std::sort(simplex.begin(), simplex.end());
    (tied[s] ? classified.tied : classified.strict).push_back(std::move(simplex));
  }
  std::sort(classified.strict.begin(), classified.strict.end());
  std::sort(classified.tied.begin(), classified.tied.end());
  return classified;
}

template <int D>
void CompareWithCgal(const std::vector<double>& cloud, bool general_position) {
  const MeshParameters parameters = test::InUnitBox(D);
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const MeshView ours{D, mesh->points, mesh->simplices};
  const TestMesh oracle = CgalDelaunay(D, mesh->points);
  const Classified our_set = Classify<D>(ours);
  const Classified oracle_set = Classify<D>(oracle.View());

  EXPECT_EQ(our_set.violations, 0u);
  EXPECT_EQ(our_set.strict, oracle_set.strict);
  if (general_position) {
    EXPECT_TRUE(our_set.tied.empty());
    EXPECT_TRUE(oracle_set.tied.empty());
  }
  // Both fill the box exactly; and our validators accept a triangulation that is not ours.
  EXPECT_TRUE(ValidateVolume(ours).ok()) << ValidateVolume(ours);
  for (const absl::Status& status :
       {ValidateIndices(oracle.View()), ValidateOrientation(oracle.View()), ValidateTopology(oracle.View()),
        ValidateVolume(oracle.View()), ValidateDelaunay(oracle.View())}) {
    EXPECT_TRUE(status.ok()) << status;
  }
}

using CloudCase = std::tuple<std::string_view, int>;

std::string NameOf(const ::testing::TestParamInfo<CloudCase>& param) {
  return test::CloudName(std::get<0>(param.param), std::get<1>(param.param));
}

class OracleTest : public ::testing::TestWithParam<CloudCase> {};

INSTANTIATE_TEST_SUITE_P(Clouds, OracleTest,
                         ::testing::Combine(::testing::ValuesIn(test::AllKinds()), ::testing::Values(2, 3)), NameOf);

TEST_P(OracleTest, SimplicesAreThoseOfCgal) {
  const auto& [kind, dimension] = GetParam();
  const std::vector<double> cloud = MakeCloud(kind, dimension, dimension == 2 ? 500 : 150);
  // Away from the faces, on which snapped points may be cocircular by symmetry, random points have no ties.
  const bool general_position = kind == "inner";
  if (dimension == 2) {
    CompareWithCgal<2>(cloud, general_position);
  } else {
    CompareWithCgal<3>(cloud, general_position);
  }
}

template <typename T>
class PredicateOracleTest : public ::testing::Test {};
template <int N>
struct Dimension {
  static constexpr int kValue = N;
};
using Dimensions = ::testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(PredicateOracleTest, Dimensions);

// Points of a sphere or a plane as doubles round them: a few ulps from degenerate, so that both stages have to decide.
TYPED_TEST(PredicateOracleTest, SignsAgreeNearDegeneracy) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = test::Seed(10);
  SCOPED_TRACE(seed);
  test::SplitMix64 random(seed);
  int filtered = 0;
  int exact = 0;
  for (int round = 0; round < 3000; ++round) {
    const double far = std::pow(10.0, -8 * random.Unit());
    std::array<Point<D>, D + 2> points;
    for (Point<D>& p : points) {
      double norm_sq = 0;
      for (double& x : p) {
        x = random.Gauss();
        norm_sq += x * x;
      }
      for (double& x : p) {
        x = 0.5 + (random.Below(20) == 0 ? 1 + far : 1) * 0.35 * x / std::sqrt(norm_sq);
      }
    }
    Simplex<D> simplex;
    std::copy_n(points.begin(), D + 1, simplex.begin());
    const MeasuredSign in_sphere = InSphere<D>(simplex, points[D + 1]);
    // CGAL's oriented side is that of a positive simplex, negated for a negative one, as is ours.
    EXPECT_EQ(in_sphere.sign, CgalInSphere<D>(simplex, points[D + 1])) << round;
    (in_sphere.stage == Stage::kFilter ? filtered : exact)++;
    // The last corner moves into the plane of the others, up to rounding.
    for (int k = 0; k < D; ++k) {
      simplex[D][k] =
          0.5 * simplex[0][k] + (D == 2 ? 0.5 : 0.25) * simplex[1][k] + (D == 2 ? 0 : 0.25 * simplex[D - 1][k]);
    }
    const MeasuredSign orientation = Orientation<D>(simplex);
    EXPECT_EQ(orientation.sign, CgalOrientation<D>(simplex)) << round;
    (orientation.stage == Stage::kFilter ? filtered : exact)++;
  }
  EXPECT_GT(filtered, 100);
  EXPECT_GT(exact, 100);
}

// The pumped mesh is CGAL's regular triangulation of its weights, where no tie leaves a choice: the points are in
// general position but for those on the faces of the box, and there the facets' simplices need not be the same.
TEST(WeightedOracleTest, APumpedMeshIsTheRegularTriangulation) {
  MeshParameters parameters{.dimension = 3};
  parameters.domain_low = test::UnitLow(3);
  parameters.domain_high = test::UnitHigh(3);
  parameters.min_dihedral = 0;
  parameters.pump_weights = true;
  RunContext context;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, MakeCloud("uniform", 3, 500), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_GT(mesh->statistics.weighted_vertices, 50);
  const auto sorted = [](std::span<const uint32_t> simplices) {
    SimplexSet all;
    for (size_t at = 0; at < simplices.size(); at += 4) {
      std::vector<uint32_t> simplex(simplices.begin() + static_cast<std::ptrdiff_t>(at),
                                    simplices.begin() + static_cast<std::ptrdiff_t>(at) + 4);
      std::sort(simplex.begin(), simplex.end());
      all.push_back(std::move(simplex));
    }
    std::sort(all.begin(), all.end());
    return all;
  };
  const SimplexSet ours = sorted(mesh->simplices);
  const SimplexSet theirs = sorted(test::CgalRegular(mesh->points, mesh->weights).simplices);
  SimplexSet only_ours;
  std::set_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(), std::back_inserter(only_ours));
  EXPECT_EQ(only_ours.size(), 0) << "of " << ours.size();
}

}  // namespace
}  // namespace wellspace::core
