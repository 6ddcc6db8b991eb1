// Proof, after the fact, that a Voronoi cell is as the paper claims: no larger and no smaller. For tests, and
// for users of the structure alone.
#ifndef WELLSPACE_CORE_VORONOI_CERTIFICATE_H_
#define WELLSPACE_CORE_VORONOI_CERTIFICATE_H_

#include <span>

#include "absl/status/status.h"
#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A cell from any source, perhaps wrong.
template <int D>
struct CellView {
  CellView(const Point<D>& at, std::span<const CellNode<D>> all_nodes, std::span<const Plane<D>> all_planes)
      : site(at), nodes(all_nodes), planes(all_planes) {}
  // Valid until the cell changes.
  CellView(const Polytope<D>& cell)  // NOLINT(google-explicit-constructor): a cell is a view of itself
      : site(cell.site()), nodes(cell.nodes()), planes(&cell.plane(0), static_cast<size_t>(cell.plane_count())) {}

  Point<D> site;
  std::span<const CellNode<D>> nodes;
  std::span<const Plane<D>> planes;
};

// Proves that `cell` is the Voronoi cell of `v` among the vertices of `structure`, in its box, clipped by the cube of
// half side `radius` about v: the promise of QueryStructure::ClippedVoronoi. Vertices that were added since may have
// cut it, too. Decided in integers, on the planes' sources; coordinates of nodes are only compared with the results.
// Neither the tree, nor the scan, nor the predicate that cut the cell take part.
//
// OK means, with P the exact cell:
//
//   (1) the cell is no larger ([HT08] §3: "a point x in the cell ...; the open ball centered at x with radius |vx| is
//       empty of any mesh vertices"): each node, the point where its planes meet, lies in the box and the cube, and its
//       open ball through v holds no vertex, for all vertices. For a fixed vertex p, |xp|^2 - |xv|^2 is affine in x,
//       so what holds at the nodes holds for every point of their convex hull: the hull is part of P.
//   (2) the cell is no smaller ("for all x on the boundary, either x is equidistant to v and another vertex, or x is at
//       the clipping distance"): every plane is the bisector of v and a vertex, a face of the box or a side of the
//       clip, and the normal cones of the nodes cover all directions, once. For a direction in the cone of node x, x is
//       farthest among all points that keep x's D planes, so among those of P: hull and P have the same extent
//       in every direction and are equal, and every point of the boundary is on one of the planes. That the cones
//       cover: a node has D planes with independent normals; it has one neighbour a plane, which shares the others and
//       has in its place one whose normal is on the other side of theirs; so beyond each facet of a cone lies
//       another, every direction is in equally many cones, and for one direction it is counted. Hence the graph is
//       closed, connected, and that of a simple polytope.
//   (3) the numbers are right: each x and radius_sq is within its slack of the exact node, each reach is at least the
//       exact distance, and each plane's normal, offset and length are those of its source.
//
// REQUIRES:   nothing of `cell`.
// Complexity: O(vertices + near vertices * nodes + nodes * D^3) operations on doubles and on integers of D + 2 times
//             the bits that the coordinates span; near are the vertices within twice the farthest node.
// Errors:     INVALID_ARGUMENT if `v` is no vertex or `radius` is not positive and finite; FAILED_PRECONDITION that
//             names the first violation (plane, node, vertex).
// Threads:    thread-safe, as everything here.
// Source:     [HT08] §3. Complete simplicial fans are usual in the theory of polytopes: G. M. Ziegler, Lectures on
//             Polytopes, 1995, §7.
template <int D>
absl::Status CertifyCell(const QueryStructure<D>& structure, VertexId v, double radius, const CellView<D>& cell);

// The same of the whole cell, inside walls one longest side of the box beyond it: QueryStructure::Voronoi promises that
// for one cell. How it breaks ties (which of the simple polytopes that are equal as sets it is) is not looked at.
template <int D>
absl::Status CertifyWholeCell(const QueryStructure<D>& structure, VertexId v, const CellView<D>& cell);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VORONOI_CERTIFICATE_H_
