// What a run asks of its memory lender.
#include <atomic>
#include <memory>
#include <vector>

#include "core/mesher.h"
#include "gtest/gtest.h"
#include "tests/support/clouds.h"

namespace wellspace::core {
namespace {

// Lends up to a limit, in one phase or in all, and remembers what it was asked for.
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
  const absl::StatusOr<MeshEstimate> estimate = (*mesher)->Estimate(parameters, context);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(context.estimated_vertices(), 0u);
  ASSERT_TRUE(ReserveMemory(**mesher, parameters, context).ok());
  EXPECT_EQ(context.estimated_vertices(), estimate->vertices);
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

TEST(Memory, IsNotAskedForWithoutALender) {
  const RunContext context;
  EXPECT_FALSE(context.HasMemoryLender());
  EXPECT_TRUE(context.ReserveMemory(~uint64_t{0}).ok());
  EXPECT_TRUE(context.AllowMemory(~uint64_t{0}).ok());
}

}  // namespace
}  // namespace wellspace::core
