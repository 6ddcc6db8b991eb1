// What a class of cells has to offer, whatever its dimension and however it keeps its nodes.
//
// The folder in the order of reading: cell_parts, meeting_point; then from 4-D on polytope, node_columns, candidates;
// in 2-D and 3-D float_cell, polygon and polyhedron, gathered_vertices, float_candidates.
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

// What may be asked of a cell that does not change.
template <typename C, int D>
concept CellToRead = requires(const C& cell, double ratio, const Box<D>& cube, int index, const CellNode<D>& node,
                              Star<D>& star) {
  { cell.KeepsRatio(ratio) } -> std::same_as<bool>;
  { cell.Reaches(cube) } -> std::same_as<bool>;
  { cell.IsTooLarge() } -> std::same_as<bool>;
  { cell.FindStar(star) } -> std::same_as<void>;
  { cell.FacesOf(node) } -> std::same_as<FaceMask>;
  { cell.site() } -> std::same_as<const Point<D>&>;
  { cell.reach_sq() } -> std::same_as<double>;
  { cell.CutLimitSq() } -> std::same_as<double>;
  { cell.nodes() } -> std::same_as<std::span<const CellNode<D>>>;
  { cell.plane(index) } -> std::same_as<const Plane<D>&>;
  { cell.plane_count() } -> std::same_as<int>;
  { cell.cuts() } -> std::same_as<uint64_t>;
  { cell.counters() } -> std::same_as<const DecisionCounters&>;
  { cell.MemoryBytes() } -> std::same_as<uint64_t>;
};

// A class of cells in D dimensions. What each function promises is said in polytope.h.
template <typename C, int D>
concept CellClass = std::default_initializable<C> && CellToRead<C, D> &&
    requires(C& cell, const Point<D>& point, const Box<D>& bounds, const std::array<PlaneKind, 2 * D>& kinds,
             TieRule rule, VertexId vertex, std::span<const Point<D>> points, const VertexNames& names, double ratio) {
  { cell.Reset(point, bounds, kinds, rule) } -> std::same_as<void>;
  { cell.Cut(vertex, point) } -> std::same_as<bool>;
  { cell.CutBeforePlace(vertex, point) } -> std::same_as<bool>;
  { cell.CutByEach(points, names, vertex) } -> std::same_as<size_t>;
  { cell.Place() } -> std::same_as<void>;
  { cell.PlaceUnlessKeeps(ratio) } -> std::same_as<bool>;
  { cell.Tighten() } -> std::same_as<void>;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_CELL_CLASS_H_
