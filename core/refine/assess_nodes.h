// The loop over the nodes of a cell: which is to be repaired first. In a box Assess runs it, in the plane PlaneRules.
#ifndef WELLSPACE_CORE_REFINE_ASSESS_NODES_H_
#define WELLSPACE_CORE_REFINE_ASSESS_NODES_H_

#include <algorithm>
#include <cstddef>

#include "core/cell/polytope.h"
#include "core/refine/assessment.h"

namespace wellspace::core {

// The verdict of the walls of a cell, faces of the box or segments, on a node. It asks for nothing with the default.
template <typename Rank>
struct NodeVerdict {
  double bound_sq = Assessment::kNone;  // the squared distance from the site that it exceeds; kNone: it exceeds none
  bool is_size = false;                 // the bound is one of the sizes, not of rho
  bool is_at_own_wall = false;          // it belongs to the boundary where the site is, and is only remembered
  int plane = -1;                       // of the bisector with its nearest generator, if it is on one
  Rank rank{};                          // of nodes with one bound the one of the largest rank comes first
};

// Assesses the nodes of `cell` by look(node), the NodeVerdict of each; look may note more in the result. Each
// node has a bound of its own; its edge is bound / rho. Only nodes of edges up to `edge_limit_sq` are to be repaired.
//
// Complexity: O(nodes), and look.
// Errors:     none.
// Source:     [HT08] Figure 4, lines 8 and 11.
template <int D, typename Look>
void AssessNodes(const Polytope<D>& cell, double rho_sq, double edge_limit_sq, Look look, Assessment& result) {
  decltype(look(cell.nodes()[0]).rank) first{};
  for (size_t i = 0; i < cell.nodes().size(); ++i) {
    const auto verdict = look(cell.nodes()[i]);
    if (verdict.bound_sq == Assessment::kNone) {
      continue;
    }
    if (verdict.is_at_own_wall) {
      result.own_boundary_edge_sq = std::min(result.own_boundary_edge_sq, verdict.bound_sq / rho_sq);
    } else if (verdict.bound_sq > rho_sq * edge_limit_sq) {
      result.next_edge_sq = std::min(result.next_edge_sq, verdict.bound_sq / rho_sq);
    } else if (verdict.bound_sq < result.bound_sq || (verdict.bound_sq == result.bound_sq && first < verdict.rank)) {
      first = verdict.rank;
      result.bound_sq = verdict.bound_sq;
      result.bad_node = static_cast<int>(i);
      result.bad_plane = verdict.plane;
      result.is_too_large = verdict.is_size;
    }
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_ASSESS_NODES_H_
