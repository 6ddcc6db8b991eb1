// Segments, seeds and rules of the plane as they come in chunks: kept, taken back, compared and checked.
#include "server/inputs/plane_features.h"

#include <optional>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;

v1::SegmentChunk Chunk(const std::vector<uint32_t>& ends, const std::vector<int32_t>& markers = {}, bool open = false) {
  v1::SegmentChunk chunk;
  chunk.mutable_ends()->Add(ends.begin(), ends.end());
  chunk.mutable_markers()->Add(markers.begin(), markers.end());
  chunk.set_open(open);
  return chunk;
}

v1::FaceOptions Faces(v1::FaceRule rule, const std::vector<double>& seeds = {},
                      std::optional<double> max_area = std::nullopt) {
  v1::FaceOptions options;
  options.set_faces(rule);
  for (size_t i = 0; i < seeds.size(); i += 2) {
    v1::FaceSeed& seed = *options.add_seeds();
    seed.set_x(seeds[i]);
    seed.set_y(seeds[i + 1]);
    if (max_area.has_value()) {
      seed.set_max_area(*max_area);
    }
  }
  return options;
}

TEST(PlaneFeatures, KeepsMarkersAndRingsOfSegmentsFromManyChunks) {
  PlaneFeatures store;
  EXPECT_TRUE(store.IsEmpty());
  store.Append(Chunk({}));
  EXPECT_TRUE(store.IsEmpty());
  store.Append(Chunk({0, 1, 1, 2}));
  store.Append(Chunk({2, 3, 3, 4, 4, 5}, {7, 8, 9}, true), 1);
  store.Append(Chunk({5, 6}));
  const core::Features features = store.View();
  EXPECT_THAT(features.ends, ElementsAre(0, 1, 1, 2, 3, 4, 4, 5, 5, 6));
  EXPECT_THAT(features.markers, ElementsAre(0, 0, 8, 9, 0));
  EXPECT_THAT(features.is_open, ElementsAre(0, 0, 1, 1, 0));
  EXPECT_EQ(store.segment_count(), 5u);
  EXPECT_EQ(store.Summary().faces, v1::FACE_RULE_BOX);
}

TEST(PlaneFeatures, KeepsGroupsAndTheSnapDistance) {
  PlaneFeatures store;
  store.Append(Chunk({0, 1, 1, 2}));
  const FeatureSummary before = store.Summary();
  v1::SegmentChunk chunk = Chunk({2, 3, 3, 4, 4, 5});
  for (const uint32_t group : {8, 9, 9}) {
    chunk.add_groups(group);
  }
  store.Append(chunk, 1);
  EXPECT_THAT(store.View().groups, ElementsAre(0, 0, 9, 9));
  EXPECT_EQ(store.CountEqual(2, 2, Chunk({3, 4, 4, 5})), 0u) << "of other groups";
  chunk.mutable_ends()->erase(chunk.ends().begin(), chunk.ends().begin() + 2);
  EXPECT_FALSE(CheckSegments(chunk, 0).ok());
  EXPECT_EQ(DetailsOf(CheckSegments(chunk, 0)).field, "segments.groups");
  chunk.mutable_groups()->erase(chunk.groups().begin());
  EXPECT_EQ(store.CountEqual(2, 2, chunk), 2u);
  v1::FaceOptions rules = Faces(v1::FACE_RULE_UNION);
  rules.set_crossings(v1::CROSSING_RULE_SNAP);
  rules.set_snap_distance(0.25);
  EXPECT_TRUE(CheckFaces(rules, 0).ok());
  store.Append(rules);
  EXPECT_EQ(store.View().snap_distance, 0.25);
  EXPECT_EQ(store.View().faces, core::FaceRule::kUnion);
  EXPECT_EQ(store.Summary().faces, v1::FACE_RULE_UNION);
  EXPECT_FALSE(store.HasOtherRules(rules));
  rules.set_snap_distance(0.5);
  EXPECT_TRUE(store.HasOtherRules(rules));
  rules.set_crossings(v1::CROSSING_RULE_REFUSE);
  EXPECT_EQ(DetailsOf(CheckFaces(rules, 0)).field, "faces.snap_distance");
  rules.set_crossings(v1::CROSSING_RULE_SPLIT);
  rules.set_snap_distance(-1);
  EXPECT_EQ(DetailsOf(CheckFaces(rules, 0)).field, "faces.snap_distance");
  store.TakeBack(before);
  EXPECT_THAT(store.View().groups, ElementsAre(0, 0));
  EXPECT_EQ(store.View().snap_distance, 0);
}

TEST(PlaneFeatures, WhatWasAppendedCanBeTakenBack) {
  PlaneFeatures store;
  store.Append(Chunk({0, 1, 1, 2}));
  const FeatureSummary before = store.Summary();
  store.Append(Chunk({2, 3}, {7}));
  store.Append(Faces(v1::FACE_RULE_HOLES, {1, 2}, 0.5));
  store.TakeBack(before);
  EXPECT_THAT(store.View().ends, ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(store.View().markers, ElementsAre(0, 0));
  EXPECT_EQ(store.seed_count(), 0u);
  EXPECT_FALSE(store.Summary().has_rules);
  EXPECT_EQ(store.Summary().faces, v1::FACE_RULE_BOX) << "segments alone";
}

TEST(PlaneFeatures, TheLastRulesHoldAndSeedsAddUp) {
  PlaneFeatures store;
  EXPECT_TRUE(store.HasOtherRules(Faces(v1::FACE_RULE_UNSPECIFIED))) << "a cloud becomes a domain";
  store.Append(Faces(v1::FACE_RULE_HOLES, {1, 2}, 0.5));
  EXPECT_FALSE(store.IsEmpty());
  EXPECT_FALSE(store.HasOtherRules(Faces(v1::FACE_RULE_HOLES)));
  store.Append(Faces(v1::FACE_RULE_EVEN_ODD, {3, 4, 5, 6}), 1);
  EXPECT_TRUE(store.HasOtherRules(Faces(v1::FACE_RULE_HOLES)));
  EXPECT_EQ(store.Summary().faces, v1::FACE_RULE_EVEN_ODD);
  ASSERT_EQ(store.seed_count(), 2u);
  EXPECT_EQ(store.View().seeds[0].max_area, 0.5);
  EXPECT_EQ(store.View().seeds[1].at[1], 6);
}

TEST(PlaneFeatures, FindsTheFirstThatIsAnother) {
  PlaneFeatures store;
  store.Append(Chunk({0, 1, 1, 2, 2, 3}, {4, 0, 6}));
  EXPECT_EQ(store.CountEqual(1, 2, Chunk({1, 2, 2, 3}, {0, 6})), 2u);
  EXPECT_EQ(store.CountEqual(1, 2, Chunk({1, 2, 2, 3})), 1u) << "no markers are zeros";
  EXPECT_EQ(store.CountEqual(0, 1, Chunk({1, 0}, {4})), 0u) << "ends have an order";
  EXPECT_EQ(store.CountEqual(1, 1, Chunk({1, 2}, {}, true)), 0u);
  store.Append(Faces(v1::FACE_RULE_HOLES, {0, 1, 2, 3}));
  EXPECT_EQ(store.CountEqual(0, 2, Faces(v1::FACE_RULE_BOX, {0, 1, 2, 3})), 2u) << "rules are no part of seeds";
  EXPECT_EQ(store.CountEqual(0, 2, Faces(v1::FACE_RULE_HOLES, {-0.0, 1, 2, 3})), 0u) << "to the bit";
  EXPECT_EQ(store.CountEqual(1, 1, Faces(v1::FACE_RULE_HOLES, {2, 3}, 1)), 0u);
  v1::FaceOptions polygon = Faces(v1::FACE_RULE_HOLES, {2, 3});
  polygon.mutable_seeds(0)->mutable_polygon()->set_count(3);
  EXPECT_EQ(store.CountEqual(1, 1, polygon), 0u);
  store.Append(polygon);
  EXPECT_EQ(store.CountEqual(2, 1, polygon), 1u);
  EXPECT_EQ(store.View().seeds[2].segment_count, 3u);
  polygon.mutable_seeds(0)->mutable_polygon()->set_first(1);
  EXPECT_EQ(store.CountEqual(2, 1, polygon), 0u);
}

TEST(CheckSegments, NamesThePlaceInAll) {
  EXPECT_TRUE(CheckSegments(Chunk({1, 2, 3, 4}, {5, 6}), 0).ok());
  EXPECT_THAT(CheckSegments(Chunk({1, 2, 3}), 40).message(), ::testing::HasSubstr("after segment 40"));
  EXPECT_EQ(DetailsOf(CheckSegments(Chunk({1, 2, 3, 4}, {5}), 0)).field, "segments.markers");
  EXPECT_THAT(CheckFaces(Faces(v1::FACE_RULE_BOX, {0, 0, 1, 1}, -1), 40).message(), ::testing::HasSubstr("seeds[40]"));
  v1::FaceOptions polygon = Faces(v1::FACE_RULE_BOX, {0, 0});
  polygon.mutable_seeds(0)->mutable_polygon();
  EXPECT_THAT(CheckFaces(polygon, 40).message(), ::testing::HasSubstr("seeds[40]: its polygon has 0 segments"));
  for (const uint64_t first : {uint64_t{1} << 32, ~uint64_t{0}}) {
    polygon.mutable_seeds(0)->mutable_polygon()->set_count(2);
    polygon.mutable_seeds(0)->mutable_polygon()->set_first(first);
    EXPECT_EQ(DetailsOf(CheckFaces(polygon, 0)).field, "faces.seeds");
  }
}

}  // namespace
}  // namespace wellspace::server
