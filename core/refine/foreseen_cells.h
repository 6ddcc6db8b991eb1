// Cells that other threads compute before the refinement, which looks at one after the other, asks for them.
#ifndef WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_
#define WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cache_lines.h"
#include "core/base/ids.h"
#include "core/base/run_context.h"
#include "core/base/thread_team.h"
#include "core/geometry/point.h"
#include "core/refine/assessment.h"
#include "core/voronoi/polytope.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The place of `v` among a few different vertices, their number if it is none of them: all are compared, in vectors, which takes less time
// than to stop at the right one.
inline size_t PlaceAmong(std::span<const VertexId> vertices, VertexId v) {
  const auto count = static_cast<uint32_t>(vertices.size());
  uint32_t place_and_one = 0;
  for (uint32_t i = 0; i < count; ++i) {
    place_and_one |= vertices[i] == v ? i + 1 : 0;
  }
  return place_and_one == 0 ? count : place_and_one - 1;
}

// A clipped cell, and what is known of it.
template <int D>
struct Look {
  Polytope<D>* cell = nullptr;
  const Assessment* found = nullptr;  // null if that is still to be found
  const Star<D>* star = nullptr;      // if the cell has been found good
};

// Clipped cells of vertices that are about to be looked at: those that are there to be taken, and those that come, which
// other threads compute meanwhile. They stay of use while vertices are added: a cell that is taken is first cut by those
// added since it was begun, which makes it the cell of now. So what the refinement does with a cell, one after the other,
// does not depend on the threads.
//
// Thread safety: thread-compatible.
// Invariants: (1) since the first Begin the structure has only had vertices added; (2) while IsRunning() they wait.
template <int D>
class ForeseenCells {
 public:
  // So many vertices are worth the waking of threads, and so many are computed together at most.
  static constexpr size_t kLeast = 8;
  static constexpr size_t kMost = D == 2 ? 64 : D == 3 ? 32 : 16;

  // Assesses a cell. Several threads call it at once.
  using Judge = std::function<Assessment(VertexId v, Polytope<D>& cell)>;

  ForeseenCells(const QueryStructure<D>& structure, ThreadTeam& team) : structure_(structure), team_(team) {}
  ~ForeseenCells() { Drop(); }

  int threads() const { return team_.threads(); }

  // Begins to compute the cells of `vertices`, clipped by cubes of half side `clip`, in the place of those that come.
  //
  // REQUIRES:   !IsRunning(); no vertex waits; vertices distinct, at most kMost.
  // Complexity: that of the cells, shared by the threads.
  // Errors:     none; once `context` is cancelled the cells that are not yet begun are left out.
  void Begin(std::span<const VertexId> vertices, double clip, Judge judge, const RunContext& context);

  // Whether other threads may be at work.
  bool IsRunning() const { return is_running_; }
  // Helps them, and returns when all that comes has been computed.
  void Finish();
  // Has them stop, and nothing come.
  void Drop() noexcept;

  // Makes what comes what may be taken, in the place of what is left of that.
  //
  // REQUIRES:   !IsRunning().
  void Advance();

  // Whether the cell of any vertex comes, clipped so; whether that of `v` does. Not if so many vertices were added since that
  // they are sooner computed anew.
  bool SomeCome(double clip) const { return IsFresh(coming(), clip); }
  bool Comes(VertexId v, double clip) const { return SomeCome(clip) && coming().Holds(v); }
  // Whether the cell of `v` may be taken, clipped so.
  bool IsReady(VertexId v, double clip) const { return IsFresh(ready(), clip) && ready().Holds(v); }

  // The cell of `v` as it is now, the caller's until the next Advance, with what was found of it if it is still as it was;
  // no cell if it may not be taken, or is too large.
  //
  // Complexity: O(kMost + vertices added since).
  // Errors:     none.
  Look<D> Take(VertexId v, double clip);

  // What all this takes in memory, roughly, and as of a few batches ago.
  uint64_t MemoryBytes() const { return memory_bytes_; }
  // What its queries have cost.
  //
  // REQUIRES:   !IsRunning().
  QueryCounters counters() const;

 private:
  // After so many insertions a cell is sooner computed anew.
  static constexpr uint32_t kMostInsertions = 1024;
  // Memory is counted once in so many batches: that reads what other threads have written.
  static constexpr uint64_t kBatchesBetweenCounts = 8;

  struct Foreseen {
    Polytope<D> cell;
    Assessment found;
    double cut_limit_sq = 0;  // of the cell, beside what else is read of one that stays as it is
    Star<D> star;             // of a good cell
  };

  struct Batch {
    void Clear() {
      vertices.clear();
      left = 0;
    }
    bool Holds(VertexId v) const { return PlaceAmong(vertices, v) != vertices.size(); }

    double clip = 0;
    uint32_t vertex_count = 0;        // of the structure when it was begun
    std::vector<VertexId> vertices;   // whose cells; none once taken
    std::vector<Foreseen*> foreseen;  // by vertex; null if left out
    size_t left = 0;                  // to be taken
  };

  // What only one thread writes, so that it stays in the caches of its core. Arrays only grow, so that polytopes are reused.
  struct alignas(kCacheLines) Own {
    struct Pool {
      std::vector<std::unique_ptr<Foreseen>> cells;
      size_t count = 0;  // of cells that are in use
    };
    Workspace<D> workspace;
    std::array<Pool, 2> pools;  // by batch
  };

  const Batch& ready() const { return batches_[ready_]; }
  const Batch& coming() const { return batches_[1 - ready_]; }
  bool IsFresh(const Batch& batch, double clip) const;
  Foreseen* ComputeOne(VertexId v, double clip, size_t batch);
  void CountMemory();
  bool CutByNew(VertexId v, uint32_t first_new, Foreseen& foreseen) const;

  const QueryStructure<D>& structure_;
  ThreadTeam& team_;
  Judge judge_;
  const RunContext* context_ = nullptr;
  std::array<Batch, 2> batches_;
  size_t ready_ = 0;  // which of them
  bool is_running_ = false;
  uint64_t batches_ended_ = 0;
  uint64_t memory_bytes_ = 0;
  std::vector<Own> own_;  // by thread
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_FORESEEN_CELLS_H_
