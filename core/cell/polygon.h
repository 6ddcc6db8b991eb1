// The Voronoi cell of one vertex in the plane under construction: Polytope<2>. The promises of its functions are in
// cell_class.h.
#ifndef WELLSPACE_CORE_CELL_POLYGON_H_
#define WELLSPACE_CORE_CELL_POLYGON_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/simd/lanes.h"
#include "core/cell/cell_parts.h"
#include "core/cell/float_cell.h"
#include "core/cell/gathered_vertices.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// The cell in the plane: a convex polygon, whose nodes are kept in order around the site, counter-clockwise, so that a
// cut takes a run of them out and puts two in. Doubts that floats leave are decided exactly.
//
//   BoundExcesses, FindKept   which run of nodes the bisector leaves; in doubt by DecideDoubtful
//   AddBisector               the new plane (float_cell.h)
//   PlaceEnds                 where the new plane meets the two edges that the run ends at
//   Replace                   the run and the two ends become the nodes, and the farthest one the reach
//
// Up to eight nodes, as most cells have, are worked on as one vector; more nodes, one by one (FindKeptOfMany,
// ReplaceAmongMany).
//
// Thread safety: thread-compatible. Reused from site to site: no allocation once warm.
// Invariants: the nodes are those that exact arithmetic and the tie rule give, whatever the rounding.
class Polygon : public FloatCell<2> {
 public:
  // Works with `unit`, which this processor has; the best there is unless told.
  explicit Polygon(VectorUnit unit = BestVectorUnit()) : FloatCell(unit), groups_(1) {}

  void Reset(const Point<2>& site, const Box<2>& bounds, const std::array<PlaneKind, 4>& kinds, TieRule rule);

  bool Cut(VertexId u, const Point<2>& position) {
    const bool is_cut = CutBeforePlace(u, position);
    Place();
    return is_cut;
  }
  bool CutBeforePlace(VertexId u, const Point<2>& position);

  size_t CutByEach(std::span<const Point<2>> positions, const VertexNames& names, VertexId site);
  // Cuts the cell by the vertices that have been gathered around its site, in the place of CutByEach, leaf after leaf.
  // Returns how many others are within reach.
  //
  // REQUIRES:   gathered.Surrounds(site()); the cell has not been cut.
  // Complexity: O(gathered), little for each, and the cuts; no allocation once warm.
  // Errors:     none.
  size_t CutByGathered(const GatheredVertices<2>& gathered, VertexId site);

  void Place();
  bool KeepsRatio(double ratio) const;
  bool PlaceUnlessKeeps(double ratio);
  bool Reaches(const Box<2>& cube) const;
  void FindStar(Star<2>& out) const;
  // Whether surely no node lies beyond the line through `foot`, relative to the site, at a right angle to the way
  // there. The nodes need not be placed.
  bool IsSurelyBefore(const Point<2>& foot) const;
  // Calls f(plane) with that of each edge, one after the other around the site, placed or not.
  template <typename F>
  void ForEachEdge(F f) const {
    for (size_t i = 0; i < count_; ++i) {
      f(planes_[PlaneFrom(i)]);
    }
  }
  uint64_t MemoryBytes() const;

 private:
  friend struct CellOnUnit<Polygon, 2>;

  // The values computed for kGroupSize nodes at a time, in the units of the nodes. Lanes beyond the last node are at
  // the site, which no bisector cuts off.
  struct alignas(kGroupSize * sizeof(float)) Group {
    float x[2][kGroupSize];
    float edge_sq[kGroupSize];  // the squared length of the edge from the site to the vertex of `plane`; 0 of a wall
    int32_t plane[kGroupSize];  // along which the cell runs from this node to the next
  };
  // One lane of a Group.
  struct Node {
    float x;
    float y;
    float edge_sq;
    int32_t plane;
  };
  // The nodes that a cut leaves: so many from there on, around.
  struct KeptRun {
    uint32_t first;
    uint32_t count;
  };

  template <VectorUnit kUnit>
  bool CutOff(const FloatBisector<2>& bisector, VertexId u, const Point<2>& position);
  Floats BoundExcesses(const FloatBisector<2>& bisector) const;
  template <VectorUnit kUnit>
  bool FindKept(const FloatBisector<2>& bisector, const Floats& excess_bounds, uint32_t maybe, const Point<2>& position,
                KeptRun& run);
  bool FindKeptOfMany(const FloatBisector<2>& bisector, const Point<2>& position, KeptRun& run);
  uint32_t DecideDoubtful(size_t first, uint32_t doubtful, const Point<2>& generator);
  void PlaceEnds(const KeptRun& run, uint32_t plane, std::array<Node, 2>& ends) const;
  template <VectorUnit kUnit>
  void Replace(const KeptRun& run, const std::array<Node, 2>& ends);
  void ReplaceAmongMany(const KeptRun& run, const std::array<Node, 2>& ends);
  template <VectorUnit kUnit>
  bool KeepsRatioWith(double ratio) const;
  bool KeepsRatioAvx2(double ratio) const;
  void SetReach(float radius_sq);
  Point<2> PositionOf(size_t node) const;  // in the units of the nodes
  std::span<const Group> groups() const { return {groups_.data(), GroupsFor(count_)}; }
  uint32_t PlaneFrom(size_t node) const {
    return static_cast<uint32_t>(groups_[node / kGroupSize].plane[node % kGroupSize]);
  }
  size_t Before(size_t node) const { return (node == 0 ? count_ : node) - 1; }

  // Arrays only grow. Beside those of FloatCell: planes_, by plane, of which plane_count_ are valid, and nodes_, by
  // node, valid once the cell is placed.
  std::vector<Group> groups_;        // node n is lane n % 8 of group n / 8; count_ nodes are valid
  std::vector<Node> reordered_;      // by node, the new nodes, in ReplaceAmongMany
  std::vector<uint8_t> is_removed_;  // by node, in FindKeptOfMany
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_POLYGON_H_
