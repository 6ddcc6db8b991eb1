// The whole cells of the vertices that were last asked for. Private to core/refine/space.
#ifndef WELLSPACE_CORE_REFINE_SPACE_WHOLE_CELLS_H_
#define WELLSPACE_CORE_REFINE_SPACE_WHOLE_CELLS_H_

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "core/base/ids.h"
#include "core/cell/polytope.h"
#include "core/geometry/point.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// New vertices near a surface ask for the cells of the same few vertices again and again. A cell that is kept is cut by
// the vertices that have been added since, which leaves the one that a query would compute, to the bit, but for the
// numbers of its nodes and planes.
//
// Thread safety: thread-compatible.
class WholeCells {
 public:
  // The cell of `v` in the box, ties perturbed, its nodes placed; valid until the next call.
  //
  // REQUIRES:   it is asked for cells of one structure, to which vertices are added meanwhile, but none is moved; no
  //             vertex is uncommitted.
  // Complexity: that of a cell, or of looking at the vertices that have been added since, kMostSince at most.
  const Polytope<3>& CellOf(VertexId v, const QueryStructure<3>& structure, Workspace<3>& workspace) {
    const auto known = std::find_if(kept_.begin(), kept_.end(), [v](const Kept& one) { return one.vertex == v; });
    Kept& kept =
        known != kept_.end() ? *known : *std::min_element(kept_.begin(), kept_.end(), [](const Kept& a, const Kept& b) {
          return a.asked < b.asked;
        });
    if (known == kept_.end() || !CutBySince(structure, kept)) {
      structure.UnplacedClippedVoronoi(v, structure.box(), workspace);
      std::swap(kept.cell, workspace.cell);
      kept.vertex = v;
    }
    kept.seen = structure.vertex_count();
    kept.asked = ++asked_;
    kept.cell.Place();
    return kept.cell;
  }

 private:
  static constexpr uint32_t kMostSince = 1024;

  struct Kept {
    VertexId vertex = kNoVertex;
    uint32_t seen = 0;   // by vertices below this it has been cut
    uint64_t asked = 0;  // when it was asked for
    Polytope<3> cell;
  };

  // Cuts a cell by the vertices that it has not been cut by; false if it is rather to be computed.
  static bool CutBySince(const QueryStructure<3>& structure, Kept& kept) {
    if (structure.vertex_count() - kept.seen > kMostSince) {
      return false;
    }
    for (uint32_t u = kept.seen; u < structure.vertex_count() && !kept.cell.IsTooLarge(); ++u) {
      const Point<3>& p = structure.point(VertexId{u});
      if (DistanceSq<3>(p, kept.cell.site()) <= kept.cell.CutLimitSq()) {
        kept.cell.CutBeforePlace(VertexId{u}, p);
      }
    }
    return !kept.cell.IsTooLarge();
  }

  std::array<Kept, 32> kept_;
  uint64_t asked_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPACE_WHOLE_CELLS_H_
