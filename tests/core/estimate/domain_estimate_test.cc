// Estimates of domains in the plane against the meshes that are made of them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "core/estimate/estimate.h"
#include "core/input/domain_cloud.h"
#include "core/meshers/mesher.h"
#include "tests/core/domain_input.h"

namespace wellspace::core {
namespace {

using test::DomainInput;

// Estimated vertices by those of the mesh.
double RatioOf(const DomainInput& input) {
  RunContext context;
  const absl::StatusOr<MeshEstimate> estimate =
      EstimateMesh(input.parameters, {input.points, input.features()}, context);
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

// ---- Work: segments that have been compared with places, by the segments that there are

uint64_t ComparedIn(const DomainInput& input) {
  RunContext context;
  absl::StatusOr<DomainCloud> made = MakeDomainCloud(input.points, input.features(), {}, 0, 1'000'000, 1, context);
  EXPECT_TRUE(made.ok()) << made.status();
  QueryStructure<2> structure;
  const absl::Status built = structure.Initialize(made->cloud.grid, std::move(made->cloud.points), ~uint64_t{0}, 1,
                                                  context, made->planar->Ends());
  EXPECT_TRUE(built.ok()) << built;
  const MeshCriteria<2> criteria{.rho = 1.5};
  const absl::StatusOr<SizeEstimate> size = EstimateSize<2>(structure, criteria, context, {}, made->planar.get());
  EXPECT_TRUE(size.ok()) << size.status();
  return size.ok() ? size->segments_compared : 0;
}

DomainInput NestedSquares(int count) {
  DomainInput input;
  for (int i = 1; i <= count; ++i) {
    const double half = static_cast<double>(i) / count;
    input.Ring({{-half, -half}, {half, -half}, {half, half}, {-half, half}});
  }
  return input;
}

// Spokes from one point: a comb of as many segments in one face.
DomainInput Star(int count) {
  DomainInput input = DomainInput().Ring({{-2, -2}, {2, -2}, {2, 2}, {-2, 2}});
  const auto centre = static_cast<uint32_t>(input.points.size() / 2);
  input.points.insert(input.points.end(), {0, 0});
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    input.points.insert(input.points.end(), {std::cos(angle), std::sin(angle)});
    input.ends.insert(input.ends.end(), {centre, centre + 1 + static_cast<uint32_t>(i)});
    input.markers.push_back(0);
  }
  return input;
}

// Segments side by side in one face.
DomainInput Comb(int count) {
  DomainInput input = DomainInput().Ring({{-1, -1}, {2, -1}, {2, 2}, {-1, 2}});
  for (int i = 0; i < count; ++i) {
    const double x = static_cast<double>(i) / count;
    input.Segment({x, 0}, {x, 1});
  }
  return input;
}

TEST(DomainEstimateTest, WorkGrowsAsTheSegmentsDo) {
  for (DomainInput (*const make)(int) : {NestedSquares, Star, Comb}) {
    const auto few = static_cast<double>(ComparedIn(make(250)));
    const auto many = static_cast<double>(ComparedIn(make(2000)));
    EXPECT_LT(many, 16 * few) << "eight times as many segments: 64 times with all pairs";
  }
}

// A mesh that is too large for any memory is estimated all the same, and is not put into a tree of that size.
TEST(DomainEstimateTest, NestedRingsThatNoMemoryHoldsAreEstimated) {
  const DomainInput input = NestedSquares(5'000);
  RunContext context;
  const absl::StatusOr<MeshEstimate> estimate =
      EstimateMesh(input.parameters, {input.points, input.features()}, context);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  // Strips of width w and length l take l / w triangles at least, about: all of them the area over w^2.
  const double least = 4 * 5'000.0 * 5'000.0;
  EXPECT_GT(estimate->vertices, least / 10);
  EXPECT_LT(estimate->vertices, least * 10);
  EXPECT_LT(estimate->tree_leaves, 4 * input.ends.size());
}

TEST(DomainEstimateTest, IsCancelledWithinALeaf) {
  const DomainInput input = Star(2000);
  RunContext context;
  absl::StatusOr<std::unique_ptr<Mesher>> mesher =
      Mesher::Create(input.parameters, {input.points, input.features()}, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  context.Cancel();
  EXPECT_EQ((*mesher)->Estimate(input.parameters, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace wellspace::core
