// Ratios and angles of simplices against closed forms and eighty digits, in all dimensions.
#include "core/simplex/quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/validate/validate.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
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
TYPED_TEST_SUITE(TypedQualityTest, test::AllDimensions);

TYPED_TEST(TypedQualityTest, RegularSimplex) {
  constexpr int D = TypeParam::kValue;
  Simplex<D> simplex{};
  simplex[0].fill((1 - std::sqrt(D + 1.0)) / D);
  for (int i = 0; i < D; ++i) {
    simplex[i + 1][i] = 1;
  }
  EXPECT_NEAR(RadiusEdgeRatio<D>(simplex), std::sqrt(D / (2 * (D + 1.0))), 1e-14);
  EXPECT_NEAR(Angles<D>(simplex).min_deg, std::acos(1.0 / D) / kDegree, 1e-11);
  EXPECT_NEAR(Angles<D>(simplex).max_deg, std::acos(1.0 / D) / kDegree, 1e-11);
}

TYPED_TEST(TypedQualityTest, CornerOfTheCubeInEveryDimension) {
  // Right angles, and those between a coordinate plane and the plane where the coordinates sum up to 1.
  constexpr int D = TypeParam::kValue;
  Simplex<D> simplex{};
  for (int i = 0; i < D; ++i) {
    simplex[i + 1][i] = 1;
  }
  EXPECT_NEAR(RadiusEdgeRatio<D>(simplex), std::sqrt(D / 4.0), 1e-14);
  EXPECT_NEAR(Angles<D>(simplex).min_deg, std::acos(1 / std::sqrt(D)) / kDegree, 1e-11);
  EXPECT_NEAR(Angles<D>(simplex).max_deg, 90, 1e-11);
}

// The apex of a simplex comes down on the middle of the facet below: the angles at that facet go to zero, some others
// to 180.
TYPED_TEST(TypedQualityTest, FlatInEveryDimension) {
  constexpr int D = TypeParam::kValue;
  Simplex<D> simplex{};
  for (int i = 1; i < D; ++i) {
    simplex[i][i - 1] = 1;
  }
  simplex[D].fill(1.0 / 8);
  for (double h = 0.125; h > 1e-130; h /= 1024) {
    simplex[D][D - 1] = h;
    // The facet opposite to the origin lies in sum x_i + ((1 - (D - 1) / 8) / h) x_(D - 1) = 1 (all i but the last),
    // the one opposite to e_i in x_i = x_(D - 1) / (8 h): the least angle is that of one of them with the base.
    const double to_origin = std::atan(h * std::sqrt(D - 1.0) / (1 - (D - 1) / 8.0));
    const double smallest = std::min(to_origin, std::atan(8 * h));
    EXPECT_NEAR(Angles<D>(simplex).min_deg, smallest / kDegree, 1e-10) << "h = " << h;
    EXPECT_LE(Angles<D>(simplex).max_deg, 180);
    if (h < 1e-6) {
      EXPECT_GT(Angles<D>(simplex).max_deg, 179.99);
    }
    EXPECT_TRUE(std::isfinite(RadiusEdgeRatio<D>(simplex)));
  }
  simplex[D][D - 1] = 0;
  EXPECT_EQ(Angles<D>(simplex).min_deg, 0);
  EXPECT_EQ(Angles<D>(simplex).max_deg, 180);
  EXPECT_EQ(RadiusEdgeRatio<D>(simplex), kInfinity);
  simplex.fill(simplex[0]);
  EXPECT_EQ(Angles<D>(simplex).min_deg, 0);
  EXPECT_EQ(Angles<D>(simplex).max_deg, 180);
  EXPECT_EQ(RadiusEdgeRatio<D>(simplex), kInfinity);
}

using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<80>, boost::multiprecision::et_off>;

// Inverts by elimination; the matrix has to be regular.
template <int D>
std::array<std::array<Wide, D>, D> Inverse(std::array<std::array<Wide, D>, D> m) {
  std::array<std::array<Wide, D>, D> inverse{};
  for (int i = 0; i < D; ++i) {
    inverse[i][i] = 1;
  }
  for (int column = 0; column < D; ++column) {
    int pivot = column;
    for (int row = column; row < D; ++row) {
      pivot = abs(m[row][column]) > abs(m[pivot][column]) ? row : pivot;
    }
    std::swap(m[pivot], m[column]);
    std::swap(inverse[pivot], inverse[column]);
    for (int row = 0; row < D; ++row) {
      if (row == column) {
        continue;
      }
      const Wide factor = m[row][column] / m[column][column];
      for (int k = 0; k < D; ++k) {
        m[row][k] -= factor * m[column][k];
        inverse[row][k] -= factor * inverse[column][k];
      }
    }
  }
  for (int row = 0; row < D; ++row) {
    for (int k = 0; k < D; ++k) {
      inverse[row][k] /= m[row][row];
    }
  }
  return inverse;
}

// With 80 digits, by gradients of barycentric coordinates from an inverse matrix, and arc cosines.
template <int D>
AngleRange OracleAngles(const Simplex<D>& simplex) {
  std::array<std::array<Wide, D>, D> edges;
  for (int i = 0; i < D; ++i) {
    for (int k = 0; k < D; ++k) {
      edges[i][k] = Wide(simplex[i + 1][k]) - simplex[0][k];
    }
  }
  const auto inverse = Inverse<D>(edges);
  std::array<std::array<Wide, D>, D + 1> gradients{};
  for (int i = 0; i < D; ++i) {
    for (int k = 0; k < D; ++k) {
      gradients[i + 1][k] = inverse[k][i];
      gradients[0][k] -= inverse[k][i];
    }
  }
  const auto dot = [](const auto& a, const auto& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), Wide(0));
  };
  Wide smallest = 4;
  Wide largest = 0;
  for (int i = 0; i <= D; ++i) {
    for (int j = 0; j < i; ++j) {
      const Wide angle = acos(Wide(-dot(gradients[i], gradients[j]) /
                                   sqrt(Wide(dot(gradients[i], gradients[i]) * dot(gradients[j], gradients[j])))));
      smallest = std::min(smallest, angle);
      largest = std::max(largest, angle);
    }
  }
  return {static_cast<double>(smallest) / kDegree, static_cast<double>(largest) / kDegree};
}

TYPED_TEST(TypedQualityTest, AnglesAgreeWithEightyDigits) {
  constexpr int D = TypeParam::kValue;
  const uint64_t seed = Seed(7);
  SCOPED_TRACE(seed);
  SplitMix64 random(seed);
  for (int round = 0; round < 200; ++round) {
    // The last corner comes near to the plane of the others, which stay well apart, at the corner of a cube.
    Simplex<D> simplex = RandomSimplex<D>(random);
    for (int i = 0; i < D; ++i) {
      for (double& x : simplex[i]) {
        x /= 4 * D;
      }
      if (i > 0) {
        simplex[i][i - 1] += 1;
      }
    }
    const double height = std::pow(10.0, -12 * random.Unit());
    for (int k = 0; k < D; ++k) {
      double mean = 0;
      for (int i = 0; i < D; ++i) {
        mean += simplex[i][k] / D;
      }
      simplex[D][k] = mean + height * (simplex[D][k] - mean);
    }
    const AngleRange expected = OracleAngles<D>(simplex);
    EXPECT_NEAR(Angles<D>(simplex).min_deg, expected.min_deg, 1e-10);
    EXPECT_NEAR(Angles<D>(simplex).max_deg, expected.max_deg, 1e-10);
  }
}

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
  for (const int d : {4, 5, 6}) {
    const TestMesh grid = KuhnGrid(d, 1);
    const QualityReport high = MeasureQuality(grid.View());
    EXPECT_EQ(high.vertices, grid.VertexCount());
    EXPECT_EQ(high.simplices, grid.SimplexCount());
    EXPECT_NEAR(high.max_radius_edge, std::sqrt(d / 4.0), 1e-14);
    EXPECT_NEAR(high.min_angle_deg, 45, 1e-11);
    EXPECT_NEAR(high.max_angle_deg, 90, 1e-11);
    EXPECT_EQ(high.angle_histogram[static_cast<size_t>(45 * kHistogramBins / LargestSmallestAngle(d))], high.simplices);
  }
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
  EXPECT_EQ(report.min_angles[26], 1u);
  EXPECT_EQ(report.min_angles[33], 2u);
  EXPECT_EQ(report.min_angles[56], 1u);
  EXPECT_EQ(report.CountBelow(33), 1u);
  EXPECT_EQ(report.CountBelow(34), 3u);
  EXPECT_EQ(std::accumulate(report.max_angles.begin(), report.max_angles.end(), uint64_t{0}), 4u);
  EXPECT_EQ(std::accumulate(report.radius_edge_ratios.begin(), report.radius_edge_ratios.end(), uint64_t{0}), 4u);
  // A regular triangle or tetrahedron belongs to the last bin, however its angles are rounded.
  const TestMesh regular = {3, {0, 0, 0, 1, 0, 1, 1, 1, 0, 0, 1, 1}, {0, 1, 2, 3}};
  EXPECT_EQ(MeasureQuality(regular.View()).angle_histogram[kHistogramBins - 1], 1u);
  for (const int d : {4, 5, 6}) {
    TestMesh simplex{.dimension = d, .points = {}, .simplices = {}};
    simplex.points.assign(static_cast<size_t>(d), (1 - std::sqrt(d + 1.0)) / d);
    for (uint32_t i = 0; i <= static_cast<uint32_t>(d); ++i) {
      simplex.simplices.push_back(i);
      for (uint32_t k = 0; i > 0 && k < static_cast<uint32_t>(d); ++k) {
        simplex.points.push_back(k == i - 1 ? 1 : 0);
      }
    }
    EXPECT_EQ(MeasureQuality(simplex.View()).angle_histogram[kHistogramBins - 1], 1u);
  }
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
