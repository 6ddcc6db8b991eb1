// Where segments are split, and which records of splits are still valid.
#include "core/refine/plane/split_place.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/voronoi/extra_vertices.h"
#include "tests/core/refine/plane/small_domain.h"

namespace wellspace::core {
namespace {

constexpr Point<2> kApex = {0, 0};
constexpr Point<2> kRight = {4, 0};
constexpr Point<2> kAbove = {3, 1};

// A flat triangle in a box: small angles at both ends of its longest side, from the apex to the right.
class SplitPlaceTest : public ::testing::Test {
 protected:
  double FromApex(const SegmentPoint& place) const { return planar_.DistanceFromEnd(place, long_.is_from_b); }
  MetPart Met(const test::SmallDomain::Found& found) const {
    return {found.segment, 0, planar_.LengthOf(found.segment), 1};
  }

  test::SmallDomain domain_{{kApex, kRight, kAbove, {0, 1}}, {0, 1, 1, 2, 2, 0}, FaceRule::kBox};
  const PlanarDomain& planar_ = *domain_.planar;
  const test::SmallDomain::Found long_ = domain_.Between(kApex, kRight);
  const VisibleDomain visible_{domain_.structure, planar_, nullptr};
};

TEST_F(SplitPlaceTest, AVertexOnASegmentNearbyGivesItsOwnDistance) {
  const VertexId v = domain_.Split(kApex, kAbove, 1.7);
  const PlanePlace place = SplitPlace(visible_, v, Met(long_));
  EXPECT_EQ(place.on.segment, long_.segment);
  EXPECT_EQ(place.on.is_from_b, long_.is_from_b);
  EXPECT_EQ(place.on.distance, 1.7) << "to the bit";
  EXPECT_EQ(place.order, SplitOrder::kAny);
}

TEST_F(SplitPlaceTest, AVertexInAFaceGivesItsFootAtARoundDistance) {
  domain_.Split(kApex, kRight, 3.5);
  const VertexId v = domain_.At({0, 1});
  const MetPart met{long_.segment, long_.is_from_b ? 2.9 : 0.9, long_.is_from_b ? 3.1 : 1.1, 1};
  const PlanePlace place = SplitPlace(visible_, v, met);  // the foot is beyond the part
  EXPECT_EQ(FromApex(place.on), 1) << "0.9, rounded by at most 0.3";
}

TEST_F(SplitPlaceTest, TheFirstBetweenTwoSmallAnglesIsInTheMiddleThird) {
  const SegmentPoint near_apex{long_.segment, long_.is_from_b, 0.25};
  const PlanePlace first = RoundPlace(visible_, near_apex, 1e-3);
  EXPECT_NEAR(first.on.distance, 4 / 3.0, 1e-3);
  EXPECT_EQ(first.order, SplitOrder::kFirst);
  domain_.Split(kApex, kRight, 2);
  const PlanePlace later = RoundPlace(visible_, near_apex, 1e-3);
  EXPECT_EQ(later.on.distance, 0.25);
  EXPECT_EQ(later.order, SplitOrder::kAny);
}

TEST_F(SplitPlaceTest, AnExpectedVertexSplitsASegmentToo) {
  ExtraVertices<2> positions;
  positions.Clear(VertexId{1000});
  std::vector<PlaneRequest> requests(1);
  requests[0].place.on = {long_.segment, false, 2};
  requests[0].point.position = {2, 0};
  positions.Append({2, 0});
  const ExpectedVertices expected(positions, requests);
  const VisibleDomain view(domain_.structure, planar_, &expected);
  EXPECT_EQ(RoundPlace(view, {long_.segment, long_.is_from_b, 0.25}, 1e-3).order, SplitOrder::kAfterExpected);
  EXPECT_TRUE(view.IsOn(VertexId{1000}, long_.segment));
  EXPECT_EQ(view.point(VertexId{1000}), (Point<2>{2, 0}));
  EXPECT_EQ(view.WaysFrom(VertexId{1000}).size(), 2u);
}

TEST_F(SplitPlaceTest, ARecordDependsOnWhetherTheSegmentIsWhole) {
  std::vector<PlaneRequest> requests(1);
  requests[0].place.on.segment = long_.segment;
  const auto are_in_order = [&](SplitOrder order) {
    requests.back().place.order = order;
    return AreSplitsInOrder(planar_, requests);
  };
  EXPECT_TRUE(are_in_order(SplitOrder::kAny));
  EXPECT_TRUE(are_in_order(SplitOrder::kFirst));
  EXPECT_FALSE(are_in_order(SplitOrder::kAfterExpected)) << "what was expected has not come";

  requests.push_back(requests[0]);
  requests[0].place.order = SplitOrder::kFirst;
  EXPECT_TRUE(are_in_order(SplitOrder::kAfterExpected)) << "its own first split comes before";
  requests.pop_back();

  domain_.Split(kApex, kRight, 2);
  EXPECT_TRUE(are_in_order(SplitOrder::kAny));
  EXPECT_FALSE(are_in_order(SplitOrder::kFirst));
  EXPECT_TRUE(are_in_order(SplitOrder::kAfterExpected));
}

}  // namespace
}  // namespace wellspace::core
