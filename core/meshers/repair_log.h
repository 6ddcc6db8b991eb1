// The log of repair: the vertices of a mesher that it has moved or added, and the given ones, which it may not touch.
#ifndef WELLSPACE_CORE_MESHERS_REPAIR_LOG_H_
#define WELLSPACE_CORE_MESHERS_REPAIR_LOG_H_

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/input/mesh_parameters.h"
#include "core/mesh/mesh.h"
#include "core/refine/refine.h"
#include "core/sliver/sliver_stage.h"

namespace wellspace::core {

// The log of a mesher that repairs slivers, whatever its domain.
//
// Thread safety: thread-compatible.
class RepairLog {
 public:
  // By vertex, the first; the others are not: whether it is an input point or a corner of the box, and never moves.
  std::vector<bool>& is_given() { return is_given_; }

  // Repairs, and notes moved and added vertices, on an error too. `made`: the count of vertices of the last mesh, which
  // do not move if the parameters say so.
  //
  // Errors:     those of SliverStage::Repair.
  template <typename Domain, typename Carrier>
  absl::Status Repair(SliverStage<3>& stage, QueryStructure<3>& structure, Refinement<Domain>& refinement,
                      Carrier& carrier, const RepairCriteria& criteria, const MeshParameters& parameters, uint64_t made,
                      RunContext& context) {
    is_given_.resize(structure.vertex_count(), false);
    moved_.GrowTo(made);
    const uint64_t moves = stage.statistics().moves;
    const uint32_t refined = structure.vertex_count();
    std::vector<bool> kept;
    if (parameters.keep_vertices) {
      kept = is_given_;
      std::fill_n(kept.begin(), made, true);
    }
    const absl::Status status =
        stage.Repair(structure, refinement, carrier, parameters.keep_vertices ? kept : is_given_, criteria, moved_,
                     parameters.threads, context);
    is_given_.resize(structure.vertex_count(), false);
    if (structure.vertex_count() > refined) {
      added_.emplace_back(refined, structure.vertex_count());
    }
    has_moved_ = has_moved_ || stage.statistics().moves > moves;
    context.SetVertices(structure.vertex_count());
    return status;
  }

  // Whether a vertex has moved since the last mesh.
  bool has_moved() const { return has_moved_; }

  // Calls f(v) for the vertices from `from` on that repair has added.
  //
  // Complexity: O(these, and repairs that have added some of them).
  template <typename F>
  void ForEachAdded(uint32_t from, F f) const {
    for (auto range = added_.rbegin(); range != added_.rend() && range->second > from; ++range) {
      for (uint32_t v = std::max(from, range->first); v < range->second; ++v) {
        f(VertexId{v});
      }
    }
  }

  // Returns the vertices of the last mesh that have moved since, ascending, and forgets them: a mesh is made.
  std::vector<VertexId> TakeMoved() {
    has_moved_ = false;
    return moved_.Take();
  }

  uint64_t MemoryBytes() const { return moved_.MemoryBytes(); }

 private:
  std::vector<bool> is_given_;
  MovedVertices moved_;                               // of those of the last mesh: since that
  std::vector<std::pair<uint32_t, uint32_t>> added_;  // by each repair: first, and end
  bool has_moved_ = false;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_MESHERS_REPAIR_LOG_H_
