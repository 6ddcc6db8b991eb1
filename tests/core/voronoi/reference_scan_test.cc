// The paper's scan against the fast one, and its program against definitions.
#include "core/voronoi/reference_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/refine/refine.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::HaveSameNodes;
using test::IsSimplePolytope;
using test::MakeStructure;
using test::SplitMix64;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The fast scan opens at most this many times the leaves that the reference does, and as many more: it takes leaves by
// plain distance, so it may open some before it has seen the vertices that rule them out. Measured over seven seeds of
// these tests (4500 queries): no query more than 1.5 times (3 for 2), no cloud on average more than 1.2 times.
constexpr double kMostFactor = 1.5;
constexpr uint64_t kMostMore = 2;
constexpr double kMostFactorOfCloud = 1.3;

template <int D>
Point<D> DrawPoint(double half_side, SplitMix64& random) {
  Point<D> p;
  for (double& x : p) {
    x = half_side * (2 * random.Unit() - 1);
  }
  return p;
}

template <int D>
Box<D> CubeOfHalfSide(double half_side) {
  Box<D> cube;
  cube.low.fill(-half_side);
  cube.high.fill(half_side);
  return cube;
}

// ---- The program
// ----------------------------------------------------------------------------------------------------------------

// normal . c = offset
template <int D>
struct TestPlane {
  Point<D> normal;
  double offset;
};

// The point of least norm on some planes, by the normal equations in long double; false if they are nearly dependent.
template <int D>
bool LeastNormOn(const std::vector<TestPlane<D>>& planes, std::array<long double, D>& c) {
  const size_t n = planes.size();
  std::vector<std::vector<long double>> gram(n, std::vector<long double>(n + 1));
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) {
      for (int k = 0; k < D; ++k) {
        gram[i][j] += static_cast<long double>(planes[i].normal[k]) * planes[j].normal[k];
      }
    }
    gram[i][n] = planes[i].offset;
  }
  for (size_t i = 0; i < n; ++i) {
    size_t pivot = i;
    for (size_t r = i; r < n; ++r) {
      if (std::abs(gram[r][i]) > std::abs(gram[pivot][i])) {
        pivot = r;
      }
    }
    std::swap(gram[i], gram[pivot]);
    if (std::abs(gram[i][i]) < 1e-9L) {
      return false;
    }
    for (size_t r = 0; r < n; ++r) {
      if (r != i) {
        const long double factor = gram[r][i] / gram[i][i];
        for (size_t k = i; k <= n; ++k) {
          gram[r][k] -= factor * gram[i][k];
        }
      }
    }
  }
  c = {};
  for (size_t i = 0; i < n; ++i) {
    for (int k = 0; k < D; ++k) {
      c[k] += gram[i][n] / gram[i][i] * planes[i].normal[k];
    }
  }
  return true;
}

// DiameterTo(p) by its definition in the paper: of the balls with the origin, p and up to D - 1 of the others on their
// surface (or centre on a wall), the smallest that holds no vertex and has its centre inside the walls.
template <int D>
double DiameterByEnumeration(const Box<D>& centres, const std::vector<Point<D>>& excluded, const Point<D>& p) {
  std::vector<TestPlane<D>> planes;  // normal . c <= offset
  for (const Point<D>& u : excluded) {
    planes.push_back({u, 0.5 * NormSq<D>(u)});
  }
  for (int k = 0; k < D; ++k) {
    Point<D> axis{};
    axis[k] = 1;
    planes.push_back({axis, centres.high[k]});
    axis[k] = -1;
    planes.push_back({axis, -centres.low[k]});
  }
  double least = kInfinity;
  std::vector<TestPlane<D>> chosen = {{p, 0.5 * NormSq<D>(p)}};
  const auto visit = [&](const auto& self, size_t from) -> void {
    std::array<long double, D> c;
    if (!LeastNormOn<D>(chosen, c)) {
      return;
    }
    long double norm_sq = 0;
    for (const long double x : c) {
      norm_sq += x * x;
    }
    const bool is_feasible = std::all_of(planes.begin(), planes.end(), [&](const TestPlane<D>& plane) {
      long double along = 0;
      for (int k = 0; k < D; ++k) {
        along += plane.normal[k] * c[k];
      }
      return along <= plane.offset + 1e-13L;
    });
    if (is_feasible) {
      least = std::min(least, 2 * static_cast<double>(std::sqrt(norm_sq)));
    }
    for (size_t i = from; i < planes.size() && chosen.size() < D; ++i) {
      chosen.push_back(planes[i]);
      self(self, i + 1);
      chosen.pop_back();
    }
  };
  visit(visit, 0);
  return least;
}

template <typename T>
class EmptyBallProgramTest : public test::SeededTest {
 protected:
  EmptyBallProgramTest() : SeededTest(2008) {}
};
TYPED_TEST_SUITE(EmptyBallProgramTest, test::AllDimensions);

TYPED_TEST(EmptyBallProgramTest, WithoutVerticesTheDiameterIsTheDistance) {
  constexpr int D = TypeParam::kValue;
  const EmptyBallProgram<D> program(CubeOfHalfSide<D>(10));
  for (int i = 0; i < 100; ++i) {
    const Point<D> p = DrawPoint<D>(1, this->random_);
    EXPECT_NEAR(program.DiameterTo(p), std::sqrt(NormSq<D>(p)), 1e-11);
    Box<D> q;
    for (int k = 0; k < D; ++k) {
      q.low[k] = 2 * this->random_.Unit() - 1;
      q.high[k] = q.low[k] + this->random_.Unit();
    }
    const double distance = std::sqrt(DistanceSq<D>(Point<D>{}, q));
    EXPECT_LE(program.DiameterTo(q), distance);
    EXPECT_NEAR(program.DiameterTo(q), distance, 2e-5 * distance);
  }
}

TYPED_TEST(EmptyBallProgramTest, DiameterToAPointIsThatOfTheDefinition) {
  constexpr int D = TypeParam::kValue;
  int finite = 0;
  int infinite = 0;
  // The enumeration looks at some (8 + 2 D)^(D - 1) / (D - 1)! balls.
  for (int i = 0; i < ByDimension<D>({200, 200, 60, 20, 6}); ++i) {
    // On every other round vertices and points of a small grid, so that many balls are tied.
    const bool is_grid = i % 2 == 0;
    const auto draw = [&] {
      Point<D> p = DrawPoint<D>(1, this->random_);
      for (double& x : p) {
        x = is_grid ? std::round(2 * x) / 2 : x;
      }
      return p;
    };
    Box<D> centres = CubeOfHalfSide<D>(i % 3 == 0 ? 4 : D <= 3 ? 0.7 : 0.25);
    centres.low[0] = i % 5 == 0 ? 0 : centres.low[0];
    EmptyBallProgram<D> program(centres);
    std::vector<Point<D>> excluded;
    for (int j = 0; j < 8; ++j) {
      const Point<D> u = draw();
      if (NormSq<D>(u) > 0) {
        excluded.push_back(u);
        program.Exclude(u);
      }
    }
    for (int j = 0; j < (D <= 4 ? 10 : 4); ++j) {
      const Point<D> p = draw();
      if (NormSq<D>(p) == 0) {
        ASSERT_EQ(program.DiameterTo(p), 0);
        continue;
      }
      const double exact = DiameterByEnumeration<D>(centres, excluded, p);
      const double found = program.DiameterTo(p);
      if (found == kInfinity || exact == kInfinity) {
        ASSERT_EQ(found, exact) << ::testing::PrintToString(p) << " of " << ::testing::PrintToString(excluded);
      } else {
        ASSERT_LE(found, exact * (1 + 1e-11));
        ASSERT_GE(found, exact * (1 - 1e-9))
            << ::testing::PrintToString(p) << " of " << ::testing::PrintToString(excluded);
      }
      ++(exact == kInfinity ? infinite : finite);
    }
  }
  EXPECT_GT(finite, D <= 3 ? 200 : 3);
  EXPECT_GT(infinite, D <= 3 ? 200 : 3);
}

// Guarantees (1) and (2) of the program for leaves: no point of q has a smaller diameter, and some point has no larger
// one. That one is found by halving: one half has the diameter of the whole, and which one is told to 2^-16. In 5 and 6
// dimensions the pieces may not suffice for the full accuracy.
TYPED_TEST(EmptyBallProgramTest, DiameterToABoxIsTheLeastOverItsPoints) {
  constexpr int D = TypeParam::kValue;
  int finite = 0;
  int infinite = 0;
  for (int i = 0; i < (D <= 4 ? 40 : 12); ++i) {
    EmptyBallProgram<D> program(CubeOfHalfSide<D>(i % 2 == 0 ? (D == 2 ? 1 : 0.3) : 5));
    for (int j = 0; j < 12; ++j) {
      program.Exclude(DrawPoint<D>(1, this->random_));
    }
    Box<D> q;
    const double side = 0.02 + 0.5 * this->random_.Unit();
    q.low = DrawPoint<D>(1, this->random_);
    for (int k = 0; k < D; ++k) {
      q.high[k] = q.low[k] + side;
    }
    SCOPED_TRACE("the box from " + ::testing::PrintToString(q.low) + ", side " + std::to_string(side));
    const double diameter = program.DiameterTo(q);
    if (q.Contains(Point<D>{})) {
      ASSERT_EQ(diameter, 0);
      continue;
    }
    for (int j = 0; j < 300; ++j) {
      Point<D> p;
      for (int k = 0; k < D; ++k) {
        p[k] = q.low[k] + side * this->random_.Unit();
      }
      ASSERT_GE(program.DiameterTo(p), diameter * (1 - 1e-12));
    }
    if (diameter == kInfinity) {
      ++infinite;
      continue;
    }
    ++finite;
    for (int j = 0; j < 30 * D; ++j) {
      Box<D> low = q;
      Box<D> high = q;
      low.high[j % D] = high.low[j % D] = 0.5 * (q.low[j % D] + q.high[j % D]);
      q = program.DiameterTo(low) <= program.DiameterTo(high) ? low : high;
    }
    ASSERT_LE(program.DiameterTo(q.low), diameter * (1 + (D <= 4 ? 30 * D * 0x1p-16 : 1e-2)));
  }
  EXPECT_GT(finite, 3);
  EXPECT_TRUE(D > 3 || infinite > 0);
}

TYPED_TEST(EmptyBallProgramTest, DiametersNeverFallWhenVerticesAreExcluded) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 20; ++i) {
    EmptyBallProgram<D> program(CubeOfHalfSide<D>(2));
    const Point<D> p = DrawPoint<D>(1, this->random_);
    Box<D> q{p, p};
    for (double& x : q.high) {
      x += 0.2;
    }
    double to_point = program.DiameterTo(p);
    double to_box = program.DiameterTo(q);
    for (int j = 0; j < 15; ++j) {
      program.Exclude(DrawPoint<D>(1, this->random_));
      const double next_to_point = program.DiameterTo(p);
      const double next_to_box = program.DiameterTo(q);
      ASSERT_GE(next_to_point, to_point * (1 - 1e-9));
      ASSERT_GE(next_to_box, to_box * (1 - 1e-4));
      ASSERT_LE(next_to_box, next_to_point * (1 + 1e-11));
      to_point = next_to_point;
      to_box = next_to_box;
    }
  }
}

// ---- The scan
// -------------------------------------------------------------------------------------------------------------------

template <int D>
std::set<VertexId> GeneratorsOf(const Polytope<D>& cell) {
  std::set<VertexId> generators;
  for (const CellNode<D>& node : cell.nodes()) {
    for (const uint16_t index : node.planes) {
      if (cell.plane(index).kind == PlaneKind::kBisector) {
        generators.insert(cell.plane(index).vertex);
      }
    }
  }
  return generators;
}

// The vertices whose bisectors touch the cell: each has a node of the cell as near as the site is, up to rounding.
template <int D>
bool Touches(const QueryStructure<D>& structure, const Polytope<D>& cell, VertexId u) {
  const Point<D> w = Difference<D>(structure.point(u), cell.site());
  return std::any_of(cell.nodes().begin(), cell.nodes().end(), [&](const CellNode<D>& node) {
    return Dot<D>(w, node.x) - 0.5 * NormSq<D>(w) >= -1e-9 * std::sqrt(NormSq<D>(w) * node.radius_sq);
  });
}

// The leaves that a ball about a point of `cell` reaches, by a look at all; a ball counts `margin` of its radius
// larger, and the uncertainty of its node by rounding is added (for a positive margin) or subtracted.
template <int D>
std::set<NodeId> LeavesOfCertificateRegion(const QueryStructure<D>& structure, const Polytope<D>& cell, double margin) {
  std::set<NodeId> leaves;
  structure.tree().ForEachLeaf([&](NodeId leaf) {
    const Box<D> cube = structure.tree().BoxOf(leaf);
    for (const CellNode<D>& node : cell.nodes()) {
      Point<D> x = node.x;
      for (int k = 0; k < D; ++k) {
        x[k] += cell.site()[k];
      }
      const double doubt = margin > 0 ? node.slack : -node.slack;
      if (std::sqrt(DistanceSq<D>(x, cube)) < (1 + margin) * std::sqrt(node.radius_sq) + doubt) {
        leaves.insert(leaf);
        return;
      }
    }
  });
  return leaves;
}

struct Totals {
  uint64_t queries = 0;
  uint64_t fast_leaves = 0;
  uint64_t reference_leaves = 0;
  uint64_t programs = 0;
};

template <int D>
class ScanComparer {
 public:
  // The fast scan and the reference give one cell; the leaves that they open are as claimed.
  void Compare(const QueryStructure<D>& structure, VertexId v, double radius) {
    SCOPED_TRACE("vertex " + std::to_string(Index(v)) + " of " + std::to_string(structure.vertex_count()) +
                 ", clipped at " + std::to_string(radius));
    const uint64_t before = fast_.counters.leaves;
    structure.ClippedVoronoi(v, radius, fast_);
    const uint64_t opened = fast_.counters.leaves - before;
    const ReferenceScan<D> reference = ReferenceClippedVoronoi<D>(structure, v, radius);

    ASSERT_TRUE(IsSimplePolytope<D>(reference.cell));
    ASSERT_TRUE(HaveSameNodes<D>(fast_.cell, reference.cell));
    // Where bisectors only touch the cell, which of them are kept depends on the order.
    const std::set<VertexId> fast_generators = GeneratorsOf<D>(fast_.cell);
    const std::set<VertexId> generators = GeneratorsOf<D>(reference.cell);
    for (const VertexId u : fast_generators) {
      ASSERT_TRUE(generators.count(u) == 1 || Touches<D>(structure, reference.cell, u)) << Index(u);
    }
    for (const VertexId u : generators) {
      ASSERT_TRUE(fast_generators.count(u) == 1 || Touches<D>(structure, fast_.cell, u)) << Index(u);
    }
    // Fig. 6's U: all that contribute, and none but vertices of the certificate balls' surfaces (Lemma 5).
    const std::set<VertexId> neighbors(reference.neighbors.begin(), reference.neighbors.end());
    ASSERT_EQ(neighbors.size(), reference.neighbors.size());
    ASSERT_TRUE(std::includes(neighbors.begin(), neighbors.end(), generators.begin(), generators.end()));
    for (const VertexId u : neighbors) {
      ASSERT_TRUE(Touches<D>(structure, reference.cell, u)) << Index(u);
    }

    const std::set<NodeId> needed = LeavesOfCertificateRegion<D>(structure, reference.cell, -1e-9);
    const std::set<NodeId> touched = LeavesOfCertificateRegion<D>(structure, reference.cell, 1e-5);
    std::set<NodeId> visited;
    double last = 0;
    for (const auto& visit : reference.leaves) {
      ASSERT_TRUE(visited.insert(visit.leaf).second);
      ASSERT_GE(visit.diameter, last * (1 - 1e-4));
      last = std::max(last, visit.diameter);
    }
    ASSERT_TRUE(std::includes(visited.begin(), visited.end(), needed.begin(), needed.end()));
    ASSERT_TRUE(std::includes(touched.begin(), touched.end(), visited.begin(), visited.end()));
    ASSERT_GE(opened, needed.size());
    ASSERT_LE(opened, kMostFactor * static_cast<double>(visited.size()) + kMostMore);

    ++totals_.queries;
    totals_.fast_leaves += opened;
    totals_.reference_leaves += visited.size();
    totals_.programs += reference.programs;
  }

  const Totals& totals() const { return totals_; }

 private:
  Workspace<D> fast_;
  Totals totals_;
};

template <typename T>
class ReferenceScanTest : public test::SeededTest {
 protected:
  ReferenceScanTest() : SeededTest(1969) {}

  // Holds the average, and leaves the figures in the test's XML output.
  void ExpectFewLeaves(const std::string& name, const Totals& totals) {
    ASSERT_GT(totals.queries, 0u);
    const auto per_query = [&](uint64_t count) {
      return static_cast<double>(count) / static_cast<double>(totals.queries);
    };
    this->RecordProperty(name + "_leaves_per_query", std::to_string(per_query(totals.fast_leaves)));
    this->RecordProperty(name + "_reference_leaves_per_query", std::to_string(per_query(totals.reference_leaves)));
    this->RecordProperty(name + "_programs_per_query", std::to_string(per_query(totals.programs)));
    EXPECT_LE(per_query(totals.fast_leaves), kMostFactorOfCloud * per_query(totals.reference_leaves));
  }
};
TYPED_TEST_SUITE(ReferenceScanTest, test::UpTo4);

// As in a bottom-up run: radii in proportion to NN.
TYPED_TEST(ReferenceScanTest, AgreesWithTheFastScanBeforeRefinement) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::AllKinds()) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({1000, 250, 12})));
    ScanComparer<D> comparer;
    for (int i = 0; i < ByDimension<D>({12, 12, 1}); ++i) {
      const VertexId v = VertexId(this->random_.Below(structure.vertex_count()));
      const double nearest = std::sqrt(test::NearestDistanceSq<D>(structure, v));
      comparer.Compare(structure, v, nearest * (0.4 + 3.6 * this->random_.Unit()));
      ASSERT_FALSE(this->HasFatalFailure());
    }
    this->ExpectFewLeaves(test::CloudName(kind, D), comparer.totals());
  }
}

TYPED_TEST(ReferenceScanTest, AgreesWithTheFastScanAtEveryStageOfRefinement) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"uniform", "clusters", "grid", "cospherical", "skew"}) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({80, 20, 6})));
    ScanComparer<D> comparer;
    RunContext context;
    uint32_t steps = 0;
    const RefinementObserver<D> observer = [&](const QueryStructure<D>& at, const Insertion&) {
      if (steps++ % ByDimension<D>({40, 40, 160}) != 0 || this->HasFatalFailure()) {
        return;
      }
      // The vertex just added, clipped as refinement does, and any other.
      const VertexId last{at.vertex_count() - 1};
      comparer.Compare(at, last, 2 * std::sqrt(test::NearestDistanceSq<D>(at, last)));
      const VertexId any = VertexId(this->random_.Below(at.vertex_count()));
      comparer.Compare(at, any, 4 * std::sqrt(test::NearestDistanceSq<D>(at, any)));
    };
    BoxRefinement<D> refinement(structure, 0x1p-48);
    const absl::Status status =
        refinement.Run({.rho = ByDimension<D>({std::sqrt(2.0), 2.0, 2.9})}, 100'000, 1, context, observer);
    ASSERT_TRUE(status.ok()) << status;
    this->ExpectFewLeaves(test::CloudName(kind, D) + "_during", comparer.totals());
    ScanComparer<D> afterwards;
    for (int i = 0; i < ByDimension<D>({8, 8, 2}); ++i) {
      // Whole cells too: any radius is cheap now.
      const VertexId v = VertexId(this->random_.Below(structure.vertex_count()));
      const double nearest = std::sqrt(test::NearestDistanceSq<D>(structure, v));
      afterwards.Compare(structure, v, i % 2 == 0 ? 4 * nearest : 1);
      ASSERT_FALSE(this->HasFatalFailure());
    }
    this->ExpectFewLeaves(test::CloudName(kind, D) + "_after", afterwards.totals());
  }
}

// The leaves opened up to a clipping distance t by the paper's ball are a beginning of the scan in any larger cube.
TYPED_TEST(ReferenceScanTest, VisitsOfSmallerBallsComeFirstAndAreTheSame) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 60));
  for (int i = 0; i < 6; ++i) {
    const VertexId v = VertexId(this->random_.Below(structure.vertex_count()));
    const double t = 1.5 * std::sqrt(test::NearestDistanceSq<D>(structure, v));
    const auto visits_below = [&](double radius) {
      std::set<NodeId> leaves;
      for (const auto& visit : ReferenceClippedVoronoi<D>(structure, v, radius).leaves) {
        if (visit.diameter < 2 * t * (1 - 1e-4)) {
          leaves.insert(visit.leaf);
        }
      }
      return leaves;
    };
    const std::set<NodeId> smaller = visits_below(t);
    EXPECT_EQ(smaller, visits_below(1.7 * t));
    EXPECT_EQ(smaller, visits_below(3 * t));
  }
}

}  // namespace
}  // namespace wellspace::core
