#include "core/simplex/quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/simplex/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/meshes.h"

namespace wellspace::core {
namespace {

using test::ConeOverUnitBox;
using test::KuhnGrid;
using test::Seed;
using test::SplitMix64;
using test::TestMesh;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = M_PI / 180;

template <int D>
Simplex<D> RandomSimplex(SplitMix64& random) {
  Simplex<D> simplex;
  for (Point<D>& p : simplex) {
    for (double& x : p) {
      x = random.Unit();
    }
  }
  return simplex;
}

// Two opposite edges of length 2 at right angles, at a distance of 2 h: a sliver for small h.
Simplex<3> Sliver(double h) { return {Point<3>{1, 0, h}, Point<3>{-1, 0, h}, Point<3>{0, 1, -h}, Point<3>{0, -1, -h}}; }

TEST(QualityTest, EquilateralTriangle) {
  const Simplex<2> simplex = {Point<2>{0, 0}, Point<2>{2, 0}, Point<2>{1, std::sqrt(3.0)}};
  EXPECT_NEAR(RadiusEdgeRatio<2>(simplex), 1 / std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(Angles<2>(simplex).min_deg, 60, 1e-11);
  EXPECT_NEAR(Angles<2>(simplex).max_deg, 60, 1e-11);
}

TEST(QualityTest, ObtuseTriangle) {
  // Angles 30, 30 and 120 degrees; the circumradius equals the two short edges.
  const Simplex<2> simplex = {Point<2>{-std::sqrt(3.0), 0}, Point<2>{std::sqrt(3.0), 0}, Point<2>{0, 1}};
  EXPECT_NEAR(RadiusEdgeRatio<2>(simplex), 1, 1e-14);
  EXPECT_NEAR(Angles<2>(simplex).min_deg, 30, 1e-11);
  EXPECT_NEAR(Angles<2>(simplex).max_deg, 120, 1e-11);
}

TEST(QualityTest, RegularTetrahedron) {
  const Simplex<3> simplex = {Point<3>{0, 0, 0}, Point<3>{1, 1, 0}, Point<3>{1, 0, 1}, Point<3>{0, 1, 1}};
  EXPECT_NEAR(RadiusEdgeRatio<3>(simplex), std::sqrt(0.375), 1e-14);
  EXPECT_NEAR(Angles<3>(simplex).min_deg, std::acos(1.0 / 3) / kDegree, 1e-11);
  EXPECT_NEAR(Angles<3>(simplex).max_deg, std::acos(1.0 / 3) / kDegree, 1e-11);
}

TEST(QualityTest, CornerOfTheCube) {
  // Three dihedral angles of 90 degrees, three between a coordinate plane and x + y + z = 1.
  const Simplex<3> simplex = {Point<3>{0, 0, 0}, Point<3>{1, 0, 0}, Point<3>{0, 1, 0}, Point<3>{0, 0, 1}};
  EXPECT_NEAR(RadiusEdgeRatio<3>(simplex), std::sqrt(0.75), 1e-14);
  EXPECT_NEAR(Angles<3>(simplex).min_deg, std::acos(1 / std::sqrt(3.0)) / kDegree, 1e-11);
  EXPECT_NEAR(Angles<3>(simplex).max_deg, 90, 1e-11);
}

TEST(QualityTest, SliversHoweverFlat) {
  for (double h = 0.5; h > 1e-30; h /= 8) {
    const Simplex<3> simplex = Sliver(h);
    const double shortest = std::min(2.0, std::sqrt(2 + 4 * h * h));
    EXPECT_NEAR(RadiusEdgeRatio<3>(simplex) / (std::sqrt(1 + h * h) / shortest), 1, 1e-10) << "h = " << h;
    const double smallest = std::atan(2 * h * std::sqrt(2 + 4 * h * h));
    const double largest = M_PI - 2 * std::atan(2 * h);
    EXPECT_NEAR(Angles<3>(simplex).min_deg, smallest / kDegree, 1e-11) << "h = " << h;
    EXPECT_NEAR(Angles<3>(simplex).max_deg, largest / kDegree, 1e-11) << "h = " << h;
  }
}

TEST(QualityTest, NeedlesHoweverThin) {
  for (double w = 0.5; w > 1e-140; w /= 1024) {
    const Simplex<2> needle = {Point<2>{0, 0}, Point<2>{w, 0}, Point<2>{w / 2, 1}};
    const double radius = (1 + w * w / 4) / 2;
    EXPECT_NEAR(RadiusEdgeRatio<2>(needle) / (radius / w), 1, 1e-10) << "w = " << w;
    EXPECT_NEAR(Angles<2>(needle).min_deg, 2 * std::atan(w / 2) / kDegree, 1e-11) << "w = " << w;
  }
}

TEST(QualityTest, FlatSimplices) {
  const Simplex<2> line = {Point<2>{0, 0}, Point<2>{1, 1}, Point<2>{3, 3}};
  EXPECT_EQ(RadiusEdgeRatio<2>(line), kInfinity);
  EXPECT_EQ(Angles<2>(line).min_deg, 0);
  EXPECT_EQ(Angles<2>(line).max_deg, 180);
  EXPECT_EQ(RadiusEdgeRatio<3>(Sliver(0)), kInfinity);
  EXPECT_EQ(Angles<3>(Sliver(0)).min_deg, 0);
  EXPECT_EQ(Angles<3>(Sliver(0)).max_deg, 180);
  const Simplex<3> equal = {Point<3>{1, 2, 3}, Point<3>{1, 2, 3}, Point<3>{1, 2, 3}, Point<3>{1, 2, 3}};
  EXPECT_EQ(RadiusEdgeRatio<3>(equal), kInfinity);
  EXPECT_EQ(Angles<3>(equal).min_deg, 0);
}

template <typename T>
class TypedQualityTest : public ::testing::Test {};
template <int N>
struct Dimension {
  static constexpr int kValue = N;
};
using Dimensions = ::testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(TypedQualityTest, Dimensions);

TYPED_TEST(TypedQualityTest, PowersOfTwoDoNotChangeTheQuality) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(4);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 100; ++round) {
    const Simplex<D> simplex = RandomSimplex<D>(random);
    for (const int exponent : {-900, -400, 400, 900}) {
      Simplex<D> scaled = simplex;
      for (Point<D>& p : scaled) {
        for (double& x : p) {
          x = std::scalbn(x, exponent);
        }
      }
      EXPECT_EQ(RadiusEdgeRatio<D>(scaled), RadiusEdgeRatio<D>(simplex));
      EXPECT_EQ(Angles<D>(scaled).min_deg, Angles<D>(simplex).min_deg);
      EXPECT_EQ(Angles<D>(scaled).max_deg, Angles<D>(simplex).max_deg);
    }
  }
}

TYPED_TEST(TypedQualityTest, OrientationDoesNotMatter) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(5);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 100; ++round) {
    const Simplex<D> simplex = RandomSimplex<D>(random);
    Simplex<D> mirrored = simplex;
    std::swap(mirrored[0], mirrored[1]);
    EXPECT_NEAR(RadiusEdgeRatio<D>(mirrored) / RadiusEdgeRatio<D>(simplex), 1, 4e-10);
    EXPECT_NEAR(Angles<D>(mirrored).min_deg, Angles<D>(simplex).min_deg, 1e-7);
    EXPECT_NEAR(Angles<D>(mirrored).max_deg, Angles<D>(simplex).max_deg, 1e-7);
  }
}

// Both ways to the circumcentre, in doubles and exact, on simplices from round to flat.
TYPED_TEST(TypedQualityTest, CircumcentreAgreesWithTheExactOne) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(6);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 1000; ++round) {
    // The last corner comes near to the plane of the others, whatever its direction.
    Simplex<D> simplex = RandomSimplex<D>(random);
    const double height = std::pow(10.0, -14 * random.Unit());
    for (int k = 0; k < D; ++k) {
      double mean = 0;
      for (int i = 0; i < D; ++i) {
        mean += simplex[i][k] / D;
      }
      simplex[D][k] = mean + height * (simplex[D][k] - mean);
    }
    const Point<D> offset = CircumcentreOffset<D>(simplex);
    const Point<D> exact = ExactCircumcentreOffset<D>(simplex);
    const double radius = std::sqrt(NormSq<D>(exact));
    EXPECT_LE(std::sqrt(DistanceSq<D>(offset, exact)), 1e-10 * radius);
  }
}

TEST(MeasureQualityTest, KuhnGrids) {
  const TestMesh square = KuhnGrid(2, 5);
  const QualityReport report = MeasureQuality(square.View());
  EXPECT_EQ(report.vertices, 36u);
  EXPECT_EQ(report.simplices, 50u);
  EXPECT_NEAR(report.max_radius_edge, std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(report.min_angle_deg, 45, 1e-11);
  EXPECT_NEAR(report.max_angle_deg, 90, 1e-11);

  const TestMesh cube = KuhnGrid(3, 4);
  const QualityReport report3 = MeasureQuality(cube.View());
  EXPECT_EQ(report3.vertices, 125u);
  EXPECT_EQ(report3.simplices, 384u);
  EXPECT_NEAR(report3.max_radius_edge, std::sqrt(0.75), 1e-14);
  EXPECT_NEAR(report3.min_angle_deg, 45, 1e-11);
  EXPECT_NEAR(report3.max_angle_deg, 90, 1e-11);
  EXPECT_EQ(std::accumulate(report3.angle_histogram.begin(), report3.angle_histogram.end(), uint64_t{0}), 384u);
}

TEST(MeasureQualityTest, HistogramCountsSmallestAngles) {
  // The smallest angles: below the apex atan(1/2) = 26.57 degrees, at its sides atan(2/3) = 33.69, above it atan(3/2)
  // = 56.31; bins are 60 / 18 degrees wide.
  const QualityReport report = MeasureQuality(ConeOverUnitBox({0.5, 0.25}).View());
  EXPECT_EQ(report.simplices, 4u);
  EXPECT_EQ(report.angle_histogram[7], 1u);
  EXPECT_EQ(report.angle_histogram[10], 2u);
  EXPECT_EQ(report.angle_histogram[16], 1u);
  // A regular triangle or tetrahedron belongs to the last bin, however its angles are rounded.
  const TestMesh regular = {3, {0, 0, 0, 1, 0, 1, 1, 1, 0, 0, 1, 1}, {0, 1, 2, 3}};
  EXPECT_EQ(MeasureQuality(regular.View()).angle_histogram[kHistogramBins - 1], 1u);
}

TEST(MeasureQualityTest, RefusedMeshHasCountsOnly) {
  TestMesh mesh = KuhnGrid(2, 2);
  mesh.simplices[4] = 1000;
  const QualityReport report = MeasureQuality(mesh.View());
  EXPECT_EQ(report.vertices, 9u);
  EXPECT_EQ(report.simplices, 8u);
  EXPECT_EQ(report.max_radius_edge, 0);
  mesh.dimension = 0;
  EXPECT_EQ(MeasureQuality(mesh.View()).simplices, 0u);
}

}  // namespace
}  // namespace wellspace::core
