// Records of a batch: vertices that conflict with them, and provisional numbers in a replay.
#include "core/refine/speculation/batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "core/refine/box_domain.h"
#include "core/refine/speculation/recorded_steps.h"
#include "core/refine/star_writer.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// The structure has so many vertices when the records are made; provisional numbers are from there on.
constexpr uint32_t kCount = 100;
constexpr Point<2> kFirstSite = {0, 0};
constexpr Point<2> kSecondSite = {10, 0};
constexpr Point<2> kFirstNew = {0.5, 0};
constexpr Point<2> kSecondNew = {10.5, 0};
constexpr double kReach = 2;

// Two vertices that each ask for one point, and reach two units far. The second notifies the point of the first.
class BatchTest : public ::testing::Test {
 protected:
  BatchTest() {
    batch_.vertices = {VertexId{1}, VertexId{2}};
    batch_.Prepare(kCount, 0);
    Record(0, kFirstSite, kFirstNew, VertexId{7});
    Record(1, kSecondSite, kSecondNew, VertexId{kCount});
    batch_.records.is_speculated = true;
    batch_.BeginReplay({});
  }

  void Record(size_t at, const Point<2>& site, const Point<2>& p, VertexId neighbour) {
    batch_.records.Begin(at);
    batch_.records.by_vertex[at].reach_sq = kReach * kReach;
    batch_.records.notices.push_back({neighbour, 1, false});
    batch_.records.steps.push_back({{}, 1, true});
    BoxDomain<2>::Request request;
    request.insertion.near = batch_.vertices[at];
    request.insertion.other = neighbour;
    request.point.position = p;
    batch_.records.requests.push_back(request);
    const VertexId x = batch_.records.inserted.Append(p);
    batch_.records.steps.push_back({{}, 0, false});
    batch_.records.star = {{x, VertexId{3}}, {VertexId{3}, VertexId{4}}};
    batch_.records.AppendStar(at);
    batch_.records.SetKnown(at, site);
  }

  bool AreValid(bool first, bool second) const {
    return batch_.IsStillValid(0, kFirstSite) == first && batch_.IsStillValid(1, kSecondSite) == second;
  }

  Batch<BoxDomain<2>> batch_;
};

TEST_F(BatchTest, RecordsAreValidUntilAVertexConflicts) {
  EXPECT_TRUE(AreValid(true, true));
  const std::vector<Point<2>> far = {{5, 0}, {0, 2.01}, {100, 100}};
  batch_.NoteConflicts(far);
  EXPECT_TRUE(AreValid(true, true));
  const std::vector<Point<2>> near_second = {{10, 1.99}};
  batch_.NoteConflicts(near_second);
  EXPECT_TRUE(AreValid(true, false));
}

TEST_F(BatchTest, WithoutARecordNothingIsValid) {
  batch_.records.by_vertex[1].is_known = false;
  EXPECT_TRUE(AreValid(true, false));
  EXPECT_THAT(batch_.records.ExpectedOf(1), IsEmpty());
  batch_.records.is_speculated = false;
  EXPECT_TRUE(AreValid(false, false));
}

TEST_F(BatchTest, WhatIsExpectedDoesNotConflictOnceItIsInserted) {
  EXPECT_THAT(batch_.records.ExpectedOf(0), ElementsAre(kFirstNew));
  const std::vector<Point<2>> inserted = {kFirstNew};
  batch_.NoteInserted(inserted, VertexId{140});
  EXPECT_THAT(batch_.conflicts, IsEmpty());
  VertexId x{kCount};
  batch_.Renumber(x);
  EXPECT_EQ(x, VertexId{140});
  VertexId old{kCount - 1};
  batch_.Renumber(old);
  EXPECT_EQ(old, VertexId{kCount - 1}) << "it is not provisional";
}

TEST_F(BatchTest, WhatIsExpectedAndNotInsertedConflicts) {
  const std::vector<Point<2>> inserted = {{1.5, 0}};
  batch_.NoteInserted(inserted, VertexId{140});
  EXPECT_THAT(batch_.conflicts, ElementsAre(kFirstNew, Point<2>{1.5, 0}));
  EXPECT_TRUE(AreValid(false, true));
  EXPECT_EQ(batch_.numbers[0], kNoVertex);
}

TEST_F(BatchTest, StepsAreReplayedWithTheNumbersOfTheStructure) {
  batch_.numbers[0] = VertexId{140};
  batch_.refined = 1;
  RecordedSteps<BoxDomain<2>> steps(batch_);
  ASSERT_NE(steps.Assess(), nullptr);
  ASSERT_EQ(steps.Notices().size(), 1);
  EXPECT_EQ(steps.Notices()[0].vertex, VertexId{140});
  const InsertionRequest<2>* const request = steps.NextRequest();
  ASSERT_NE(request, nullptr);
  EXPECT_EQ(request->insertion.near, VertexId{2});
  EXPECT_EQ(request->insertion.other, VertexId{140});
  EXPECT_EQ(request->point.position, kSecondNew);
  steps.Inserted(VertexId{150});
  ASSERT_NE(steps.Assess(), nullptr);
  EXPECT_THAT(steps.Notices(), IsEmpty());
  EXPECT_EQ(steps.NextRequest(), nullptr);
  StarWriter<2> stars;
  const auto star = steps.FindStar(stars);
  EXPECT_THAT(star, ElementsAre(std::array{VertexId{3}, VertexId{4}}, std::array{VertexId{150}, VertexId{3}}));
}

TEST_F(BatchTest, WhatIsReassessedTakesThePlaceOfWhatWasFound) {
  batch_.records.Begin(0);
  batch_.records.steps.push_back({.found = {.bad_node = 3}, .is_reassessed = true});
  batch_.records.reassessed.push_back({.bad_node = -1, .next_edge_sq = 4});
  RecordedSteps<BoxDomain<2>> steps(batch_);
  const Assessment* const found = steps.Assess();
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->bad_node, 3) << "until a request is looked for";
  EXPECT_EQ(steps.NextRequest(), nullptr);
  EXPECT_EQ(found->bad_node, -1);
  EXPECT_EQ(found->next_edge_sq, 4);
}

}  // namespace
}  // namespace wellspace::core
