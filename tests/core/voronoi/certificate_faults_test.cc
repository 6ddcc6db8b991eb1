// Certificates: no cell with a planted fault has one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/voronoi/certificate.h"
#include "tests/support/brute_force.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

using test::MakeStructure;
using ::testing::HasSubstr;

// A cell that can be tampered with.
template <int D>
struct KeptCell {
  explicit KeptCell(const Polytope<D>& cell) : site(cell.site()), nodes(cell.nodes().begin(), cell.nodes().end()) {
    for (int i = 0; i < cell.plane_count(); ++i) {
      planes.push_back(cell.plane(i));
    }
  }

  CellView<D> View() const { return {site, nodes, planes}; }

  // The plane of a facet that is a bisector.
  Plane<D>& SomeBisector() {
    for (const CellNode<D>& node : nodes) {
      for (const uint16_t index : node.planes) {
        if (planes[index].kind == PlaneKind::kBisector) {
          return planes[index];
        }
      }
    }
    ADD_FAILURE() << "no bisector";
    return planes[0];
  }

  Point<D> site;
  std::vector<CellNode<D>> nodes;
  std::vector<Plane<D>> planes;
};

::testing::AssertionResult IsRefused(const absl::Status& status, std::string_view what) {
  if (status.code() == absl::StatusCode::kFailedPrecondition &&
      std::string(status.message()).find(what) != std::string::npos) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << status << "; expected: " << what;
}

template <typename T>
class CertificateFaultsTest : public test::SeededTest {
 protected:
  static constexpr int kD = T::kValue;

  CertificateFaultsTest() : SeededTest(1995) {}

  // A vertex inside the box whose cell, clipped at `radius_`, touches no wall, and that cell.
  void MakeInnerCell() {
    structure_ = MakeStructure<kD>(test::SortedCloud<kD>("uniform", kD == 2 ? 100 : 400));
    for (int i = 0; i < 1000; ++i) {
      v_ = VertexId(random_.Below(structure_.vertex_count()));
      structure_.ClippedVoronoi(v_, radius_, workspace_);
      const Polytope<kD>& cell = workspace_.cell;
      const bool is_inner = std::all_of(cell.nodes().begin(), cell.nodes().end(), [&](const CellNode<kD>& node) {
        return std::all_of(node.planes.begin(), node.planes.end(),
                           [&](uint16_t index) { return cell.plane(index).kind == PlaneKind::kBisector; });
      });
      if (is_inner) {
        ASSERT_TRUE(Certify(KeptCell<kD>(cell)).ok());
        return;
      }
    }
    FAIL() << "every cell touches a wall";
  }

  absl::Status Certify(const KeptCell<kD>& cell) const { return CertifyCell<kD>(structure_, v_, radius_, cell.View()); }

  const double radius_ = 0.5;
  QueryStructure<kD> structure_;
  VertexId v_{};
  Workspace<kD> workspace_;
};
TYPED_TEST_SUITE(CertificateFaultsTest, test::UpTo4);

TYPED_TEST(CertificateFaultsTest, RefusesACellThatLacksANeighbour) {
  constexpr int D = TypeParam::kValue;
  for (int i = 0; i < 10; ++i) {
    this->MakeInnerCell();
    ASSERT_FALSE(this->HasFatalFailure());
    const VertexId dropped = KeptCell<D>(this->workspace_.cell).SomeBisector().vertex;
    const Point<D>& site = this->structure_.point(this->v_);
    Box<D> bounds;
    std::array<PlaneKind, 2 * D> kinds;
    for (int face = 0; face < 2 * D; ++face) {
      const Plane<D>& wall = this->workspace_.cell.plane(face);
      (face % 2 == 0 ? bounds.low : bounds.high)[face / 2] = wall.source.coordinate;
      kinds[face] = wall.kind;
    }
    Polytope<D> cell;
    cell.Reset(site, bounds, kinds, TieRule::kKeep);
    for (uint32_t u = 0; u < this->structure_.vertex_count(); ++u) {
      if (VertexId{u} != this->v_ && VertexId{u} != dropped) {
        cell.Cut(VertexId{u}, this->structure_.point(VertexId{u}));
      }
    }
    EXPECT_TRUE(IsRefused(CertifyCell<D>(this->structure_, this->v_, this->radius_, cell),
                          "vertex " + std::to_string(Index(dropped)) + " is in the ball about node"));
    // A vertex added since, that has not cut.
    this->structure_.AddVertex(this->v_, [&] {
      Point<D> p = this->structure_.point(dropped);
      for (int k = 0; k < D; ++k) {
        p[k] = site[k] + 0.75 * (p[k] - site[k]);
      }
      return p;
    }());
    EXPECT_TRUE(IsRefused(CertifyCell<D>(this->structure_, this->v_, this->radius_, this->workspace_.cell),
                          "is in the ball about node"));
  }
}

TYPED_TEST(CertificateFaultsTest, RefusesACellThatIsCutByAFalseBisector) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  Polytope<D>& cell = this->workspace_.cell;
  const Plane<D> bisector = KeptCell<D>(cell).SomeBisector();
  Point<D> nearer;
  for (int k = 0; k < D; ++k) {
    nearer[k] = cell.site()[k] + 0.9 * bisector.normal[k];
  }
  ASSERT_TRUE(cell.Cut(bisector.vertex, nearer));
  EXPECT_TRUE(IsRefused(this->Certify(KeptCell<D>(cell)),
                        "is not the bisector of vertex " + std::to_string(Index(bisector.vertex))));
  // Not better when it says that it is of no vertex, of itself or a vertex to come.
  for (const uint32_t name : {Index(kNoVertex), Index(this->v_), this->structure_.vertex_count()}) {
    KeptCell<D> renamed(cell);
    renamed.planes.back().vertex = VertexId{name};
    EXPECT_TRUE(IsRefused(this->Certify(renamed), "which is no other vertex"));
  }
  // Nor as a wall, of whatever kind.
  for (const PlaneKind kind : {PlaneKind::kFace, PlaneKind::kClip}) {
    KeptCell<D> wall(cell);
    wall.planes.back().kind = kind;
    EXPECT_TRUE(IsRefused(this->Certify(wall), "says it is a wall"));
  }
}

TYPED_TEST(CertificateFaultsTest, RefusesWallsThatAreNotThere) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 60));
  Workspace<D> workspace;
  const VertexId v{3};
  const double radius = 0.3 * std::sqrt(test::NearestDistanceSq<D>(structure, v));
  structure.ClippedVoronoi(v, radius, workspace);
  ASSERT_TRUE(CertifyCell<D>(structure, v, radius, workspace.cell).ok());
  // Clipped nearer or farther than it says.
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, v, 1.5 * radius, workspace.cell), "nor the clip there"));
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, v, 0.75 * radius, workspace.cell), "nor the clip there"));
  EXPECT_TRUE(IsRefused(CertifyWholeCell<D>(structure, v, workspace.cell), "nor the clip there"));
  // A clip passed off as a face of the box, and the other way round; a wall on another axis.
  KeptCell<D> cell(workspace.cell);
  cell.planes[0].kind = PlaneKind::kFace;
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, v, radius, cell.View()), "nor the clip there"));
  structure.ClippedVoronoi(v, 10, workspace);
  cell = KeptCell<D>(workspace.cell);
  ASSERT_TRUE(CertifyCell<D>(structure, v, 10, cell.View()).ok());
  cell.planes[1].kind = PlaneKind::kClip;
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, v, 10, cell.View()), "nor the clip there"));
  cell = KeptCell<D>(workspace.cell);
  cell.planes[1].source.axis = 1;
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, v, 10, cell.View()), "nor the clip there"));
  // Another vertex's cell.
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, VertexId{4}, 10, workspace.cell), "site is not where vertex 4 is"));
}

// One wall moved inward: every ball is empty, but the boundary is not justified. One moved outward: beyond the box.
TYPED_TEST(CertificateFaultsTest, RefusesABoxOfAnotherSize) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>({});
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  for (const double high : {0.25, 1.5}) {
    Box<D> bounds = structure.box();
    bounds.high[0] = high;
    Polytope<D> cell;
    cell.Reset(structure.point(VertexId{0}), bounds, kinds, TieRule::kKeep);
    for (uint32_t u = 1; u < structure.vertex_count(); ++u) {
      cell.Cut(VertexId{u}, structure.point(VertexId{u}));
    }
    EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, VertexId{0}, 10, cell), "plane 1 (face 1 at"));
    KeptCell<D> kept(cell);
    kept.planes[1].source.coordinate = 1;
    EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, VertexId{0}, 10, kept.View()), "has not the normal and offset"));
  }
  Polytope<D> uncut;
  uncut.Reset(structure.point(VertexId{0}), structure.box(), kinds, TieRule::kKeep);
  uncut.Place();
  EXPECT_TRUE(IsRefused(CertifyCell<D>(structure, VertexId{0}, 10, uncut), "is in the ball about node"));
}

// A node on planes that are all right, but where another one of them has cut it off.
TYPED_TEST(CertificateFaultsTest, RefusesNodesBeyondTheWalls) {
  constexpr int D = TypeParam::kValue;
  const QueryStructure<D> structure = MakeStructure<D>(test::SortedCloud<D>("uniform", 60));
  Workspace<D> workspace;
  Box<D> bounds = structure.box();
  for (int k = 0; k < D; ++k) {
    bounds.low[k] -= 1;
    bounds.high[k] += 1;
  }
  std::array<PlaneKind, 2 * D> kinds;
  kinds.fill(PlaneKind::kFace);
  int refused = 0;
  for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
    structure.ClippedVoronoi(VertexId{u}, 10, workspace);
    KeptCell<D> cell(workspace.cell);
    // The same bisectors in a larger box; its planes are then said to be those of the box.
    Polytope<D> larger;
    larger.Reset(workspace.cell.site(), bounds, kinds, TieRule::kKeep);
    for (uint32_t w = 0; w < structure.vertex_count(); ++w) {
      if (w != u) {
        larger.Cut(VertexId{w}, structure.point(VertexId{w}));
      }
    }
    KeptCell<D> kept(larger);
    std::copy_n(cell.planes.begin(), 2 * D, kept.planes.begin());
    for (CellNode<D>& node : kept.nodes) {
      node.slack = std::numeric_limits<double>::infinity();  // nothing is said of its place
      node.reach = node.slack;
    }
    const absl::Status certified = CertifyCell<D>(structure, VertexId{u}, 10, kept.View());
    if (test::NamesOf<D>(larger) == test::NamesOf<D>(workspace.cell)) {
      EXPECT_TRUE(certified.ok()) << certified;
    } else {
      EXPECT_TRUE(IsRefused(certified, "is beyond the walls on axis"));
      ++refused;
    }
  }
  EXPECT_GT(refused, 3);
}

TYPED_TEST(CertificateFaultsTest, RefusesNumbersThatAreWrong) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  const KeptCell<D> right(this->workspace_.cell);
  const size_t i = this->random_.Below(right.nodes.size());
  {
    KeptCell<D> cell = right;
    cell.nodes[i].x[D - 1] += 2 * cell.nodes[i].slack;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "node " + std::to_string(i) + " is "));
    cell.nodes[i].x[D - 1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(IsRefused(this->Certify(cell), "from where its planes meet"));
  }
  {
    KeptCell<D> cell = right;
    cell.nodes[i].radius_sq *= 1 + 1e-6;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "has radius_sq"));
  }
  {
    KeptCell<D> cell = right;
    cell.nodes[i].reach *= 1 - 1e-9;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "has reach"));
  }
  {
    KeptCell<D> cell = right;
    cell.SomeBisector().length *= 1 + 1e-12;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "says its normal has length"));
  }
  {
    KeptCell<D> cell = right;
    cell.SomeBisector().normal[0] *= 1 + 1e-12;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "has not the normal and offset of the bisector"));
  }
  {
    KeptCell<D> cell = right;
    cell.SomeBisector().offset *= 1 - 1e-12;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "has not the normal and offset of the bisector"));
  }
}

TYPED_TEST(CertificateFaultsTest, RefusesGraphsThatAreNotClosed) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  const KeptCell<D> right(this->workspace_.cell);
  const size_t i = this->random_.Below(right.nodes.size());
  {
    KeptCell<D> cell = right;
    cell.nodes.clear();
    EXPECT_TRUE(IsRefused(this->Certify(cell), "no nodes"));
  }
  {
    // The last node is cut away: its neighbours' edges have one end.
    KeptCell<D> cell = right;
    cell.nodes.pop_back();
    EXPECT_TRUE(IsRefused(this->Certify(cell), "node"));
  }
  {
    KeptCell<D> cell = right;
    cell.nodes[0].neighbours[0] = 0;
    EXPECT_TRUE(IsRefused(this->Certify(cell), "has the neighbour"));
  }
  {
    KeptCell<D> cell = right;
    std::swap(cell.nodes[i].neighbours[0], cell.nodes[i].neighbours[1]);
    EXPECT_TRUE(IsRefused(this->Certify(cell), "are not the two ends of one edge"));
  }
  {
    KeptCell<D> cell = right;
    cell.nodes[i].planes[0] = static_cast<uint16_t>(cell.planes.size());
    EXPECT_TRUE(IsRefused(this->Certify(cell), "is on plane"));
  }
  {
    KeptCell<D> cell = right;
    cell.nodes[i].planes[0] = cell.nodes[i].planes[1];
    EXPECT_TRUE(IsRefused(this->Certify(cell), "do not meet in one point"));
  }
  {
    // Two whole cells side by side: locally right everywhere.
    KeptCell<D> cell = right;
    const auto count = static_cast<uint16_t>(right.nodes.size());
    for (CellNode<D> node : right.nodes) {
      for (uint16_t& neighbour : node.neighbours) {
        neighbour = static_cast<uint16_t>(neighbour + count);
      }
      cell.nodes.push_back(node);
    }
    EXPECT_TRUE(IsRefused(this->Certify(cell), "are both extreme in one direction"));
  }
}

// Every ball of the nodes that stay is empty; each missing node is skipped by joining its neighbours to each other.
TYPED_TEST(CertificateFaultsTest, RefusesPartsOfACellThatArePassedOffAsTheWhole) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  const KeptCell<D> right(this->workspace_.cell);
  for (size_t gone = 0; gone < right.nodes.size(); ++gone) {
    KeptCell<D> cell = right;
    const auto& around = right.nodes[gone].neighbours;
    for (int k = 0; k < D; ++k) {
      for (uint16_t& back : cell.nodes[around[k]].neighbours) {
        if (back == gone) {
          back = around[(k + 1) % D];
        }
      }
    }
    const auto last = static_cast<uint16_t>(cell.nodes.size() - 1);
    cell.nodes[gone] = cell.nodes[last];
    cell.nodes.pop_back();
    for (CellNode<D>& node : cell.nodes) {
      std::replace(node.neighbours.begin(), node.neighbours.end(), last, static_cast<uint16_t>(gone));
    }
    EXPECT_EQ(this->Certify(cell).code(), absl::StatusCode::kFailedPrecondition);
  }
}

// A simplex of D + 1 true bisectors, all pairs of nodes joined. Those of the two ends of an edge do not surround the
// site, so that in some direction no node is extreme; the graph alone does not tell.
TYPED_TEST(CertificateFaultsTest, RefusesNodesThatAreNotExtremeInEveryDirection) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  const KeptCell<D> right(this->workspace_.cell);
  int told_by_an_edge = 0;
  for (const CellNode<D>& node : right.nodes) {
    for (const uint16_t neighbour : node.neighbours) {
      std::vector<uint16_t> planes(node.planes.begin(), node.planes.end());
      for (const uint16_t plane : right.nodes[neighbour].planes) {
        if (std::find(planes.begin(), planes.end(), plane) == planes.end()) {
          planes.push_back(plane);
        }
      }
      ASSERT_EQ(planes.size(), D + 1u);
      KeptCell<D> cell = right;
      cell.nodes.clear();
      for (int left_out = 0; left_out <= D; ++left_out) {
        CellNode<D> made;
        made.slack = std::numeric_limits<double>::infinity();
        made.reach = made.slack;
        for (int k = 0; k < D; ++k) {
          made.planes[k] = planes[k < left_out ? k : k + 1];
          made.neighbours[k] = static_cast<uint16_t>(k < left_out ? k : k + 1);
        }
        cell.nodes.push_back(made);
      }
      const absl::Status refused = this->Certify(cell);
      ASSERT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
      told_by_an_edge += IsRefused(refused, "leads away from plane") ? 1 : 0;
    }
  }
  EXPECT_GT(told_by_an_edge, 0);
}

TYPED_TEST(CertificateFaultsTest, RefusesWhatIsNoVertexAndNoRadius) {
  constexpr int D = TypeParam::kValue;
  this->MakeInnerCell();
  ASSERT_FALSE(this->HasFatalFailure());
  const Polytope<D>& cell = this->workspace_.cell;
  const absl::Status no_vertex =
      CertifyCell<D>(this->structure_, VertexId{this->structure_.vertex_count()}, this->radius_, cell);
  EXPECT_EQ(no_vertex.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(no_vertex.message()), HasSubstr("vertices"));
  EXPECT_EQ(CertifyWholeCell<D>(this->structure_, kNoVertex, cell).code(), absl::StatusCode::kInvalidArgument);
  for (const double radius : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    const absl::Status refused = CertifyCell<D>(this->structure_, this->v_, radius, cell);
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("positive and finite"));
  }
}

// The site and all others are the ends of a cross: exactly on one sphere. The bisector with the opposite end touches
// the cell in the centre alone, so the cell is right without it; not if that end is nearer by a unit in the last place.
TYPED_TEST(CertificateFaultsTest, TellsTheLastBit) {
  constexpr int D = TypeParam::kValue;
  for (const bool is_nearer : {false, true}) {
    std::vector<Point<D>> points;
    Point<D> centre;
    centre.fill(0.5);
    for (int k = 0; k < D; ++k) {
      points.insert(points.end(), 2, centre);
      points[2 * k][k] = 0.25;
      points[2 * k + 1][k] = k == 0 && is_nearer ? std::nextafter(0.75, 0) : 0.75;
    }
    const Point<D> site = points[0];
    const Point<D> opposite = points[1];
    const QueryStructure<D> structure = MakeStructure<D>(test::MortonSorted<D>(test::UnitBox<D>(), points));
    std::array<PlaneKind, 2 * D> kinds;
    kinds.fill(PlaneKind::kFace);
    Polytope<D> cell;
    cell.Reset(site, structure.box(), kinds, TieRule::kKeep);
    VertexId v{};
    for (uint32_t u = 0; u < structure.vertex_count(); ++u) {
      const Point<D>& position = structure.point(VertexId{u});
      if (position == site) {
        v = VertexId{u};
      } else if (position != opposite) {
        cell.Cut(VertexId{u}, position);
      }
    }
    const absl::Status certified = CertifyCell<D>(structure, v, 10, cell);
    if (is_nearer) {
      EXPECT_TRUE(IsRefused(certified, "is in the ball about node"));
    } else {
      EXPECT_TRUE(certified.ok()) << certified;
    }
  }
}

}  // namespace
}  // namespace wellspace::core
