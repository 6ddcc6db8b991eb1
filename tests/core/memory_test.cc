// The memory that a run asks its lender for.
#include <atomic>
#include <memory>
#include <vector>

#include "core/meshers/mesher.h"
#include "gtest/gtest.h"
#include "tests/core/domain_input.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

// Lends up to a limit, in one phase or in all, and remembers the bytes that it was asked for.
class Lender final : public MemoryLender {
 public:
  explicit Lender(RunContext& context) : context_(context) { context.SetMemoryLender(this); }

  absl::Status Reserve(uint64_t bytes) override {
    reserved.push_back(bytes);
    return bytes > reserve_limit ? absl::ResourceExhaustedError("reserve") : absl::OkStatus();
  }

  absl::Status Allow(uint64_t bytes) override {
    uint64_t seen = peak;
    while (seen < bytes && !peak.compare_exchange_weak(seen, bytes)) {
    }
    ++asked[static_cast<int>(context_.Snapshot().phase)];
    return context_.Snapshot().phase == refused_phase ? absl::ResourceExhaustedError("allow") : absl::OkStatus();
  }

  uint64_t reserve_limit = ~uint64_t{0};
  Phase refused_phase = Phase::kDone;
  std::vector<uint64_t> reserved;
  std::atomic<uint64_t> peak{0};
  std::atomic<int> asked[kPhaseCount] = {};

 private:
  RunContext& context_;
};

std::vector<double> Cloud() { return test::MakeCloud("uniform", 3, 5'000); }

TEST(Memory, IsReservedForTheTreeThenForTheMeshAndTheRunHoldsNoMore) {
  RunContext context;
  Lender lender(context);
  const absl::StatusOr<Mesh> mesh = MeshPoints(MeshParameters{.dimension = 3}, Cloud(), context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_EQ(lender.reserved.size(), 2u);
  EXPECT_LT(lender.reserved[0], lender.reserved[1]);
  EXPECT_LE(lender.peak, lender.reserved[1]);
  EXPECT_GE(4 * lender.peak, lender.reserved[1]);
  for (const Phase phase : {Phase::kTree, Phase::kRefinement, Phase::kSimplices, Phase::kSlivers}) {
    EXPECT_GT(lender.asked[static_cast<int>(phase)], 0) << PhaseName(phase);
  }
}

TEST(Memory, WhatItIsReservedForIsPredicted) {
  const MeshParameters parameters{.dimension = 3};
  RunContext context;
  Lender lender(context);
  const absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters, Cloud(), context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  const absl::StatusOr<MeshEstimate> estimate = (*mesher)->EstimateToReserve(parameters, context);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(context.estimated_vertices(), 0u);
  ASSERT_TRUE(ReserveMemory(**mesher, parameters, context).ok());
  EXPECT_EQ(context.estimated_vertices(), estimate->vertices);
}

TEST(Memory, NumbersAloneReserveEnoughForEvenClouds) {
  for (const int dimension : {2, 3}) {
    for (const int count : {1, 10, 100, 1'000, 10'000}) {
      SCOPED_TRACE(testing::Message() << count << " points in " << dimension << "-D");
      RunContext context;
      Lender lender(context);
      const std::vector<double> points = test::MakeCloud("uniform", dimension, count);
      ASSERT_TRUE(MeshPoints(MeshParameters{.dimension = dimension}, points, context).ok());
      EXPECT_LE(lender.peak, lender.reserved.at(1));
    }
  }
}

TEST(Memory, AMeshOfFewVerticesReservesForThem) {
  RunContext all_context;
  Lender all(all_context);
  ASSERT_TRUE(MeshPoints(MeshParameters{.dimension = 3}, Cloud(), all_context).ok());
  RunContext few_context;
  Lender few(few_context);
  EXPECT_EQ(MeshPoints(MeshParameters{.dimension = 3, .max_vertices = 6'000}, Cloud(), few_context).status().code(),
            absl::StatusCode::kResourceExhausted);
  EXPECT_LT(few.reserved.at(1), all.reserved.at(1));
}

TEST(Memory, ARefusedReservationEndsTheRunWithTheLendersError) {
  RunContext context;
  Lender lender(context);
  lender.reserve_limit = 1 << 20;
  EXPECT_EQ(MeshPoints(MeshParameters{.dimension = 3}, Cloud(), context).status().message(), "reserve");
  EXPECT_EQ(lender.reserved.size(), 1u);
}

TEST(Memory, ARunThatOutgrowsItInAnyPhaseEndsWithTheLendersErrorAndCanGoOn) {
  const MeshParameters parameters{.dimension = 3, .min_dihedral = 0};
  for (const int threads : {1, 2}) {
    RunContext context;
    Lender lender(context);
    lender.refused_phase = Phase::kTree;
    EXPECT_EQ(Mesher::Create(parameters, Cloud(), context).status().message(), "allow");

    lender.refused_phase = Phase::kRefinement;
    absl::StatusOr<std::unique_ptr<Mesher>> mesher = Mesher::Create(parameters, Cloud(), context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    EXPECT_EQ((*mesher)->Refine(parameters, context).message(), "allow");

    lender.refused_phase = Phase::kSimplices;
    ASSERT_TRUE((*mesher)->Refine(parameters, context).ok());
    EXPECT_EQ((*mesher)->Extract(threads, context).status().message(), "allow");

    lender.refused_phase = Phase::kDone;
    const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(threads, context);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    RunContext other;
    const absl::StatusOr<Mesh> expected = MeshPoints(parameters, Cloud(), other);
    ASSERT_TRUE(expected.ok());
    EXPECT_EQ(mesh->simplices, expected->simplices);
  }
}

// A thousand squares side by side, each with four points and as many segments.
test::DomainInput Squares() {
  test::DomainInput input;
  for (int i = 0; i < 1000; ++i) {
    const double x = 3.0 * (i % 32);
    const double y = 3.0 * (i / 32);
    input.Ring({{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}});
  }
  return input;
}

TEST(Memory, OfADomainIsReservedForItsGraphThenForTheMeshAndTheRunHoldsNoMore) {
  for (const double size : {0.0, 0.1}) {
    test::DomainInput input = Squares();
    input.parameters.max_circumradius = size;
    RunContext context;
    Lender lender(context);
    const absl::StatusOr<Mesh> mesh = MeshPoints(input.parameters, {input.points, input.features()}, context);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ASSERT_EQ(lender.reserved.size(), 2u);
    // Coordinates, ends, and the least memory of a graph, its faces, a sweep over it and a tree for each.
    EXPECT_GT(lender.reserved[0], input.points.size() / 2 * 100 + input.ends.size() / 2 * 100);
    EXPECT_LE(lender.peak, lender.reserved[1]);
    for (const Phase phase : {Phase::kTree, Phase::kRefinement}) {  // which ends with the triangles
      EXPECT_GT(lender.asked[static_cast<int>(phase)], 0) << PhaseName(phase);
    }
  }
}

TEST(Memory, OfADomainIsReservedBeforeItsFirstArrayIsMade) {
  const test::DomainInput input = Squares();
  for (const bool is_estimate : {false, true}) {
    RunContext context;
    Lender lender(context);
    lender.reserve_limit = 4 << 20;
    const absl::Status status = is_estimate
                                    ? EstimateMesh(input.parameters, {input.points, input.features()}, context).status()
                                    : MeshPoints(input.parameters, {input.points, input.features()}, context).status();
    EXPECT_EQ(status.message(), "reserve");
    EXPECT_EQ(lender.reserved.size(), 1u);
    EXPECT_EQ(lender.peak, 0u) << "it was asked for memory that was made";
  }
}

TEST(Memory, ADomainThatOutgrowsItInAnyPhaseEndsWithTheLendersErrorAndCanGoOn) {
  const test::DomainInput input = Squares();
  RunContext context;
  Lender lender(context);
  lender.refused_phase = Phase::kTree;
  EXPECT_EQ(Mesher::Create(input.parameters, {input.points, input.features()}, context).status().message(), "allow");

  lender.refused_phase = Phase::kRefinement;
  absl::StatusOr<std::unique_ptr<Mesher>> mesher =
      Mesher::Create(input.parameters, {input.points, input.features()}, context);
  ASSERT_TRUE(mesher.ok()) << mesher.status();
  EXPECT_EQ((*mesher)->Refine(input.parameters, context).message(), "allow");

  lender.refused_phase = Phase::kDone;
  ASSERT_TRUE((*mesher)->Refine(input.parameters, context).ok());
  const absl::StatusOr<Mesh> mesh = (*mesher)->Extract(1, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const absl::StatusOr<Mesh> expected = input.Make();
  ASSERT_TRUE(expected.ok()) << expected.status();
  EXPECT_EQ(mesh->simplices, expected->simplices);
}

TEST(Memory, SizesAtPointsAreAskedForBeforeTheyAreTakenAndCountWhileTheMeshGrows) {
  auto samples = std::make_shared<SizeSamples>();
  for (int i = 0; i < 20'000; ++i) {
    samples->points.insert(samples->points.end(), {0.5 + 1e-6 * (i % 100), 0.5 + 1e-6 * (i / 100)});
    samples->sizes.push_back(0.1);
  }
  MeshParameters parameters{.dimension = 2, .domain_low = {0, 0}, .domain_high = {1, 1}};
  const uint64_t of_samples = samples->sizes.size() * 4 * sizeof(double);  // at least: places, sizes, and their tree
  test::DomainInput square = test::DomainInput().Ring({{0, 0}, {1, 0}, {1, 1}, {0, 1}});
  for (const bool is_domain : {false, true}) {
    RunContext context;
    Lender lender(context);
    absl::StatusOr<std::unique_ptr<Mesher>> mesher =
        is_domain ? Mesher::Create(square.parameters, {square.points, square.features()}, context)
                  : Mesher::Create(parameters, test::MakeCloud("uniform", 2, 2'000), context);
    ASSERT_TRUE(mesher.ok()) << mesher.status();
    MeshParameters sized = is_domain ? square.parameters : parameters;
    sized.size_samples = samples;

    lender.refused_phase = Phase::kRefinement;
    const int asked = lender.asked[static_cast<int>(Phase::kRefinement)];
    EXPECT_EQ((*mesher)->Refine(sized, context).message(), "allow");
    EXPECT_EQ(lender.asked[static_cast<int>(Phase::kRefinement)], asked + 1);
    EXPECT_GE(lender.peak, (*mesher)->memory_bytes() + of_samples);

    lender.refused_phase = Phase::kDone;
    ASSERT_TRUE((*mesher)->Refine(sized, context).ok());
    sized.max_circumradius = 0.01;
    lender.peak = 0;
    ASSERT_TRUE((*mesher)->Refine(sized, context).ok());
    EXPECT_GE(lender.peak, of_samples) << "they are there while the mesh grows";
  }
}

TEST(Memory, IsNotAskedForWithoutALender) {
  const RunContext context;
  EXPECT_FALSE(context.HasMemoryLender());
  EXPECT_TRUE(context.ReserveMemory(~uint64_t{0}).ok());
  EXPECT_TRUE(context.AllowMemory(~uint64_t{0}).ok());
}

}  // namespace
}  // namespace wellspace::core
