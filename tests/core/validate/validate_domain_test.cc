// Checks of domains: right meshes are right, by every rule of faces, and each fault that is planted is found.
#include "core/validate/validate_domain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/geometry/segment.h"
#include "tests/core/domain_check.h"
#include "tests/core/domain_input.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"

namespace wellspace::core {
namespace {

using test::CheckAgainst;
using test::DomainInput;
using test::DomainMesh;
using ::testing::AllOf;
using ::testing::HasSubstr;

DomainInput& Square(DomainInput& input, double low, double high, int32_t marker = 0) {
  return input.Ring({{low, low}, {high, low}, {high, high}, {low, high}}, marker);
}

// A polygon of all segments from `first` on.
void AddPolygon(DomainInput& input, size_t first, int32_t region) {
  input.seeds.push_back({.region = region,
                         .first_segment = static_cast<uint32_t>(first),
                         .segment_count = static_cast<uint32_t>(input.ends.size() / 2 - first)});
}

DomainMesh Made(const DomainInput& input) {
  const absl::StatusOr<Mesh> mesh = input.Make();
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return DomainMesh(mesh.value());
}

double AreaOf(const DomainMesh& mesh, int32_t region) {
  double area = 0;
  for (size_t t = 0; t < mesh.regions.size(); ++t) {
    const auto at = [&](int k) { return PointAt<2>(mesh.points, mesh.simplices[3 * t + k]); };
    area += mesh.regions[t] == region ? 0.5 * Cross(Difference<2>(at(1), at(0)), Difference<2>(at(2), at(0))) : 0;
  }
  return area;
}

TEST(ValidateDomainTest, OneStretchOfASegmentMayBoundNothing) {
  // A notch whose side lies on that of the square, and a zone on its border.
  for (const std::vector<Point<2>>& inner :
       {std::vector<Point<2>>{{0, 1}, {3, 2}, {0, 3}}, std::vector<Point<2>>{{0, 1}, {3, 1}, {3, 4}, {0, 4}}}) {
    DomainInput input;
    Square(input, 0, 10).Ring(inner);
    input.faces = FaceRule::kEvenOdd;
    EXPECT_EQ(CheckAgainst(input, Made(input)), absl::OkStatus());
  }
}

TEST(ValidateDomainTest, ALineMayLeaveTheDomainAndComeBack) {
  DomainInput input;
  Square(input, 0, 1);
  Square(input, 2, 3).Segment({-1, 0.5}, {4, 2.5});
  input.crossings = CrossingRule::kSplit;
  EXPECT_EQ(CheckAgainst(input, Made(input)), absl::OkStatus());
}

TEST(ValidateDomainTest, AZoneIsNoHoleByTheRuleOfHoles) {
  DomainInput input;
  Square(input, 0, 10);
  AddPolygon(input, 0, 1);
  Square(input, 3, 6);
  AddPolygon(input, 4, 2);
  DomainMesh mesh = Made(input);
  EXPECT_NEAR(AreaOf(mesh, 1), 91, 1e-9);
  EXPECT_NEAR(AreaOf(mesh, 2), 9, 1e-9);
  EXPECT_EQ(CheckAgainst(input, mesh), absl::OkStatus());
  input.faces = FaceRule::kEvenOdd;
  EXPECT_THAT(std::string(CheckAgainst(input, mesh).message()), HasSubstr("an even number of rings surrounds it"));
}

// Two squares with markers, one with a hole and a zone of small triangles; a third one apart, with a point in it.
DomainInput ManyThings() {
  DomainInput input;
  Square(input, 0, 10, 4);
  Square(input, 2, 4, 5);
  Square(input, 6, 8);
  Square(input, 20, 25, -3);
  input.points.insert(input.points.end(), {22.5, 23});
  input.seeds = {
      {.at = {3, 3}, .is_hole = true}, {.at = {7, 7}, .region = 7, .max_area = 0.25}, {.at = {21, 21}, .region = -2}};
  return input;
}

struct Fault {
  std::string name;
  std::function<void(DomainInput&, DomainMesh&)> plant;
  std::string found;
};

std::vector<Fault> FaultsToPlant() {
  const auto in = [](double low, double high) {
    return [=](const Point<2>& p) { return p[0] > low && p[0] < high && p[1] > low && p[1] < high; };
  };
  return {
      {"nothing", [](DomainInput&, DomainMesh&) {}, ""},
      {"a component is missing", [in](DomainInput&, DomainMesh& m) { m.TakeOut(in(20, 25)); }, "has no triangles"},
      {"a hole that the file does not have", [in](DomainInput&, DomainMesh& m) { m.TakeOut(in(6, 8)); },
       "has no triangles"},
      {"a hole is meshed",
       [](DomainInput& d, DomainMesh&) {
         d.seeds.push_back({.at = {1, 1}, .is_hole = true});
       },
       "seeds[3], a hole"},
      {"the file has another hole", [](DomainInput& d, DomainMesh&) { d.seeds[0].is_hole = false; },
       "has no triangles"},
      {"a segment more",
       [](DomainInput& d, DomainMesh&) {
         d.Segment({0, 5}, {1, 5});
       },
       "no facets lead along"},
      {"a ring more", [](DomainInput& d, DomainMesh&) { Square(d, 30, 31); }, "has no triangles"},
      {"a segment less", [](DomainInput& d, DomainMesh&) { d.ends.resize(d.ends.size() - 2); }, "along no segment"},
      {"a point more",
       [](DomainInput& d, DomainMesh&) {
         d.points.insert(d.points.end(), {1.25, 9.125});
       },
       "points[17]"},
      {"the region of one triangle", [](DomainInput&, DomainMesh& m) { m.regions[5] = m.regions[5] == 7 ? 1 : 7; },
       "its region is"},
      {"all of a region", [](DomainInput&, DomainMesh& m) { std::replace(m.regions.begin(), m.regions.end(), 7, 8); },
       "its region is 8"},
      {"two regions of one number",
       [](DomainInput&, DomainMesh& m) {
         m.region_names.clear();
         std::replace(m.regions.begin(), m.regions.end(), 2, 1);
       },
       "its region is 1"},
      {"triangles that are too large", [](DomainInput& d, DomainMesh&) { d.seeds[1].max_area = 1e-3; },
       "at most 0.001 is allowed in the face of seeds[1]"},
      {"a tag", [](DomainInput&, DomainMesh& m) { m.tags[0] = m.tags.back() == m.tags[0] ? 5 : m.tags.back(); },
       "its tag is"},
      {"another marker", [](DomainInput& d, DomainMesh&) { d.markers[5] = 4; }, "expected that of \"marker_4\""},
      {"names of tags", [](DomainInput&, DomainMesh& m) { m.tag_names[4] = "marker_5"; }, "expected that of"},
      {"a moved vertex of the file", [](DomainInput& d, DomainMesh&) { d.points[32] += 1e-9; }, "points[16]"},
      {"all is turned to even and odd", [](DomainInput& d, DomainMesh&) { d.faces = FaceRule::kEvenOdd; },
       "an even number of rings"},
      {"a box around all", [](DomainInput& d, DomainMesh&) { d.faces = FaceRule::kBox; }, "has no triangles"},
      {"no triangles", [](DomainInput&, DomainMesh& m) { m.TakeOut([](const Point<2>&) { return true; }); },
       "0 simplices"},
  };
}

TEST(ValidateDomainTest, FaultsThatArePlantedAreFound) {
  for (const Fault& fault : FaultsToPlant()) {
    SCOPED_TRACE(fault.name);
    DomainInput input = ManyThings();
    DomainMesh mesh = Made(input);
    fault.plant(input, mesh);
    const absl::Status status = CheckAgainst(input, mesh);
    EXPECT_EQ(status.ok(), fault.found.empty()) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(fault.found));
  }
}

TEST(ValidateDomainTest, WhatAFileDoesNotTellIsNotHeldAgainstIt) {
  DomainInput input = ManyThings();
  DomainMesh mesh = Made(input);
  mesh.tag_names.clear();
  mesh.region_names.clear();
  EXPECT_EQ(CheckAgainst(input, mesh), absl::OkStatus());
  mesh.tags.clear();
  EXPECT_EQ(CheckAgainst(input, mesh), absl::OkStatus());
  mesh.regions.clear();
  EXPECT_THAT(std::string(CheckAgainst(input, mesh).message()), HasSubstr("the mesh has no regions"));
  const DomainView view{.points = input.points, .features = input.features(), .has_regions = false};
  EXPECT_EQ(ValidateConformity(mesh.View(), mesh.Parts(), view, 1e-10, RunContext()), absl::OkStatus());
}

TEST(ValidateDomainTest, TrianglesOverEachOtherAreFoundByTheirArea) {
  // Of a regular pentagon, on one circle: triangles 0 1 3 and 1 2 4 keep all rules of their own.
  DomainInput input;
  input.Circle({0, 0}, 1, 5);
  DomainMesh mesh = Made(input);
  mesh.simplices = {0, 1, 3, 1, 2, 4};
  mesh.facets = {0, 1, 1, 3, 3, 0, 1, 2, 2, 4, 4, 1};
  mesh.tags.assign(6, 1);
  mesh.regions.assign(2, 1);
  EXPECT_FALSE(CheckAgainst(input, mesh).ok());
}

TEST(ValidateDomainTest, ACancelledRunEnds) {
  const DomainInput input = ManyThings();
  const DomainMesh mesh = Made(input);
  RunContext context;
  context.Cancel();
  EXPECT_TRUE(absl::IsCancelled(ValidateDomainMesh(mesh.View(), mesh.facets, 2, context).status()));
  const DomainView domain{.points = input.points, .features = input.features()};
  EXPECT_TRUE(absl::IsCancelled(ValidateConformity(mesh.View(), mesh.Parts(), domain, 1e-12, context)));
}

// Inputs that are quadratic in pairs: segments on each other, in a fan, and rings in each other; half of it is not
// meshed, so that the check finds the faces there.
TEST(ValidateDomainTest, ManyThatLieOnEachOtherOrHaveACommonEndAreFollowedInTime) {
  constexpr int kCount = 3000;
  DomainInput input;
  Square(input, -1, 1);
  input.faces = FaceRule::kEvenOdd;
  const Features ring = input.features();
  DomainMesh mesh = Made(input);
  std::vector<uint8_t> is_open(ring.segment_count(), 0);
  for (int i = 0; i < kCount; ++i) {
    input.Segment({2, 2}, {3.0 + i, 2});
    input.Segment({2, 3}, {3.0 + i, 9});
    is_open.insert(is_open.end(), {1, 1});
  }
  Features features = input.features();
  features.is_open = is_open;
  const DomainView domain{.points = input.points, .features = features};
  EXPECT_EQ(ValidateConformity(mesh.View(), mesh.Parts(), domain, 1e-9, RunContext()), absl::OkStatus());
}

class ValidateDomainPropertyTest : public test::SeededTest {
 protected:
  ValidateDomainPropertyTest() : SeededTest(0xc4ec) {}

  Point<2> OnGrid(uint64_t size) {
    return {static_cast<double>(random_.Below(size)), static_cast<double>(random_.Below(size))};
  }

  static std::string TextOf(const DomainInput& input) {
    std::string text = absl::StrCat("rule ", static_cast<int>(input.faces), "\n");
    for (size_t s = 0; s < input.ends.size() / 2; ++s) {
      const auto at = [&](size_t i, size_t axis) { return input.points[2 * size_t{input.ends[2 * s + i]} + axis]; };
      absl::StrAppend(&text, "segment ", at(0, 0), ",", at(0, 1), " ", at(1, 0), ",", at(1, 1), "\n");
    }
    for (const FaceSeed& seed : input.seeds) {
      absl::StrAppend(&text, seed.is_hole ? "hole " : "region ", seed.at[0], ",", seed.at[1], " polygon ",
                      seed.first_segment, "+", seed.segment_count, "\n");
    }
    return text;
  }

  // Rings, open lines and lone points on a small grid, which cross, touch and lie on each other.
  DomainInput RandomDomain() {
    DomainInput input;
    input.crossings = CrossingRule::kSplit;
    input.faces = std::vector{FaceRule::kBox, FaceRule::kHoles, FaceRule::kEvenOdd, FaceRule::kUnion}[random_.Below(4)];
    input.parameters.domain_low = {-1, -1};
    input.parameters.domain_high = {9, 9};
    if (input.faces != FaceRule::kBox) {
      input.parameters.domain_low = input.parameters.domain_high = {};
    }
    const uint64_t size = 3 + random_.Below(6);
    for (uint64_t ring = 0; ring < 1 + random_.Below(4); ++ring) {
      std::vector<Point<2>> corners(3 + random_.Below(4));
      for (Point<2>& corner : corners) {
        corner = OnGrid(size);
      }
      const size_t first = input.ends.size() / 2;
      input.Ring(corners);
      input.groups.resize(input.ends.size() / 2, static_cast<uint32_t>(7 + random_.Below(3)));
      if (random_.Below(2) == 0) {
        AddPolygon(input, first, 3);
      }
    }
    for (uint64_t line = random_.Below(3); line > 0 && input.faces <= FaceRule::kHoles; --line) {
      input.Segment(OnGrid(size), OnGrid(size));
      input.groups.push_back(0);
    }
    for (uint64_t point = random_.Below(3); point > 0; --point) {
      const Point<2> p = OnGrid(size);
      input.points.insert(input.points.end(), p.begin(), p.end());
    }
    for (uint64_t seed = random_.Below(3); seed > 0; --seed) {
      const Point<2> p = {static_cast<double>(size) * random_.Unit(), static_cast<double>(size) * random_.Unit()};
      input.seeds.push_back(random_.Below(2) == 0 ? FaceSeed{.at = p, .is_hole = true}
                                                  : FaceSeed{.at = p, .region = 5, .max_area = 0.5});
    }
    return input;
  }
};

TEST_F(ValidateDomainPropertyTest, MeshesOfMergedAndSnappedDomainsAgree) {
  int agreed = 0;
  uint64_t merged = 0;
  uint64_t led = 0;
  for (int run = 0; run < 300; ++run) {
    SCOPED_TRACE(absl::StrCat("run ", run));
    DomainInput input = RandomDomain();
    for (double& x : input.points) {
      x += 1e-4 * random_.Unit();
    }
    input.parameters.merge_distance = 1e-3;
    input.snap_distance = 1e-3;
    const absl::StatusOr<Mesh> made = input.Make();
    if (!made.ok()) {
      EXPECT_THAT(std::string(made.status().message()), ::testing::ContainsRegex("face|seeds"));
      continue;
    }
    merged += made->statistics.merged_points;
    led += made->statistics.domain->near_points;
    const DomainMesh mesh(*made);
    ASSERT_EQ(CheckAgainst(input, mesh), absl::OkStatus()) << TextOf(input);
    ++agreed;
  }
  EXPECT_GE(agreed, 100);
  EXPECT_GE(merged, 100u);
  EXPECT_GE(led, 100u);
}

TEST_F(ValidateDomainPropertyTest, MeshesOfRandomDomainsAgreeAndThoseWithoutAFaceDoNot) {
  int agreed = 0;
  int found = 0;
  for (int run = 0; run < 300; ++run) {
    SCOPED_TRACE(absl::StrCat("run ", run));
    const DomainInput input = RandomDomain();
    const absl::StatusOr<Mesh> made = input.Make();
    if (!made.ok()) {  // nothing is enclosed, or two seeds differ in one face
      EXPECT_THAT(std::string(made.status().message()), ::testing::ContainsRegex("face|seeds"));
      continue;
    }
    DomainMesh mesh(*made);
    ASSERT_EQ(CheckAgainst(input, mesh), absl::OkStatus()) << TextOf(input);
    ++agreed;
    // Without the triangles on one side of a segment, the rest is no mesh of the domain, unless it has been all.
    const Point<2> at = mesh.CentreOf(random_.Below(mesh.regions.size()));
    const size_t all = mesh.regions.size();
    mesh.TakeOut([&](const Point<2>& p) { return p == at; });
    EXPECT_FALSE(CheckAgainst(input, mesh).ok()) << all;
    ++found;
  }
  EXPECT_GE(agreed, 150);
  EXPECT_EQ(found, agreed);
}

}  // namespace
}  // namespace wellspace::core
