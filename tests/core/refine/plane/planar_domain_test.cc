// Where vertices are in a domain: on which segments, in which sectors and faces.
#include "core/refine/plane/planar_domain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/core/refine/plane/small_domain.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;

constexpr Point<2> kApex = {0, 0};
constexpr Point<2> kRight = {4, 0};
constexpr Point<2> kTop = {0, 4};

// A triangle with a point inside and a right angle at the apex.
class PlanarDomainTest : public ::testing::Test {
 protected:
  test::SmallDomain domain_{{kApex, kRight, kTop, {1, 1}}, {0, 1, 1, 2, 2, 0}, FaceRule::kHoles};
  const PlanarDomain& planar_ = *domain_.planar;
};

TEST_F(PlanarDomainTest, GivenPointsAreEndsOrInAFace) {
  EXPECT_EQ(planar_.segment_count(), 3u);
  EXPECT_EQ(planar_.point_count(), 4u);
  const VertexId inner = domain_.At({1, 1});
  EXPECT_TRUE(planar_.IsInFace(inner));
  EXPECT_TRUE(planar_.faces().IsMeshed(planar_.FaceOf(inner)));
  EXPECT_TRUE(planar_.WaysFrom(inner).empty());
  EXPECT_FALSE(planar_.IsInFace(domain_.At(kApex)));
  EXPECT_FALSE(planar_.PlaceOf(domain_.At(kApex)).IsOnSegment()) << "it is an end of two";
}

TEST_F(PlanarDomainTest, AVertexOnASegmentHasTwoWaysAndADistanceFromBothEnds) {
  const VertexId v = domain_.Split(kApex, kRight, 1.5);
  const auto [segment, is_from_b] = domain_.Between(kApex, kRight);
  EXPECT_FALSE(planar_.IsGraphPoint(v));
  EXPECT_FALSE(planar_.IsInFace(v));
  EXPECT_TRUE(planar_.IsOn(v, segment));
  EXPECT_EQ(domain_.structure.point(v), (Point<2>{1.5, 0}));
  EXPECT_EQ(planar_.WaysFrom(v).size(), 2u);
  EXPECT_EQ(planar_.DistanceFromEnd(v, segment, is_from_b), 1.5);
  EXPECT_EQ(planar_.DistanceFromEnd(v, segment, !is_from_b), 2.5);
  EXPECT_EQ(planar_.SplitsOf(segment), 1u);
}

TEST_F(PlanarDomainTest, OneSectorOfAnEndOfTheOutlineIsMeshed) {
  for (const VertexId v : {domain_.At(kApex), domain_.Split(kApex, kRight, 2)}) {
    const auto is_meshed = [&](const Point<2>& d) {
      return planar_.faces().IsMeshed(planar_.FaceOfSector(v, planar_.SectorToward(v, d)));
    };
    EXPECT_TRUE(is_meshed({1, 1}));
    EXPECT_TRUE(is_meshed({0.01, 1}));
    EXPECT_FALSE(is_meshed({1, -0.01}));
    EXPECT_FALSE(is_meshed({-1, -1}));
  }
}

TEST_F(PlanarDomainTest, AcuteIsBelowSixtyDegrees) {
  const auto way = [&](const Point<2>& p, const Point<2>& q) {
    const auto [segment, is_from_b] = domain_.Between(p, q);
    return HalfEdgeOf(segment, is_from_b);
  };
  EXPECT_FALSE(planar_.HasSmallAngle(way(kApex, kRight)));
  EXPECT_TRUE(planar_.HasSmallAngle(way(kRight, kApex)));
  EXPECT_TRUE(planar_.HasSmallAngle(way(kRight, kTop)));
  EXPECT_NEAR(planar_.MinAngle(), std::numbers::pi / 4, 1e-15);
}

TEST_F(PlanarDomainTest, TheFootOfAPointIsAlongTheSegment) {
  const auto [segment, is_from_b] = domain_.Between(kApex, kRight);
  const PlanarDomain::Foot foot = planar_.FootOf({1, 3}, segment);
  EXPECT_EQ(is_from_b ? 4 - foot.from_a : foot.from_a, 1);
  EXPECT_EQ(std::abs(foot.away), 3);
  EXPECT_EQ(planar_.DistanceSqTo({1, 3}, segment), 9);
  EXPECT_EQ(planar_.DistanceSqTo({7, 4}, segment), 25) << "beyond the end";
}

TEST_F(PlanarDomainTest, ChainsGoFromEndToEnd) {
  const VertexId last = domain_.Split(kApex, kRight, 3);
  const VertexId first = domain_.Split(kApex, kRight, 1);
  const auto [segment, is_from_b] = domain_.Between(kApex, kRight);
  const PlanarDomain::Chains chains = planar_.FindChains();
  std::vector<VertexId> chain(chains.Of(segment).begin(), chains.Of(segment).end());
  if (is_from_b) {
    std::reverse(chain.begin(), chain.end());
  }
  EXPECT_THAT(chain, ElementsAre(domain_.At(kApex), first, last, domain_.At(kRight)));
  EXPECT_EQ(chains.Of(domain_.Between(kApex, kTop).segment).size(), 2u);
}

}  // namespace
}  // namespace wellspace::core
