// Refinement of clouds that are large enough for many rounds: several threads speculate, and the mesh does not tell.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "core/refine/refine.h"
#include "tests/core/refine/expect_refined.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ExpectRefined;
using test::MakeStructure;
using ::testing::HasSubstr;

constexpr uint64_t kMany = 1'000'000;
constexpr double kMinEdge = 0x1p-48;
constexpr size_t kPoints = 4000;

MeshCriteria<2> PlainCriteria() { return {.rho = std::sqrt(2.0)}; }

template <int D>
struct RefinedIn {
  explicit RefinedIn(const std::vector<Point<D>>& cloud)
      : structure(MakeStructure<D>(cloud)), refinement(structure, kMinEdge) {}

  QueryStructure<D> structure;
  BoxRefinement<D> refinement;
};
using Refined = RefinedIn<2>;

// In order, which stars are not listed in.
template <int D>
Star<D> ListedAt(const RefinedIn<D>& refined, VertexId v) {
  const auto listed = refined.refinement.stars().Of(v);
  Star<D> sorted(listed.begin(), listed.end());
  for (auto& simplex : sorted) {
    std::sort(simplex.begin(), simplex.end());
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

template <int D>
void ExpectSame(const RefinedIn<D>& actual, const RefinedIn<D>& expected) {
  ASSERT_EQ(actual.structure.vertex_count(), expected.structure.vertex_count());
  for (uint32_t i = 0; i < actual.structure.vertex_count(); ++i) {
    const VertexId v{i};
    ASSERT_EQ(actual.structure.point(v), expected.structure.point(v)) << "vertex " << i;
    ASSERT_EQ(ListedAt(actual, v), ListedAt(expected, v)) << "vertex " << i;
  }
}

// That the ball about a new vertex was empty.
void ExpectIsFar(const QueryStructure<2>& structure, const Insertion& insertion, Workspace<2>& workspace) {
  const double limit = std::max(0.0, std::sqrt(insertion.empty_radius_sq) * (1 - 1e-9) - 0x1p-50);
  const Neighbor nearest = structure.NearestWithin(insertion.vertex, limit * limit, workspace);
  ASSERT_EQ(nearest.vertex, kNoVertex) << "at a squared distance of " << nearest.distance_sq;
}

// That each simplex at `v` is listed by one of its vertices.
void ExpectIsListed(const Refined& refined, VertexId v, const Polytope<2>& cell) {
  Star<2> star;
  cell.FindStar(star);
  for (const auto& [a, b] : star) {
    const auto lists = [&](VertexId u, VertexId w, VertexId x) {
      const Star<2> listed = ListedAt(refined, u);
      return std::find(listed.begin(), listed.end(), std::array{std::min(w, x), std::max(w, x)}) != listed.end();
    };
    ASSERT_TRUE(lists(v, a, b) || lists(a, v, b) || lists(b, v, a)) << Index(v) << ' ' << Index(a) << ' ' << Index(b);
  }
}

// On several threads, and stopped now and then on one and on two.
template <int D>
void ExpectSameHoweverItIsRun(const std::vector<Point<D>>& cloud, const MeshCriteria<D>& criteria,
                              uint64_t most_at_once, test::SplitMix64& random) {
  RefinedIn<D> expected(cloud);
  RunContext context;
  ASSERT_TRUE(expected.refinement.Run(criteria, kMany, 1, context).ok());
  for (const int threads : {2, 4}) {
    SCOPED_TRACE(threads);
    RefinedIn<D> actual(cloud);
    ASSERT_TRUE(actual.refinement.Run(criteria, kMany, threads, context).ok());
    ExpectSame<D>(actual, expected);
  }
  RefinedIn<D> stopped(cloud);
  absl::Status status = absl::UnknownError("not begun");
  while (!status.ok()) {
    const uint64_t budget = stopped.structure.vertex_count() + 1 + random.Below(most_at_once);
    status = stopped.refinement.Run(criteria, budget, 1 + static_cast<int>(random.Below(2)), context);
    if (!status.ok()) {
      ASSERT_THAT(std::string(status.message()), HasSubstr("max_vertices = " + std::to_string(budget)));
      ASSERT_EQ(stopped.structure.vertex_count(), budget);
    }
  }
  ExpectSame<D>(stopped, expected);
}

class RefineInRoundsTest : public test::SeededTest, public ::testing::WithParamInterface<std::string_view> {
 protected:
  RefineInRoundsTest() : SeededTest(2021), cloud_(test::SortedCloud<2>(GetParam(), kPoints)) {}

  const std::vector<Point<2>> cloud_;
};
INSTANTIATE_TEST_SUITE_P(Clouds, RefineInRoundsTest,
                         ::testing::Values("uniform", "clusters", "lines", "grid", "boundary", "cospherical"),
                         [](const auto& kind) { return std::string(kind.param); });

TEST_P(RefineInRoundsTest, IsTheSameForAnyNumberOfThreadsAndHoweverOftenItIsStopped) {
  MeshCriteria<2> tight = PlainCriteria();
  tight.rho = 1;
  MeshCriteria<2> sized = PlainCriteria();
  sized.sizes = SizeField<2>(0.02, {{{{0.2, 0.3}, {0.4, 0.5}}, 0.004}});
  MeshCriteria<2> well_spaced = PlainCriteria();
  well_spaced.criterion = Criterion::kWellSpaced;
  for (const MeshCriteria<2>& criteria : {PlainCriteria(), tight, sized, well_spaced}) {
    SCOPED_TRACE(criteria.rho);
    SCOPED_TRACE(criteria.sizes.max_circumradius());
    ExpectSameHoweverItIsRun<2>(cloud_, criteria, 200, random_);
    ASSERT_FALSE(HasFatalFailure());
  }
}

TEST_P(RefineInRoundsTest, IsTheSameIn3d) {
  const std::vector<Point<3>> cloud = test::SortedCloud<3>(GetParam(), kPoints / 4);
  MeshCriteria<3> well_spaced{.rho = 2};
  well_spaced.criterion = Criterion::kWellSpaced;
  for (const MeshCriteria<3>& criteria : {MeshCriteria<3>{.rho = 2}, well_spaced}) {
    ExpectSameHoweverItIsRun<3>(cloud, criteria, 400, random_);
    ASSERT_FALSE(HasFatalFailure());
  }
}

// One segment is a vertex longer than a number of batches, and ends after all others.
TEST(RefineInRoundsAloneTest, TheLongestSegmentIsRefinedToItsEnd) {
  constexpr int kColumns = 41;
  constexpr int kRows = 25;
  static_assert(kColumns * kRows == 8 * 128 + 1);
  std::vector<Point<2>> cloud;
  for (int i = 0; i < kColumns * kRows; ++i) {
    cloud.push_back({0.1 + 0.0195 * (i % kColumns), 0.1 + 0.0195 * (i / kColumns)});
  }
  cloud = test::MortonSorted<2>(test::UnitBox<2>(), cloud);
  Refined expected(cloud);
  RunContext context;
  ASSERT_TRUE(expected.refinement.Run(PlainCriteria(), kMany, 1, context).ok());
  for (int repeat = 0; repeat < 5; ++repeat) {
    Refined actual(cloud);
    ASSERT_TRUE(actual.refinement.Run(PlainCriteria(), kMany, 2, context).ok());
    ExpectSame<2>(actual, expected);
    ASSERT_FALSE(HasFatalFailure());
  }
}

TEST_P(RefineInRoundsTest, EveryCellIsGoodInTheEnd) {
  Refined refined(cloud_);
  RunContext context;
  Workspace<2> workspace;
  uint32_t vertices = refined.structure.vertex_count();
  const auto observer = [&](const QueryStructure<2>& structure, const Insertion& insertion) {
    ASSERT_EQ(Index(insertion.vertex), vertices++);
    ASSERT_EQ(structure.vertex_count(), vertices);
    ASSERT_LT(Index(insertion.near), Index(insertion.vertex));
    // The other end of the edge, by numbers that hold now.
    if (insertion.other != kNoVertex) {
      const double edge_sq = DistanceSq<2>(structure.point(insertion.near), structure.point(insertion.other));
      ASSERT_NEAR(edge_sq, insertion.edge_sq, 1e-9 * edge_sq);
    }
    ExpectIsFar(structure, insertion, workspace);
  };
  ASSERT_TRUE(refined.refinement.Run(PlainCriteria(), kMany, 2, context, observer).ok());
  ASSERT_EQ(refined.structure.vertex_count(), vertices);
  Polytope<2> cell;
  for (uint32_t v = static_cast<uint32_t>(random_.Below(20)); v < vertices; v += 20) {
    ExpectRefined<2>(refined.structure, VertexId{v}, PlainCriteria().rho, cell);
    ASSERT_FALSE(HasFatalFailure());
    ExpectIsListed(refined, VertexId{v}, cell);
    ASSERT_FALSE(HasFatalFailure());
  }
}

// Where the refinement is at work, so that records are no longer valid.
TEST_P(RefineInRoundsTest, IsToldOfVerticesThatOthersAddWhileItIsStopped) {
  Refined refined(cloud_);
  RunContext context;
  Workspace<2> workspace;
  const auto observer = [&](const QueryStructure<2>& structure, const Insertion& insertion) {
    ExpectIsFar(structure, insertion, workspace);
  };
  absl::Status status = absl::UnknownError("not begun");
  while (!status.ok()) {
    const uint64_t budget = refined.structure.vertex_count() + 1 + random_.Below(50);
    status = refined.refinement.Run(PlainCriteria(), budget, 2, context, observer);
    ASSERT_FALSE(HasFatalFailure());
    const VertexId last{refined.structure.vertex_count() - 1};
    const double angle = 2 * std::numbers::pi * random_.Unit();
    const double radius = 1.5 * std::sqrt(refined.structure.NearestNeighbor(last, workspace).distance_sq);
    Point<2> p = refined.structure.point(last);
    p = {p[0] + radius * std::cos(angle), p[1] + radius * std::sin(angle)};
    if (status.ok() || refined.structure.vertex_count() > 3 * kPoints || !test::UnitBox<2>().Contains(p)) {
      continue;
    }
    const Neighbor nearest = refined.structure.NearestTo(p, last, workspace);
    if (nearest.distance_sq > radius * radius / 16) {
      refined.refinement.VertexAdded(refined.structure.AddVertex(nearest.vertex, p));
    }
  }
  Polytope<2> cell;
  for (uint32_t v = 0; v < refined.structure.vertex_count(); v += 20) {
    ExpectRefined<2>(refined.structure, VertexId{v}, PlainCriteria().rho, cell);
    ASSERT_FALSE(HasFatalFailure());
  }
}

TEST_P(RefineInRoundsTest, OtherCriteriaMayFollowWhileItIsStopped) {
  Refined refined(cloud_);
  RunContext context;
  const absl::Status status =
      refined.refinement.Run(PlainCriteria(), refined.structure.vertex_count() + 50, 2, context);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  const MeshCriteria<2> tighter{.rho = 1.1};
  ASSERT_TRUE(refined.refinement.Run(tighter, kMany, 2, context).ok());
  Polytope<2> cell;
  for (uint32_t v = 0; v < refined.structure.vertex_count(); v += 20) {
    ExpectRefined<2>(refined.structure, VertexId{v}, tighter.rho, cell);
    ASSERT_FALSE(HasFatalFailure());
  }
}

}  // namespace
}  // namespace wellspace::core
