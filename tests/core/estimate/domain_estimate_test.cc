// Estimates of domains in the plane against the meshes that are made of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/mesher.h"
#include "tests/core/domain_input.h"

namespace wellspace::core {
namespace {

using test::DomainInput;

// Estimated vertices by those of the mesh.
double RatioOf(const DomainInput& input) {
  RunContext context;
  const absl::StatusOr<MeshEstimate> estimate =
      EstimateFeatures(input.parameters, input.points, input.features(), context);
  const absl::StatusOr<Mesh> mesh = input.Make();
  EXPECT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return estimate.ok() && mesh.ok() ? static_cast<double>(estimate->vertices) / mesh->vertex_count() : 0;
}

DomainInput UnitSquare() { return DomainInput().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}}); }

// Few features, many vertices: no leaf is crowded, and two points alone would tell nothing of the strip.
TEST(DomainEstimateTest, SegmentsNearEachOtherAreSeen) {
  for (const double distance : {1e-2, 1e-3}) {
    DomainInput input = UnitSquare();
    input.Segment({0.2, 0.5}, {0.8, 0.5});
    input.Segment({0.2, 0.5 + distance}, {0.8, 0.5 + distance});
    const double ratio = RatioOf(input);
    EXPECT_GT(ratio, 0.6) << distance;
    EXPECT_LT(ratio, 1.5) << distance;
  }
}

TEST(DomainEstimateTest, WhatAWallHidesDoesNotCount) {
  constexpr double kWidth = 1e-6;
  DomainInput slit = UnitSquare().Ring({{0.2, 0.5}, {0.8, 0.5}, {0.8, 0.5 + kWidth}, {0.2, 0.5 + kWidth}});
  slit.seeds.push_back({.at = {0.5, 0.5 + kWidth / 2}, .is_hole = true});
  const double ratio = RatioOf(slit);
  EXPECT_GT(ratio, 0.6);
  EXPECT_LT(ratio, 1.5);
}

TEST(DomainEstimateTest, HolesAndTheOutsideDoNotCount) {
  DomainInput ring = DomainInput().Circle({0, 0}, 1, 400).Circle({0, 0}, 0.9, 400);
  ring.seeds.push_back({.at = {0, 0}, .is_hole = true});
  ring.parameters.max_circumradius = 0.01;
  const double ratio = RatioOf(ring);
  EXPECT_GT(ratio, 0.7);
  EXPECT_LT(ratio, 1.4);
}

TEST(DomainEstimateTest, LargestAreasAreSizesOfTheirFaceAlone) {
  DomainInput input = UnitSquare().Segment({0.5, 0}, {0.5, 1});
  input.seeds.push_back({.at = {0.25, 0.5}, .region = 1, .max_area = 1e-4});
  input.seeds.push_back({.at = {0.75, 0.5}, .region = 2});
  const double ratio = RatioOf(input);
  EXPECT_GT(ratio, 0.7);
  EXPECT_LT(ratio, 1.4);
}

TEST(DomainEstimateTest, RandomSegments) {
  std::mt19937_64 random(20261128);
  std::uniform_real_distribution<double> uniform(0.02, 0.9);
  DomainInput input = UnitSquare();
  // One in each cell of a grid, so that none cross.
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) {
      const auto in_cell = [&] {
        return Point<2>{(i + uniform(random)) * 0.98 / 30 + 0.01, (j + uniform(random)) * 0.98 / 30 + 0.01};
      };
      const Point<2> a = in_cell();
      input.Segment(a, in_cell());
    }
  }
  const double ratio = RatioOf(input);
  EXPECT_GT(ratio, 0.65);
  EXPECT_LT(ratio, 1.4);
}

}  // namespace
}  // namespace wellspace::core
