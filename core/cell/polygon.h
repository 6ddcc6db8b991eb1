// The Voronoi cell of one vertex in the plane under construction: Polytope<2>. What its functions promise is said in
// polytope.h.
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

// Polytope<2>, to which its functions that are not told about here belong: a convex polygon, whose nodes are kept in
// order around the site, so that a cut takes a run of them out and puts two in. What floats leave in doubt is decided
// exactly. Up to eight nodes, as most cells have, are worked on as one vector.
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
  // Cuts the cell by the vertices that have been gathered around its site. Returns how many others are within reach.
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

  // Nodes, each with the edge from it to the next one: the square of the length of what its bisector stands for, 0 of a
  // wall, and its plane, by index. Places beyond the last node are at the site, which no bisector cuts off.
  struct alignas(kTogether * sizeof(float)) Group {
    float x[2][kTogether];
    float edge_sq[kTogether];
    int32_t plane[kTogether];
  };
  struct Node {
    float x;
    float y;
    float edge_sq;
    int32_t plane;
  };
  // What is left of the nodes: so many from there on, around.
  struct Rest {
    uint32_t first;
    uint32_t count;
  };

  template <VectorUnit kUnit>
  bool CutOff(const FloatBisector<2>& bisector, VertexId u, const Point<2>& position);
  Floats MostExcesses(const FloatBisector<2>& bisector) const;
  template <VectorUnit kUnit>
  bool FindRest(const FloatBisector<2>& bisector, const Floats& most, uint32_t maybe, const Point<2>& position,
                Rest& rest);
  bool FindRestOfMany(const FloatBisector<2>& bisector, const Point<2>& position, Rest& rest);
  uint32_t DecideDoubtful(size_t first, uint32_t doubtful, const Point<2>& generator);
  void PlaceEnds(const Rest& rest, uint32_t plane, std::array<Node, 2>& ends) const;
  template <VectorUnit kUnit>
  void Replace(const Rest& rest, const std::array<Node, 2>& ends);
  void ReplaceAmongMany(const Rest& rest, const std::array<Node, 2>& ends);
  template <VectorUnit kUnit>
  bool KeepsRatioWith(double ratio) const;
  bool KeepsRatioAvx2(double ratio) const;
  void SetReach(float radius_sq);
  Point<2> PositionOf(size_t node) const;  // in the units of the nodes
  std::span<const Group> groups() const { return {groups_.data(), GroupsFor(count_)}; }
  uint32_t PlaneFrom(size_t node) const {
    return static_cast<uint32_t>(groups_[node / kTogether].plane[node % kTogether]);
  }
  size_t Before(size_t node) const { return (node == 0 ? count_ : node) - 1; }

  std::vector<Group> groups_;        // and more
  std::vector<Node> around_;         // scratch of ReplaceAmongMany
  std::vector<uint8_t> is_removed_;  // scratch of FindRestOfMany
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_POLYGON_H_
