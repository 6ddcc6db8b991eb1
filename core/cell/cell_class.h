// The contract of a cell: the promises of Polygon (2-D), Polyhedron (3-D) and Polytope (4-D to 6-D). Their headers have
// their own alone. docs/design/cell.md has the folder's story, and which file answers which question.
//
// A cell is the part of a box that is nearer to its site than to each vertex that it was cut by. Its state decides the
// meaning of its nodes():
//
//   state    after                                           nodes()
//   cut      Reset, CutBeforePlace, CutByEach                may not be asked for
//   rough    PlaceUnlessKeeps, if that returned false        those that may break the ratio as in `placed`; others
//                                                            within their slack. In 3-D none tells its neighbours
//   placed   Place, Cut                                      positions that follow from the planes alone
//
// All else may be asked in every state. A caller may rely on this, whichever the class:
//
//   1. Exact arithmetic and the tie rule decide whether a vertex cuts, and which nodes there are, as sets of planes.
//      Rounding may cost time, and never changes the answer.
//   2. Once placed, a cell is the same to the bit whatever the order of its cuts, and by every vector unit; only the
//      numbers of its nodes and planes differ. With TieRule::kKeep so are positions, while nodes that coincide may be
//      joined otherwise.
//   3. Positions, `reach` and Reaches are in doubles or floats, and err to one side: a node is within its slack of the
//      exact one, reach_sq() is never too small, Reaches is never false where a vertex could cut.
//   4. Nothing is allocated once the cell is warm: Reset keeps the arrays of the cell before.
//   5. A cell may be used by one thread at a time; two cells share nothing.
//
// The differences, and why:
//
//   property                    Polygon, Polyhedron                      Polytope
//   nodes while cut             floats, eight a vector; one bound for    doubles, four a vector; a slack each, since
//                               all, since they come from planes         new nodes come from nodes before them
//   Tighten                     does nothing: a cut brings reach_sq()    finds the farthest node, which a cut leaves
//                               down at once                             to those that ask
//   CutByGathered               is there (polygon.h)                     is not: the walk to the vertices, which it
//                                                                        saves, is a small part of a query there
//   vector unit                 the constructor's                        the best that there is
//
// Lengths are in the units of the input. Positions of nodes and normals of planes are relative to the site; arguments
// are absolute.
#ifndef WELLSPACE_CORE_CELL_CELL_CLASS_H_
#define WELLSPACE_CORE_CELL_CELL_CLASS_H_

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/base/ids.h"
#include "core/cell/cell_parts.h"
#include "core/cell/star.h"
#include "core/geometry/box.h"
#include "core/geometry/point.h"
#include "core/geometry/power_predicate.h"

namespace wellspace::core {

// The questions to a cell that does not change.
template <typename C, int D>
concept CellToRead = requires(const C& cell, double ratio, const Box<D>& cube, int index, const CellNode<D>& node,
                              Star<D>& star) {
  // Whether every node surely lies on bisectors alone, and nearer to the site than `ratio` times the nearest of their
  // vertices; then it does so as it will be placed, too.
  //
  // Complexity: O(nodes).
  // Errors:     none; false where it is not sure.
  { cell.KeepsRatio(ratio) } -> std::same_as<bool>;

  // Whether some vertex in `cube` could still cut the cell: whether some node x has dist(x, cube) <= |x - site|,
  // decided generously where rounding leaves a doubt.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  // Source:     [HT08] §6 with the polytope in the place of the ball: |x p|^2 - |x site|^2 is affine in x for fixed p,
  //             so its least value over the cell is at a node.
  { cell.Reaches(cube) } -> std::same_as<bool>;

  // Whether the last cut has made the cell larger than it may be (kMostNodes, kMostPlanes).
  { cell.IsTooLarge() } -> std::same_as<bool>;

  // Puts into `star` a simplex for each node that lies on bisectors alone.
  //
  // Complexity: O(nodes); no allocation once warm.
  // Errors:     none.
  { cell.FindStar(star) } -> std::same_as<void>;

  // The faces of the box that a node of the cell lies on.
  { cell.FacesOf(node) } -> std::same_as<FaceMask>;

  { cell.site() } -> std::same_as<const Point<D>&>;
  // At least the squared distance from the site to the farthest node: little more after Tighten() or Place().
  { cell.reach_sq() } -> std::same_as<double>;
  // A vertex whose computed squared distance from the site is larger than this cannot cut the cell.
  { cell.CutLimitSq() } -> std::same_as<double>;
  // REQUIRES:   the state is `rough` or `placed`.
  { cell.nodes() } -> std::same_as<std::span<const CellNode<D>>>;
  // By index from 0 to plane_count(); the first 2 D are the walls, by FaceIndex. A plane stays in the list when no node
  // is left on it.
  { cell.plane(index) } -> std::same_as<const Plane<D>&>;
  { cell.plane_count() } -> std::same_as<int>;
  // How many vertices have cut something off since Reset.
  { cell.cuts() } -> std::same_as<uint64_t>;
  // How many nodes were decided on exactly since Reset.
  { cell.counters() } -> std::same_as<const DecisionCounters&>;
  // The memory of the cell, roughly, but for itself.
  { cell.MemoryBytes() } -> std::same_as<uint64_t>;
};

// A class of cells in D dimensions.
template <typename C, int D>
concept CellClass = std::default_initializable<C> && CellToRead<C, D> &&
    requires(C& cell, const Point<D>& point, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds,
             TieRule rule, VertexId vertex, std::span<const Point<D>> points, const VertexNames& names, double ratio) {
  // Begins with the box `bounds`, which holds the site `point` and whose faces are of kind `kinds[FaceIndex]`. `rule`
  // decides ties: nodes that lie exactly on a bisector.
  //
  // Complexity: O(2^D); no allocation once warm.
  // Errors:     none.
  { cell.Reset(point, bounds, kinds, rule) } -> std::same_as<void>;

  // Cuts the cell by the bisector of its site and `vertex`, which is at `point`, keeping the site's side, and places
  // the nodes. Returns whether anything was cut off.
  //
  // REQUIRES:   the vertex is not the site, and not one that was cut by before; !IsTooLarge().
  // Guarantees: (1) the result is a subset of the cell; (2) exact: the nodes are those of the exact cell under the tie
  //             rule.
  // Complexity: O(nodes); no allocation once warm.
  // Errors:     none.
  // Source:     the cell as a simple polytope is usual since Tanemura, Ogawa and Ogita 1983.
  { cell.Cut(vertex, point) } -> std::same_as<bool>;

  // Cuts like Cut where more cuts may follow: the nodes are not placed.
  { cell.CutBeforePlace(vertex, point) } -> std::same_as<bool>;

  // Cuts so by the vertices at `points`, called `names`, as many as a leaf holds at most; the nearest first, since far
  // ones then seldom cut. The cell's own, `vertex`, may be among them. Returns how many others are within reach. Ends
  // early once IsTooLarge().
  //
  // REQUIRES:   points and listed names may be read so many together, beyond the last perhaps, as those of a leaf
  //             (VertexPool::kReadTogether).
  // Complexity: O(points nodes), and the cuts; no allocation once warm.
  // Errors:     none.
  { cell.CutByEach(points, names, vertex) } -> std::same_as<size_t>;

  // Computes the result of nodes() from the planes of each node alone, so that it does not depend on the order of the
  // cuts. Nothing is left to do if the cell is placed.
  //
  // Complexity: O(nodes); in 3-D O(nodes log nodes) with more than 64 planes. No allocation once warm.
  // Errors:     none.
  { cell.Place() } -> std::same_as<void>;

  // Returns KeepsRatio(ratio), and places nothing if that holds. Else it places the nodes of which it does not surely
  // hold; the others may keep the place that they had while cut, where it holds of them, too.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  { cell.PlaceUnlessKeeps(ratio) } -> std::same_as<bool>;

  // Lowers the bound reach_sq() to the nodes that the last cut has left.
  //
  // Complexity: O(nodes).
  // Errors:     none.
  { cell.Tighten() } -> std::same_as<void>;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_CELL_CLASS_H_
