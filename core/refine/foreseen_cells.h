// Cells that several threads compute together before the refinement, which looks at one after the other, asks for them.
#ifndef WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_
#define WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/base/thread_team.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/voronoi/polytope.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// A clipped cell, and what is known of it.
template <int D>
struct Look {
  Polytope<D>* cell = nullptr;
  const Assessment* found = nullptr;          // null if that is still to be found
  std::span<const VertexId> neighbours = {};  // all that the cell has, if it has been found good
};

// Clipped cells of vertices that are about to be looked at. They stay of use while vertices are added: a cell that is taken is first cut by those added since it was computed, which makes it
// the cell of now. So what the refinement does with a cell, one after the other, does not depend on the threads.
//
// Thread safety: thread-compatible.
// Invariants: since the first Compute the structure has only had vertices added.
template <int D>
class ForeseenCells {
 public:
  // So many vertices are worth the waking of threads, and so many are computed together at most.
  static constexpr size_t kLeast = 8;
  static constexpr size_t kMost = D == 2 ? 64 : D == 3 ? 32 : 16;

  // Assesses the cell of the i-th vertex. Several threads call it at once.
  using Judge = std::function<Assessment(size_t i, Polytope<D>& cell)>;

  ForeseenCells(const QueryStructure<D>& structure, ThreadTeam& team) : structure_(structure), team_(team) {}

  int threads() const { return team_.threads(); }

  // Computes the cells of `vertices`, clipped by cubes of half side `clip`.
  //
  // REQUIRES:   vertices distinct, at most kMost.
  // Complexity: that of the cells, shared by the threads.
  // Errors:     none; once `context` is cancelled the cells that are not yet begun are left out.
  void Compute(std::span<const VertexId> vertices, double clip, const Judge& judge, const RunContext& context);

  // Whether cells clipped so are left, and not so many vertices were added since that they are sooner computed anew.
  bool Has(double clip) const;

  // The cell of `v` as it is now, the caller's until the next Compute, with what was found of it if it is still as it was;
  // no cell if it is not left.
  //
  // Complexity: O(kMost + vertices added since).
  // Errors:     none.
  Look<D> Take(VertexId v, double clip);

  // What all this takes in memory, roughly.
  uint64_t MemoryBytes() const;
  QueryCounters counters() const;

 private:
  // After so many insertions a cell is sooner computed anew.
  static constexpr uint32_t kMostInsertions = 1024;

  struct Foreseen {
    Polytope<D> cell;
    Assessment found;
    double cut_limit_sq = 0;           // of the cell, beside what else is read of one that stays as it is
    std::vector<VertexId> neighbours;  // of a good cell
  };

  // What only one thread writes, so that it stays in the caches of its core. Arrays only grow, so that polytopes are reused.
  struct alignas(64) Own {
    Workspace<D> workspace;
    std::vector<std::unique_ptr<Foreseen>> cells;
    size_t count = 0;  // of cells, since the last Compute
  };

  Foreseen* ComputeOne(VertexId v, size_t i, const Judge& judge, const RunContext& context);
  bool CutByNew(VertexId v, Foreseen& foreseen) const;

  const QueryStructure<D>& structure_;
  ThreadTeam& team_;
  double clip_ = 0;
  uint32_t vertex_count_ = 0;        // of the structure when the cells were computed
  std::vector<VertexId> vertices_;   // whose cells; none once taken
  std::vector<Foreseen*> foreseen_;  // by vertex; null if left out
  size_t left_ = 0;                  // to be taken
  std::vector<Own> own_;             // by thread
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_
