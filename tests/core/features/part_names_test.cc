// Names of parts: which are taken, and the parts of meshes that have them.
#include "core/features/part_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/support/surfaces.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

std::string ErrorOf(const PartNames& names) { return std::string(CheckPartNames(names).message()); }

TEST(PartNamesTest, TextOfAnyLanguageIsAName) {
  EXPECT_TRUE(CheckPartNames({}).ok());
  EXPECT_TRUE(
      CheckPartNames({.markers = {{-5, "Zufluß, oben"}, {0, "wall"}, {7, "marker_left"}}, .regions = {{7, "wall"}}})
          .ok());
}

TEST(PartNamesTest, RefusalsNameTheNumber) {
  for (const char* name : {"", "a\nb", "\x7f", "a\xc2\x9b", "marker_8", "region_-3", "unmarked", "domain"}) {
    EXPECT_THAT(ErrorOf({.markers = {{7, name}}, .regions = {}}), HasSubstr("names.markers[7]: expected a name"))
        << name;
    EXPECT_THAT(ErrorOf({.markers = {}, .regions = {{-7, name}}}), HasSubstr("names.regions[-7]: expected a name"));
  }
  EXPECT_TRUE(IsPartName(std::string(kLongestPartName, 'a')));
  EXPECT_FALSE(IsPartName(std::string(kLongestPartName + 1, 'a')));
  EXPECT_THAT(ErrorOf({.markers = {{5, "inlet"}, {7, "inlet"}}, .regions = {}}),
              HasSubstr("names.markers[7]: it has the name of 5, \"inlet\""));
  PartNames many;
  for (int32_t i = 0; i <= static_cast<int32_t>(kMostPartNames); ++i) {
    many.regions[i] = std::to_string(i);
  }
  EXPECT_THAT(ErrorOf(many), HasSubstr("names.regions: there are 1001 names; at most 1000"));
}

std::vector<std::string> NamesOf(const std::vector<BoundaryPart>& parts) {
  std::vector<std::string> names;
  for (const BoundaryPart& part : parts) {
    names.push_back(part.name);
  }
  return names;
}

std::vector<std::string> NamesOf(const std::vector<Region>& regions) {
  std::vector<std::string> names;
  for (const Region& region : regions) {
    names.push_back(region.name);
  }
  return names;
}

// Two squares side by side: markers 5 and 9 around them, 0 between; the right one is of region 7.
TEST(PartNamesTest, PartsOfADomainInThePlaneHaveThem) {
  const std::vector<double> points = {0, 0, 1, 0, 2, 0, 2, 1, 1, 1, 0, 1};
  const std::vector<uint32_t> ends = {0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 0, 1, 4};
  const std::vector<int32_t> markers = {5, 5, 5, 9, 9, 9, 0};
  const FaceSeed seed{.at = {1.5, 0.5}, .region = 7};
  const PartNames names{.markers = {{0, "between"}, {5, "inlet"}, {6, "nowhere"}}, .regions = {{7, "steel"}}};
  Features features;
  features.ends = ends;
  features.markers = markers;
  features.seeds = {&seed, 1};
  features.faces = FaceRule::kHoles;
  features.names = &names;
  RunContext context;
  MeshParameters parameters;
  parameters.dimension = 2;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, Input(points, features), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(NamesOf(mesh->boundary), UnorderedElementsAre("between", "inlet", "marker_9"));
  EXPECT_THAT(NamesOf(mesh->regions), UnorderedElementsAre("domain", "steel"));

  const PartNames bad{.markers = {{5, ""}}, .regions = {}};
  features.names = &bad;
  EXPECT_THAT(std::string(MeshPoints(parameters, Input(points, features), context).status().message()),
              HasSubstr("names.markers[5]"));
}

TEST(PartNamesTest, PartsOfADomainInSpaceHaveThem) {
  const test::TestSurface boxes = test::Boxes({0, 1, 2}, {0, 1}, {0, 1}, [](int x, int, int) { return x + 1; });
  const PartNames names{.markers = {{1, "left"}, {12, "between"}}, .regions = {{2, "steel"}}};
  SurfaceFeatures features = boxes.Features();
  features.solids = SolidRule::kHoles;
  features.names = &names;
  RunContext context;
  MeshParameters parameters;
  parameters.dimension = 3;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, Input(boxes.points, features), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(NamesOf(mesh->boundary), UnorderedElementsAre("left", "marker_2", "between"));
  EXPECT_THAT(NamesOf(mesh->regions), ElementsAre("region_1", "steel"));
}

TEST(PartNamesTest, TheOnlyRegionHasTheNameOfItsNumber) {
  const test::TestSurface cube = test::Cube();
  const PartNames names{.markers = {}, .regions = {{1, "steel"}}};
  SurfaceFeatures features = cube.Features();
  features.names = &names;
  RunContext context;
  MeshParameters parameters;
  parameters.dimension = 3;
  const absl::StatusOr<Mesh> mesh = MeshPoints(parameters, Input(cube.points, features), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_THAT(NamesOf(mesh->regions), ElementsAre("steel"));
}

}  // namespace
}  // namespace wellspace::core
