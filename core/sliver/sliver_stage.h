// The slivers of a refined mesh, between refinement and output: repaired by moves and new vertices, or pumped away.
#ifndef WELLSPACE_CORE_SLIVER_SLIVER_STAGE_H_
#define WELLSPACE_CORE_SLIVER_SLIVER_STAGE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/refine/refine.h"
#include "core/simplex/simplices.h"
#include "core/simplex/slot_rows.h"
#include "core/sliver/known_cosines.h"
#include "core/sliver/moved_vertices.h"
#include "core/sliver/repair.h"
#include "core/sliver/triangulation.h"
#include "core/sliver/vertex_carrier.h"
#include "core/sliver/worst_shapes.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// The figures of a stage, over its life.
struct SliverStatistics {
  uint64_t slivers = 0;       // that Repair found
  uint64_t slivers_left = 0;  // by the last Repair
  // Of `slivers_left`: see RepairReport.
  std::array<uint64_t, kSliverReasons> left_by{};
  std::vector<LeftSliver> flattest_left;
  uint64_t operations = 0;      // of Repair
  uint64_t measured = 0;        // tetrahedra, to find slivers and the worst shapes
  bool slivers_wanted = false;  // whether a mesh was to be repaired or pumped
  uint64_t moves = 0;
  uint64_t added = 0;
  uint64_t weighted = 0;                // vertices with a weight in the last mesh
  std::optional<double> min_angle_deg;  // before the first Repair; none: there was no triangulation yet
  QueryCounters star_queries;           // of the triangulation
  double star_seconds = 0;              // for them
  double seconds = 0;                   // for all the rest
};

struct WeightedSimplices {
  Simplices simplices;
  HugeVector<double> weights;  // by output index, in the structure's unit; empty where all are zero
};

// Keeps the Delaunay triangulation of a structure while its mesh is repaired, and adds vertices that come to the
// structure in between. D >= 3.
//
// Thread safety: thread-compatible.
// Invariants: the triangulation, if there is one, is that of the structure's first vertices, where they are.
template <int D>
class SliverStage {
 public:
  // Repairs the slivers, and tells structure and refinement of the changes, on an error too. `carrier` says where
  // vertices may go: the carrier of the domain that is refined. Vertices that move are noted in `moved`. 3-D.
  //
  // REQUIRES:   the structure is refined for criteria.criteria; is_fixed has an entry for each of its vertices.
  // Complexity: O(m) the first time, in a domain with surfaces each time; then O(1) for each vertex added since and
  //             each sliver.
  // Errors:     RESOURCE_EXHAUSTED (max_vertices, memory of the context), CANCELLED, DEADLINE_EXCEEDED; all stays
  //             usable.
  // Threads:    uses `threads` for the stars that the triangulation is made of.
  template <typename Domain, VertexCarrier Carrier>
  absl::Status Repair(QueryStructure<3>& structure, Refinement<Domain>& refinement, Carrier& carrier,
                      std::vector<bool>& is_fixed, const RepairCriteria& criteria, MovedVertices& moved, int threads,
                      RunContext& context) requires(D == 3 && Domain::kDimension == 3);

  // The simplices of the repaired mesh; with `pump`, of its regular triangulation under pumped weights. Order and form
  // of the simplices are independent of the number of threads.
  //
  // Shapes:     output_index: as for ComputeSimplices.
  // REQUIRES:   no vertex has been added since Repair; or `pump`.
  // Complexity: O(m).
  // Errors:     RESOURCE_EXHAUSTED (memory of the context), CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<WeightedSimplices> ToSimplices(const QueryStructure<D>& structure, const StarLists<D>& stars,
                                                std::span<const uint32_t> output_index, bool pump, int threads,
                                                RunContext& context);

  // The changes that bring the simplices of the last ToSimplices without `pump`, or of the last Update, up to date;
  // none if they are too many. Until it succeeds, ToSimplices has to be called.
  //
  // Shapes:     as for ToSimplices.
  // REQUIRES:   the last ToSimplices or Update has succeeded, without `pump`, and the triangulation has lasted since;
  //             3-D.
  // Guarantees: (1) they give what ToSimplices would give, in its order.
  // Complexity: O(change), and a step for each 2048 simplices.
  // Errors:     CANCELLED, DEADLINE_EXCEEDED.
  absl::StatusOr<std::optional<SimplexChanges>> Update(std::span<const uint32_t> output_index,
                                                       RunContext& context) requires(D == 3);

  // Peak memory of the stage, beside the structure and a mesh. Unit: bytes.
  static uint64_t EstimateBytes(uint64_t vertices, uint64_t simplices) {
    return vertices * sizeof(Point<D>) + Triangulation<D>::BuildBytes(vertices, simplices);
  }

  // Memory of the stage. Unit: bytes.
  uint64_t MemoryBytes() const {
    return triangulation_.has_value()
               ? triangulation_->MemoryBytes() + cosines_.MemoryBytes() + rows_.MemoryBytes() + shapes_.MemoryBytes()
               : 0;
  }
  bool HasTriangulation() const { return triangulation_.has_value(); }
  // Drops the triangulation, and the slivers that were left. To be called when the structure changes without Repair.
  void Forget() {
    triangulation_.reset();
    cosines_ = {};
    statistics_.slivers_left = 0;
    statistics_.left_by = {};
    statistics_.flattest_left.clear();
  }
  const SliverStatistics& statistics() const { return statistics_; }

 private:
  absl::Status FollowStructure(const QueryStructure<D>& structure, const StarLists<D>& stars, int threads,
                               RunContext& context);
  absl::StatusOr<Triangulation<D>> Triangulate(const QueryStructure<D>& structure, const StarLists<D>& stars,
                                               int threads, RunContext& context);

  std::optional<Triangulation<D>> triangulation_;
  KnownCosines cosines_;  // of its simplices
  // Of the simplices of the last mesh.
  SlotRows rows_;
  WorstShapes shapes_;
  SliverStatistics statistics_;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_SLIVER_STAGE_H_
