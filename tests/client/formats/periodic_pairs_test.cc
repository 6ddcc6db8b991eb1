// Pairs of vertices on opposite sides, and what is said where there are none.
#include "client/formats/periodic_pairs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/write_mesh.h"
#include "tests/support/temporary_folder.h"

namespace wellspace::formats {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

MeshShape UnitSquare(std::vector<int> axes) {
  MeshShape shape{.dimension = 2};
  shape.periodic_axes = std::move(axes);
  shape.low = {0, 0};
  shape.high = {1, 1};
  return shape;
}

TEST(PeriodicPairsTest, FindsPairsInAnyOrderOfVertices) {
  PeriodicPairs pairs(UnitSquare({0, 1}));
  const std::vector<double> points = {1, 0.5, 0.25, 1, 1, 1, 0, 1, 0.5, 0.5, 0.25, 0, 1, 0, 0, 0, 0, 0.5};
  pairs.Add(std::span(points).first(6));
  pairs.Add(std::span(points).subspan(6));
  EXPECT_THAT(*pairs.Across(0), ElementsAre(VertexPair{3, 2}, VertexPair{7, 6}, VertexPair{8, 0}));
  EXPECT_THAT(*pairs.Across(1), ElementsAre(VertexPair{5, 1}, VertexPair{6, 2}, VertexPair{7, 3}));
}

TEST(PeriodicPairsTest, NamesAVertexWithoutPartner) {
  for (const bool is_high : {false, true}) {
    PeriodicPairs pairs(UnitSquare({0}));
    pairs.Add(std::vector<double>{0, 0, 1, 0, 0, 1, 1, 1, is_high ? 1.0 : 0.0, 0.5});
    EXPECT_THAT(std::string(pairs.Across(0).status().message()),
                HasSubstr(is_high ? "vertex 4 on the high side" : "vertex 4 on the low side"));
  }
}

TEST(PeriodicPairsTest, WritersRefuseMeshesThatAreNotPeriodic) {
  const TemporaryFolder folder;
  const std::vector<double> points = {0, 0, 1, 0, 0, 1, 1, 1, 1, 0.5};
  const std::vector<uint32_t> simplices = {0, 1, 4, 0, 4, 2, 2, 4, 3};
  for (const auto& [axes, message] : {std::pair(std::vector<int>{0}, "vertex 4 on the high side across axis 0"),
                                      {std::vector<int>{2}, "expected axes from 0 to 1"},
                                      {std::vector<int>{1, 0}, "ascending"}}) {
    const MeshView mesh{.dimension = 2, .points = points, .simplices = simplices, .periodic_axes = axes};
    EXPECT_THAT(std::string(WriteMesh(folder.Path("mesh.npz"), "", mesh).message()), HasSubstr(message));
  }
  const std::vector<int> axes = {1};
  const MeshView mesh{.dimension = 2, .points = points, .simplices = simplices, .periodic_axes = axes};
  EXPECT_EQ(WriteMesh(folder.Path("mesh.npz"), "", mesh), absl::OkStatus());
  std::vector<std::string> notes;
  EXPECT_EQ(WriteMesh(folder.Path("mesh.vtu"), "", mesh, {}, &notes), absl::OkStatus());
  EXPECT_THAT(notes, ElementsAre(HasSubstr("no place for the pairs of vertices across periodic axes")));
}

}  // namespace
}  // namespace wellspace::formats
