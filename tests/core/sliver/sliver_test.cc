// No slivers: the guarantees of repair and pumping for whole meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/point.h"
#include "core/meshers/mesher.h"
#include "core/validate/validate.h"
#include "tests/support/canonical.h"
#include "tests/support/clouds.h"
#include "tests/support/lender_with_a_turn.h"

namespace wellspace::core {
namespace {

using ::testing::HasSubstr;

MeshParameters InUnitBox(int dimension, double min_dihedral, bool pump_weights = false) {
  MeshParameters parameters{.dimension = dimension};
  parameters.domain_low = test::UnitLow(dimension);
  parameters.domain_high = test::UnitHigh(dimension);
  parameters.min_dihedral = min_dihedral;
  parameters.pump_weights = pump_weights;
  return parameters;
}

Mesh MeshOf(const MeshParameters& parameters, const std::vector<double>& cloud) {
  RunContext context;
  absl::StatusOr<Mesh> mesh = MeshPoints(parameters, cloud, context);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : Mesh{};
}

absl::Status Validate(const MeshParameters& parameters, const Mesh& mesh, const std::vector<double>& cloud) {
  ValidationOptions options;
  options.rho = parameters.rho == 0 ? DefaultRho(mesh.dimension) : parameters.rho;
  options.criterion = parameters.criterion;
  options.max_circumradius = parameters.max_circumradius;
  options.size_boxes = parameters.size_boxes;
  options.cloud = cloud;
  options.min_angle_deg = parameters.min_dihedral.value_or(0);
  return ValidateMesh({mesh.dimension, mesh.points, mesh.simplices, mesh.weights}, options);
}

struct Case {
  std::string_view kind;
  size_t points;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.kind; }

class SliverTest : public ::testing::TestWithParam<Case> {
 protected:
  const std::vector<double> cloud_ = test::MakeCloud(GetParam().kind, 3, GetParam().points);
};

INSTANTIATE_TEST_SUITE_P(Clouds, SliverTest,
                         ::testing::Values(Case{"uniform", 600}, Case{"grid", 512}, Case{"cospherical", 300},
                                           Case{"skew", 200}, Case{"boundary", 200}, Case{"clusters", 400},
                                           Case{"none", 0}),
                         [](const auto& c) { return std::string(c.param.kind); });

TEST_P(SliverTest, EveryAngleIsReachedByADelaunayMesh) {
  const Mesh plain = MeshOf(InUnitBox(3, 0), cloud_);
  for (const double angle : {12.0, 15.0, 18.0}) {
    SCOPED_TRACE(angle);
    const MeshParameters parameters = InUnitBox(3, angle);
    const Mesh mesh = MeshOf(parameters, cloud_);
    EXPECT_TRUE(Validate(parameters, mesh, cloud_).ok()) << Validate(parameters, mesh, cloud_);
    const MeshStatistics& statistics = mesh.statistics;
    EXPECT_EQ(statistics.slivers_left, 0);
    EXPECT_TRUE(mesh.weights.empty());
    EXPECT_GE(statistics.min_angle_deg, angle);
    EXPECT_NEAR(statistics.min_angle_deg, MeasureQuality({3, mesh.points, mesh.simplices}).min_angle_deg, 1e-9);
    EXPECT_NEAR(statistics.max_radius_edge, MeasureQuality({3, mesh.points, mesh.simplices}).max_radius_edge, 1e-9);
    EXPECT_NEAR(statistics.min_angle_before_deg, plain.statistics.min_angle_deg, 1e-9);
    EXPECT_EQ(mesh.vertex_count(), plain.vertex_count() + statistics.sliver_vertices);
    EXPECT_LE(static_cast<double>(mesh.vertex_count()), (angle == 12   ? 1.04
                                                         : angle == 15 ? 1.08
                                                                       : 1.25) *
                                                            static_cast<double>(plain.vertex_count()));
  }
}

// A Delaunay mesh is better than a regular one: weights are for slivers that are left.
TEST_P(SliverTest, WeightsOnlyWhereSliversAreLeft) {
  for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
    MeshParameters parameters = InUnitBox(3, 18, true);
    parameters.criterion = criterion;
    const Mesh mesh = MeshOf(parameters, cloud_);
    parameters.min_dihedral = 0;
    EXPECT_TRUE(Validate(parameters, mesh, cloud_).ok()) << Validate(parameters, mesh, cloud_);
    EXPECT_EQ(mesh.weights.empty(), mesh.statistics.slivers_left == 0);
    EXPECT_TRUE(criterion == Criterion::kWellSpaced || mesh.weights.empty());
  }
}

TEST_P(SliverTest, PumpingMakesTheWorstBetter) {
  const MeshParameters parameters = InUnitBox(3, 0, true);
  const Mesh plain = MeshOf(InUnitBox(3, 0), cloud_);
  const Mesh mesh = MeshOf(parameters, cloud_);
  EXPECT_TRUE(Validate(parameters, mesh, cloud_).ok()) << Validate(parameters, mesh, cloud_);
  EXPECT_EQ(mesh.points, plain.points);
  EXPECT_GE(mesh.statistics.min_angle_deg, std::max(3.0, plain.statistics.min_angle_deg));
  EXPECT_EQ(
      mesh.statistics.weighted_vertices,
      static_cast<uint64_t>(std::count_if(mesh.weights.begin(), mesh.weights.end(), [](double w) { return w > 0; })));
  EXPECT_EQ(mesh.weights.empty(), mesh.statistics.weighted_vertices == 0);
}

// Where the weight of one vertex alone leaves slivers, those of two are chosen together.
TEST(SliverPairsTest, PumpingLeavesNoSliver) {
  for (const std::string_view kind : {"sphere", "annuli"}) {
    SCOPED_TRACE(kind);
    const std::vector<double> cloud = test::MakeCloud(kind, 3, 4000);
    const MeshParameters parameters = InUnitBox(3, 0, true);
    const Mesh mesh = MeshOf(parameters, cloud);
    EXPECT_TRUE(Validate(parameters, mesh, cloud).ok()) << Validate(parameters, mesh, cloud);
    EXPECT_EQ(MeasureQuality({3, mesh.points, mesh.simplices}).CountBelow(5), 0);
  }
}

TEST(SliverValidationTest, WrongWeightsAreFound) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 200);
  const MeshParameters parameters = InUnitBox(3, 0, true);
  const Mesh mesh = MeshOf(parameters, cloud);
  ASSERT_TRUE(Validate(parameters, mesh, cloud).ok());
  Mesh faulty = mesh;
  faulty.weights[7] = -1e-9;
  EXPECT_THAT(std::string(Validate(parameters, faulty, cloud).message()), HasSubstr("vertex 7 has weight -1e-09"));
  faulty.weights.pop_back();
  EXPECT_EQ(Validate(parameters, faulty, cloud).code(), absl::StatusCode::kInvalidArgument);
  // Each weight counts: none can be taken from the one that has most, nor all.
  faulty.weights = mesh.weights;
  *std::max_element(faulty.weights.begin(), faulty.weights.end()) = 0;
  EXPECT_THAT(std::string(Validate(parameters, faulty, cloud).message()), HasSubstr("negative power"));
  faulty.weights.clear();
  EXPECT_THAT(std::string(Validate(parameters, faulty, cloud).message()), HasSubstr("inside the circumsphere"));
  MeshParameters better = parameters;
  better.min_dihedral = std::ceil(mesh.statistics.min_angle_deg + 1);
  EXPECT_THAT(std::string(Validate(better, mesh, cloud).message()), HasSubstr("has an angle of"));
}

TEST_P(SliverTest, OrderOfThePointsAndThreadsDoNotMatter) {
  for (const bool pump : {false, true}) {
    MeshParameters parameters = InUnitBox(3, pump ? 0 : 15, pump);
    const Mesh mesh = MeshOf(parameters, cloud_);
    parameters.threads = 3;
    const Mesh other = MeshOf(parameters, test::Shuffled(cloud_, 3, 5));
    EXPECT_EQ(test::Canonical(mesh), test::Canonical(other));
    HugeVector<double> weights = mesh.weights;
    HugeVector<double> other_weights = other.weights;
    std::sort(weights.begin(), weights.end());
    std::sort(other_weights.begin(), other_weights.end());
    EXPECT_EQ(weights, other_weights);
  }
}

TEST(SliverDemandsTest, SizesAndTighterBoundsAreKept) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 100);
  MeshParameters sized = InUnitBox(3, 12);
  sized.size_boxes = {{{0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}, 0.05}};
  MeshParameters tight = InUnitBox(3, 12);
  tight.rho = 1.3;
  for (const MeshParameters& parameters : {sized, tight}) {
    const Mesh mesh = MeshOf(parameters, cloud);
    EXPECT_TRUE(Validate(parameters, mesh, cloud).ok()) << Validate(parameters, mesh, cloud);
  }
  // Where repair cannot reach the angle it still keeps the criterion, and says how many are left.
  MeshParameters well_spaced = InUnitBox(3, 12);
  well_spaced.criterion = Criterion::kWellSpaced;
  const Mesh mesh = MeshOf(well_spaced, cloud);
  const double angle = mesh.statistics.slivers_left == 0 ? 12.0 : 0.0;
  well_spaced.min_dihedral = angle;
  EXPECT_TRUE(Validate(well_spaced, mesh, cloud).ok()) << Validate(well_spaced, mesh, cloud);
  EXPECT_LT(mesh.statistics.slivers_left, mesh.statistics.slivers / 10 + 1);
}

TEST(SliverDimensionsTest, PumpingWorksIn4D) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 4, 20);
  MeshParameters plain = InUnitBox(4, 0);
  const Mesh before = MeshOf(plain, cloud);
  const MeshParameters parameters = InUnitBox(4, 0, true);
  const Mesh mesh = MeshOf(parameters, cloud);
  EXPECT_TRUE(Validate(parameters, mesh, cloud).ok()) << Validate(parameters, mesh, cloud);
  EXPECT_GT(mesh.statistics.min_angle_deg, before.statistics.min_angle_deg);
  EXPECT_GT(mesh.statistics.weighted_vertices, 0);
}

TEST(SliverParametersTest, WhatCannotBeIsRefused) {
  RunContext context;
  const auto message = [](const MeshParameters& parameters) {
    return std::string(ValidateParameters(parameters).message());
  };
  EXPECT_EQ(message(InUnitBox(3, 18)), "");
  EXPECT_EQ(message(InUnitBox(3, 18.5)), "min_dihedral: 18.5 is not allowed in 3-D; 0 to 18 degrees are");
  EXPECT_THAT(message(InUnitBox(3, -1)), HasSubstr("min_dihedral: -1 "));
  EXPECT_THAT(message(InUnitBox(3, std::nan(""))), HasSubstr("min_dihedral: nan "));
  EXPECT_THAT(message(InUnitBox(2, 12)), HasSubstr("min_dihedral: 12 is not allowed in 2-D; 0 is"));
  EXPECT_THAT(message(InUnitBox(2, 0, true)), HasSubstr("pump_weights: true is not allowed in 2-D"));
  EXPECT_EQ(message(InUnitBox(4, 0, true)), "");
}

TEST(SliverSessionTest, GoesOnAfterABudgetThatWasTooSmall) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 600);
  MeshParameters parameters = InUnitBox(3, 18);
  RunContext context;
  auto mesher = Mesher::Create(parameters, cloud, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  parameters.max_vertices = MeshOf(InUnitBox(3, 0), cloud).vertex_count() + 1;
  const absl::Status refused = (*mesher)->Refine(parameters, context);
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("min_dihedral = 18"));
  EXPECT_EQ((*mesher)->Extract(1, context).status().code(), absl::StatusCode::kFailedPrecondition);
  parameters.max_vertices = 0;
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(Validate(parameters, *mesh, cloud).ok()) << Validate(parameters, *mesh, cloud);
}

TEST(SliverSessionTest, AnEditedMeshIsRepairedAgain) {
  std::vector<double> cloud = test::MakeCloud("uniform", 3, 400);
  const std::vector<double> more = test::MakeCloud("cospherical", 3, 6);
  MeshParameters parameters = InUnitBox(3, 15);
  RunContext context;
  auto mesher = Mesher::Create(parameters, cloud, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const uint64_t stars = mesh->statistics.stars_computed;
  const auto added = (*mesher)->AddPoints(more, context);
  ASSERT_TRUE(added.ok()) << added.status();
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  ASSERT_TRUE((*mesher)->Update(*mesh, 1, context).ok());
  EXPECT_TRUE(Validate(parameters, *mesh, cloud).ok()) << Validate(parameters, *mesh, cloud);
  // The points are where they were given, and no star was computed for it.
  for (size_t i = 0; i < added->size(); ++i) {
    EXPECT_EQ(PointAt<3>(mesh->points, (*added)[i]), PointAt<3>(more, i));
  }
  EXPECT_EQ(mesh->statistics.stars_computed, stars);
  // Cells are those of the vertices that have moved.
  std::vector<uint32_t> all(mesh->vertex_count());
  std::iota(all.begin(), all.end(), uint32_t{0});
  const auto nearest = (*mesher)->NearestNeighborDistances(all);
  ASSERT_TRUE(nearest.ok());
  std::vector<double> expected(all.size(), 2);
  for (size_t at = 0; at < mesh->simplices.size(); at += 4) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const uint32_t u = mesh->simplices[at + i];
        const uint32_t v = mesh->simplices[at + j];
        if (u != v) {
          expected[u] =
              std::min(expected[u], std::sqrt(DistanceSq<3>(PointAt<3>(mesh->points, u), PointAt<3>(mesh->points, v))));
        }
      }
    }
  }
  for (size_t v = 0; v < all.size(); ++v) {
    ASSERT_NEAR((*nearest)[v], expected[v], 1e-12) << v;
  }
  // Without repair, and for another bound, refinement goes on from there.
  parameters.min_dihedral = 0;
  parameters.rho = 1.6;
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  ASSERT_TRUE((*mesher)->Update(*mesh, 1, context).ok());
  EXPECT_TRUE(Validate(parameters, *mesh, cloud).ok()) << Validate(parameters, *mesh, cloud);
}

// Moved vertices have other neighbours than the refinement has seen.
TEST_P(SliverTest, ARepairedMeshIsFoundAgainFromFacetToFacet) {
  MeshParameters parameters = InUnitBox(3, 15);
  RunContext context;
  auto mesher = Mesher::Create(parameters, cloud_, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> repaired = (*mesher)->Extract(1, context);
  ASSERT_TRUE(repaired.ok()) << repaired.status();
  EXPECT_TRUE(cloud_.size() < 600 || repaired->statistics.sliver_moves > 0);
  // Data that repair kept are dropped, and the same demands ask for nothing.
  parameters.min_dihedral = 0;
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> again = (*mesher)->Extract(1, context);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(test::Canonical(*again), test::Canonical(*repaired));
  EXPECT_TRUE(Validate(parameters, *again, cloud_).ok()) << Validate(parameters, *again, cloud_);
  EXPECT_GE(again->statistics.stars_computed, repaired->statistics.stars_computed + again->vertex_count());

  ASSERT_TRUE((*mesher)->AddPoints(test::MakeCloud("uniform", 3, 40), context).ok());
  ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
  const absl::StatusOr<Mesh> more = (*mesher)->Extract(1, context);
  ASSERT_TRUE(more.ok()) << more.status();
  EXPECT_TRUE(Validate(parameters, *more, cloud_).ok()) << Validate(parameters, *more, cloud_);
}

// Between any two passes repair can be stopped; its work until then is valid, and a later run goes on from there.
TEST(SliverSessionTest, StoppedAfterAnyPassItGoesOn) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 300);
  const MeshParameters parameters = InUnitBox(3, 18);
  for (const bool cancels : {false, true}) {
    for (int turn = 0;; ++turn) {
      SCOPED_TRACE(turn);
      RunContext stopped;
      test::LenderWithATurn lender(stopped, turn, cancels, Phase::kSlivers);
      auto mesher = Mesher::Create(parameters, cloud, stopped);
      ASSERT_TRUE(mesher.ok()) << mesher.status();
      const absl::Status status = (*mesher)->Refine(parameters, stopped);
      if (lender.asked() <= turn) {
        EXPECT_TRUE(status.ok()) << status;
        EXPECT_GT(turn, 2);
        break;
      }
      EXPECT_EQ(status.code(), cancels ? absl::StatusCode::kCancelled : absl::StatusCode::kResourceExhausted);
      RunContext context;
      // Left as it is it would be a mesh already.
      MeshParameters plain = parameters;
      plain.min_dihedral = 0;
      for (const MeshParameters& next : {plain, parameters}) {
        ASSERT_TRUE((*mesher)->Refine(next, context).ok());
        const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
        ASSERT_TRUE(mesh.ok()) << mesh.status();
        EXPECT_TRUE(Validate(next, *mesh, cloud).ok()) << Validate(next, *mesh, cloud);
      }
    }
  }
}

TEST(SliverSessionTest, CancelledInAnyPhaseItGoesOn) {
  const std::vector<double> cloud = test::MakeCloud("uniform", 3, 300);
  for (const bool pumps : {false, true}) {
    const MeshParameters parameters = InUnitBox(3, pumps ? 0 : 15, pumps);
    const Mesh expected = MeshOf(parameters, cloud);
    RunContext fresh;
    auto mesher = Mesher::Create(parameters, cloud, fresh);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    RunContext cancelled;
    cancelled.Cancel();
    EXPECT_EQ((*mesher)->Refine(parameters, cancelled).code(), absl::StatusCode::kCancelled);
    MeshParameters plain = parameters;
    plain.min_dihedral = 0;
    plain.pump_weights = false;
    ASSERT_TRUE((*mesher)->Refine(plain, fresh).ok());
    if (!pumps) {
      EXPECT_EQ((*mesher)->Refine(parameters, cancelled).code(), absl::StatusCode::kCancelled);
    }
    ASSERT_TRUE((*mesher)->Refine(parameters, fresh).ok());
    EXPECT_EQ((*mesher)->Extract(1, cancelled).status().code(), absl::StatusCode::kCancelled);
    const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, fresh);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_EQ(test::Canonical(*mesh), test::Canonical(expected));
    EXPECT_EQ(mesh->weights, expected.weights);
  }
}

}  // namespace
}  // namespace wellspace::core
