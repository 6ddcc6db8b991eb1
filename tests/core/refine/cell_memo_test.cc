// The memo of a cell is rounded to the safe side, and an edge is not taken for a radius.
#include "core/refine/cell_memo.h"

#include <gtest/gtest.h>

#include <cmath>

namespace wellspace::core {
namespace {

// No float: the nearest is less.
constexpr double kAboveAFloat = 1 + 0x1p-26;
// No float: the nearest is more.
constexpr double kBelowAFloat = 1 - 0x1p-27;

TEST(CellMemoTest, WhereNothingIsRememberedANodeMayBeAnywhere) {
  EXPECT_TRUE(CellMemo().MayReachBeyond(1e300));
  EXPECT_FALSE(CellMemo().HasBoundaryEdge());
}

TEST(CellMemoTest, ARadiusIsRoundedUp) {
  for (const double radius_sq : {kAboveAFloat, kBelowAFloat}) {
    const CellMemo memo = CellMemo::OfRadius(radius_sq);
    EXPECT_FALSE(memo.HasBoundaryEdge());
    EXPECT_TRUE(memo.MayReachBeyond(std::nextafter(radius_sq, 0)));
    EXPECT_FALSE(memo.MayReachBeyond(1.000001 * radius_sq));
  }
}

TEST(CellMemoTest, AnEdgeIsRoundedDown) {
  for (const double edge_sq : {kAboveAFloat, kBelowAFloat}) {
    const CellMemo memo = CellMemo::OfBoundaryEdge(edge_sq);
    ASSERT_TRUE(memo.HasBoundaryEdge());
    EXPECT_LE(memo.boundary_edge_sq(), edge_sq);
    EXPECT_GE(memo.boundary_edge_sq(), 0.999999 * edge_sq);
    EXPECT_FALSE(memo.MayReachBeyond(0)) << "it tells nothing of radii";
  }
}

// A cell that was found good without a look at its nodes has a radius of 0.
TEST(CellMemoTest, ARadiusOfZeroIsNoEdge) {
  EXPECT_FALSE(CellMemo::OfRadius(0).HasBoundaryEdge());
  EXPECT_FALSE(CellMemo::OfRadius(0).MayReachBeyond(0));
}

}  // namespace
}  // namespace wellspace::core
