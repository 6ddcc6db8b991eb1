// The simplices of a refined structure: those of the vertices' whole cells, each once.
#include "core/simplex/simplices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/refine/refine.h"
#include "core/simplex/quality.h"
#include "core/simplex/simplex_list.h"
#include "core/sliver/repair.h"
#include "core/sliver/sliver_stage.h"
#include "core/validate/validate.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::MakeStructure;

template <int D>
using SimplexSet = std::vector<std::array<uint32_t, D + 1>>;

template <int D>
SimplexSet<D> Sorted(SimplexSet<D> simplices) {
  for (auto& simplex : simplices) {
    std::sort(simplex.begin(), simplex.end());
  }
  std::sort(simplices.begin(), simplices.end());
  return simplices;
}

template <int D>
SimplexSet<D> SetOf(const Simplices& simplices) {
  SimplexSet<D> set(simplices.indices.size() / (D + 1));
  for (size_t i = 0; i < simplices.indices.size(); ++i) {
    set[i / (D + 1)][i % (D + 1)] = simplices.indices[i];
  }
  return Sorted<D>(std::move(set));
}

// Each simplex as the vertex with the lowest index finds it among the nodes of its cell.
template <int D>
SimplexSet<D> SetOfCells(const QueryStructure<D>& structure, const std::vector<uint32_t>& output_index) {
  SimplexSet<D> set;
  Workspace<D> workspace;
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    structure.Voronoi(VertexId{v}, workspace);
    for (const CellNode<D>& node : workspace.cell.nodes()) {
      std::array<uint32_t, D + 1> simplex;
      simplex[D] = output_index[v];
      bool is_lowest = true;
      for (int k = 0; k < D; ++k) {
        const Plane<D>& plane = workspace.cell.plane(node.planes[k]);
        simplex[k] = plane.kind == PlaneKind::kBisector ? output_index[Index(plane.vertex)] : 0;
        is_lowest = is_lowest && plane.kind == PlaneKind::kBisector && simplex[k] > simplex[D];
      }
      if (is_lowest) {
        set.push_back(simplex);
      }
    }
  }
  return Sorted<D>(std::move(set));
}

template <int D>
StarLists<D> Refine(QueryStructure<D>& structure) {
  RunContext context;
  BoxRefinement<D> refinement(structure, 0x1p-48);
  const absl::Status refined = refinement.Run({.rho = std::sqrt(1 << (D - 1))}, 1'000'000, 1, context);
  EXPECT_TRUE(refined.ok()) << refined;
  return refinement.stars();
}

// Any permutation serves.
std::vector<uint32_t> MakeOutputIndex(uint32_t count) {
  std::vector<uint32_t> index(count);
  std::iota(index.begin(), index.end(), 0u);
  test::SplitMix64 random(7);
  for (uint32_t i = count; i > 1; --i) {
    std::swap(index[i - 1], index[random.Below(i)]);
  }
  return index;
}

template <int D>
void ExpectSimplicesOfCells(std::string_view kind, size_t n) {
  QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, n));
  const StarLists<D> stars = Refine<D>(structure);
  const std::vector<uint32_t> output_index = MakeOutputIndex(structure.vertex_count());
  RunContext context;
  const absl::StatusOr<Simplices> simplices = ComputeSimplices<D>(structure, stars, output_index, 1, context);
  ASSERT_TRUE(simplices.ok()) << simplices.status();
  const SimplexSet<D> set = SetOf<D>(*simplices);
  EXPECT_EQ(set, SetOfCells<D>(structure, output_index));
  EXPECT_EQ(context.Snapshot().simplices, set.size());
  EXPECT_EQ(simplices->counters.queries, structure.vertex_count());

  // Positive, the lowest vertex first; and the worst of all shapes is the one that is reported, to the bit.
  std::vector<Point<D>> points(structure.vertex_count());
  for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
    points[output_index[v]] = structure.point(VertexId{v});
  }
  double max_radius_edge = 0;
  double min_angle_deg = 180;
  for (size_t s = 0; s < set.size(); ++s) {
    Simplex<D> simplex;
    Simplex<D> ascending;
    for (int i = 0; i <= D; ++i) {
      simplex[i] = points[simplices->indices[s * (D + 1) + i]];
      ascending[i] = points[set[s][i]];
      EXPECT_LE(simplices->indices[s * (D + 1)], simplices->indices[s * (D + 1) + i]);
    }
    ASSERT_EQ(Orientation<D>(simplex).sign, Sign::kPositive);
    max_radius_edge = std::max(max_radius_edge, RadiusEdgeRatio<D>(ascending));
    min_angle_deg = std::min(min_angle_deg, Angles<D>(ascending).min_deg);
  }
  EXPECT_EQ(simplices->max_radius_edge, max_radius_edge);
  EXPECT_EQ(simplices->min_angle_deg, min_angle_deg);

  const absl::StatusOr<Simplices> again = ComputeSimplices<D>(structure, stars, output_index, 2, context);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->indices, simplices->indices);
  EXPECT_EQ(again->max_radius_edge, simplices->max_radius_edge);
  EXPECT_EQ(again->min_angle_deg, simplices->min_angle_deg);
}

using CloudCase = std::tuple<std::string_view, int>;

class SimplicesOfCloud : public ::testing::TestWithParam<CloudCase> {};

INSTANTIATE_TEST_SUITE_P(Clouds, SimplicesOfCloud,
                         ::testing::Combine(::testing::ValuesIn(test::AllKinds()), ::testing::Values(2, 3)),
                         [](const auto& param) {
                           return test::CloudName(std::get<0>(param.param), std::get<1>(param.param));
                         });

TEST_P(SimplicesOfCloud, AreThoseOfTheCells) {
  const auto& [kind, dimension] = GetParam();
  if (dimension == 2) {
    ExpectSimplicesOfCells<2>(kind, 1000);
  } else {
    ExpectSimplicesOfCells<3>(kind, 300);
  }
}

// More vertices than one block takes.
TEST(Simplices, BlocksAgree) {
  ExpectSimplicesOfCells<2>("uniform", 4'000);
  ExpectSimplicesOfCells<2>("grid", 5'000);
  ExpectSimplicesOfCells<3>("grid", 5'000);
  ExpectSimplicesOfCells<3>("uniform", 2'000);
}

// Large stars beside small ones.
TEST(Simplices, StarsAgreeWhereSizesVary) {
  ExpectSimplicesOfCells<2>("lines", 2'000);
  ExpectSimplicesOfCells<3>("skew", 1'000);
}

TEST(Simplices, InHigherDimensionsToo) {
  ExpectSimplicesOfCells<4>("uniform", 60);
  ExpectSimplicesOfCells<4>("grid", 16);
}

// Refinements that stop, or are told of vertices, on the way to their end.
class StarsOfRefinementTest : public test::SeededTest {
 protected:
  StarsOfRefinementTest() : SeededTest(47) {}

  template <int D>
  static absl::Status Run(BoxRefinement<D>& refinement, RunContext& context,
                          const RefinementObserver<D>& observer = nullptr) {
    const int threads = 2;
    return refinement.Run({.rho = std::sqrt(1 << (D - 1))}, 1'000'000, threads, context, observer);
  }

  // The simplices are those of the cells.
  template <int D>
  static void ExpectSimplicesOfCells(const QueryStructure<D>& structure, const StarLists<D>& stars) {
    RunContext context;
    const std::vector<uint32_t> output_index = MakeOutputIndex(structure.vertex_count());
    const absl::StatusOr<Simplices> simplices = ComputeSimplices<D>(structure, stars, output_index, 1, context);
    ASSERT_TRUE(simplices.ok()) << simplices.status();
    EXPECT_EQ(SetOf<D>(*simplices), SetOfCells<D>(structure, output_index));
  }

  template <int D>
  void ExpectThoseOfCellsAfterVerticesWereAdded(std::string_view kind) {
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, D == 2 ? 200 : D == 3 ? 60 : 8));
    BoxRefinement<D> refinement(structure, 0x1p-48);
    RunContext context;
    ASSERT_TRUE(Run<D>(refinement, context).ok());
    for (int round = 0; round < 3; ++round) {
      // One in the interior after the other, closer and closer to a first.
      Point<D> p;
      for (double& x : p) {
        x = 0.1 + 0.8 * random_.Unit();
      }
      for (int i = 0; i < 8; ++i) {
        refinement.VertexAdded(structure.AddVertex(kNoVertex, p));
        p[i % D] += std::ldexp(0.1 + random_.Unit(), -4 - i);
      }
      ASSERT_TRUE(Run<D>(refinement, context).ok());
      ExpectSimplicesOfCells<D>(structure, refinement.stars());
    }
  }

  template <int D>
  void ExpectThoseOfCellsAfterStops(std::string_view kind) {
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, D == 2 ? 300 : 80));
    BoxRefinement<D> refinement(structure, 0x1p-48);
    absl::Status status = absl::CancelledError();
    int stops = 0;
    for (; absl::IsCancelled(status); ++stops) {
      RunContext context;
      uint64_t left = 1 + random_.Below(40);
      status = Run<D>(refinement, context, [&](const QueryStructure<D>&, const Insertion&) {
        if (--left == 0) {
          context.Cancel();
        }
      });
    }
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_GT(stops, 3);
    ExpectSimplicesOfCells<D>(structure, refinement.stars());
  }

  // Without an observer vertices are uncommitted for a while, on two threads.
  template <int D>
  void ExpectThoseOfCellsWithinBudgets(const MeshCriteria<D>& criteria) {
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", D == 2 ? 400 : 100));
    BoxRefinement<D> refinement(structure, 0x1p-48);
    absl::Status status = absl::ResourceExhaustedError("");
    int stops = 0;
    for (; absl::IsResourceExhausted(status); ++stops) {
      RunContext context;
      status = refinement.Run(criteria, structure.vertex_count() + 1 + random_.Below(50), 2, context);
    }
    ASSERT_TRUE(status.ok()) << status;
    EXPECT_GT(stops, 3);
    ExpectSimplicesOfCells<D>(structure, refinement.stars());
  }
};

// Moved vertices have other simplices than the refinement has seen: nothing is listed then, until all are looked at
// again.
TEST_F(StarsOfRefinementTest, GiveTheSimplicesAfterVerticesWereMoved) {
  constexpr double kMinEdge = 0x1p-48;
  QueryStructure<3> structure = MakeStructure<3>(test::SortedCloud<3>("uniform", 100));
  BoxRefinement<3> refinement(structure, kMinEdge);
  std::vector<bool> is_fixed(structure.vertex_count(), true);
  RunContext context;
  ASSERT_TRUE(Run<3>(refinement, context).ok());
  is_fixed.resize(structure.vertex_count(), false);
  SliverStage<3> stage;
  const RepairCriteria criteria{{.rho = 2}, 15, kMinEdge, 1'000'000};
  MovedVertices moved;
  BoxCarrier carrier;
  const absl::Status repaired = stage.Repair(structure, refinement, carrier, is_fixed, criteria, moved, 1, context);
  ASSERT_TRUE(repaired.ok()) << repaired;
  EXPECT_GT(stage.statistics().moves, 0u);
  EXPECT_FALSE(refinement.stars().IsComplete());
  ExpectSimplicesOfCells<3>(structure, refinement.stars());
  refinement.VertexAdded(structure.AddVertex(kNoVertex, {0.3, 0.4, 0.6}));
  ASSERT_TRUE(Run<3>(refinement, context).ok());
  EXPECT_FALSE(refinement.stars().IsComplete());
  ExpectSimplicesOfCells<3>(structure, refinement.stars());
  ASSERT_TRUE(refinement.Run({.rho = 2.5}, 1'000'000, 2, context).ok());
  EXPECT_TRUE(refinement.stars().IsComplete());
  ExpectSimplicesOfCells<3>(structure, refinement.stars());
}

TEST_F(StarsOfRefinementTest, GiveTheSimplicesAfterVerticesWereAdded) {
  for (const std::string_view kind : {"uniform", "grid"}) {
    ExpectThoseOfCellsAfterVerticesWereAdded<2>(kind);
    ExpectThoseOfCellsAfterVerticesWereAdded<3>(kind);
  }
  ExpectThoseOfCellsAfterVerticesWereAdded<4>("uniform");
}

TEST_F(StarsOfRefinementTest, GiveTheSimplicesOfAllDemandsWithinBudgets) {
  const SizeField<2> sizes_2(0.1, {{{{0, 0}, {0.5, 0.5}}, 0.02}});
  const SizeField<3> sizes_3(0.25, {{{{0, 0, 0}, {0.5, 0.5, 0.5}}, 0.1}});
  for (const Criterion criterion : {Criterion::kRadiusEdge, Criterion::kWellSpaced}) {
    ExpectThoseOfCellsWithinBudgets<2>({.criterion = criterion, .rho = 2});
    ExpectThoseOfCellsWithinBudgets<2>({.criterion = criterion, .rho = 2, .sizes = sizes_2});
    ExpectThoseOfCellsWithinBudgets<3>({.criterion = criterion, .rho = 2.5});
    ExpectThoseOfCellsWithinBudgets<3>({.criterion = criterion, .rho = 2.5, .sizes = sizes_3});
  }
}

TEST_F(StarsOfRefinementTest, GiveTheSimplicesAfterStops) {
  for (const std::string_view kind : {"uniform", "lines"}) {
    ExpectThoseOfCellsAfterStops<2>(kind);
    ExpectThoseOfCellsAfterStops<3>(kind);
  }
}

class SimplexListTest : public test::SeededTest {
 protected:
  SimplexListTest() : SeededTest(61) {}

  // Orientation and worst shapes are the exact ones, flatter and flatter as the apex comes closer to the facet beyond
  // it, or to a corner.
  template <int D>
  void ExpectExactlyTheWorst() {
    for (int bits = 0; bits < 50; ++bits) {
      SimplexList<D> list;
      double max_radius_edge = 0;
      double min_angle_deg = 180;
      for (int i = 0; i < 50; ++i) {
        Simplex<D> simplex;
        for (Point<D>& corner : simplex) {
          for (double& x : corner) {
            x = random_.Unit();
          }
        }
        const double share = i % 3 == 0 ? 1 : random_.Unit();
        for (int k = 0; k < D; ++k) {
          const double flat = share * simplex[0][k] + (1 - share) * simplex[1][k];
          simplex[D][k] = flat + std::ldexp(simplex[D][k], -bits);
        }
        std::array<uint32_t, D + 1> indices;
        std::iota(indices.begin(), indices.end(), uint32_t{0});
        for (int k = D; k > 0; --k) {
          std::swap(indices[k], indices[random_.Below(k + 1)]);
        }
        if (Orientation<D>(simplex).sign == Sign::kZero) {
          continue;
        }
        list.Clear();
        list.Add(simplex, indices);
        ASSERT_EQ(list.size(), 1u);
        EXPECT_EQ(list.indices()[0], 0u);
        Simplex<D> as_listed;
        Simplex<D> ascending;
        for (int k = 0; k <= D; ++k) {
          const auto at = [&](uint32_t index) {
            return simplex[std::find(indices.begin(), indices.end(), index) - indices.begin()];
          };
          as_listed[k] = at(list.indices()[k]);
          ascending[k] = at(static_cast<uint32_t>(k));
        }
        ASSERT_EQ(Orientation<D>(as_listed).sign, Sign::kPositive) << "flat by 2^-" << bits;
        max_radius_edge = std::max(max_radius_edge, RadiusEdgeRatio<D>(ascending));
        min_angle_deg = std::min(min_angle_deg, Angles<D>(ascending).min_deg);
      }
      EXPECT_EQ(list.max_radius_edge(), max_radius_edge) << "flat by 2^-" << bits;
      EXPECT_EQ(list.min_angle_deg(), min_angle_deg) << "flat by 2^-" << bits;
    }
  }
};

TEST_F(SimplexListTest, OrientsAndMeasuresFlatSimplicesExactly) {
  ExpectExactlyTheWorst<2>();
  ExpectExactlyTheWorst<3>();
  ExpectExactlyTheWorst<4>();
}

}  // namespace
}  // namespace wellspace::core
