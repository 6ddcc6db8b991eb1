// Laws of EstimateSize, and its accuracy on small clouds; estimate_long_test.cc has the large ones.
#include "core/estimate/estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/estimate/nearest_points.h"
#include "core/meshers/mesher.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::MakeStructure;

template <int D>
SizeEstimate Estimate(const QueryStructure<D>& structure, const MeshCriteria<D>& demands) {
  RunContext context;
  const absl::StatusOr<SizeEstimate> estimate = EstimateSize<D>(structure, demands, context);
  EXPECT_TRUE(estimate.ok()) << estimate.status();
  return estimate.value_or(SizeEstimate());
}

template <int D>
MeshCriteria<D> RadiusEdge(double rho) {
  MeshCriteria<D> demands;
  demands.rho = rho;
  return demands;
}

// The larger one over the smaller one.
double Factor(double a, double b) { return std::max(a, b) / std::min(a, b); }

template <typename T>
class NearestPointsTest : public ::testing::Test {};
TYPED_TEST_SUITE(NearestPointsTest, test::Dimensions);

TYPED_TEST(NearestPointsTest, AgreesWithALookAtAll) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = test::Seed(1975);
  SCOPED_TRACE("seed " + std::to_string(seed));
  test::SplitMix64 random(seed);
  RunContext context;
  for (const std::string_view kind : test::AllKinds()) {
    SCOPED_TRACE(std::string(kind));
    const std::vector<Point<D>> points = test::SortedCloud<D>(kind, 100);
    NearestPoints<D> nearest;
    const auto passed_over = static_cast<uint32_t>(random.Below(100));
    ASSERT_TRUE(nearest.Build(points, {passed_over}, context).ok());
    for (int i = 0; i < 50; ++i) {
      Point<D> x;
      for (double& coordinate : x) {
        coordinate = random.Unit();
      }
      const bool is_point = i % 2 == 0 && !points.empty();
      const size_t but = is_point ? random.Below(points.size()) : points.size();
      x = is_point ? points[but] : x;
      std::vector<double> distances(2, std::numeric_limits<double>::infinity());
      for (size_t k = 0; k < points.size(); ++k) {
        distances.push_back(k == but || k == passed_over ? distances[0] : DistanceSq<D>(x, points[k]));
      }
      std::sort(distances.begin(), distances.end());
      const NearestTwo two = nearest.Nearest(x, but);
      EXPECT_EQ(two.first_sq, distances[0]);
      EXPECT_EQ(two.second_sq, distances[1]);
      EXPECT_TRUE(points.size() < 2 || DistanceSq<D>(x, points[two.first]) == two.first_sq);
    }
  }
}

template <typename T>
class EstimateTest : public ::testing::Test {};
TYPED_TEST_SUITE(EstimateTest, test::Dimensions);

// Guarantee (1), on clouds small enough to be meshed here.
TYPED_TEST(EstimateTest, IsNearWhatMeshingMakes) {
  constexpr int D = TypeParam::kValue;
  const std::vector<double> rhos = D == 2 ? std::vector{1.0, DefaultRho(2), 5.0, 1000.0} : std::vector{1.2, 2.0, 5.0};
  for (const std::string_view kind : test::kReferenceKinds) {
    const size_t n = D == 2 ? 500 : 100;
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, n));
    for (const double rho : rhos) {
      SCOPED_TRACE(std::string(kind) + ", rho " + std::to_string(rho));
      MeshParameters parameters;
      parameters.dimension = D;
      parameters.rho = rho;
      parameters.min_dihedral = 0;
      parameters.domain_low = test::UnitLow(D);
      parameters.domain_high = test::UnitHigh(D);
      RunContext context;
      const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, test::MakeCloud(kind, D, n), context);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      const SizeEstimate estimate = Estimate<D>(structure, RadiusEdge<D>(rho));
      const double most = rho == DefaultRho(D) ? 1.5 : 2;
      EXPECT_LE(Factor(estimate.vertices, static_cast<double>(mesh->vertex_count())), most)
          << estimate.vertices << " for " << mesh->vertex_count() << " vertices";
      EXPECT_LE(Factor(estimate.simplices, static_cast<double>(mesh->simplex_count())), most)
          << estimate.simplices << " for " << mesh->simplex_count() << " simplices";
    }
  }
}

TYPED_TEST(EstimateTest, TendsToTheInputAndTheBoxAsRhoGrows) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"inner", "clusters", "grid"}) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, 1000));
    const SizeEstimate estimate = Estimate<D>(structure, RadiusEdge<D>(1e6));
    EXPECT_LE(estimate.vertices, 1.15 * structure.vertex_count());
  }
  // Two corners of the box are as far apart as its points are from each other: nothing is missing.
  const SizeEstimate empty = Estimate<D>(MakeStructure<D>({}), RadiusEdge<D>(DefaultRho(D)));
  EXPECT_NEAR(empty.vertices, 1 << D, 0.5);
}

// Guarantee (3), and that a looser bound never asks for many more vertices.
TYPED_TEST(EstimateTest, FallsWithRhoDownToWhatThereIs) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::AllKinds()) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, 100));
    double before = 0;
    for (const double rho : {0.9, 1.0, 1.1, 1.3, 1.7, 2.5, 4.0, 20.0, 100.0, 5000.0}) {
      if (rho < MinimumRho(D)) {
        continue;
      }
      const SizeEstimate estimate = Estimate<D>(structure, RadiusEdge<D>(rho));
      EXPECT_GE(estimate.vertices, structure.vertex_count());
      EXPECT_GE(estimate.simplices, 1);
      EXPECT_GE(estimate.bytes, estimate.vertices * D * sizeof(double));
      EXPECT_TRUE(before == 0 || estimate.vertices <= 1.1 * before) << rho;
      before = estimate.vertices;
    }
  }
}

// Guarantee (2).
TYPED_TEST(EstimateTest, IsTheSameEveryTime) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("clusters", 2000));
  const SizeEstimate first = Estimate<D>(structure, RadiusEdge<D>(2));
  const SizeEstimate second = Estimate<D>(structure, RadiusEdge<D>(2));
  EXPECT_EQ(first.vertices, second.vertices);
  EXPECT_EQ(first.simplices, second.simplices);
  EXPECT_EQ(first.bytes, second.bytes);
}

TYPED_TEST(EstimateTest, DoesNotDependOnTheUnitOfLength) {
  constexpr int D = TypeParam::kValue;
  std::vector<Point<D>> points = test::SortedCloud<D>("uniform", 300);
  const SizeEstimate unit = Estimate<D>(MakeStructure<D>(points), RadiusEdge<D>(2));
  Box<D> box = test::UnitBox<D>();
  box.high.fill(0x1p30);
  for (Point<D>& p : points) {
    for (double& x : p) {
      x *= 0x1p30;
    }
  }
  const SizeEstimate scaled = Estimate<D>(MakeStructure<D>(box, std::move(points)), RadiusEdge<D>(2));
  EXPECT_NEAR(scaled.vertices, unit.vertices, 1e-9 * unit.vertices);
  EXPECT_NEAR(scaled.simplices, unit.simplices, 1e-9 * unit.simplices);
}

TYPED_TEST(EstimateTest, LooksAtEveryLeafOfSmallCloudsAndAtEnoughOfLargeOnes) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> small = MakeStructure<D>(test::SortedCloud<D>("uniform", 50));
  ASSERT_LT(small.tree().leaf_count(), 256u);
  EXPECT_EQ(Estimate<D>(small, RadiusEdge<D>(2)).sampling_error, 0);
  const QueryStructure<D> large = MakeStructure<D>(test::SortedCloud<D>("annuli", 5000));
  const double error = Estimate<D>(large, RadiusEdge<D>(2)).sampling_error;
  EXPECT_GT(error, 0);
  EXPECT_LE(error, 0.05);
}

// A glance predicts vertices nearly as well, from fewer leaves.
TYPED_TEST(EstimateTest, AGlanceIsRoughlyRight) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::kReferenceKinds) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, 3000));
    RunContext context;
    const absl::StatusOr<SizeEstimate> glance =
        EstimateSize<D>(structure, RadiusEdge<D>(DefaultRho(D)), context, kGlance);
    ASSERT_TRUE(glance.ok()) << glance.status();
    EXPECT_LE(glance->sampling_error, kGlance.sampling_error);
    EXPECT_LE(Factor(glance->vertices, Estimate<D>(structure, RadiusEdge<D>(DefaultRho(D))).vertices), 2);
  }
}

TYPED_TEST(EstimateTest, SizesAloneAskForVerticesByVolume) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>({});
  MeshCriteria<D> demands = RadiusEdge<D>(2);
  demands.sizes = SizeField<D>(0.04);
  const double coarse = Estimate<D>(structure, demands).vertices;
  demands.sizes = SizeField<D>(0.02);
  const double fine = Estimate<D>(structure, demands).vertices;
  EXPECT_NEAR(fine / coarse, 1 << D, 0.1 * (1 << D));

  // A box of a quarter of the volume, and all of the volume.
  Box<D> half = test::UnitBox<D>();
  half.high.fill(0.5);
  demands.sizes = SizeField<D>(std::numeric_limits<double>::infinity(), {{half, 0.02}});
  const double in_a_box = Estimate<D>(structure, demands).vertices;
  EXPECT_GT(in_a_box, fine / (1 << D));
  EXPECT_LT(in_a_box, fine);
}

TYPED_TEST(EstimateTest, SizesLargerThanTheMeshHasAnywayChangeNothing) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 500));
  MeshCriteria<D> demands = RadiusEdge<D>(2);
  const double without = Estimate<D>(structure, demands).vertices;
  demands.sizes = SizeField<D>(10);
  EXPECT_NEAR(Estimate<D>(structure, demands).vertices, without, 0.02 * without);
}

TYPED_TEST(EstimateTest, WellSpacedVerticesAreMore) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 500));
  MeshCriteria<D> demands = RadiusEdge<D>(DefaultRho(D));
  const double radius_edge = Estimate<D>(structure, demands).vertices;
  demands.criterion = Criterion::kWellSpaced;
  EXPECT_GT(Estimate<D>(structure, demands).vertices, 1.5 * radius_edge);
}

TYPED_TEST(EstimateTest, EndsWhenCancelled) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 100));
  RunContext cancelled;
  cancelled.Cancel();
  EXPECT_EQ(EstimateSize<D>(structure, RadiusEdge<D>(2), cancelled).status().code(), absl::StatusCode::kCancelled);
  RunContext late;
  late.ExceedDeadline();
  EXPECT_EQ(EstimateSize<D>(structure, RadiusEdge<D>(2), late).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(TypicalSizeTest, IsThatOfEvenClouds) {
  for (const int dimension : {2, 3}) {
    for (const int count : {10, 100, 1'000, 10'000}) {
      SCOPED_TRACE(testing::Message() << count << " points in " << dimension << "-D");
      const MeshParameters parameters{.dimension = dimension};
      RunContext context;
      const absl::StatusOr<std::unique_ptr<Mesher>> mesher =
          Mesher::Create(parameters, test::MakeCloud("uniform", dimension, count), context);
      ASSERT_TRUE(mesher.ok()) << mesher.status();
      const absl::StatusOr<MeshEstimate> typical = (*mesher)->EstimateToReserve(parameters, context);
      ASSERT_TRUE(typical.ok()) << typical.status();
      EXPECT_GE(typical->memory_bytes, (*mesher)->Estimate(parameters, context)->memory_bytes);
      ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
      EXPECT_LE(Factor(typical->vertices, (*mesher)->vertex_count()), 1.3);
    }
  }
}

TEST(TypicalSizeTest, IsNotSaidWhereNumbersSayTooLittle) {
  const QueryStructure<2> structure = MakeStructure<2>(test::SortedCloud<2>("uniform", 100));
  const MeshCriteria<2> plain = RadiusEdge<2>(DefaultRho(2));
  EXPECT_TRUE(TypicalSize<2>(structure, plain).has_value());

  MeshCriteria<2> demands = plain;
  demands.rho = 1.2;
  EXPECT_FALSE(TypicalSize<2>(structure, demands).has_value());
  demands = plain;
  demands.criterion = Criterion::kWellSpaced;
  EXPECT_FALSE(TypicalSize<2>(structure, demands).has_value());
  demands = plain;
  const Box<2> box = structure.box();
  demands.sizes = SizeField<2>(box.LongestSide(), {{box, 0.1 * box.LongestSide()}});
  EXPECT_FALSE(TypicalSize<2>(structure, demands).has_value());
}

TEST(TypicalSizeTest, KnowsTheSizeAskedForAndTheShapeOfTheBox) {
  const QueryStructure<2> structure = MakeStructure<2>(test::SortedCloud<2>("uniform", 100));
  MeshCriteria<2> sized = RadiusEdge<2>(DefaultRho(2));
  const double side = structure.box().LongestSide();
  double before = TypicalSize<2>(structure, sized)->vertices;
  for (const double part : {0.1, 0.03, 0.01}) {
    sized.sizes = SizeField<2>(part * side);
    const std::optional<SizeEstimate> size = TypicalSize<2>(structure, sized);
    ASSERT_TRUE(size.has_value()) << part;
    EXPECT_GT(size->vertices, before);
    EXPECT_GE(size->vertices, 0.7 * Estimate<2>(structure, sized).vertices);
    before = size->vertices;
  }
  sized.sizes = SizeField<2>(1e-4 * side);  // of too much memory for a guess
  EXPECT_FALSE(TypicalSize<2>(structure, sized).has_value());
}

}  // namespace
}  // namespace wellspace::core
