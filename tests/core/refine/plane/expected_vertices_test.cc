// Vertices of a domain that are expected: where they are, and how far away.
#include "core/refine/plane/expected_vertices.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace wellspace::core {
namespace {

constexpr uint32_t kCount = 100;

class ExpectedVerticesTest : public ::testing::Test {
 protected:
  ExpectedVerticesTest() { positions_.Clear(VertexId{kCount}); }

  void Add(const Point<2>& p, const SegmentPoint& on) {
    PlaneRequest request;
    request.point.position = p;
    request.place.on = on;
    requests_.push_back(request);
    positions_.Append(p);
  }

  ExtraVertices<2> positions_;
  std::vector<PlaneRequest> requests_;
  ExpectedVertices expected_{positions_, requests_};
};

TEST_F(ExpectedVerticesTest, ProvisionalNumbersHaveTheirPlaces) {
  Add({1, 2}, {});
  Add({3, 4}, {.segment = 7, .distance = 0.5});
  EXPECT_FALSE(expected_.Has(VertexId{kCount - 1}));
  EXPECT_TRUE(expected_.Has(VertexId{kCount}));
  EXPECT_EQ(expected_.point(VertexId{kCount + 1}), (Point<2>{3, 4}));
  EXPECT_FALSE(expected_.PlaceOf(VertexId{kCount}).IsOnSegment());
  EXPECT_EQ(expected_.PlaceOf(VertexId{kCount + 1}).segment, 7u);
}

TEST_F(ExpectedVerticesTest, ASegmentHasVerticesOnceOneIsExpectedOnIt) {
  EXPECT_FALSE(expected_.AreOn(7));
  Add({1, 2}, {});
  Add({3, 4}, {.segment = 7, .distance = 0.5});
  EXPECT_TRUE(expected_.AreOn(7));
  EXPECT_FALSE(expected_.AreOn(6));
}

TEST_F(ExpectedVerticesTest, TheNearestCountsWithinTheLimit) {
  EXPECT_EQ(expected_.NearestSq({0, 0}, 9), 9);
  for (int i = 0; i < 40; ++i) {
    Add({3.0 + i, 4}, {});
  }
  EXPECT_EQ(expected_.NearestSq({0, 0}, 30), 25);
  EXPECT_EQ(expected_.NearestSq({0, 0}, 24), 24) << "it is farther";
  EXPECT_EQ(expected_.NearestSq({42, 5}, 30), 1) << "the last one";
}

}  // namespace
}  // namespace wellspace::core
