// TwinSearch: the simplices that two meshes have in common, in any order of them and of their corners.
#include "core/mesh/kept_parts.h"

#include <cstdint>
#include <vector>

#include "core/base/run_context.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace wellspace::core {
namespace {

using ::testing::ElementsAre;

// A square of two by one, cut into four triangles.
const std::vector<double> kPoints = {0, 0, 1, 0, 2, 0, 0, 1, 1, 1, 2, 1};
const std::vector<uint32_t> kTriangles = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};

Twins TwinsOf(const std::vector<double>& points, const std::vector<uint32_t>& triangles) {
  const MeshView from{.dimension = 2, .points = kPoints, .simplices = kTriangles};
  const MeshView onto{.dimension = 2, .points = points, .simplices = triangles};
  const RunContext context;
  return TwinSearch<2>(from, onto, context).Run().value();
}

TEST(TwinSearch, FindsThoseInTheirOrder) {
  const Twins twins = TwinsOf(kPoints, {0, 1, 4, 1, 2, 5, 1, 5, 4});
  EXPECT_THAT(twins.of_onto, ElementsAre(0, 2, 3));
  EXPECT_THAT(twins.has_twin, ElementsAre(true, false, true, true));
}

TEST(TwinSearch, FindsThoseInAnyOrder) {
  const Twins twins = TwinsOf(kPoints, {5, 4, 1, 1, 2, 4, 3, 0, 4, 1, 4, 0});
  EXPECT_THAT(twins.of_onto, ElementsAre(3, kNoSimplex, 1, 0));
  EXPECT_THAT(twins.has_twin, ElementsAre(true, true, false, true));
}

TEST(TwinSearch, AVertexThatHasMovedKeepsNoSimplex) {
  std::vector<double> points = kPoints;
  points[8] = 1.125;
  const Twins twins = TwinsOf(points, kTriangles);
  EXPECT_THAT(twins.of_onto, ElementsAre(kNoSimplex, kNoSimplex, 2, kNoSimplex));
  EXPECT_THAT(twins.has_twin, ElementsAre(false, false, true, false));
}

}  // namespace
}  // namespace wellspace::core
