// Decisions of repair and pumping in doubles, against the exact predicates, and with every vector unit.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/simplex/quality.h"
#include "core/sliver/lifted_plane.h"
#include "core/sliver/link_columns.h"
#include "core/sliver/tetrahedron.h"
#include "tests/support/clouds.h"
#include "tests/support/dimensions.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::SplitMix64;

template <int D>
Point<D> DrawPoint(SplitMix64& random) {
  Point<D> p;
  for (double& x : p) {
    x = random.Unit();
  }
  return p;
}

template <int D>
Simplex<D> DrawSimplex(SplitMix64& random) {
  Simplex<D> corners;
  do {
    for (Point<D>& p : corners) {
      p = DrawPoint<D>(random);
    }
  } while (Orientation<D>(corners).sign != Sign::kPositive);
  return corners;
}

// The largest weight that two vertices may have.
template <int D>
double WeightLimit(const Point<D>& p, std::span<const Point<D>> others) {
  double nearest_sq = std::numeric_limits<double>::infinity();
  for (const Point<D>& q : others) {
    nearest_sq = q == p ? nearest_sq : std::min(nearest_sq, DistanceSq<D>(p, q));
  }
  return nearest_sq / 4;
}

template <int D>
std::array<double, D + 1> DrawWeights(const Simplex<D>& corners, SplitMix64& random) {
  std::array<double, D + 1> weights;
  for (int i = 0; i <= D; ++i) {
    weights[i] = random.Unit() * WeightLimit<D>(corners[i], corners);
  }
  return weights;
}

template <typename Dimension>
class LiftedPlaneTest : public test::SeededTest {
 protected:
  LiftedPlaneTest() : SeededTest(1) {}
};
using From3 = testing::Types<test::Dimension<3>, test::Dimension<4>, test::Dimension<5>, test::Dimension<6>>;
TYPED_TEST_SUITE(LiftedPlaneTest, From3);

TYPED_TEST(LiftedPlaneTest, IsCertainOfWhatIsTrue) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  int certain = 0;
  int asked = 0;
  for (int k = 0; k < 200; ++k) {
    const Simplex<D> corners = DrawSimplex<D>(random);
    const std::array<double, D + 1> weights =
        k % 2 == 0 ? std::array<double, D + 1>{} : DrawWeights<D>(corners, random);
    const LiftedPlane<D> plane(corners, weights);
    for (int j = 0; j < 20; ++j) {
      const Point<D> p = DrawPoint<D>(random);
      const double weight = k % 2 == 0 ? 0 : random.Unit() * WeightLimit<D>(p, corners);
      const int side = plane.SideOf(p, weight);
      const Sign sign = InPowerSphere<D>(corners, weights, p, weight).sign;
      if (side != 0) {
        EXPECT_EQ(side > 0, sign == Sign::kPositive);
      }
      certain += side != 0 ? 1 : 0;
      ++asked;
    }
  }
  EXPECT_GE(certain, 0.99 * asked);
}

TYPED_TEST(LiftedPlaneTest, IsNotMisledNearTheSphere) {
  constexpr int D = TypeParam::kValue;
  SplitMix64& random = this->random_;
  int in_doubt = 0;
  for (int k = 0; k < 500; ++k) {
    const Simplex<D> corners = DrawSimplex<D>(random);
    const LiftedPlane<D> plane(corners, {});
    // Reflected in the centre, so that nothing but rounding parts it from the sphere.
    const Point<D> offset = ExactCircumcentreOffset<D>(corners);
    Point<D> p;
    for (int i = 0; i < D; ++i) {
      p[i] = corners[0][i] + 2 * offset[i];
    }
    const int side = plane.SideOf(p, 0);
    if (side != 0) {
      EXPECT_EQ(side > 0, InSphere<D>(corners, p).sign == Sign::kPositive);
    }
    in_doubt += side == 0 ? 1 : 0;
  }
  EXPECT_GE(in_doubt, 400);
}

// Neighbours of a vertex, with the exact answer.
class LinkColumnsTest : public test::SeededTest {
 protected:
  LinkColumnsTest() : SeededTest(2) {}

  struct Link {
    Point<3> vertex;
    std::vector<Point<3>> points;
    std::vector<double> weights;
    LinkColumns columns;

    void Add(const Point<3>& p, double weight) {
      points.push_back(p);
      weights.push_back(weight);
      columns.Add(Difference<3>(p, vertex), weight);
    }

    Simplex<3> Corners(uint32_t a, uint32_t b, uint32_t c, uint32_t d) const {
      return {points[a], points[b], points[c], points[d]};
    }

    bool IsEmpty(uint32_t a, uint32_t b, uint32_t c, uint32_t d) const {
      const std::array<double, 4> own = {weights[a], weights[b], weights[c], weights[d]};
      for (uint32_t u = 0; u < points.size(); ++u) {
        if (u != a && u != b && u != c && u != d &&
            InPowerSphere<3>(Corners(a, b, c, d), own, points[u], weights[u]).sign != Sign::kNegative) {
          return false;
        }
      }
      return true;
    }

    std::optional<uint32_t> Apex(uint32_t a, uint32_t b, uint32_t c) const {
      for (uint32_t u = 0; u < points.size(); ++u) {
        if (u != a && u != b && u != c && Orientation<3>(Corners(a, b, c, u)).sign == Sign::kPositive &&
            IsEmpty(a, b, c, u)) {
          return u;
        }
      }
      return std::nullopt;
    }
  };

  static Link DrawLink(size_t count, bool is_weighted, SplitMix64& random) {
    std::vector<Point<3>> points;
    for (size_t i = 0; i < count; ++i) {
      points.push_back(DrawPoint<3>(random));
    }
    Link link{{0.5, 0.5, 0.5}, {}, {}, {}};
    for (const Point<3>& p : points) {
      link.Add(p, is_weighted ? random.Unit() * WeightLimit<3>(p, points) : 0);
    }
    return link;
  }
};

TEST_F(LinkColumnsTest, FindsTheNeighbourWhoseSphereIsEmpty) {
  int facets = 0;
  for (int k = 0; k < 12; ++k) {
    const Link link = DrawLink(5 + random_.Below(20), k % 3 == 2, random_);
    const auto count = static_cast<uint32_t>(link.points.size());
    for (uint32_t a = 0; a < count; ++a) {
      for (uint32_t b = 0; b < count; ++b) {
        for (uint32_t c = 0; c < count; ++c) {
          if (a == b || b == c || c == a) {
            continue;
          }
          const auto found = link.columns.Wrap(a, b, c);
          const std::optional<uint32_t> apex = link.Apex(a, b, c);
          ASSERT_EQ(found.has_value(), apex.has_value()) << a << ' ' << b << ' ' << c;
          if (!found.has_value()) {
            continue;
          }
          ++facets;
          ASSERT_EQ(found->apex, *apex);
          const LiftedPlane<3> plane(link.points[a], link.weights[a], found->cofactors, found->largest);
          const std::array<double, 4> own = {link.weights[a], link.weights[b], link.weights[c], link.weights[*apex]};
          const Point<3> p = DrawPoint<3>(random_);
          if (const int side = plane.SideOf(p, 0); side != 0) {
            EXPECT_EQ(side > 0, InPowerSphere<3>(link.Corners(a, b, c, *apex), own, p, 0).sign == Sign::kPositive);
          }
        }
      }
    }
  }
  EXPECT_GT(facets, 1000);
}

TEST_F(LinkColumnsTest, LeavesTiesToOthers) {
  Link link{{0.5, 0.5, 0.5}, {}, {}, {}};
  for (int corner = 0; corner < 8; ++corner) {
    link.Add({corner & 1 ? 1.0 : 0.0, corner & 2 ? 1.0 : 0.0, corner & 4 ? 1.0 : 0.0}, 0);
  }
  EXPECT_FALSE(link.columns.Wrap(0, 1, 2).has_value());  // corners 4 to 7 are on one sphere with them
  EXPECT_FALSE(link.columns.Wrap(0, 2, 1).has_value());  // nothing is beyond
}

TEST_F(LinkColumnsTest, LeavesManyNeighboursToOthers) {
  Link link = DrawLink(64, false, random_);
  std::optional<LinkColumns::Tetrahedron> found;
  uint32_t b = 1;
  uint32_t c = 2;
  for (; b < 64 && !found.has_value(); ++b) {
    for (c = 1; c < 64 && !found.has_value(); ++c) {
      found = b == c ? std::nullopt : link.columns.Wrap(0, b, c);
    }
  }
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->apex, link.Apex(0, b - 1, c - 1));
  link.Add({100, 100, 100}, 0);
  EXPECT_FALSE(link.columns.Wrap(0, b - 1, c - 1).has_value());
  link.columns.Clear();
  for (size_t i = 0; i < 64; ++i) {
    link.columns.Add(Difference<3>(link.points[i], link.vertex), 0);
  }
  EXPECT_EQ(link.columns.Wrap(0, b - 1, c - 1)->apex, found->apex);
}

TEST_F(LinkColumnsTest, IsTheSameWithEveryVectorUnit) {
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one unit";
  }
  for (int k = 0; k < 20; ++k) {
    const Link link = DrawLink(4 + random_.Below(40), false, random_);
    const auto count = static_cast<uint32_t>(link.points.size());
    for (uint32_t c = 2; c < count; ++c) {
      const auto one = link.columns.Wrap(0, 1, c, VectorUnit::kBaseline);
      const auto other = link.columns.Wrap(0, 1, c, VectorUnit::kAvx2);
      ASSERT_EQ(one.has_value(), other.has_value());
      if (one.has_value()) {
        EXPECT_EQ(one->apex, other->apex);
        EXPECT_EQ(one->cofactors, other->cofactors);
      }
    }
  }
}

class TetrahedronTest : public test::SeededTest {
 protected:
  TetrahedronTest() : SeededTest(3) {}
};

TEST_F(TetrahedronTest, MeasuresAreThoseOfQuality) {
  for (int k = 0; k < 2000; ++k) {
    const Simplex<3> corners = DrawSimplex<3>(random_);
    const double angle = Angles<3>(corners).min_deg;
    if (angle < 1) {
      continue;
    }
    const TetrahedronMeasure measure = MeasureTetrahedron(corners);
    EXPECT_NEAR(std::acos(measure.cosine) * 180 / std::numbers::pi, angle, 1e-9);
    const double ratio = RadiusEdgeRatio<3>(corners);
    EXPECT_NEAR(std::sqrt(measure.radius_sq / measure.edge_sq), ratio, 1e-10 * ratio);
    const Point<3> offset = ExactCircumcentreOffset<3>(corners);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(measure.centre[i], corners[0][i] + offset[i], 1e-10 * std::sqrt(measure.radius_sq));
    }
    double edge_sq = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) {
        edge_sq = std::min(edge_sq, DistanceSq<3>(corners[i], corners[j]));
      }
    }
    EXPECT_DOUBLE_EQ(measure.edge_sq, edge_sq);
    EXPECT_GT(measure.determinant, 0);
  }
}

TEST_F(TetrahedronTest, IsTheSameWithEveryVectorUnit) {
  if (!Has(VectorUnit::kAvx2)) {
    GTEST_SKIP() << "this processor has one unit";
  }
  for (int k = 0; k < 1000; ++k) {
    const Simplex<3> corners = DrawSimplex<3>(random_);
    const TetrahedronMeasure one = MeasureTetrahedron(corners, VectorUnit::kBaseline);
    const TetrahedronMeasure other = MeasureTetrahedron(corners, VectorUnit::kAvx2);
    EXPECT_EQ(one.cosine, other.cosine);
    EXPECT_EQ(one.determinant, other.determinant);
    EXPECT_EQ(one.radius_sq, other.radius_sq);
    EXPECT_EQ(one.edge_sq, other.edge_sq);
    EXPECT_EQ(one.centre, other.centre);
  }
}

}  // namespace
}  // namespace wellspace::core
