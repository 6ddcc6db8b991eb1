// Owners of a triangle in a trial cell: no point as near to three vertices as to any is missed.
#include "core/refine/space/surface_in_cell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

class SurfaceInCellTest : public test::SeededTest {
 protected:
  SurfaceInCellTest() : SeededTest(43'311) {}

  Point<3> SomePoint() { return {random_.Unit(), random_.Unit(), random_.Unit()}; }

  // The cell of `site` in the unit cube among the vertices.
  Polytope<3> CellOf(const Point<3>& site, const std::vector<Point<3>>& vertices) {
    std::array<PlaneKind, 6> kinds;
    kinds.fill(PlaneKind::kFace);
    Polytope<3> cell;
    cell.Reset(site, {{0, 0, 0}, {1, 1, 1}}, kinds, TieRule::kPerturb);
    for (uint32_t v = 0; v < vertices.size(); ++v) {
      cell.CutBeforePlace(VertexId{v}, vertices[v]);
    }
    cell.Place();
    return cell;
  }
};

// The three vertices that are nearest to `p`, nearest first.
std::array<uint32_t, 3> NearestThree(const Point<3>& p, const std::vector<Point<3>>& vertices) {
  std::vector<uint32_t> order(vertices.size());
  for (uint32_t v = 0; v < order.size(); ++v) {
    order[v] = v;
  }
  std::partial_sort(order.begin(), order.begin() + 3, order.end(), [&](uint32_t u, uint32_t w) {
    return DistanceSq<3>(vertices[u], p) < DistanceSq<3>(vertices[w], p);
  });
  return {order[0], order[1], order[2]};
}

TEST_F(SurfaceInCellTest, TheThreeNearestVerticesOfAPointAreOwners) {
  SurfaceInCell surface;
  int met = 0;
  int none = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<Point<3>> vertices;
    for (int i = 0; i < 40; ++i) {
      vertices.push_back(SomePoint());
    }
    const Point<3> site = SomePoint();
    surface.Take(CellOf(site, vertices));
    // A triangle about a point p that is as near to three vertices.
    const Point<3> p = SomePoint();
    const std::array<uint32_t, 3> three = NearestThree(p, vertices);
    const Point<3>& a = vertices[three[0]];
    const Point<3> u = Difference<3>(vertices[three[1]], a);
    const Point<3> w = Difference<3>(vertices[three[2]], a);
    const Point<3> normal = Cross(u, w);
    const Point<3> across_u = Cross(normal, u);
    const Point<3> across_w = Cross(w, normal);
    Point<3> centre;
    for (int axis = 0; axis < 3; ++axis) {
      centre[axis] =
          a[axis] + 0.5 / NormSq<3>(normal) * (NormSq<3>(w) * across_u[axis] + NormSq<3>(u) * across_w[axis]);
    }
    std::array<uint32_t, 3> nearest = NearestThree(centre, vertices);
    std::sort(nearest.begin(), nearest.end());
    std::array<uint32_t, 3> corners = three;
    std::sort(corners.begin(), corners.end());
    const bool is_met = nearest == corners && DistanceSq<3>(centre, site) < (1 - 1e-9) * DistanceSq<3>(centre, a);
    const Triangle triangle = {Between(centre, SomePoint(), 0.3), Between(centre, SomePoint(), 0.3), centre};
    std::vector<VertexId> owners;
    surface.AppendOwnersOfThree(triangle, owners);
    EXPECT_TRUE(owners.empty() || owners.size() >= 3);
    none += owners.empty() ? 1 : 0;
    if (is_met) {
      ++met;
      for (const uint32_t v : corners) {
        EXPECT_NE(std::find(owners.begin(), owners.end(), VertexId{v}), owners.end()) << "round " << round;
      }
    }
  }
  EXPECT_GT(met, 10);
  EXPECT_GT(none, 1000);
}

}  // namespace
}  // namespace wellspace::core
