// Where two triangles come together: against clipping in rational numbers, on grids where nearly everything is
// degenerate.
#include "core/features/triangle_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <vector>

#include "core/features/surface_complex.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using Kind = TriangleContact::Kind;
using Rational = boost::multiprecision::cpp_rational;
using Exact = std::array<Rational, 3>;

Exact Minus(const Exact& a, const Exact& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Exact Product(const Exact& a, const Exact& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Rational Inner(const Exact& a, const Exact& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// The part of a polygon in {x: n . (x - from) >= 0}: a point and a segment are polygons, too.
std::vector<Exact> Clip(const std::vector<Exact>& polygon, const Exact& from, const Exact& n) {
  std::vector<Exact> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Exact& p = polygon[i];
    const Exact& q = polygon[(i + 1) % polygon.size()];
    const Rational at_p = Inner(n, Minus(p, from));
    const Rational at_q = Inner(n, Minus(q, from));
    if (at_p >= 0) {
      kept.push_back(p);
    }
    if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0)) {
      const Rational share = at_p / (at_p - at_q);
      const Exact along = Minus(q, p);
      kept.push_back({p[0] + share * along[0], p[1] + share * along[1], p[2] + share * along[2]});
    }
  }
  return kept;
}

// Whether the triangles have a point in common that is in no corner or side which they share: all corners of what is
// left of one within the other are looked at.
bool MeetByClipping(const TriangleCorners& one, const TriangleCorners& other) {
  std::array<Exact, 3> t;
  std::vector<Exact> left;
  for (size_t k = 0; k < 3; ++k) {
    for (size_t axis = 0; axis < 3; ++axis) {
      t[k][axis] = one.places[k][axis];
    }
    left.push_back({other.places[k][0], other.places[k][1], other.places[k][2]});
  }
  const Exact normal = Product(Minus(t[1], t[0]), Minus(t[2], t[0]));
  left = Clip(left, t[0], normal);
  left = Clip(left, t[0], {-normal[0], -normal[1], -normal[2]});
  for (size_t k = 0; k < 3; ++k) {
    left = Clip(left, t[k], Product(normal, Minus(t[(k + 1) % 3], t[k])));
  }
  std::vector<Exact> shared;
  for (size_t k = 0; k < 3; ++k) {
    if (std::find(other.names.begin(), other.names.end(), one.names[k]) != other.names.end()) {
      shared.push_back(t[k]);
    }
  }
  return std::any_of(left.begin(), left.end(), [&](const Exact& p) {
    if (shared.empty()) {
      return true;
    }
    if (shared.size() == 1) {
      return p != shared[0];
    }
    const Exact along = Minus(shared[1], shared[0]);
    const Rational at = Inner(along, Minus(p, shared[0]));
    return Product(along, Minus(p, shared[0])) != Exact{0, 0, 0} || at < 0 || at > Inner(along, along);
  });
}

class TriangleContactTest : public test::SeededTest {
 protected:
  TriangleContactTest() : SeededTest(20'543) {}

  // Points of a small grid, scaled; names are their places.
  TriangleCorners Draw(uint64_t side, double scale) {
    while (true) {
      TriangleCorners t;
      for (size_t k = 0; k < 3; ++k) {
        t.names[k] = 0;
        for (double& x : t.places[k]) {
          const uint64_t step = random_.Below(side);
          t.names[k] = static_cast<uint32_t>(t.names[k] * side + step);
          x = scale * static_cast<double>(step);
        }
      }
      if (!AreCollinear(t.places[0], t.places[1], t.places[2])) {
        return t;
      }
    }
  }

  static bool HaveTheSameCorners(TriangleCorners t, TriangleCorners u) {
    std::sort(t.names.begin(), t.names.end());
    std::sort(u.names.begin(), u.names.end());
    return t.names == u.names;
  }
};

TEST_F(TriangleContactTest, IsThatOfClippingOnGrids) {
  size_t meet = 0;
  std::array<size_t, 3> by_shared{};
  for (int round = 0; round < 60'000; ++round) {
    const uint64_t side = 2 + random_.Below(4);
    const double scale = round % 2 == 0 ? 1.0 : 0.1;  // exact, and rounded
    const TriangleCorners t = Draw(side, scale);
    const TriangleCorners u = Draw(side, scale);
    if (HaveTheSameCorners(t, u)) {
      continue;
    }
    const TriangleContact contact = FindContact(t, u, 0);
    const bool expected = MeetByClipping(t, u);
    ASSERT_EQ(contact.kind == Kind::kMeet, expected) << round;
    ASSERT_EQ(FindContact(u, t, 0), contact);
    meet += expected ? 1 : 0;
    size_t shared = 0;
    for (const uint32_t name : t.names) {
      shared += std::find(u.names.begin(), u.names.end(), name) != u.names.end() ? 1 : 0;
    }
    ++by_shared[shared];
    if (expected) {
      // The place is on both, but for rounding.
      ASSERT_LT(DistanceToTriangle(contact.at, t.places), 1e-12) << round;
      ASSERT_LT(DistanceToTriangle(contact.at, u.places), 1e-12) << round;
    }
  }
  EXPECT_GT(meet, 10'000u);
  for (const size_t count : by_shared) {
    EXPECT_GT(count, 1'000u);
  }
}

TEST_F(TriangleContactTest, IsExactWhereOneUlpDecides) {
  const TriangleCorners floor{{0, 1, 2}, {{{0, 0, 0.1}, {1, 0, 0.1}, {0, 1, 0.1}}}};
  for (const double height : {std::nextafter(0.1, 1), 0.1, std::nextafter(0.1, 0)}) {
    const TriangleCorners needle{{3, 4, 5}, {{{0.2, 0.2, height}, {0.2, 0.3, 1}, {0.3, 0.2, 1}}}};
    EXPECT_EQ(FindContact(floor, needle, 0).kind, height > 0.1 ? Kind::kNone : Kind::kMeet) << height;
    EXPECT_EQ(FindContact(floor, needle, 1e-9).kind, height > 0.1 ? Kind::kNear : Kind::kMeet) << height;
  }
}

TEST_F(TriangleContactTest, RandomTrianglesOfAllScales) {
  for (int round = 0; round < 20'000; ++round) {
    std::array<TriangleCorners, 2> pair;
    std::array<Point<3>, 6> places;
    for (Point<3>& p : places) {
      const double scale = std::exp2(-static_cast<double>(random_.Below(40)));
      for (double& x : p) {
        x = scale * random_.Gauss();
      }
    }
    const uint64_t shared = random_.Below(3);
    for (size_t k = 0; k < 3; ++k) {
      pair[0].names[k] = static_cast<uint32_t>(k);
      pair[0].places[k] = places[k];
      const size_t other = k < shared ? k : 3 + k;
      pair[1].names[k] = static_cast<uint32_t>(other);
      pair[1].places[k] = places[other];
    }
    ASSERT_EQ(FindContact(pair[0], pair[1], 0).kind == Kind::kMeet, MeetByClipping(pair[0], pair[1])) << round;
  }
}

TEST_F(TriangleContactTest, NearCornersAreToldWithTheirDistance) {
  const TriangleCorners floor{{0, 1, 2}, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}};
  // Over the inside, over a side, beyond a corner; as stranger, at a corner and at a side.
  const std::vector<std::pair<Point<3>, double>> near = {
      {{0.25, 0.25, 0.001}, 0.001}, {{0.5, -0.003, 0.004}, 0.005}, {{1.003, -0.004, 0}, 0.005}};
  for (const auto& [corner, distance] : near) {
    const TriangleCorners stranger{{3, 4, 5},
                                   {{corner,
                                     {corner[0] + 0.2, corner[1] - 0.3, corner[2] + 1},
                                     {corner[0] + 0.3, corner[1] - 0.2, corner[2] + 1}}}};
    const TriangleContact contact = FindContact(floor, stranger, 0.01);
    EXPECT_EQ(contact.kind, Kind::kNear);
    EXPECT_NEAR(contact.distance, distance, 1e-12);
    EXPECT_LE(Distance<3>(contact.at, corner), 1.01 * distance);
    EXPECT_EQ(FindContact(floor, stranger, 0.9 * distance).kind, Kind::kNone);
  }
  const TriangleCorners at_corner{{2, 4, 5}, {{{0, 1, 0}, {0.3, 0.3, 0.001}, {-1, 0, 2}}}};
  EXPECT_EQ(FindContact(floor, at_corner, 0.01).kind, Kind::kNear);
  const TriangleCorners at_side{{0, 1, 5}, {{{0, 0, 0}, {1, 0, 0}, {0, 0.5, 0.001}}}};
  EXPECT_NEAR(FindContact(floor, at_side, 0.01).distance, 0.001, 1e-12);
  EXPECT_EQ(FindContact(floor, at_side, 0.0005).kind, Kind::kNone);
}

}  // namespace
}  // namespace wellspace::core
