// Dots of input points in pictures: at which corners, in front of what, and by which files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/render/scene.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/meshes.h"

namespace wellspace::cli {
namespace {

using ::testing::HasSubstr;

// The places of dots in a scene, rounded.
std::multiset<std::pair<int, int>> DotsOf(const render::Scene& scene) {
  std::multiset<std::pair<int, int>> dots;
  for (const render::Facet& facet : scene.facets) {
    for (int i = 0; i < 3; ++i) {
      if (facet.has_dot[i]) {
        dots.emplace(static_cast<int>(1000 * facet.corners[i][0]), static_cast<int>(1000 * facet.corners[i][1]));
      }
    }
  }
  return dots;
}

TEST(SceneDots, AreAtTheVerticesThatWereNamed) {
  const formats::Mesh square = {.dimension = 2, .points = {0, 0, 2, 0, 2, 1, 0, 1}, .simplices = {0, 1, 2, 0, 2, 3}};
  render::View view;
  EXPECT_TRUE(DotsOf(*render::MakeScene(square.View(), view)).empty());
  view.dots = {true, false, false, true};
  const std::multiset<std::pair<int, int>> expected = {{0, 0}, {0, 0}, {0, 1000}};  // the first is of both triangles
  EXPECT_EQ(DotsOf(*render::MakeScene(square.View(), view)), expected);
  view.dots.pop_back();
  EXPECT_THAT(render::MakeScene(square.View(), view).status().message(), HasSubstr("4 vertices"));
}

// Inside of a mesh nothing is drawn.
TEST(SceneDots, AreOfVisibleFacetsAlone) {
  const test::TestMesh grid = test::KuhnGrid(3, 2);
  const formats::Mesh cubes = {.dimension = 3, .points = grid.points, .simplices = grid.simplices};
  size_t middle = 0;
  while (grid.points[3 * middle] != 1 || grid.points[3 * middle + 1] != 1 || grid.points[3 * middle + 2] != 1) {
    ++middle;
  }
  render::View view{.only_boundary = true, .dots = std::vector<bool>(cubes.View().vertex_count())};
  view.dots[middle] = true;
  EXPECT_TRUE(DotsOf(*render::MakeScene(cubes.View(), view)).empty());
  view.only_boundary = false;
  view.plane = render::Plane{{0, 0, 1}, 1};
  EXPECT_FALSE(DotsOf(*render::MakeScene(cubes.View(), view)).empty());
}

class RenderPointsTest : public CommandsTest {};

TEST_F(RenderPointsTest, FilesThatTellOfInputPoints) {
  folder_.Write("cloud.csv", "0,0\n1,0\n0,1\n0.3,0.4\n");
  for (const char* name : {"mesh.vtu", "mesh.npz", "mesh.vtk"}) {
    ASSERT_EQ(RunWellspace({"mesh", Path("cloud.csv"), "-o", Path(name)}).exit_code, 0);
    ASSERT_EQ(RunWellspace({"render", Path(name), "-o", Path("plain.svg")}).exit_code, 0);
    const RunResult dotted = RunWellspace({"render", Path(name), "-o", Path("dotted.svg"), "--points"});
    ASSERT_EQ(dotted.exit_code, 0) << dotted.err;
    EXPECT_GT(folder_.Read("dotted.svg").size(), folder_.Read("plain.svg").size()) << name;
  }
  folder_.Write("foreign.node", "3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n");
  folder_.Write("foreign.ele", "1 3 0\n0 0 1 2\n");
  ASSERT_EQ(RunWellspace({"convert", Path("foreign.node"), Path("foreign.msh")}).exit_code, 0);
  const RunResult unknown = RunWellspace({"render", Path("foreign.msh"), "-o", Path("none.png"), "--points"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("does not tell which vertices are input points"));
}

}  // namespace
}  // namespace wellspace::cli
