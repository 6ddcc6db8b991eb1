// Cells that are kept are those of a query, whatever has been added since.
#include "core/refine/space/whole_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/refine/space/tetrahedron_name.h"
#include "tests/support/clouds.h"
#include "tests/support/seeded_test.h"
#include "tests/support/structures.h"

namespace wellspace::core {
namespace {

// Of a node: its name, and where it is to the bit.
struct NamedNode {
  TetrahedronName name;
  Point<3> x{};

  auto operator<=>(const NamedNode&) const = default;
};

std::vector<NamedNode> NodesOf(const Polytope<3>& cell) {
  std::vector<NamedNode> nodes;
  for (const CellNode<3>& node : cell.nodes()) {
    nodes.push_back({NameOf(cell, node), node.x});
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

class WholeCellsTest : public test::SeededTest {
 protected:
  WholeCellsTest() : SeededTest(20261202) {}
};

TEST_F(WholeCellsTest, AreThoseOfAQuery) {
  for (const char* kind : {"uniform", "grid"}) {
    QueryStructure<3> structure = test::MakeStructure<3>(test::SortedCloud<3>(kind, 300));
    WholeCells whole;
    Workspace<3> workspace;
    Workspace<3> of_query;
    uint64_t cells = 0;
    for (int round = 0; round < 400; ++round) {
      // More vertices than are kept, some of them often.
      const VertexId v{static_cast<uint32_t>(random_.Below(round % 3 == 0 ? structure.vertex_count() : 20))};
      const Polytope<3>& cell = whole.CellOf(v, structure, workspace);
      structure.UnplacedClippedVoronoi(v, structure.box(), of_query);
      of_query.cell.Place();
      ASSERT_EQ(NodesOf(cell), NodesOf(of_query.cell)) << kind << ", round " << round;
      cells = workspace.counters.queries;
      if (round % 2 == 0) {
        Point<3> p = structure.point(v);
        for (double& x : p) {
          x = std::clamp(x + 0.05 * (random_.Unit() - 0.5), 0.0, 1.0);
        }
        structure.AddVertex(v, p);
      }
    }
    EXPECT_LT(cells, 350) << "the others were kept";
    EXPECT_GT(cells, 50);
  }
}

}  // namespace
}  // namespace wellspace::core
