// A memo of a vertex' cell between two looks at it. PendingVertices keeps one for each vertex, and asks it
// whether a new neighbour matters.
#ifndef WELLSPACE_CORE_REFINE_CELL_MEMO_H_
#define WELLSPACE_CORE_REFINE_CELL_MEMO_H_

#include <cmath>
#include <limits>

namespace wellspace::core {

// One of three: nothing; a radius; or an edge at the boundary. Four bytes, since there is one for every vertex. A memo
// is rounded to the safe side: a radius up, an edge down.
class CellMemo {
 public:
  // Nothing: the vertex is pending, or its cell has changed since.
  constexpr CellMemo() = default;

  // The cell is good, and R(v)^2, the squared distance of its farthest node, is at most `radius_sq`. That is 0 where
  // the cell was found good without a look at its nodes: by the radius-edge criterion, which does not ask for radii.
  static CellMemo OfRadius(double radius_sq) { return CellMemo(RoundedUp(radius_sq)); }

  // Of the nodes on faces that the vertex lies on, some are too far for an edge of this squared length, the shortest
  // such; in a domain, of those at segments (Assessment::own_boundary_edge_sq). They ask for nothing, as they are no
  // circumcentres, until a new vertex cuts one of them off.
  static CellMemo OfBoundaryEdge(double edge_sq) { return CellMemo(RoundedUp(-edge_sq)); }

  bool HasBoundaryEdge() const { return value_ < 0; }

  // REQUIRES:   HasBoundaryEdge().
  double boundary_edge_sq() const { return -static_cast<double>(value_); }

  // Whether the cell may have a node farther than this, by the square; also where nothing is remembered.
  //
  // False where an edge at the boundary is remembered.
  //
  // REQUIRES:   the well-spaced criterion, by which radii are known.
  bool MayReachBeyond(double distance_sq) const { return value_ > distance_sq; }

 private:
  explicit constexpr CellMemo(float value) : value_(value) {}

  // The least float that is not less.
  static float RoundedUp(double x) {
    const auto nearest = static_cast<float>(x);
    return nearest < x ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
  }

  float value_ = std::numeric_limits<float>::infinity();  // a squared radius, or minus a squared edge
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_CELL_MEMO_H_
