// The places of new vertices.
#include "core/refine/steiner_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "core/refine/assessment.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::MakeStructure;

template <typename T>
class SteinerPointTest : public test::SeededTest {
 protected:
  SteinerPointTest() : SeededTest(2004) {}
};
TYPED_TEST_SUITE(SteinerPointTest, test::UpTo5);

TYPED_TEST(SteinerPointTest, SnappedPointsAreInTheBoxAndExactlyOnFaces) {
  constexpr int D = TypeParam::kValue;
  Box<D> box;
  for (int k = 0; k < D; ++k) {
    box.low[k] = -0.3 * (k + 1);
    box.high[k] = 0.7;
  }
  int snapped_often = 0;
  for (int i = 0; i < 2000; ++i) {
    SteinerPoint<D> point;
    for (int k = 0; k < D; ++k) {
      const double t = this->random_.Below(4) == 0 ? 0.02 * this->random_.Unit() : this->random_.Unit();
      point.position[k] = box.low[k] + t * (box.high[k] - box.low[k]);
    }
    point.empty_radius_sq = std::pow(0.3 * this->random_.Unit(), 2);
    const SteinerPoint<D> snapped = SnapToBoundary<D>(box, point);
    ASSERT_TRUE(box.Contains(snapped.position));
    double moved_sq = 0;
    int moved = 0;
    for (int k = 0; k < D; ++k) {
      const double by = snapped.position[k] - point.position[k];
      if (by != 0) {
        ASSERT_TRUE(snapped.position[k] == box.low[k] || snapped.position[k] == box.high[k]);
        moved_sq += by * by;
        ++moved;
      }
    }
    snapped_often += moved > 1 ? 1 : 0;
    ASSERT_NEAR(snapped.empty_radius_sq, point.empty_radius_sq - moved_sq, 1e-12);
    ASSERT_GE(snapped.empty_radius_sq, point.empty_radius_sq * std::pow(0.5, moved) * (1 - 1e-12));
    for (int face = 0; face < 2 * D; ++face) {
      const double distance = box.DistanceToFace(snapped.position, face);
      ASSERT_TRUE(distance == 0 || distance * distance >= 0.5 * snapped.empty_radius_sq);
    }
  }
  EXPECT_GT(snapped_often, 10);
}

// Guarantees of OffCenter, for the nodes of cells of many shapes.
TYPED_TEST(SteinerPointTest, OffCentersAreInTheCellAndFarEnough) {
  constexpr int D = TypeParam::kValue;
  int moved = 0;
  for (const std::string_view kind : {"uniform", "boundary", "clusters", "lines"}) {
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({30, 30, 8, 3})));
    Polytope<D> cell;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      test::CutByAllInBox<D>(structure, VertexId{v}, cell);
      for (size_t i = 0; i < cell.nodes().size(); ++i) {
        for (const uint16_t index : cell.nodes()[i].planes) {
          const Plane<D>& plane = cell.plane(index);
          if (plane.kind != PlaneKind::kBisector) {
            continue;
          }
          const double rho = 1 + this->random_.Unit();
          const double factor = 1 + this->random_.Unit();
          const double distance_sq = std::pow(factor * rho * plane.length, 2);
          const auto point = OffCenter<D>(cell, static_cast<int>(i), index, distance_sq);
          const double radius = std::sqrt(point.empty_radius_sq);
          const double node_radius = std::sqrt(cell.nodes()[i].radius_sq);
          const double rounding = 1e-9 + std::min(cell.nodes()[i].slack, 1e-6);
          ASSERT_GE(radius, std::min(node_radius, rho * plane.length) * (1 - 1e-9));
          ASSERT_LE(radius, node_radius * (1 + 1e-9));
          moved += radius < 0.99 * node_radius ? 1 : 0;
          ASSERT_NEAR(std::sqrt(DistanceSq<D>(point.position, structure.point(VertexId{v}))), radius, rounding);
          for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
            ASSERT_GE(std::sqrt(DistanceSq<D>(point.position, structure.point(VertexId{u}))), radius - rounding);
          }
        }
      }
    }
  }
  EXPECT_GT(moved, 20);
}

class PetalPointTest : public test::SeededTest {
 protected:
  PetalPointTest() : SeededTest(2009) {}
};

// Guarantees of PetalPoint, for the nodes of cells of many shapes whose triangle breaks a rho, but not by far.
TEST_F(PetalPointTest, IsInTheCellAndThePetalAndNoNearerThanTheNode) {
  int moved = 0;
  int stayed = 0;
  for (const std::string_view kind : {"uniform", "boundary", "clusters", "lines"}) {
    const QueryStructure<2> structure = MakeStructure<2>(test::SortedCloud<2>(kind, 60));
    Polytope<2> cell;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      test::CutByAllInBox<2>(structure, VertexId{v}, cell);
      for (size_t i = 0; i < cell.nodes().size(); ++i) {
        const CellNode<2>& node = cell.nodes()[i];
        const Plane<2>* edge = &cell.plane(node.planes[0]);
        const Plane<2>* third = &cell.plane(node.planes[1]);
        if (edge->kind != PlaneKind::kBisector || third->kind != PlaneKind::kBisector) {
          continue;
        }
        if (third->length < edge->length) {
          std::swap(edge, third);
        }
        const Point<2>& u = edge->normal;
        const double node_radius = std::sqrt(node.radius_sq);
        const double rho = node_radius / edge->length / (1.001 + 0.8 * this->random_.Unit());
        const double top = OffCenterFactor<2>(rho, false) * rho * edge->length;
        if (rho < 0.9 || node_radius > top) {
          continue;
        }
        const int plane = node.planes[edge == &cell.plane(node.planes[0]) ? 0 : 1];
        const SteinerPoint<2> point = PetalPoint(cell, static_cast<int>(i), plane, top * top, rho);
        const double radius = std::sqrt(point.empty_radius_sq);
        const double rounding = 1e-9 + std::min(node.slack, 1e-6);
        ASSERT_GE(radius, node_radius);
        for (uint32_t w = 0; w < structure.vertex_count(); ++w) {
          ASSERT_GE(std::sqrt(DistanceSq<2>(point.position, structure.point(VertexId{w}))), radius - rounding);
        }
        const Point<2> p = Difference<2>(point.position, cell.site());
        ASSERT_NEAR(std::sqrt(NormSq<2>(p)), radius, rounding);
        if (radius < node_radius * (1 + 1e-9)) {
          ++stayed;
          continue;
        }
        ++moved;
        const double from_u = std::sqrt(DistanceSq<2>(p, u));
        const double twice_area = std::abs(u[0] * p[1] - u[1] * p[0]);
        ASSERT_LE(radius * from_u * edge->length / (2 * twice_area), rho * edge->length)
            << "the new triangle breaks rho";
        ASSERT_LE((rho - 1) * (from_u - radius), radius - rho * edge->length + rounding);
        ASSERT_LT(DistanceSq<2>(p, node.x), node.radius_sq) << "the old triangle stays";
      }
    }
  }
  EXPECT_GT(moved, 20);
  EXPECT_GT(stayed, 20);
}

// A site in the middle of the unit box, its cell not cut by anything: every node is on foreign faces.
TYPED_TEST(SteinerPointTest, EncroachmentPointIsTheMeanOfTheFacetsNodes) {
  constexpr int D = TypeParam::kValue;
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  Point<D> site;
  site.fill(0.4);
  Polytope<D> cell;
  cell.Reset(site, test::UnitBox<D>(), kinds, TieRule::kKeep);
  cell.Place();
  for (int face = 0; face < 2 * D; ++face) {
    const auto point = EncroachmentPoint<D>(cell, 0, face);
    double distance_sq = 0;
    for (int k = 0; k < D; ++k) {
      const double expected = k == face / 2 ? face % 2 : 0.5;
      EXPECT_DOUBLE_EQ(point.position[k], expected);
      distance_sq += (expected - 0.4) * (expected - 0.4);
    }
    EXPECT_EQ(point.position[face / 2], face % 2) << "exactly on the face";
    EXPECT_NEAR(point.empty_radius_sq, distance_sq, 1e-15);
  }
  const Assessment found = Assess<D>(cell, 0, {.rho = 1.5}, 1);
  EXPECT_EQ(found.encroached_face % 2, 0) << "the low faces are nearer";
  EXPECT_LT(found.bad_node, 0);
  EXPECT_FALSE(found.is_clipped);
  EXPECT_FALSE(found.IsGood());
}

// The same cell, of a site on the low faces of all axes but the first: its points on the high face of that are on an
// edge of the box.
TYPED_TEST(SteinerPointTest, EncroachmentPointStaysOnTheSitesFaces) {
  constexpr int D = TypeParam::kValue;
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  Point<D> site{};
  site[0] = 0.4;
  Polytope<D> cell;
  cell.Reset(site, test::UnitBox<D>(), kinds, TieRule::kKeep);
  cell.Place();
  const FaceMask faces = test::UnitBox<D>().FacesOf(site);
  const auto point = EncroachmentPoint<D>(cell, faces, FaceIndex(0, true));
  EXPECT_EQ(point.position[0], 1);
  for (int k = 1; k < D; ++k) {
    EXPECT_EQ(point.position[k], 0);
  }
  EXPECT_DOUBLE_EQ(point.empty_radius_sq, 0.6 * 0.6);
  // The high face of axis 1 is opposite to one of the site's.
  const auto across = EncroachmentPoint<D>(cell, faces, FaceIndex(1, true));
  EXPECT_DOUBLE_EQ(across.position[0], 0.5);
  EXPECT_EQ(across.position[1], 1);
  EXPECT_EQ(across.position[D - 1], D == 2 ? 1 : 0);
}

TEST(SteinerPointByHandTest, OffCenterLiesWhereTheNewTriangleJustKeepsRho) {
  for (const double rho : {1.0, std::sqrt(2.0), 2.0, 3.0}) {
    // The triangle of v = 0, u = (1, 0) and the point of their bisector at distance T has circumradius T^2 / (2 h).
    const double distance = OffCenterFactor<2>(rho, false) * rho;
    const double radius = distance * distance / (2 * std::sqrt(distance * distance - 0.25));
    EXPECT_LE(radius, rho);
    EXPECT_GE(radius, 0.99 * rho);
  }
}

// The cell of v = 0 in a large box, cut by u = (1, 0), whose bisector x = 1/2 is this plane, and by others.
constexpr int kBisectorOfU = 4;
Polytope<2> CellByHand(const std::vector<Point<2>>& others) {
  std::array<PlaneKind, 4> kinds;
  kinds.fill(PlaneKind::kFace);
  Polytope<2> cell;
  cell.Reset({0, 0}, {{-100, -100}, {100, 100}}, kinds, TieRule::kKeep);
  cell.Cut(VertexId{0}, {1, 0});
  for (uint32_t i = 0; i < others.size(); ++i) {
    cell.Cut(VertexId{i + 1}, others[i]);
  }
  return cell;
}

int NodeAt(const Polytope<2>& cell, const Point<2>& x) {
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    if (DistanceSq<2>(cell.nodes()[i].x, x) < 1e-12) {
      return static_cast<int>(i);
    }
  }
  throw std::invalid_argument("no such node");
}

// The node of u is at height 5 from (0, 10), 2 from (0, 4).
TEST(SteinerPointByHandTest, OffCenterByHand) {
  const auto off_center = [](const std::vector<Point<2>>& others, const Point<2>& at, double rho, double factor) {
    const Polytope<2> cell = CellByHand(others);
    return OffCenter<2>(cell, NodeAt(cell, at), kBisectorOfU, std::pow(factor * rho, 2));
  };
  const auto far = off_center({{0, 10}}, {0.5, 5}, 2, 1.25);
  EXPECT_DOUBLE_EQ(far.position[0], 0.5);
  EXPECT_DOUBLE_EQ(far.position[1], std::sqrt(6.25 - 0.25));
  EXPECT_DOUBLE_EQ(far.empty_radius_sq, 6.25);

  const auto circumcenter = off_center({{0, 4}}, {0.5, 2}, 2, 1.25);
  EXPECT_DOUBLE_EQ(circumcenter.position[1], 2);

  // (1/2, -1/20) cuts the segment off below height 2.475, above the off-centre at sqrt(3.75).
  const auto stopped = off_center({{0, 10}, {0.5, -0.05}}, {0.5, 5}, 2, 1);
  EXPECT_DOUBLE_EQ(stopped.position[0], 0.5);
  EXPECT_NEAR(stopped.position[1], 2.475, 1e-12);
}

// With w = (2, 2): the node (1/2, 3/2), and beyond it the facet x + y = 2, which leads up and to the left.
TEST(SteinerPointByHandTest, PetalPointByHand) {
  const double rho = 1.4;
  const double top = OffCenterFactor<2>(rho, false) * rho;
  const double radius = top * top / (2 * std::sqrt(top * top - 0.25));
  const Point<2> centre = {0.5, std::sqrt(radius * radius - 0.25)};
  const auto petal_point = [&](const std::vector<Point<2>>& others) {
    const Polytope<2> cell = CellByHand(others);
    const int node = NodeAt(cell, {0.5, 1.5});
    const Petal petal = PetalOf(cell, node, kBisectorOfU, top * top);
    EXPECT_NEAR(petal.radius, radius, 1e-12);
    EXPECT_NEAR(DistanceSq<2>(petal.centre, centre), 0, 1e-24);
    return PetalPoint(cell, node, kBisectorOfU, top * top, rho);
  };
  const SteinerPoint<2> leaves = petal_point({{2, 2}});
  EXPECT_NEAR(leaves.position[0] + leaves.position[1], 2, 1e-12);
  EXPECT_NEAR(DistanceSq<2>(leaves.position, centre), radius * radius, 1e-12);
  EXPECT_GT(leaves.position[1], 1.5);
  EXPECT_DOUBLE_EQ(leaves.empty_radius_sq, NormSq<2>(leaves.position));

  // (-2, 2) ends that facet at (0, 2), in the petal, and its own, y - x = 2, leads back towards v.
  const SteinerPoint<2> stopped = petal_point({{2, 2}, {-2, 2}});
  EXPECT_NEAR(stopped.position[0], 0, 1e-12);
  EXPECT_NEAR(stopped.position[1], 2, 1e-12);
}

TEST(SteinerPointByHandTest, SnapsByHand) {
  const Box<2> box = test::UnitBox<2>();
  const auto snap = [&](Point<2> p, double radius) { return SnapToBoundary<2>(box, {p, radius * radius}); };
  EXPECT_EQ(snap({0.15, 0.5}, 0.2).position, (Point<2>{0.15, 0.5})) << "farther than 0.2 / sqrt 2";
  EXPECT_EQ(snap({0.1, 0.5}, 0.2).position, (Point<2>{0, 0.5}));
  EXPECT_NEAR(snap({0.1, 0.5}, 0.2).empty_radius_sq, 0.03, 1e-15);
  EXPECT_EQ(snap({0.05, 0.96}, 0.2).position, (Point<2>{0, 1}));
  EXPECT_NEAR(snap({0.05, 0.96}, 0.2).empty_radius_sq, 0.04 - 0.0016 - 0.0025, 1e-15);
  EXPECT_EQ(snap({-1e-17, 0.5}, 0.2).position, (Point<2>{0, 0.5})) << "rounded out of the box";
  EXPECT_EQ(snap({0, 0.5}, 0.4).position, (Point<2>{0, 0.5})) << "on a face already";
}

}  // namespace
}  // namespace wellspace::core
