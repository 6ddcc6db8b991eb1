// Flat tetrahedra between points that mirror each other: gone after flips, whatever the order of rows and numbers.
#include "core/simplex/flat_tetrahedra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "core/geometry/vector_product.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

struct Tetrahedra {
  std::vector<double> points;
  HugeVector<uint32_t> simplices;
  HugeVector<uint32_t> solids;

  Point<3> At(uint32_t v) const { return PointAt<3>(points, v); }
  double VolumeOf(size_t s) const {
    const Point<3> a = At(simplices[4 * s]);
    const auto edge = [&](size_t k) { return Difference<3>(At(simplices[4 * s + k]), a); };
    return Dot<3>(Cross(edge(1), edge(2)), edge(3)) / 6;
  }
  void Add(std::array<uint32_t, 4> row, uint32_t solid = 1) {
    std::sort(row.begin(), row.end());
    simplices.insert(simplices.end(), row.begin(), row.end());
    solids.push_back(solid);
    if (VolumeOf(solids.size() - 1) < 0) {
      std::swap(simplices[simplices.size() - 2], simplices[simplices.size() - 1]);
    }
  }
  // Places of the corners of each tetrahedron.
  std::multiset<std::array<Point<3>, 4>> Places() const {
    std::multiset<std::array<Point<3>, 4>> all;
    for (size_t s = 0; s < solids.size(); ++s) {
      std::array<Point<3>, 4> places;
      for (size_t k = 0; k < 4; ++k) {
        places[k] = At(simplices[4 * s + k]);
      }
      std::sort(places.begin(), places.end());
      all.insert(places);
    }
    return all;
  }
};

// Two pyramids over a turned square, whose halves meet at different diagonals; a flat tetrahedron is between them.
// Rounded, its corners are hardly on a plane.
Tetrahedra TwoPyramids(uint32_t solid_above = 1) {
  Tetrahedra mesh;
  const auto add = [&](double x, double y, double z) {
    const double c = std::cos(0.3);
    const double s = std::sin(0.3);
    const double u = c * x - s * z;
    const double w = s * x + c * z;
    mesh.points.insert(mesh.points.end(), {0.5 + c * u - s * y, 0.5 + s * u + c * y, 0.5 + w});
  };
  for (int k = 0; k < 4; ++k) {
    add(0.1 * std::cos(0.7 + k * 1.5707963267948966), 0.1 * std::sin(0.7 + k * 1.5707963267948966), 0);
  }
  add(0.01, 0.02, 0.2);
  add(0.02, -0.01, -0.2);
  mesh.Add({0, 1, 2, 4}, solid_above);
  mesh.Add({0, 2, 3, 4}, solid_above);
  mesh.Add({0, 1, 3, 5});
  mesh.Add({1, 2, 3, 5});
  mesh.Add({0, 1, 2, 3});
  return mesh;
}

double Volume(const Tetrahedra& mesh) {
  double sum = 0;
  for (size_t s = 0; s < mesh.solids.size(); ++s) {
    sum += mesh.VolumeOf(s);
  }
  return sum;
}

uint64_t Flip(Tetrahedra& mesh) {
  return FlipFlatTetrahedra(mesh.points, mesh.simplices, mesh.solids, RunContext()).value();
}

void ExpectGood(const Tetrahedra& mesh) {
  for (size_t s = 0; s < mesh.solids.size(); ++s) {
    EXPECT_GT(mesh.VolumeOf(s), 1e-5);
    const auto row = mesh.simplices.begin() + static_cast<std::ptrdiff_t>(4 * s);
    EXPECT_EQ(*std::min_element(row, row + 4), *row);
  }
}

TEST(FlatTetrahedra, GoWithADiagonal) {
  Tetrahedra mesh = TwoPyramids();
  const double volume = Volume(mesh);
  ASSERT_LT(std::abs(mesh.VolumeOf(4)), 1e-17);
  EXPECT_EQ(Flip(mesh), 0u);
  EXPECT_EQ(mesh.solids.size(), 4u);
  EXPECT_NEAR(Volume(mesh), volume, 1e-15);
  ExpectGood(mesh);
}

class FlatTetrahedraTest : public test::SeededTest {
 protected:
  FlatTetrahedraTest() : SeededTest(20261130) {}
};

TEST_F(FlatTetrahedraTest, GoAlikeInAnyOrder) {
  Tetrahedra first = TwoPyramids();
  Flip(first);
  for (int round = 0; round < 50; ++round) {
    const Tetrahedra given = TwoPyramids();
    std::vector<uint32_t> number(given.points.size() / 3);
    std::iota(number.begin(), number.end(), 0);
    std::vector<size_t> rows(given.solids.size());
    std::iota(rows.begin(), rows.end(), 0);
    for (size_t i = number.size(); i > 1; --i) {
      std::swap(number[i - 1], number[random_.Below(i)]);
    }
    for (size_t i = rows.size(); i > 1; --i) {
      std::swap(rows[i - 1], rows[random_.Below(i)]);
    }
    Tetrahedra mesh;
    mesh.points.resize(given.points.size());
    for (size_t v = 0; v < number.size(); ++v) {
      std::copy_n(&given.points[3 * v], 3, &mesh.points[3 * size_t{number[v]}]);
    }
    for (const size_t s : rows) {
      const uint32_t* row = &given.simplices[4 * s];
      mesh.Add({number[row[0]], number[row[1]], number[row[2]], number[row[3]]});
    }
    EXPECT_EQ(Flip(mesh), 0u);
    EXPECT_EQ(mesh.Places(), first.Places());
  }
}

// Nothing is flipped over the boundary of a solid, nor where no edge has three tetrahedra.
TEST(FlatTetrahedra, StayWhereNothingCanBeFlipped) {
  Tetrahedra two = TwoPyramids(/*solid_above=*/2);
  // Of the lower solid are three around one diagonal.
  EXPECT_EQ(Flip(two), 0u);
  EXPECT_EQ(two.solids.size(), 4u);
  Tetrahedra alone = TwoPyramids();
  alone.simplices = {0, 1, 2, 3};
  alone.solids = {1};
  EXPECT_EQ(Flip(alone), 1u);
  EXPECT_EQ(alone.solids.size(), 1u);
  // A point between the three others has no diagonal.
  Tetrahedra cap;
  cap.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0};
  cap.simplices = {0, 1, 2, 3};
  cap.solids = {1};
  EXPECT_EQ(Flip(cap), 1u);
}

TEST(FlatTetrahedra, ThatAreThinButNotFlatStay) {
  Tetrahedra thin;
  thin.points = {0, 0, 0, 1, 0, 0, 1, 1, 1e-5, 0, 1, 0};
  thin.Add({0, 1, 2, 3});
  EXPECT_EQ(Flip(thin), 0u);
  EXPECT_EQ(thin.solids.size(), 1u);
}

TEST(FlatTetrahedra, CanBeCancelled) {
  Tetrahedra mesh = TwoPyramids();
  RunContext context;
  context.Cancel();
  EXPECT_EQ(FlipFlatTetrahedra(mesh.points, mesh.simplices, mesh.solids, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
