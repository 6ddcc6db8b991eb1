// The assessment of single cells in a domain, and the points that they ask for.
#include "core/refine/plane/plane_rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/refine/step_rules.h"
#include "tests/core/refine/plane/small_domain.h"

namespace wellspace::core {
namespace {

constexpr double kLimitSq = 1e6;  // every edge may ask

// The rules for a domain as it is.
class Looks {
 public:
  explicit Looks(const test::SmallDomain& domain, double rho = std::sqrt(2.0))
      : domain_(domain), step_rules_(domain.structure, {.rho = rho}, 1e-9) {}

  PlaneAssessment Assess(VertexId v, double limit_sq = kLimitSq, const PassedOver& passed_over = {}) {
    domain_.structure.UnplacedClippedVoronoi(v, step_rules_.ClipAround(v, limit_sq), workspace_);
    return rules_.AssessCell(v, workspace_.cell, workspace_.segments, limit_sq, passed_over);
  }
  PlaneRules::Answer Next(VertexId v, const PlaneAssessment& found) {
    const auto cell_of = [this](VertexId u, const Box<2>& clip) {
      domain_.structure.UnplacedClippedVoronoi(u, clip, scratch_);
      scratch_.cell.Place();
      return &scratch_.cell;
    };
    return rules_.NextRequest(v, workspace_.cell, workspace_.segments, found, kLimitSq, cell_of, scratch_);
  }
  NodeName NameOf(int node) const { return NodeView(workspace_.cell, workspace_.cell.nodes()[node]).Name(); }

  const PlaneRules& rules() const { return rules_; }
  Workspace<2>& scratch() { return scratch_; }

 private:
  const test::SmallDomain& domain_;
  const StepRules<2> step_rules_;
  const PlaneRules rules_{domain_.structure, *domain_.planar, step_rules_};
  Workspace<2> workspace_;
  Workspace<2> scratch_;
};

test::SmallDomain Square(std::vector<Point<2>> inner = {}) {
  std::vector<Point<2>> points = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  points.insert(points.end(), inner.begin(), inner.end());
  return {points, {0, 1, 1, 2, 2, 3, 3, 0}, FaceRule::kHoles};
}

TEST(PlaneRulesTest, ASegmentThatACellMeetsIsSplitAtTheFoot) {
  const test::SmallDomain domain = Square({{1.75, 0.5}});
  Looks looks(domain);
  const VertexId v = domain.At({1.75, 0.5});
  const PlaneAssessment found = looks.Assess(v);
  EXPECT_TRUE(found.is_segment_encroached);
  EXPECT_EQ(found.encroached_face, -1) << "no face of the box counts";
  EXPECT_FALSE(found.IsGood());
  EXPECT_EQ(found.met.segment, domain.Between({0, 0}, {4, 0}).segment);
  EXPECT_NEAR(found.met.distance, 0.5, 1e-12);

  const PlaneRules::Answer answer = looks.Next(v, found);
  ASSERT_TRUE(answer.request.has_value());
  EXPECT_EQ(answer.request->insertion.reason, Reason::kEncroachment);
  EXPECT_EQ(answer.request->place.on.segment, found.met.segment);
  EXPECT_EQ(answer.request->point.position, (Point<2>{1.75, 0}));
  EXPECT_NEAR(answer.request->point.empty_radius_sq, 0.25, 1e-12);
}

TEST(PlaneRulesTest, WhatIsBeyondTheOutlineDoesNotCount) {
  const test::SmallDomain domain = Square();
  Looks looks(domain);
  for (const Point<2>& corner : {Point<2>{0, 0}, {4, 0}, {4, 4}, {0, 4}}) {
    const PlaneAssessment found = looks.Assess(domain.At(corner));
    EXPECT_TRUE(found.IsGood()) << "though the cell reaches far out";
    EXPECT_FALSE(found.is_clipped);
    EXPECT_NEAR(found.radius_sq, 8, 1e-12);
    EXPECT_FALSE(looks.Next(domain.At(corner), found).request.has_value());
  }
}

TEST(PlaneRulesTest, ABadNodeAsksInItsFace) {
  const test::SmallDomain domain = Square({{2, 2}, {2, 2.25}});
  Looks looks(domain);
  const VertexId v = domain.At({2, 2});
  const PlaneAssessment found = looks.Assess(v);
  ASSERT_FALSE(found.is_segment_encroached);
  ASSERT_GE(found.bad_node, 0);
  const PlaneRules::Answer answer = looks.Next(v, found);
  ASSERT_TRUE(answer.request.has_value());
  EXPECT_EQ(answer.request->insertion.reason, Reason::kRatio);
  EXPECT_EQ(answer.request->insertion.other, domain.At({2, 2.25}));
  EXPECT_FALSE(answer.request->place.on.IsOnSegment());
  EXPECT_TRUE(domain.planar->faces().IsMeshed(answer.request->place.face));

  const PlaneAssessment without = looks.Assess(v, kLimitSq, {.nodes = {looks.NameOf(found.bad_node)}, .segments = {}});
  EXPECT_NE(without.bad_node, found.bad_node) << "a node that is refused asks for nothing";
  const PlaneAssessment later = looks.Assess(v, 0.01);
  EXPECT_LT(later.bad_node, 0) << "the bucket is below its edge";
  EXPECT_NEAR(later.next_edge_sq, 0.0625, 1e-12);
}

// At 15 degrees the triangle of the apex and two vertices at the same distance is bad, and stays.
class SmallAngleTest : public ::testing::Test {
 protected:
  // Whether the node of `v`, `u` and the apex is bad.
  bool IsBadAtApex(VertexId v, VertexId u) const {
    Looks looks(domain_);
    const NodeName at_apex = std::minmax(u, domain_.At(kApex));
    PassedOver refused;
    for (PlaneAssessment found = looks.Assess(v); found.bad_node >= 0; found = looks.Assess(v, kLimitSq, refused)) {
      refused.nodes.push_back(looks.NameOf(found.bad_node));
    }
    return std::find(refused.nodes.begin(), refused.nodes.end(), at_apex) != refused.nodes.end();
  }

  static constexpr Point<2> kApex = {0, 0};
  static constexpr Point<2> kRight = {4, 0};
  static constexpr Point<2> kUp = {3.875, 1.03125};
  test::SmallDomain domain_{{kApex, kRight, kUp}, {0, 1, 0, 2}, FaceRule::kBox};
  const VertexId v_ = domain_.Split(kApex, kRight, 2);
};

TEST_F(SmallAngleTest, TheSecondSegmentIsSplitAtTheDistanceOfTheFirst) {
  Looks looks(domain_);
  const PlaneAssessment met = looks.Assess(v_);
  ASSERT_TRUE(met.is_segment_encroached);
  const PlaneRules::Answer answer = looks.Next(v_, met);
  ASSERT_TRUE(answer.request.has_value());
  EXPECT_EQ(answer.request->place.on.segment, domain_.Between(kApex, kUp).segment);
  EXPECT_EQ(answer.request->place.on.distance, 2) << "the distance of v from the common end";
}

TEST_F(SmallAngleTest, ATriangleAcrossStays) { EXPECT_FALSE(IsBadAtApex(v_, domain_.Split(kApex, kUp, 2))); }

TEST_F(SmallAngleTest, ATriangleOfOtherDistancesIsBad) {
  EXPECT_TRUE(IsBadAtApex(v_, domain_.Split(kApex, kUp, 2.0625)));
}

TEST(PlaneRulesTest, TheNearestSegmentIsOneThatTheVertexIsNotOn) {
  const test::SmallDomain domain = Square({{1.75, 0.5}});
  Looks looks(domain);
  EXPECT_NEAR(looks.rules().NearestFeatureSq(domain.At({1.75, 0.5}), 100, looks.scratch()), 0.25, 1e-12);
  EXPECT_EQ(looks.rules().NearestFeatureSq(domain.At({1.75, 0.5}), 0.2, looks.scratch()), 0.2);
  EXPECT_NEAR(looks.rules().NearestFeatureSq(domain.At({0, 0}), 100, looks.scratch()), 16, 1e-12);
}

}  // namespace
}  // namespace wellspace::core
