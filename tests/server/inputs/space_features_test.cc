// Triangles, seeds and options of space as they come in chunks: kept, compared and checked.
#include "server/inputs/space_features.h"

#include <limits>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "server/inputs/feature_store.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::TriangleChunk Chunk(const std::vector<uint32_t>& corners, const std::vector<int32_t>& markers = {}) {
  v1::TriangleChunk chunk;
  chunk.mutable_corners()->Add(corners.begin(), corners.end());
  chunk.mutable_markers()->Add(markers.begin(), markers.end());
  return chunk;
}

v1::SurfaceOptions Surface(v1::SolidRule rule, const std::vector<double>& seeds = {}) {
  v1::SurfaceOptions options;
  options.set_solids(rule);
  for (size_t i = 0; i < seeds.size(); i += 3) {
    v1::SolidSeed& seed = *options.add_seeds();
    seed.set_x(seeds[i]);
    seed.set_y(seeds[i + 1]);
    seed.set_z(seeds[i + 2]);
  }
  return options;
}

v1::Box BoxOf(const std::vector<double>& low, const std::vector<double>& high) {
  v1::Box box;
  box.mutable_low()->Add(low.begin(), low.end());
  box.mutable_high()->Add(high.begin(), high.end());
  return box;
}

TEST(SpaceFeatures, KeepsTheBox) {
  SpaceFeatures store;
  v1::SurfaceOptions options = Surface(v1::SOLID_RULE_BOX);
  *options.mutable_box() = BoxOf({0, 1, 2}, {3, 4, 5});
  EXPECT_TRUE(CheckSurface(options, 0).ok());
  store.Append(options);
  EXPECT_EQ(store.View().solids, core::SolidRule::kBox);
  EXPECT_EQ(store.View().box, (core::Box<3>{{0, 1, 2}, {3, 4, 5}}));
  EXPECT_EQ(store.Summary().surface->box().high(2), 5);
  EXPECT_FALSE(store.HasOtherRules(options));
  options.mutable_box()->set_high(2, 6);
  EXPECT_TRUE(store.HasOtherRules(options));
}

TEST(SpaceFeatures, KeepsMarkersOfTrianglesFromManyChunks) {
  SpaceFeatures store;
  store.Append(Chunk({}));
  EXPECT_TRUE(store.IsEmpty());
  EXPECT_FALSE(store.Summary().surface.has_value());
  store.Append(Chunk({0, 1, 2}));
  store.Append(Chunk({0, 1, 2, 2, 1, 3, 3, 4, 5}, {7, 8, 9}), 1);
  const core::SurfaceFeatures features = store.View();
  EXPECT_THAT(features.corners, ElementsAre(0, 1, 2, 2, 1, 3, 3, 4, 5));
  EXPECT_THAT(features.markers, ElementsAre(0, 8, 9));
  EXPECT_EQ(store.Summary().counts, (FeatureCounts{.triangles = 3}));
  ASSERT_TRUE(store.Summary().surface.has_value());
  EXPECT_EQ(store.Summary().surface->solids(), v1::SOLID_RULE_EVEN_ODD);
  EXPECT_EQ(store.Summary().surface->crease_angle(), core::SurfaceFeatures().crease_angle);
  EXPECT_FALSE(store.Summary().surface->has_weld());
}

TEST(SpaceFeatures, TheLastOptionsHoldAndSeedsAddUp) {
  SpaceFeatures store;
  EXPECT_TRUE(store.HasOtherRules(v1::SurfaceOptions())) << "a cloud becomes a domain";
  v1::SurfaceOptions options = Surface(v1::SOLID_RULE_HOLES, {1, 2, 3});
  options.mutable_seeds(0)->set_max_volume(0.5);
  options.set_weld(1e-3);
  options.set_crease_angle(40);
  options.set_min_patch(0.25);
  store.Append(options);
  EXPECT_FALSE(store.HasOtherRules(options));
  EXPECT_EQ(store.View().solids, core::SolidRule::kHoles);
  EXPECT_EQ(store.View().weld, 1e-3);
  EXPECT_EQ(store.View().crease_angle, 40);
  EXPECT_EQ(store.View().min_patch, 0.25);
  const FeatureSummary before = store.Summary();
  EXPECT_EQ(before.surface->weld(), 1e-3);
  EXPECT_EQ(before.surface->seeds_size(), 0);
  store.Append(Chunk({0, 1, 2}));
  store.Append(Surface(v1::SOLID_RULE_UNSPECIFIED, {3, 4, 5, 6, 7, 8}), 1);
  EXPECT_EQ(store.View().solids, core::SolidRule::kEvenOdd);
  EXPECT_EQ(store.View().weld, 0);
  ASSERT_EQ(store.seed_count(), 2u);
  EXPECT_EQ(store.View().seeds[0].max_volume, 0.5);
  EXPECT_EQ(store.View().seeds[1].at[2], 8);
  EXPECT_EQ(store.View().seeds[1].max_volume, std::numeric_limits<double>::infinity());
  store.TakeBack(before);
  EXPECT_EQ(store.triangle_count(), 0u);
  EXPECT_EQ(store.seed_count(), 1u);
  EXPECT_FALSE(store.HasOtherRules(options));
  store.TakeBack(FeatureSummary());
  EXPECT_TRUE(store.IsEmpty());
}

TEST(SpaceFeatures, NamesStayUntilOthersCome) {
  SpaceFeatures store;
  v1::SurfaceOptions options = Surface(v1::SOLID_RULE_HOLES, {});
  options.set_keep_points(true);
  (*options.mutable_names()->mutable_markers())[7] = "inlet";
  (*options.mutable_names()->mutable_regions())[2] = "steel";
  store.Append(options);
  EXPECT_FALSE(store.HasOtherRules(options));
  EXPECT_TRUE(store.View().keeps_points);
  EXPECT_EQ(store.View().names->markers.at(7), "inlet");
  const FeatureSummary before = store.Summary();
  EXPECT_EQ(before.names.regions().at(2), "steel");
  EXPECT_TRUE(before.surface->keep_points());

  options.clear_names();
  EXPECT_FALSE(store.HasOtherRules(options)) << "none are no other ones";
  store.Append(options);
  EXPECT_EQ(store.View().names->markers.size(), 1u);
  (*options.mutable_names()->mutable_markers())[7] = "outlet";
  EXPECT_TRUE(store.HasOtherRules(options));
  store.Append(options);
  EXPECT_EQ(store.View().names->markers.at(7), "outlet");
  EXPECT_TRUE(store.View().names->regions.empty()) << "both tables are replaced";
  store.TakeBack(before);
  EXPECT_EQ(store.View().names->markers.at(7), "inlet");
  options.set_keep_points(false);
  EXPECT_TRUE(store.HasOtherRules(options));
}

TEST(SpaceFeatures, FindsTheFirstThatIsAnother) {
  SpaceFeatures store;
  store.Append(Chunk({0, 1, 2, 1, 2, 3, 2, 3, 4}, {4, 0, 6}));
  EXPECT_EQ(store.CountEqual(1, 2, Chunk({1, 2, 3, 2, 3, 4}, {0, 6})), 2u);
  EXPECT_EQ(store.CountEqual(1, 2, Chunk({1, 2, 3, 2, 3, 4})), 1u) << "no markers are zeros";
  EXPECT_EQ(store.CountEqual(0, 1, Chunk({1, 2, 0}, {4})), 0u) << "corners have an order";
  store.Append(Surface(v1::SOLID_RULE_HOLES, {0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(store.CountEqual(0, 2, Surface(v1::SOLID_RULE_EVEN_ODD, {0, 1, 2, 3, 4, 5})), 2u)
      << "rules are no part of seeds";
  EXPECT_EQ(store.CountEqual(0, 2, Surface(v1::SOLID_RULE_HOLES, {-0.0, 1, 2, 3, 4, 5})), 0u) << "to the bit";
  v1::SurfaceOptions other = Surface(v1::SOLID_RULE_HOLES, {3, 4, 5});
  other.mutable_seeds(0)->set_hole(true);
  EXPECT_EQ(store.CountEqual(1, 1, other), 0u);
}

TEST(CheckTriangles, NamesThePlaceInAll) {
  EXPECT_TRUE(CheckTriangles(Chunk({1, 2, 3, 4, 5, 6}, {5, 6}), 0).ok());
  EXPECT_THAT(CheckTriangles(Chunk({1, 2, 3, 4}), 40).message(), HasSubstr("after triangle 40"));
  EXPECT_EQ(DetailsOf(CheckTriangles(Chunk({1, 2}), 0)).field, "triangles.corners");
  EXPECT_EQ(DetailsOf(CheckTriangles(Chunk({1, 2, 3, 4, 5, 6}, {5}), 0)).field, "triangles.markers");
}

TEST(CheckSurface, RefusesWhatCannotBe) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto field = [](auto change) {
    v1::SurfaceOptions options = Surface(v1::SOLID_RULE_HOLES, {0, 0, 0});
    change(options);
    const absl::Status status = CheckSurface(options, 40);
    EXPECT_FALSE(status.ok());
    EXPECT_EQ(DetailsOf(status).reason, "INVALID_TRIANGLES");
    return DetailsOf(status).field;
  };
  EXPECT_EQ(field([](auto& o) { o.set_solids(static_cast<v1::SolidRule>(5)); }), "surface.solids");
  EXPECT_EQ(field([](auto& o) { o.set_solids(v1::SOLID_RULE_BOX); }), "surface.box") << "needs one";
  EXPECT_EQ(field([](auto& o) { *o.mutable_box() = BoxOf({0, 0, 0}, {1, 1, 1}); }), "surface.box") << "of another rule";
  for (const auto& [low, high] : std::vector<std::pair<std::vector<double>, std::vector<double>>>{
           {{0, 0}, {1, 1}}, {{0, 0, 0}, {1, 0, 1}}, {{0, 0, kNan}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, kInfinity}}, {}}) {
    EXPECT_EQ(field([&](auto& o) {
                o.set_solids(v1::SOLID_RULE_BOX);
                *o.mutable_box() = BoxOf(low, high);
              }),
              "surface.box");
  }
  for (const double angle : {kNan, -1.0, 180.5, kInfinity}) {
    EXPECT_EQ(field([&](auto& o) { o.set_crease_angle(angle); }), "surface.crease_angle") << angle;
  }
  for (const double length : {kNan, -1.0, kInfinity}) {
    EXPECT_EQ(field([&](auto& o) { o.set_weld(length); }), "surface.weld") << length;
    EXPECT_EQ(field([&](auto& o) { o.set_min_patch(length); }), "surface.min_patch") << length;
    EXPECT_EQ(field([&](auto& o) { o.mutable_seeds(0)->set_max_volume(length); }), "surface.seeds") << length;
  }
  EXPECT_EQ(field([&](auto& o) { o.mutable_seeds(0)->set_z(kNan); }), "surface.seeds");
  v1::SurfaceOptions seed = Surface(v1::SOLID_RULE_HOLES, {0, kInfinity, 0});
  EXPECT_THAT(CheckSurface(seed, 40).message(), HasSubstr("seeds[40]: it is at (0, inf, 0)"));
}

TEST(CheckFeatures, EachKindHasItsDimension) {
  FeaturePart plane;
  plane.mutable_faces();
  FeaturePart space;
  space.mutable_triangles();
  EXPECT_TRUE(CheckFeatures(plane, {}, 2).ok());
  EXPECT_TRUE(CheckFeatures(space, {}, 3).ok());
  EXPECT_EQ(DetailsOf(CheckFeatures(plane, {}, 3)).reason, "INVALID_SEGMENTS");
  EXPECT_EQ(DetailsOf(CheckFeatures(space, {}, 2)).reason, "INVALID_TRIANGLES");
  EXPECT_EQ(DetailsOf(CheckFeatures(space, {}, 4)).field, "triangles");
}

TEST(FeatureStore, IsOfThePlaneOrOfSpace) {
  FeaturePart plane;
  plane.mutable_segments()->mutable_ends()->Add(1);
  plane.mutable_segments()->mutable_ends()->Add(2);
  FeaturePart space;
  *space.mutable_triangles() = Chunk({4, 5, 6});
  FeatureStore in_plane;
  FeatureStore in_space;
  const std::vector<double> points = {1, 2, 3};
  EXPECT_FALSE(in_plane.InputOf(points).features.has_value());
  in_plane.Append(plane);
  in_space.Append(space);
  EXPECT_TRUE(in_plane.InputOf(points).features.has_value());
  EXPECT_FALSE(in_plane.InputOf(points).surface.has_value());
  EXPECT_TRUE(in_space.InputOf(points).surface.has_value());
  EXPECT_FALSE(in_space.InputOf(points).features.has_value());
  EXPECT_THAT(in_space.points(), ElementsAre(4, 5, 6));
  EXPECT_TRUE(in_plane.Summary().AreInBox());
  EXPECT_FALSE(in_space.Summary().AreInBox()) << "the box of a surface grows with it";
  EXPECT_EQ(in_plane.bytes(), 17u);
  EXPECT_EQ(in_space.bytes(), 16u);
}

}  // namespace
}  // namespace wellspace::server
