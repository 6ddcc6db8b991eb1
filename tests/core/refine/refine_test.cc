// Refinement and its parts: schedule, assessment of cells, sizes.
#include "core/refine/refine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/refine/assessment.h"
#include "core/refine/schedule.h"
#include "tests/core/refine/expect_refined.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::ExpectRefined;
using test::MakeStructure;
using test::Seed;
using test::SplitMix64;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr uint64_t kMany = 1'000'000;

struct Parameters {
  double rho = 0;
  uint64_t max_vertices = kMany;
  double min_edge = 0x1p-48;
};

template <int D>
Parameters Defaults() {
  return {.rho = ByDimension<D>({std::sqrt(2.0), 2.0, 2.9, 4.1})};
}

template <int D>
absl::Status Refine(const Parameters& parameters, QueryStructure<D>& structure, RunContext& context,
                    const RefinementObserver<D>& observer = nullptr) {
  BoxRefinement<D> refinement(structure, parameters.min_edge);
  return refinement.Run({.rho = parameters.rho}, parameters.max_vertices, 2, context, observer);
}

template <int D>
absl::Status RefineQuietly(const Parameters& parameters, QueryStructure<D>& structure) {
  RunContext context;
  return Refine<D>(parameters, structure, context);
}

template <typename T>
class RefineTest : public test::SeededTest {
 protected:
  RefineTest() : SeededTest(1995) {}
};
TYPED_TEST_SUITE(RefineTest, test::UpTo5);

TYPED_TEST(RefineTest, EveryCellIsGoodInTheEnd) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::SomeKinds(D)) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({25, 6, 4, 1})));
    const Parameters parameters = Defaults<D>();
    const absl::Status refined = RefineQuietly<D>(parameters, structure);
    ASSERT_TRUE(refined.ok()) << refined;
    Polytope<D> cell;
    const uint32_t stride = structure.vertex_count() / ByDimension<D>({200, 200, 40, 5}) + 1;
    for (uint32_t v = static_cast<uint32_t>(this->random_.Below(stride)); v < structure.vertex_count(); v += stride) {
      ExpectRefined<D>(structure, VertexId{v}, parameters.rho, cell);
      ASSERT_FALSE(this->HasFatalFailure());
    }
  }
}

TYPED_TEST(RefineTest, KeepsTheTighterBoundsToo) {
  constexpr int D = TypeParam::kValue;
  Parameters parameters = Defaults<D>();
  parameters.rho = ByDimension<D>({0.95, 1.3, 2.0, 3.0});
  QueryStructure<D> structure = MakeStructure<D>(
      test::SortedCloud<D>(ByDimension<D>({"uniform", "uniform", "uniform", "inner"}), ByDimension<D>({20, 4, 3, 1})));
  const absl::Status refined = RefineQuietly<D>(parameters, structure);
  ASSERT_TRUE(refined.ok()) << refined;
  Polytope<D> cell;
  const uint32_t stride = structure.vertex_count() / ByDimension<D>({200, 200, 40, 5}) + 1;
  for (uint32_t v = 0; v < structure.vertex_count(); v += stride) {
    ExpectRefined<D>(structure, VertexId{v}, parameters.rho, cell);
    ASSERT_FALSE(this->HasFatalFailure());
  }
}

TYPED_TEST(RefineTest, InputVerticesStayWhereTheyAre) {
  constexpr int D = TypeParam::kValue;
  const std::vector<Point<D>> points = test::SortedCloud<D>("boundary", ByDimension<D>({20, 20, 10, 2}));
  QueryStructure<D> structure = MakeStructure<D>(points);
  ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok());
  for (uint32_t v = 0; v < points.size(); ++v) {
    EXPECT_EQ(structure.point(VertexId{v}), points[v]);
  }
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    EXPECT_TRUE(structure.box().Contains(structure.point(VertexId{v})));
    EXPECT_EQ(structure.faces(VertexId{v}), structure.box().FacesOf(structure.point(VertexId{v})));
  }
}

// Guarantee (2).
TYPED_TEST(RefineTest, IsDeterministic) {
  constexpr int D = TypeParam::kValue;
  std::array<QueryStructure<D>, 2> structures;
  for (QueryStructure<D>& structure : structures) {
    structure = MakeStructure<D>(test::SortedCloud<D>("rounded", ByDimension<D>({20, 20, 10, 1})));
    ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok());
  }
  ASSERT_EQ(structures[0].vertex_count(), structures[1].vertex_count());
  for (uint32_t v = 0; v < structures[0].vertex_count(); ++v) {
    ASSERT_EQ(structures[0].point(VertexId{v}), structures[1].point(VertexId{v}));
  }
}

TYPED_TEST(RefineTest, ARefinedStructureNeedsNothingMore) {
  constexpr int D = TypeParam::kValue;
  QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", ByDimension<D>({20, 20, 10, 1})));
  ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok());
  const uint32_t count = structure.vertex_count();
  ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok());
  EXPECT_EQ(structure.vertex_count(), count);
}

// Size-conforming up to the boundary: NN(v) >= lfs(v) / (1 + C). An interior Steiner vertex has lfs(x) <= C_0 r(x),
// r(x) its distance from the nearest vertex when inserted, with C_0 = 1 + C / rho; each of up to D projections on faces
// of the box, or encroachments across one, turns a constant C into sqrt 2 C + 1.
TYPED_TEST(RefineTest, VerticesAreNoCloserThanFeaturesAskFor) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "clusters", "boundary", "lines"}) {
    SCOPED_TRACE(std::string(kind));
    const double growth = std::pow(2.0, 0.5 * D);
    Parameters parameters = Defaults<D>();
    parameters.rho = 2 * growth;
    double added = 0;
    for (int k = 0; k < D; ++k) {
      added = std::sqrt(2.0) * added + 1;
    }
    const double c = growth * (1 + added / parameters.rho) / (1 - growth / parameters.rho) + added;
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({40, 40, 10, 1})));
    std::vector<Point<D>> features;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      features.push_back(structure.point(VertexId{v}));
    }
    ASSERT_TRUE(RefineQuietly<D>(parameters, structure).ok());
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      const double lfs = test::LocalFeatureSize<D>(structure.box(), features, structure.point(VertexId{v}));
      ASSERT_GE(std::sqrt(test::NearestDistanceSq<D>(structure, VertexId{v})), lfs / (1 + c)) << "vertex " << v;
    }
  }
}

// Guarantee (1): vertices of a bucket are no closer to others than the bucket's edges allow, as long as nothing is
// snapped; a projection on up to D faces shortens its empty radius by at most sqrt 2 each.
TYPED_TEST(RefineTest, NewVerticesAreAsFarApartAsTheBucketSays) {
  constexpr int D = TypeParam::kValue;
  uint32_t inserted = 0;
  for (const std::string_view kind : {"uniform", "clusters", "boundary", "log-uniform"}) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({40, 10, 6, 1})));
    const Parameters parameters = Defaults<D>();
    RunContext context;
    const uint32_t before = structure.vertex_count();
    uint32_t expected = before;
    double worst = std::numeric_limits<double>::infinity();
    const absl::Status status =
        Refine<D>(parameters, structure, context, [&](const QueryStructure<D>& at, const Insertion& insertion) {
          ASSERT_EQ(at.vertex_count(), ++expected) << "one vertex a step";
          ASSERT_EQ(Index(insertion.vertex), expected - 1);
          const double bucket_begins = std::sqrt(insertion.edge_limit_sq / 2);
          const double nearest = std::sqrt(test::NearestDistanceSq<D>(at, VertexId{at.vertex_count() - 1}));
          worst = std::min(worst, nearest / bucket_begins);
        });
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_GE(worst, std::pow(0.5, 0.5 * D));
    inserted += structure.vertex_count() - before;
    if (structure.vertex_count() > before) {
      EXPECT_EQ(context.Snapshot().vertices, structure.vertex_count());
    }
  }
  EXPECT_GT(inserted, 100u);
}

TYPED_TEST(RefineTest, EndsAtMaxVerticesWithTheStructureUsable) {
  constexpr int D = TypeParam::kValue;
  QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", ByDimension<D>({30, 30, 10, 1})));
  Parameters parameters = Defaults<D>();
  parameters.max_vertices = structure.vertex_count() + 25;
  const absl::Status status = RefineQuietly<D>(parameters, structure);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_vertices = " + std::to_string(parameters.max_vertices)));
  ASSERT_EQ(structure.vertex_count(), parameters.max_vertices);
  Workspace<D> workspace;
  Polytope<D> slow;
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    structure.ClippedVoronoi(VertexId{v}, 10, workspace);
    test::CutByAllInBox<D>(structure, VertexId{v}, slow);
    ASSERT_TRUE(test::HaveSameNodes<D>(workspace.cell, slow));
  }
  ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok()) << "with a larger budget it goes on";
  ExpectRefined<D>(structure, VertexId{0}, parameters.rho, slow);
}

TYPED_TEST(RefineTest, WhatWasStoppedEndsAsIfItHadNotBeen) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "grid", "boundary"}) {
    SCOPED_TRACE(std::string(kind));
    const std::vector<Point<D>> cloud = test::SortedCloud<D>(kind, ByDimension<D>({200, 60, 8, 1}));
    QueryStructure<D> at_once = MakeStructure<D>(cloud);
    ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), at_once).ok());
    QueryStructure<D> stopped = MakeStructure<D>(cloud);
    BoxRefinement<D> refinement(stopped, Defaults<D>().min_edge);
    RunContext context;
    absl::Status status = absl::UnknownError("not begun");
    int stops = 0;
    for (; !status.ok() && stops < 10'000; ++stops) {
      const uint64_t budget = stopped.vertex_count() + this->random_.Below(20);
      const int threads = 1 + static_cast<int>(this->random_.Below(2));
      status = refinement.Run({.rho = Defaults<D>().rho}, budget, threads, context);
    }
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_TRUE(stops > 3 || kind == "boundary") << stops;  // a point on a face may need no vertices
    ASSERT_EQ(stopped.vertex_count(), at_once.vertex_count());
    for (uint32_t v = 0; v < stopped.vertex_count(); ++v) {
      ASSERT_EQ(stopped.point(VertexId{v}), at_once.point(VertexId{v})) << "vertex " << v;
    }
  }
}

TYPED_TEST(RefineTest, EndsAtTheShortestEdge) {
  constexpr int D = TypeParam::kValue;
  QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("clusters", ByDimension<D>({100, 60, 30, 10})));
  Parameters parameters = Defaults<D>();
  parameters.min_edge = 0.1;
  const uint32_t inputs = structure.vertex_count();
  const absl::Status status = RefineQuietly<D>(parameters, structure);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("edge of length"));
  for (uint32_t v = inputs; v < structure.vertex_count(); ++v) {
    // Snapped points keep an empty ball that the box's faces bound, never a shorter distance.
    EXPECT_GE(std::sqrt(test::NearestDistanceSq<D>(structure, VertexId{v})), parameters.min_edge * (1 - 1e-9));
  }
  Workspace<D> workspace;
  structure.Voronoi(VertexId{0}, workspace);
  EXPECT_TRUE(test::HasEmptyBalls<D>(structure, VertexId{0}, workspace.cell));
}

TYPED_TEST(RefineTest, CancelFromTheObserverEndsTheRun) {
  constexpr int D = TypeParam::kValue;
  for (const bool deadline : {false, true}) {
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", ByDimension<D>({100, 100, 20, 2})));
    RunContext context;
    int steps = 0;
    int steps_after = 0;
    const absl::Status status =
        Refine<D>(Defaults<D>(), structure, context, [&](const QueryStructure<D>&, const Insertion&) {
          steps_after += context.IsCancelled() ? 1 : 0;
          if (++steps == 20) {
            deadline ? context.ExceedDeadline() : context.Cancel();
          }
        });
    EXPECT_EQ(status.code(), deadline ? absl::StatusCode::kDeadlineExceeded : absl::StatusCode::kCancelled);
    EXPECT_EQ(steps_after, 0) << "not even the cell at hand is finished";
    ASSERT_TRUE(RefineQuietly<D>(Defaults<D>(), structure).ok()) << "the structure stays usable";
  }
}

// The cell of corner 0 of an empty unit box: a cube of side 1/2, all nodes but the far one on the site's own faces.
TYPED_TEST(RefineTest, AssessesTheCellOfACorner) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>({});
  Workspace<D> workspace;
  structure.ClippedVoronoi(VertexId{0}, 10, workspace);
  const FaceMask faces = structure.faces(VertexId{0});
  const double far = std::sqrt(0.25 * D);

  const Assessment good = Assess<D>(workspace.cell, faces, {.rho = far + 1e-9}, 100);
  EXPECT_TRUE(good.IsGood());
  EXPECT_DOUBLE_EQ(good.radius_sq, 0.25 * D);

  const Assessment bad = Assess<D>(workspace.cell, faces, {.rho = far - 1e-9}, 1);
  EXPECT_FALSE(bad.IsGood());
  ASSERT_GE(bad.bad_node, 0);
  EXPECT_DOUBLE_EQ(workspace.cell.nodes()[bad.bad_node].radius_sq, 0.25 * D);
  EXPECT_EQ(workspace.cell.plane(bad.bad_plane).length, 1);
  EXPECT_EQ(bad.next_edge_sq, Assessment::kNone);

  // The same node belongs to an edge that is too long to be looked at now.
  const Assessment later = Assess<D>(workspace.cell, faces, {.rho = far - 1e-9}, 0.99);
  EXPECT_LT(later.bad_node, 0);
  EXPECT_DOUBLE_EQ(later.next_edge_sq, 1);
  EXPECT_FALSE(later.IsGood());

  // A node on an own face at (1/2, ...) that is too far asks for nothing, but is remembered with its edge.
  const double on_face = std::sqrt(0.25 * (D - 1));
  const Assessment remembered = Assess<D>(workspace.cell, faces, {.rho = on_face - 1e-9}, 0.99);
  EXPECT_DOUBLE_EQ(remembered.own_boundary_edge_sq, 1);
  EXPECT_DOUBLE_EQ(remembered.radius_sq, 0.25 * D);
  EXPECT_EQ(Assess<D>(workspace.cell, faces, {.rho = on_face + 1e-9}, 0.99).own_boundary_edge_sq, Assessment::kNone);

  structure.ClippedVoronoi(VertexId{0}, 0.4, workspace);
  const Assessment clipped = Assess<D>(workspace.cell, faces, {.rho = 2}, 100);
  EXPECT_TRUE(clipped.is_clipped);
  EXPECT_FALSE(clipped.IsGood());
}

TEST(SizeFieldTest, LeastAroundAPointIsTheLeastOfItsBall) {
  constexpr double kFar = 1.7;
  const SizeField<2> sizes(1.5, {{{{0, 0}, {1, 1}}, 0.25}, {{{4, 0}, {5, 1}}, 0.5}});
  test::SplitMix64 random(test::Seed(2008));
  for (int repeat = 0; repeat < 50; ++repeat) {
    const Point<2> x = {8 * random.Unit() - 2, 5 * random.Unit() - 2};
    const double reach = kFar * random.Unit();
    double least = sizes.AtSq(x);
    EXPECT_NEAR(sizes.LeastAroundSq(x, 0), least, 1e-14);
    constexpr int kSteps = 200;
    for (int i = 0; i < kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        const double angle = 2 * std::numbers::pi * i / kSteps;
        const double radius = reach * j / kSteps;
        least = std::min(least, sizes.AtSq({x[0] + radius * std::cos(angle), x[1] + radius * std::sin(angle)}));
      }
    }
    EXPECT_LE(sizes.LeastAroundSq(x, reach), least * (1 + 1e-12));
    EXPECT_NEAR(sizes.LeastAroundSq(x, reach), least, 0.01);
  }
}

TEST(ScheduleTest, BucketsDivideSquaredLengthsByTwo) {
  const Schedule schedule(1e-3);
  EXPECT_EQ(schedule.BucketOf(1e-9), 0);
  EXPECT_EQ(schedule.BucketOf(1e-6), 0);
  for (int bucket = 0; bucket < 60; ++bucket) {
    EXPECT_EQ(schedule.BucketOf(std::nextafter(schedule.UpperLengthSq(bucket), 0)), bucket);
    EXPECT_EQ(schedule.BucketOf(schedule.UpperLengthSq(bucket)), bucket + 1);
  }
}

// Invariants, against a model that remembers for each vertex its bucket and when it came there.
TEST(ScheduleTest, BehavesAsItsModel) {
  const uint64_t seed = Seed(4711);
  SCOPED_TRACE("seed " + std::to_string(seed));
  SplitMix64 random(seed);
  Schedule schedule(1);
  std::map<uint32_t, std::pair<int, int>> model;
  for (int time = 0; time < 20000; ++time) {
    if (random.Below(5) < 3) {
      const uint32_t v = static_cast<uint32_t>(random.Below(100));
      const int bucket = static_cast<int>(random.Below(40));
      if (random.Below(2) == 0) {
        schedule.AddToBucket(VertexId{v}, bucket);
      } else {
        schedule.Add(VertexId{v}, 1.5 * std::ldexp(1.0, bucket));
      }
      if (!model.contains(v) || model[v].first > bucket) {
        model[v] = {bucket, time};
      }
      continue;
    }
    const auto next = std::min_element(model.begin(), model.end(), [](const auto& a, const auto& b) {
      return a.second.first != b.second.first ? a.second.first < b.second.first : a.second.second > b.second.second;
    });
    VertexId v{};
    int bucket = -1;
    ASSERT_EQ(schedule.Pop(v, bucket), next != model.end());
    if (next != model.end()) {
      ASSERT_EQ(Index(v), next->first);
      ASSERT_EQ(bucket, next->second.first);
      model.erase(next);
    }
  }
}

TEST(ScheduleTest, WhatIsDetachedIsPendingUntilItIsTakenOrReattached) {
  Schedule schedule(1);
  for (uint32_t v = 0; v < 6; ++v) {
    schedule.AddToBucket(VertexId{v}, 3);
  }
  schedule.AddToBucket(VertexId{4}, 2);
  VertexId v{};
  int bucket = 0;
  ASSERT_TRUE(schedule.Pop(v, bucket));
  schedule.AddToBucket(v, 3);  // which it had before: once more in the list, but pending once
  EXPECT_EQ(schedule.Lowest(), 3);
  const HugeVector<VertexId> detached = schedule.Detach(3);
  EXPECT_THAT(detached, ElementsAre(VertexId{0}, VertexId{1}, VertexId{2}, VertexId{3}, VertexId{5}, VertexId{4}));
  EXPECT_EQ(schedule.size(), 6);
  EXPECT_FALSE(schedule.HasBelow(3));
  EXPECT_EQ(schedule.Lowest(), -1) << "what is detached has no place in the order";
  for (const VertexId u : detached) {
    EXPECT_TRUE(schedule.IsPendingIn(u, 3));
  }
  schedule.AddToBucket(VertexId{1}, 1);  // moves down
  EXPECT_FALSE(schedule.IsPendingIn(VertexId{1}, 3));
  EXPECT_TRUE(schedule.HasBelow(3));
  EXPECT_TRUE(schedule.Pop(v, bucket, 3));
  EXPECT_EQ(v, VertexId{1});
  EXPECT_FALSE(schedule.Pop(v, bucket, 3));
  schedule.Take(VertexId{0});
  EXPECT_FALSE(schedule.IsPending(VertexId{0}));
  schedule.DetachAgain(VertexId{0}, 3);
  EXPECT_TRUE(schedule.IsPendingIn(VertexId{0}, 3));
  EXPECT_EQ(schedule.size(), 5);
  schedule.Take(VertexId{0});
  schedule.AddToBucket(VertexId{0}, 1);
  schedule.DetachAgain(VertexId{0}, 3);
  EXPECT_TRUE(schedule.Pop(v, bucket, 3)) << "it is pending below";
  EXPECT_EQ(v, VertexId{0});
  schedule.Reattach(VertexId{5}, 3);
  schedule.Reattach(VertexId{2}, 3);
  EXPECT_EQ(schedule.MostIn(3), 2);
  EXPECT_FALSE(schedule.Pop(v, bucket, 3)) << "below 3";
  for (const uint32_t expected : {2, 5}) {
    EXPECT_TRUE(schedule.Pop(v, bucket));
    EXPECT_EQ(Index(v), expected);
    EXPECT_EQ(bucket, 3);
  }
  EXPECT_FALSE(schedule.Pop(v, bucket));
  EXPECT_EQ(schedule.size(), 2) << "3 and 4 are detached still";
  schedule.AddToBucket(VertexId{6}, 3);
  schedule.AddToBucket(VertexId{6}, 1);
  EXPECT_EQ(schedule.MostIn(3), 1);
  EXPECT_TRUE(schedule.Detach(3).empty()) << "6 has moved on";
}

// Vertices come by blocks of numbers, new ones in the block of their neighbour. The last of a block come first, and
// vertices of a lower bucket before all.
TEST(ScheduleTest, BucketsArePutInOrderByBlocksOnce) {
  constexpr uint32_t kBlocks = 5;
  constexpr uint32_t kCount = kBlocks * Schedule::kBlockSize;
  constexpr int kBucket = 3;
  const uint64_t seed = Seed(4712);
  SCOPED_TRACE("seed " + std::to_string(seed));
  SplitMix64 random(seed);
  Schedule schedule(1);
  std::vector<uint32_t> block_of(kCount);
  for (uint32_t v = 0; v < kCount; ++v) {
    block_of[v] = v / Schedule::kBlockSize;
  }
  for (int round = 0; round < 2; ++round) {
    schedule.Begin(kCount);
    const auto new_vertex = [&](VertexId near) {
      const VertexId v{static_cast<uint32_t>(block_of.size())};
      schedule.PutBeside(near, v);
      block_of.push_back(block_of[Index(near)]);
      return v;
    };
    std::vector<VertexId> come;
    for (uint32_t v = 0; v < kCount; ++v) {
      come.push_back(VertexId{v});
    }
    for (int i = 0; i < 100; ++i) {
      come.push_back(new_vertex(VertexId{static_cast<uint32_t>(random.Below(kCount))}));
    }
    for (size_t i = come.size(); i-- > 1;) {
      std::swap(come[i], come[random.Below(i + 1)]);
    }
    for (const VertexId v : come) {
      schedule.AddToBucket(v, kBucket);
    }
    const VertexId lowest = new_vertex(VertexId{0});
    schedule.AddToBucket(lowest, 0);
    std::stable_sort(come.begin(), come.end(),
                     [&](VertexId a, VertexId b) { return block_of[Index(a)] < block_of[Index(b)]; });
    VertexId v{};
    int bucket = -1;
    ASSERT_TRUE(schedule.Pop(v, bucket));
    ASSERT_EQ(v, lowest);
    while (!come.empty()) {
      ASSERT_TRUE(schedule.Pop(v, bucket));
      ASSERT_EQ(bucket, kBucket);
      ASSERT_EQ(v, come.back());
      come.pop_back();
      if (random.Below(100) == 0) {
        come.push_back(new_vertex(VertexId{static_cast<uint32_t>(random.Below(kCount))}));
        schedule.AddToBucket(come.back(), kBucket);
      }
      if (random.Below(100) == 0) {  // a lower one between does not put this one in order again
        schedule.AddToBucket(lowest, 1);
        ASSERT_TRUE(schedule.Pop(v, bucket));
        ASSERT_EQ(v, lowest);
      }
    }
    ASSERT_FALSE(schedule.Pop(v, bucket));
  }
}

// As many vertices as there can be do not need more blocks than can be numbered.
TEST(ScheduleTest, BlocksGrowWithTheNumberOfVertices) {
  Schedule schedule(1);
  constexpr uint32_t kCount = (Schedule::kBlockSize << 16) + 1;
  schedule.Begin(kCount);
  std::vector<VertexId> expected;
  for (const uint32_t v : {uint32_t{0}, kCount / 2, kCount - 1}) {
    expected.push_back(VertexId{v});
  }
  schedule.AddToBucket(expected[1], 0);
  schedule.AddToBucket(expected[0], 0);
  schedule.AddToBucket(expected[2], 0);
  VertexId v{};
  int bucket = -1;
  while (!expected.empty()) {
    ASSERT_TRUE(schedule.Pop(v, bucket));
    ASSERT_EQ(v, expected.back());
    expected.pop_back();
  }
}

}  // namespace
}  // namespace wellspace::core
