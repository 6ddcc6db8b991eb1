// The guarantees of docs/design/guarantees.md for every refinement, on random and adversarial clouds.
#include "tests/core/guarantees.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/meshers/mesher.h"
#include "tests/core/guarantee_runs.h"
#include "tests/support/seeded_test.h"

namespace wellspace::test {
namespace {

using core::Criterion;
using core::Insertion;
using core::Mesh;
using core::MeshCriteria;
using core::MeshParameters;
using core::Point;
using core::QueryStructure;
using core::RunContext;
using core::SizeBox;
using core::SizeField;
using core::VertexId;

template <typename T>
class GuaranteesTest : public test::SeededTest {
 protected:
  GuaranteesTest() : SeededTest(2008) {}
};
TYPED_TEST_SUITE(GuaranteesTest, Dimensions);

TYPED_TEST(GuaranteesTest, AtEveryInsertionForTheLeastRho) {
  constexpr int D = TypeParam::kValue;
  for (const Criterion criterion : kCriteria) {
    const bool well_spaced = criterion == Criterion::kWellSpaced;
    ExpectGuaranteesOfAll<D>(criterion, "unit", LeastRho<D>(), (D == 2 ? 16 : 4) / (well_spaced ? 4 : 1), this->seed_);
  }
}

TYPED_TEST(GuaranteesTest, AtEveryInsertionWhereTheCloudTouchesTheBox) {
  constexpr int D = TypeParam::kValue;
  for (const Criterion criterion : kCriteria) {
    ExpectGuaranteesOfAll<D>(criterion, "touching", 1.25 * LeastRho<D>(), D == 2 ? 12 : 4, this->seed_ + 1);
  }
}

// Away from the boundary the constants are small for a large rho, and those at the boundary finite.
TYPED_TEST(GuaranteesTest, AtEveryInsertionForLargerRho) {
  constexpr int D = TypeParam::kValue;
  for (const Criterion criterion : kCriteria) {
    ExpectGuaranteesOfAll<D>(criterion, "margin", 2 * LeastRho<D>(), D == 2 ? 24 : 6, this->seed_ + 2);
  }
}

TYPED_TEST(GuaranteesTest, AtEveryInsertionInALongBox) {
  constexpr int D = TypeParam::kValue;
  ExpectGuaranteesOfAll<D>(Criterion::kRadiusEdge, "long", 1.25 * LeastRho<D>(), D == 2 ? 16 : 8, this->seed_ + 3);
}

// Below the least rho nothing promises an end, but insertions obey the same rules.
TYPED_TEST(GuaranteesTest, AtEveryInsertionBelowTheLeastRho) {
  constexpr int D = TypeParam::kValue;
  int insertions = 0;
  for (const Criterion criterion : kCriteria) {
    for (const std::string_view kind : {"uniform", "boundary", "lines"}) {
      SCOPED_TRACE(std::string(kind) + " " + Name(criterion));
      const MeshCriteria<D> criteria{.criterion = criterion, .rho = D == 2 ? 1.05 : 1.4, .sizes = {}};
      std::optional<GuaranteeChecker<D>> checker;
      RefineInput<D>(
          MakeInput<D>(kind, "unit", 12, this->seed_), criteria, 40,
          [&](const QueryStructure<D>& before) { checker.emplace(before, criteria, 41); },
          [&](const QueryStructure<D>& structure, const Insertion& insertion) {
            checker->Observe(structure, insertion);
          });
      EXPECT_EQ(checker->violation(), "");
      insertions += checker->seen().insertions;
    }
  }
  EXPECT_GT(insertions, 500);
}

// Vertices of faces have nodes there that ask for nothing until a new vertex comes near; then their short edges are
// served soon: in the lower half of the next bucket at the latest. (Without the memory of these edges the worst was
// 0.26, with it 0.69.)
TYPED_TEST(GuaranteesTest, EdgesOnFacesAreNotRefinedLate) {
  constexpr int D = TypeParam::kValue;
  double worst = 1;
  const MeshCriteria<D> criteria{.rho = LeastRho<D>(), .sizes = {}};
  const Outcome outcome = RefineInput<D>(MakeInput<D>("near-corners", "unit", 12, 0), criteria, kBudget, nullptr,
                                         [&](const QueryStructure<D>&, const Insertion& insertion) {
                                           if (insertion.reason == core::Reason::kRatio) {
                                             worst = std::min(worst, insertion.edge_sq / insertion.edge_limit_sq);
                                           }
                                         });
  EXPECT_TRUE(outcome.status.ok()) << outcome.status;
  EXPECT_GE(std::sqrt(worst), 0.5);
}

// The bound away from the boundary is not far off: points along a line come near it.
TYPED_TEST(GuaranteesTest, TheConstantIsNearlyReached) {
  constexpr int D = TypeParam::kValue;
  const MeshCriteria<D> criteria{.rho = LeastRho<D>(), .sizes = {}};
  double reached = 0;
  for (const std::string_view kind : {"pairs", "clusters", "collinear"}) {
    const auto seen = ExpectGuarantees<D>(MakeInput<D>(kind, "unit", 20, this->seed_), criteria, 1000);
    reached = std::max(reached, seen.reached);
  }
  EXPECT_GT(reached, 0.5);
}

// A checker that is told of other insertions than those that were made finds each of them wrong.
TYPED_TEST(GuaranteesTest, AnInsertionOutOfOrderIsSeen) {
  constexpr int D = TypeParam::kValue;
  const MeshCriteria<D> criteria{.rho = LeastRho<D>(), .sizes = {}};
  struct Mutation {
    std::string_view complaint;
    std::function<void(Insertion&)> apply;
  };
  const std::vector<Mutation> mutations = {
      {"is too small for", [](Insertion& i) { i.edge_sq *= 16, i.edge_limit_sq *= 16; }},
      {"farther than a node can be", [](Insertion& i) { i.edge_sq *= 1e-4, i.edge_limit_sq *= 1e-4; }},
      {"is of an earlier bucket", [](Insertion& i) { i.edge_limit_sq *= 2.5; }},
      {"is of a later bucket", [](Insertion& i) { i.edge_limit_sq *= 0.4; }},
      {"holds a vertex", [](Insertion& i) { i.empty_radius_sq *= 1.1; }},
      {"lfs = ", [](Insertion& i) { i.empty_radius_sq *= 1e-4; }},
  };
  for (const Mutation& mutation : mutations) {
    SCOPED_TRACE(std::string(mutation.complaint));
    int seen = 0;
    const auto observe = [&](std::optional<GuaranteeChecker<D>>& checker, const QueryStructure<D>& structure,
                             Insertion insertion) {
      if (insertion.reason == core::Reason::kRatio) {
        mutation.apply(insertion);
      }
      checker->Observe(structure, insertion);
      seen += checker->violation().find(mutation.complaint) != std::string::npos ? 1 : 0;
    };
    for (uint64_t seed = 0; seed < 5; ++seed) {
      std::optional<GuaranteeChecker<D>> checker;
      RefineInput<D>(
          MakeInput<D>("inner", "unit", 30, seed), criteria, kBudget,
          [&](const QueryStructure<D>& before) { checker.emplace(before, criteria, 1000); },
          [&](const QueryStructure<D>& structure, const Insertion& insertion) {
            observe(checker, structure, insertion);
          });
    }
    EXPECT_GT(seen, 0);
  }
}

// A longer edge is refined while a shorter one is pending.
TYPED_TEST(GuaranteesTest, PendingEdgesAreSeen) {
  constexpr int D = TypeParam::kValue;
  QueryStructure<D> structure;
  RunContext context;
  // Two points at distance 1e-3, two at 0.1: by brute force the short edge is the one that is pending.
  std::vector<Point<D>> points(4);
  for (Point<D>& p : points) {
    p.fill(0.3);
  }
  points[1][0] += 1e-3;
  points[2].fill(0.7);
  points[3].fill(0.7);
  points[3][0] += 0.1;
  points = MortonSorted<D>(UnitBox<D>(), points);
  ASSERT_TRUE(
      structure.Initialize(core::MortonGrid<D>(UnitBox<D>()), {points.begin(), points.end()}, 1000, 1, context).ok());
  const MeshCriteria<D> criteria{.rho = 2, .sizes = {}};
  EXPECT_NEAR(ShortestPending<D>(structure, criteria).inner.length, 1e-3, 1e-12);
  EXPECT_NEAR(ShortestPending<D>(structure, {.criterion = Criterion::kWellSpaced, .rho = 2, .sizes = {}}).inner.length,
              1e-3, 1e-12);
  EXPECT_NEAR(ShortestPending<D>(structure, criteria).face.length, 0.2, 1e-12);
  EXPECT_EQ(ShortestPending<D>(structure, {.rho = 1e6, .sizes = {}}).inner.length,
            std::numeric_limits<double>::infinity());

  GuaranteeChecker<D> checker(structure, criteria, 1);
  const auto add = [&](uint32_t near, double edge) {
    Point<D> x = structure.point(VertexId{near});
    x[D - 1] -= 2.5 * edge;
    Insertion insertion{.near = VertexId{near},
                        .other = VertexId{near + 1},
                        .edge_sq = edge * edge,
                        .edge_limit_sq = 1.5 * edge * edge,
                        .empty_radius_sq = 6.25 * edge * edge};
    insertion.vertex = structure.AddVertex(insertion.near, x);
    checker.Observe(structure, insertion);
  };
  add(0, 1e-3);
  EXPECT_EQ(checker.violation(), "");
  add(2, 0.1);
  EXPECT_NE(checker.violation().find("was pending"), std::string::npos) << checker.violation();
}

// Termination: on every generator, in every box, within a multiple of the needs of the tree over points and box.

TYPED_TEST(GuaranteesTest, EndsForTheLeastRho) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view shape : kShapes) {
    ExpectItEnds<D>(Criterion::kRadiusEdge, LeastRho<D>(), D == 2 ? 30 : 5, this->seed_ + 10, shape);
    ASSERT_FALSE(this->HasFatalFailure());
  }
  for (const std::string_view shape : {"unit", "touching", "long"}) {
    ExpectItEnds<D>(Criterion::kWellSpaced, LeastRho<D>(), D == 2 ? 20 : 3, this->seed_ + 11, shape);
    ASSERT_FALSE(this->HasFatalFailure());
  }
}

TYPED_TEST(GuaranteesTest, EndsForEverySize) {
  constexpr int D = TypeParam::kValue;
  for (const size_t n : {2, D == 2 ? 150 : 15}) {
    ExpectItEnds<D>(Criterion::kRadiusEdge, LeastRho<D>(), n, this->seed_ + n, "unit");
    ASSERT_FALSE(this->HasFatalFailure());
  }
}

TYPED_TEST(GuaranteesTest, EndsForAnyLargerRho) {
  constexpr int D = TypeParam::kValue;
  for (const double rho : {10.0, 1000.0}) {
    for (const std::string_view shape : {"touching", "long"}) {
      ExpectItEnds<D>(Criterion::kRadiusEdge, rho, D == 2 ? 30 : 5, this->seed_ + 20, shape);
      ASSERT_FALSE(this->HasFatalFailure());
      ExpectItEnds<D>(Criterion::kWellSpaced, rho, D == 2 ? 30 : 5, this->seed_ + 21, shape);
      ASSERT_FALSE(this->HasFatalFailure());
    }
  }
}

// The circumcentre and the radius of a simplex, in long double.
template <int D>
std::pair<Point<D>, double> Circumball(const Mesh& mesh, size_t simplex) {
  using Real = long double;
  std::array<std::array<Real, D + 1>, D> rows;
  const auto coordinate = [&](int corner, int axis) {
    return mesh.points[size_t{mesh.simplices[simplex * (D + 1) + corner]} * D + axis];
  };
  for (int i = 0; i < D; ++i) {
    rows[i][D] = 0;
    for (int k = 0; k < D; ++k) {
      rows[i][k] = Real{coordinate(i + 1, k)} - coordinate(0, k);
      rows[i][D] += rows[i][k] * rows[i][k] / 2;
    }
  }
  for (int column = 0; column < D; ++column) {
    int pivot = column;
    for (int i = column + 1; i < D; ++i) {
      pivot = std::abs(rows[i][column]) > std::abs(rows[pivot][column]) ? i : pivot;
    }
    std::swap(rows[column], rows[pivot]);
    for (int i = 0; i < D; ++i) {
      if (i != column) {
        const Real factor = rows[i][column] / rows[column][column];
        for (int k = column; k <= D; ++k) {
          rows[i][k] -= factor * rows[column][k];
        }
      }
    }
  }
  Point<D> centre;
  Real radius_sq = 0;
  for (int k = 0; k < D; ++k) {
    const Real x = rows[k][D] / rows[k][k];
    radius_sq += x * x;
    centre[k] = static_cast<double>(coordinate(0, k) + x);
  }
  return {centre, static_cast<double>(std::sqrt(radius_sq))};
}

// Sizing: every simplex keeps its bound and rho.
template <int D>
void ExpectSizes(const MeshParameters& parameters, std::string_view kind, size_t n) {
  RunContext context;
  std::vector<double> flat;
  for (const Point<D>& p : MakeInput<D>(kind, "unit", n, 1).points) {
    flat.insert(flat.end(), p.begin(), p.end());
  }
  const absl::StatusOr<Mesh> mesh = core::MeshPoints(parameters, flat, context);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ASSERT_GT(mesh->simplex_count(), 0u);
  bool binds = false;
  for (size_t i = 0; i < mesh->simplex_count(); ++i) {
    const auto [centre, radius] = Circumball<D>(*mesh, i);
    double bound =
        parameters.max_circumradius == 0 ? std::numeric_limits<double>::infinity() : parameters.max_circumradius;
    for (const SizeBox& size : parameters.size_boxes) {
      double distance_sq = 0;
      for (int k = 0; k < D; ++k) {
        const double gap = std::max({size.low[k] - centre[k], 0.0, centre[k] - size.high[k]});
        distance_sq += gap * gap;
      }
      bound = std::min(bound, std::max(size.max_circumradius, std::sqrt(distance_sq)));
    }
    ASSERT_LE(radius, bound * (1 + 1e-9)) << "simplex " << i;
    binds = binds || radius > 0.5 * bound;
    double shortest = std::numeric_limits<double>::infinity();
    for (int a = 0; a <= D; ++a) {
      for (int b = a + 1; b <= D; ++b) {
        double length_sq = 0;
        for (int k = 0; k < D; ++k) {
          const double by = mesh->points[size_t{mesh->simplices[i * (D + 1) + a]} * D + k] -
                            mesh->points[size_t{mesh->simplices[i * (D + 1) + b]} * D + k];
          length_sq += by * by;
        }
        shortest = std::min(shortest, std::sqrt(length_sq));
      }
    }
    ASSERT_LE(radius, parameters.rho * shortest * (1 + 1e-9)) << "simplex " << i;
  }
  EXPECT_TRUE(binds) << "the sizes asked for nothing";
}

TYPED_TEST(GuaranteesTest, EverySimplexKeepsItsSize) {
  constexpr int D = TypeParam::kValue;
  for (const Criterion criterion : kCriteria) {
    for (const std::string_view kind : {"none", "uniform", "boundary", "clusters", "near-faces", "pairs"}) {
      SCOPED_TRACE(std::string(kind) + " " + Name(criterion));
      MeshParameters parameters;
      parameters.dimension = D;
      parameters.rho = LeastRho<D>();
      parameters.criterion = criterion;
      parameters.domain_low = UnitLow(D);
      parameters.domain_high = UnitHigh(D);
      parameters.max_circumradius = D == 2 ? 0.04 : 0.15;
      ExpectSizes<D>(parameters, kind, 6);

      // One in the interior, one flat and across the boundary, one that is a point; the second inside the reach of the
      // first.
      SizeBox inner{std::vector<double>(D, 0.6), std::vector<double>(D, 0.7), D == 2 ? 0.01 : 0.06};
      SizeBox flat{std::vector<double>(D, -1.0), std::vector<double>(D, 0.3), D == 2 ? 0.02 : 0.09};
      flat.low[0] = flat.high[0] = 0.25;
      const SizeBox point{std::vector<double>(D, 0.9), std::vector<double>(D, 0.9), 1e-4};
      parameters.max_circumradius = 0;
      parameters.size_boxes = {inner, flat, point};
      ExpectSizes<D>(parameters, kind, 6);
      ASSERT_FALSE(this->HasFatalFailure());
    }
  }
}

// With sizes, too, the insertions are bottom-up and where they belong.
TYPED_TEST(GuaranteesTest, AtEveryInsertionWithSizes) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"none", "uniform", "boundary", "near-faces", "pairs"}) {
    SCOPED_TRACE(std::string(kind));
    core::Box<D> region = UnitBox<D>();
    region.high.fill(0.2);
    const MeshCriteria<D> criteria{.rho = LeastRho<D>(),
                                   .sizes = SizeField<D>(D == 2 ? 0.05 : 0.2, {{region, D == 2 ? 0.01 : 0.08}})};
    std::optional<GuaranteeChecker<D>> checker;
    const Outcome outcome = RefineInput<D>(
        MakeInput<D>(kind, "unit", 8, this->seed_), criteria, 1e6,
        [&](const QueryStructure<D>& before) { checker.emplace(before, criteria, 53); },
        [&](const QueryStructure<D>& structure, const Insertion& insertion) {
          checker->Observe(structure, insertion);
        });
    EXPECT_TRUE(outcome.status.ok()) << outcome.status;
    EXPECT_EQ(checker->violation(), "");
    EXPECT_GT(checker->seen().orders, 2);
  }
}

}  // namespace
}  // namespace wellspace::test
