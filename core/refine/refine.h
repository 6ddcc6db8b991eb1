// Bottom-up refinement: Steiner points until every simplex meets the criteria.
#ifndef WELLSPACE_CORE_REFINE_REFINE_H_
#define WELLSPACE_CORE_REFINE_REFINE_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/refine/box_domain.h"
#include "core/refine/cell_steps.h"
#include "core/refine/criteria.h"
#include "core/refine/insertion.h"
#include "core/refine/pending_vertices.h"
#include "core/refine/refinement_checks.h"
#include "core/refine/speculation/recorded_steps.h"
#include "core/refine/speculation/rounds.h"
#include "core/refine/star_writer.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"
#include "core/voronoi/star_lists.h"

namespace wellspace::core {

class ThreadTeam;

// RESOURCE_EXHAUSTED for a refinement that does not end with `max_vertices`.
absl::Status TooManyVerticesError(uint64_t max_vertices);

// Called after each insertion with the structure as it is then; for tests.
template <int D>
using RefinementObserver = std::function<void(const QueryStructure<D>&, const Insertion&)>;

// Predicts with how many vertices the refinement will end; 0 if that is not worth the time. Called at most once in a
// run, maybe by another thread, while vertices are only read.
using VertexPredictor = std::function<absl::StatusOr<uint64_t>()>;

// The refinement of one structure in a domain, which may be run again: after an error, after vertices were added, for
// other criteria. Domains are BoxDomain<D>, PlaneDomain and SpaceDomain; see box_domain.h. Built with WELLSPACE_CHECKS
// it asserts at each insertion the promises of docs/design/guarantees.md, as far as they can be seen nearby, and
// aborts with the figures.
//
// The parts: vertices to be looked at (PendingVertices), the faults of a cell and its requests (the domain's
// Steps, by its Rules), the loop (here), and the work of threads ahead of it (Rounds).
//
// Thread safety: thread-compatible.
// Invariants: (1) every vertex is pending, or its cell meets the criteria of the last run, for as long as no vertex is
//             added that VertexAdded is not told of.
template <typename Domain>
class Refinement {
  static_assert(RefinedDomain<Domain>);

 public:
  static constexpr int D = Domain::kDimension;

  // No vertex is added nearer than `min_edge` to another. The meshed part of `domain` takes the place of the box.
  //
  // REQUIRES:   the structure, and the object behind the handle `domain`, outlive this; they have the same
  //             vertices.
  explicit Refinement(QueryStructure<D>& structure, double min_edge, Domain domain = Domain());
  Refinement(const Refinement&) = delete;
  Refinement& operator=(const Refinement&) = delete;

  // Adds vertices until (1) no Delaunay simplex of the box breaks the criteria, and (2) no Voronoi cell touches a face
  // of the box that its vertex does not lie on. By (2) the Delaunay triangulation decomposes exactly the box. Ties are
  // perturbed, as they are for the simplices.
  //
  // REQUIRES:   rho at least MinimumRho(D).
  // Guarantees: (1) bottom-up, [HT08] Definition 1: the vertex whose cell is looked at has an edge shorter, up to the
  //             ratio of a bucket, than all that are pending; (2) deterministic: the vertices and the lists of
  //             simplices are the same to the bit for any number of threads, and however often the run was stopped.
  // Complexity: O(m) queries for m vertices in the end; when run again for the same criteria, in proportion to the
  //             vertices added since and to the insertions that these make necessary.
  // Errors:     RESOURCE_EXHAUSTED with the bound that was met, one of the context's memory too; CANCELLED,
  //             DEADLINE_EXCEEDED; those of `predict`. All stays usable: a later run takes up the work where it was
  //             left.
  // Threads:    uses `threads`, at most as many as the machine has cores, to speculate on the next vertices (ADR 23).
  // Source:     [HT08] Figure 4; see docs/design/refine.md.
  absl::Status Run(const MeshCriteria<D>& criteria, uint64_t max_vertices, int threads, RunContext& context,
                   const RefinementObserver<D>& observer = nullptr, const VertexPredictor& predict = nullptr);

  // Tells of the vertex `x`, which has been added to the structure from outside since the last run.
  //
  // Complexity: O(1) in a refined structure.
  void VertexAdded(VertexId x);

  // Tells that the cell of `v`, which may be new, has changed, but meets the criteria of the last run; if v is on a
  // face of the box, `nearest_sq` is at most the squared distance to its nearest neighbour. The memo of the
  // cell is forgotten: an insertion nearby has v looked at again in any case that could matter. Simplices are no longer
  // listed.
  //
  // REQUIRES:   the last run came to its end; every vertex whose neighbours have changed is told of.
  // Complexity: O(1), except for the first after a run for other criteria.
  void CellChanged(VertexId v, double nearest_sq);

  // Has the next run look at all vertices again: the demands of its domain have changed.
  void ForgetRun() { pending_.End(); }

  // The simplices at all vertices, when the last run came to its end, unless a cell has changed otherwise since the
  // first run for these criteria.
  const StarLists<D>& stars() const { return stars_.lists(); }

  // Forgets the simplices; none are listed until all vertices are scheduled again.
  void DropStars() { stars_.GiveUp(); }

  // The speculation of threads in all runs.
  const SpeculationCounts& speculation() const { return rounds_.counts(); }

  // The cost of all queries.
  QueryCounters counters() const;

  // The memory of the refinement beside the structure.
  uint64_t MemoryBytes() const;

 private:
  // An image of a vertex that is inserted, and a vertex near it.
  struct Image {
    SteinerPoint<D> point;
    VertexId near = kNoVertex;
    [[no_unique_address]] typename Domain::Place place;
  };

  // The cells of all vertices that have been added, for CellSteps.
  struct CurrentCells {
    void ComputeOwn(VertexId v, const Box<D>& clip, Workspace<D>& workspace) {
      refinement.ComputeCell(v, clip, workspace);
    }
    const Polytope<D>* ComputeOther(VertexId u, const Box<D>& clip, Workspace<D>& workspace) {
      refinement.ComputeCell(u, clip, workspace);
      workspace.cell.Place();
      return workspace.cell.IsTooLarge() ? nullptr : &workspace.cell;
    }

    Refinement& refinement;
  };

  absl::Status ScheduleAll(const MeshCriteria<D>& criteria, const VertexPredictor& predict, ThreadTeam& team);
  absl::Status Predict(const VertexPredictor& predict);
  void Reserve(uint32_t vertices);
  absl::Status Loop();
  absl::Status RefineShorterThan(int bucket);
  absl::Status RefineInRounds();
  absl::Status RefineBatch(Batch<Domain>& batch);
  absl::Status RefineNextOf(Batch<Domain>& batch);
  bool IsNextStillValid(const Batch<Domain>& batch) const;
  absl::Status RefineTaken(VertexId v, int bucket);
  absl::Status RefineByCell(VertexId v, int bucket);
  template <typename Steps>
  absl::StatusOr<bool> RefineVertex(VertexId v, int bucket, Steps& steps);
  template <typename Steps>
  void Finish(VertexId v, const Assessment& found, int bucket, Steps& steps);
  absl::StatusOr<VertexId> Insert(const typename Domain::Request& request);
  void FindImages(const typename Domain::Request& request);
  absl::Status CheckPoint(const SteinerPoint<D>& point) const;
  VertexId AddVertex(VertexId near, VertexId beside, const SteinerPoint<D>& point, const typename Domain::Place& place);
  void AddPending(VertexId near, VertexId x, double nearest_sq);
  void ComputeCell(VertexId v, const Box<D>& clip, Workspace<D>& workspace);
  absl::Status CountRefined();
  double EdgeLimitSq(int bucket) const { return pending_.schedule().UpperLengthSq(bucket); }

  QueryStructure<D>& structure_;
  const double min_edge_;
  [[no_unique_address]] Domain domain_;
  PendingVertices<D> pending_;
  StarWriter<D> stars_;  // of vertices that are done, or have been
  Rounds<Domain> rounds_;
  StepWorkspace<D> workspace_;
  std::vector<Image> images_;  // of the vertex that was inserted last

  // State of the last run.
  std::optional<StepRules<D>> step_rules_;
  std::optional<typename Domain::Rules> rules_;  // which refer to these
  uint64_t max_vertices_ = 0;
  uint64_t refined_ = 0;           // how often a vertex has been refined, in all runs
  RunContext* context_ = nullptr;  // valid until the run ends, as is the next
  const RefinementObserver<D>* observer_ = nullptr;

  RefinementChecks<D> checks_;  // used in the checking build alone
};

// The refinement of a cloud.
template <int D>
using BoxRefinement = Refinement<BoxDomain<D>>;

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_REFINE_H_
