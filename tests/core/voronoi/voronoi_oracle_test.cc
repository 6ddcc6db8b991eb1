// Queries against a look at every vertex, at many stages of refinement and on degenerate clouds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/refine/refine.h"
#include "core/voronoi/query_structure.h"
#include "tests/support/brute_force.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::ByDimension;
using test::CutByAll;
using test::HasEmptyBalls;
using test::HaveSameNodes;
using test::IsSimplePolytope;
using test::MakeStructure;
using test::NamesOf;
using test::SplitMix64;

// The cube that ClippedVoronoi clips by.
template <int D>
struct ClipCube {
  ClipCube(const QueryStructure<D>& structure, VertexId v, double radius) : bounds(structure.box()) {
    kinds.fill(PlaneKind::kFace);
    for (int face = 0; face < 2 * D; ++face) {
      const double at = structure.point(v)[face / 2] + (face % 2 == 0 ? -radius : radius);
      double& bound = face % 2 == 0 ? bounds.low[face / 2] : bounds.high[face / 2];
      if (face % 2 == 0 ? at > bound : at < bound) {
        bound = at;
        kinds[face] = PlaneKind::kClip;
      }
    }
  }

  Box<D> bounds;
  std::array<PlaneKind, 2 * D> kinds;
};

// Walls one longest side of the box beyond it, as Voronoi has them.
template <int D>
Box<D> WallsAround(Box<D> box) {
  const double side = box.LongestSide();
  for (int k = 0; k < D; ++k) {
    box.low[k] -= side;
    box.high[k] += side;
  }
  return box;
}

template <int D>
class QueryChecker {
 public:
  explicit QueryChecker(SplitMix64& random) : random_(random) {}

  // How many nodes were not placed, as they surely keep a ratio that others do not.
  uint64_t left_rough() const { return left_rough_; }

  void CheckAll(const QueryStructure<D>& structure, VertexId v) {
    SCOPED_TRACE("vertex " + std::to_string(Index(v)) + " of " + std::to_string(structure.vertex_count()));
    const double nearest_sq = test::NearestDistanceSq<D>(structure, v);
    const Neighbor found = structure.NearestNeighbor(v, fast_);
    ASSERT_EQ(found.distance_sq, nearest_sq);
    ASSERT_NE(found.vertex, v);
    ASSERT_EQ(DistanceSq<D>(structure.point(found.vertex), structure.point(v)), nearest_sq);
    ASSERT_EQ(structure.NearestWithin(v, std::nextafter(nearest_sq, 2 * nearest_sq), fast_).distance_sq, nearest_sq);
    ASSERT_EQ(structure.NearestWithin(v, nearest_sq, fast_).vertex, kNoVertex);
    for (const double factor : {0.4, 1.0, 4.0, 1e3}) {
      CheckClipped(structure, v, factor * std::sqrt(nearest_sq) * (0.75 + 0.5 * random_.Unit()));
    }
    CheckWhole(structure, v);
  }

 private:
  void CheckClipped(const QueryStructure<D>& structure, VertexId v, double radius) {
    SCOPED_TRACE("clipped at " + std::to_string(radius));
    structure.ClippedVoronoi(v, radius, fast_);
    ASSERT_TRUE(IsSimplePolytope<D>(fast_.cell));
    ASSERT_TRUE(HasEmptyBalls<D>(structure, v, fast_.cell));
    const ClipCube<D> cube(structure, v, radius);
    for (int face = 0; face < 2 * D; ++face) {
      ASSERT_EQ(fast_.cell.plane(face).kind, cube.kinds[face]);
      ASSERT_EQ(fast_.cell.plane(face).source.coordinate, cube.bounds.FaceCoordinate(face));
    }
    CutByAll<D>(structure, v, cube.bounds, cube.kinds, TieRule::kKeep, random_.Next(), slow_);
    ASSERT_TRUE(HaveSameNodes<D>(fast_.cell, slow_));
    CheckRatios(structure, v, radius);
  }

  // A ratio that is sure before the nodes are placed holds once they are. All cells that keep it with some room are
  // known to keep it.
  void CheckRatios(const QueryStructure<D>& structure, VertexId v, double radius) {
    Polytope<D>& cell = fast_.cell;
    structure.UnplacedClippedVoronoi(v, CubeAround<D>(structure.point(v), radius), fast_);
    constexpr std::array kRatios = {0.75, 1.0, 2.0, 8.0};
    std::array<bool, kRatios.size()> keeps;
    std::transform(kRatios.begin(), kRatios.end(), keeps.begin(), [&](double r) { return cell.KeepsRatio(r); });
    cell.Place();
    double largest = 0;
    std::vector<double> ratios;
    for (const CellNode<D>& node : cell.nodes()) {
      double nearest_sq = std::numeric_limits<double>::infinity();
      for (const uint16_t index : node.planes) {
        const Plane<D>& plane = cell.plane(index);
        nearest_sq = plane.kind == PlaneKind::kBisector ? std::min(nearest_sq, NormSq<D>(plane.normal)) : 0;
        if (nearest_sq == 0) {
          break;
        }
      }
      ratios.push_back(std::sqrt(node.radius_sq / nearest_sq));
      largest = std::max(largest, ratios.back());
    }
    for (size_t i = 0; i < kRatios.size(); ++i) {
      ASSERT_EQ(cell.KeepsRatio(kRatios[i]), keeps[i]);
      if (keeps[i]) {
        ASSERT_LE(largest, kRatios[i]);
      } else {
        ASSERT_GE(largest, kRatios[i] * (1 - 1e-5));
      }
    }
    const std::vector<CellNode<D>> placed(cell.nodes().begin(), cell.nodes().end());
    for (const double ratio : kRatios) {
      structure.UnplacedClippedVoronoi(v, CubeAround<D>(structure.point(v), radius), fast_);
      if (cell.PlaceUnlessKeeps(ratio)) {
        continue;
      }
      ASSERT_EQ(cell.nodes().size(), placed.size());
      for (size_t i = 0; i < placed.size(); ++i) {
        const CellNode<D>& node = cell.nodes()[i];
        if (node.x == placed[i].x) {
          continue;
        }
        ++left_rough_;
        ASSERT_LE(ratios[i], ratio);
        ASSERT_LE(std::sqrt(node.radius_sq), ratio * std::sqrt(placed[i].radius_sq) / ratios[i]);
        ASSERT_LE(std::sqrt(DistanceSq<D>(node.x, placed[i].x)), node.slack + placed[i].slack);
      }
    }
  }

  // The perturbation leaves no choice, so the cells agree plane by plane.
  void CheckWhole(const QueryStructure<D>& structure, VertexId v) {
    structure.Voronoi(v, fast_);
    ASSERT_TRUE(IsSimplePolytope<D>(fast_.cell));
    ASSERT_TRUE(HasEmptyBalls<D>(structure, v, fast_.cell));
    std::array<PlaneKind, 2 * D> kinds;
    kinds.fill(PlaneKind::kClip);
    CutByAll<D>(structure, v, WallsAround<D>(structure.box()), kinds, TieRule::kPerturb, random_.Next(), slow_);
    ASSERT_EQ(NamesOf<D>(fast_.cell), NamesOf<D>(slow_));
  }

  SplitMix64& random_;
  Workspace<D> fast_;
  Polytope<D> slow_;
  uint64_t left_rough_ = 0;
};

template <typename T>
class VoronoiOracleTest : public test::SeededTest {
 protected:
  VoronoiOracleTest() : SeededTest(1908) {}
};
TYPED_TEST_SUITE(VoronoiOracleTest, test::UpTo5);

TYPED_TEST(VoronoiOracleTest, InitializeAddsTheCornersThatAreMissing) {
  constexpr int D = TypeParam::kValue;
  Point<D> high;
  high.fill(1);
  Point<D> on_face;
  on_face.fill(0.25);
  on_face[0] = 1;
  const QueryStructure<D> structure = MakeStructure<D>({on_face, high});
  ASSERT_EQ(structure.vertex_count(), 1u + (1u << D));
  EXPECT_EQ(structure.point(VertexId{0}), on_face);
  EXPECT_EQ(structure.point(VertexId{1}), high);
  for (int corner = 0; corner < (1 << D) - 1; ++corner) {
    const VertexId v{2 + static_cast<uint32_t>(corner)};
    for (int k = 0; k < D; ++k) {
      EXPECT_EQ(structure.point(v)[k], (corner >> k) & 1);
    }
    EXPECT_EQ(structure.faces(v), CornerFaces<D>(corner));
  }
  EXPECT_EQ(structure.faces(VertexId{0}), 1u << FaceIndex(0, true));
}

// Before any refinement queries may take long, but are as exact.
TYPED_TEST(VoronoiOracleTest, QueriesAreExactOnEveryKindOfCloud) {
  constexpr int D = TypeParam::kValue;
  uint64_t left_rough = 0;
  for (const std::string_view kind : test::SomeKinds(D)) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 30, 16, 4})));
    QueryChecker<D> checker(this->random_);
    for (int i = 0; i < ByDimension<D>({6, 6, 4, 1}); ++i) {
      checker.CheckAll(structure, VertexId(this->random_.Below(structure.vertex_count())));
      ASSERT_FALSE(this->HasFatalFailure());
    }
    left_rough += checker.left_rough();
  }
  EXPECT_TRUE(left_rough > 0 || D == 2) << "in the plane all are placed";
}

// From wherever it is looked for; where a vertex is, on faces and between leaves too.
TYPED_TEST(VoronoiOracleTest, NearestToIsTheNearestOfAll) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : test::SomeKinds(D)) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 60, 30, 6})));
    Workspace<D> workspace;
    for (int i = 0; i < ByDimension<D>({40, 40, 20, 10}); ++i) {
      const VertexId any = VertexId(this->random_.Below(structure.vertex_count()));
      Point<D> p = structure.point(any);
      for (int k = 0; k < D && i % 4 != 0; ++k) {
        const uint64_t place = this->random_.Below(5);
        p[k] = place < 2 ? this->random_.Unit() : place < 4 ? 0.5 * static_cast<double>(this->random_.Below(3)) : p[k];
      }
      double nearest_sq = D;
      for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
        nearest_sq = std::min(nearest_sq, DistanceSq<D>(structure.point(VertexId{u}), p));
      }
      for (const VertexId near : {kNoVertex, any, VertexId(this->random_.Below(structure.vertex_count()))}) {
        const Neighbor found = structure.NearestTo(p, near, workspace);
        ASSERT_EQ(found.distance_sq, nearest_sq);
        ASSERT_EQ(DistanceSq<D>(structure.point(found.vertex), p), nearest_sq);
        if (nearest_sq == 0) {
          ASSERT_EQ(structure.point(found.vertex), p);
        }
      }
    }
  }
}

TYPED_TEST(VoronoiOracleTest, QueriesAreExactInElongatedAndOffsetBoxes) {
  constexpr int D = TypeParam::kValue;
  for (const double low : {0.0, -0.3, 1e5}) {
    Box<D> box;
    for (int k = 0; k < D; ++k) {
      box.low[k] = low;
      box.high[k] = low + (k == 0 ? 30 : 0.9);
    }
    std::vector<Point<D>> points = test::ToPoints<D>(test::MakeCloud("boundary", D, ByDimension<D>({40, 40, 20, 6})));
    for (Point<D>& p : points) {
      for (int k = 0; k < D; ++k) {
        p[k] = p[k] == 1 ? box.high[k] : box.low[k] + p[k] * (box.high[k] - box.low[k]);
      }
    }
    const QueryStructure<D> structure = MakeStructure<D>(box, test::MortonSorted<D>(box, points));
    QueryChecker<D> checker(this->random_);
    for (int i = 0; i < ByDimension<D>({10, 10, 6, 2}); ++i) {
      checker.CheckAll(structure, VertexId(this->random_.Below(structure.vertex_count())));
      ASSERT_FALSE(this->HasFatalFailure());
    }
  }
}

TYPED_TEST(VoronoiOracleTest, QueriesAreExactAtEveryStageOfRefinement) {
  constexpr int D = TypeParam::kValue;
  uint32_t steps = 0;
  for (const std::string_view kind : {"uniform", "cospherical", "boundary", "lines", "log-uniform"}) {
    SCOPED_TRACE(std::string(kind));
    QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 16, 6, 1})));
    QueryChecker<D> checker(this->random_);
    RunContext context;
    const RefinementObserver<D> observer = [&](const QueryStructure<D>& at, const Insertion&) {
      if (steps++ % ByDimension<D>({30, 30, 100, 150}) == 0 && !this->HasFatalFailure()) {
        checker.CheckAll(at, VertexId(this->random_.Below(at.vertex_count())));
        checker.CheckAll(at, VertexId{at.vertex_count() - 1});
      }
    };
    BoxRefinement<D> refinement(structure, 1e-9);
    const absl::Status status =
        refinement.Run({.rho = ByDimension<D>({2.0, 2.0, 2.9, 4.1})}, 600, 1, context, observer);
    EXPECT_TRUE(status.ok() || status.code() == absl::StatusCode::kResourceExhausted) << status;
    ASSERT_FALSE(this->HasFatalFailure());
  }
  EXPECT_GT(steps, 300u);
}

// Guarantee (1) of Voronoi: u's cell has v for a neighbour in just the nodes where v's has u.
TYPED_TEST(VoronoiOracleTest, CellsOfDifferentSitesAgree) {
  constexpr int D = TypeParam::kValue;
  for (const std::string_view kind : {"grid", "cospherical", "boundary", "rounded", "uniform"}) {
    SCOPED_TRACE(std::string(kind));
    const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>(kind, ByDimension<D>({60, 60, 30, 6})));
    std::map<std::vector<uint32_t>, int> seen;  // simplices, and from how many of their corners
    Workspace<D> workspace;
    for (uint32_t v = 0; v < structure.vertex_count(); ++v) {
      structure.Voronoi(VertexId{v}, workspace);
      for (const CellNode<D>& node : workspace.cell.nodes()) {
        std::vector<uint32_t> corners = {v};
        for (const uint16_t index : node.planes) {
          const Plane<D>& plane = workspace.cell.plane(index);
          if (plane.kind == PlaneKind::kBisector) {
            corners.push_back(Index(plane.vertex));
          }
        }
        if (corners.size() == D + 1) {
          std::sort(corners.begin(), corners.end());
          ++seen[corners];
        }
      }
    }
    EXPECT_GT(seen.size(), structure.vertex_count());
    for (const auto& [corners, count] : seen) {
      ASSERT_EQ(count, D + 1) << ::testing::PrintToString(corners);
    }
  }
}

// One workspace serves structures of any size, one after the other.
TYPED_TEST(VoronoiOracleTest, WorkspaceKeepsNothingFromTheLastQuery) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> large =
      MakeStructure<D>(test::SortedCloud<D>("uniform", ByDimension<D>({100, 100, 100, 30})));
  const QueryStructure<D> small = MakeStructure<D>(test::SortedCloud<D>("uniform", 10));
  Workspace<D> used;
  for (int i = 0; i < 20; ++i) {
    for (const QueryStructure<D>* structure : {&large, &small}) {
      const VertexId v = VertexId(this->random_.Below(structure->vertex_count()));
      structure->Voronoi(v, used);
      Workspace<D> fresh;
      structure->Voronoi(v, fresh);
      ASSERT_EQ(NamesOf<D>(used.cell), NamesOf<D>(fresh.cell));
      ASSERT_EQ(used.counters.queries, 2u * i + (structure == &large ? 1 : 2));
    }
  }
}

TYPED_TEST(VoronoiOracleTest, CountersCountWhatQueriesDo) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>({});
  Workspace<D> workspace;
  // The corners of the unit box: the cell of one is the box of half the side about it, cut by D others; leaves are few.
  structure.ClippedVoronoi(VertexId{0}, 10, workspace);
  EXPECT_EQ(workspace.counters.queries, 1u);
  EXPECT_EQ(workspace.counters.cuts, static_cast<uint64_t>(D));
  EXPECT_EQ(workspace.counters.vertices, (uint64_t{1} << D));
  EXPECT_EQ(workspace.counters.leaves, structure.tree().leaf_count());
  EXPECT_EQ(workspace.counters.max_leaves, workspace.counters.leaves);
  QueryCounters sum = workspace.counters;
  sum.Add(workspace.counters);
  EXPECT_EQ(sum.queries, 2u);
  EXPECT_EQ(sum.cuts, 2u * D);
  EXPECT_EQ(sum.max_leaves, workspace.counters.max_leaves);
}

}  // namespace
}  // namespace wellspace::core
