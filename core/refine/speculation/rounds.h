// A bucket's vertices in rounds: while one round is refined, threads speculate on the vertices of the next. ADR 23.
#ifndef WELLSPACE_CORE_REFINE_SPECULATION_ROUNDS_H_
#define WELLSPACE_CORE_REFINE_SPECULATION_ROUNDS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/memory/huge_pages.h"
#include "core/base/run_context.h"
#include "core/base/thread_team.h"
#include "core/geometry/point.h"
#include "core/refine/cell_steps.h"
#include "core/refine/pending_vertices.h"
#include "core/refine/speculation/batch.h"
#include "core/refine/star_writer.h"
#include "core/refine/step_rules.h"
#include "core/voronoi/query_structure.h"

namespace wellspace::core {

// How often a vertex was refined whose batch had been speculated on; and how often by its record, as that was valid.
struct SpeculationCounts {
  uint64_t speculated = 0;
  uint64_t replayed = 0;
};

// A bucket with many vertices is detached from the schedule and cut into strips. A round refines a batch of each
// strip of one half; the next round does so with the other half. To speculate is to record the steps of a batch's
// vertices on a structure that is not changed meanwhile: vertices that are added stay uncommitted until no thread
// speculates any more.
//
// The calling thread alone decides, so that the mesh does not depend on the work of other threads, or on its timing.
//
//   if (rounds.Begin(bucket))
//     while (!rounds.AreDone()) {
//       rounds.BeginRound();
//       while (Batch<Domain>* batch = rounds.NextBatch()) … refine its vertices …
//       rounds.EndRound();
//       rounds.NextRound();
//     }
//
// The state that a call may find, and the state that it leaves; a dash where that stays. A bucket is detached, or none
// is. Others record (IsRecording), or not. Stars are written at once, collected (StarWriter::NeedsStars), or written by
// another thread (StarWriter::IsWriting), which may go on while stars are collected.
//
//   function       before                                   after
//                  detached  recording  stars               detached  recording  stars
//   BeginRun       any       no         at once             -         -          -
//   Begin          none      no         at once, by other   one [1]   -          -
//   ForgetRecords  any       no         at once, by other   -         -          -
//   BeginRound     one       no         at once, by other   -         yes [2]    collected [2], by other
//   NextBatch      one       any        any                 -         -          -
//   AwaitOthers    any       any        any                 -         no         no more by other
//   CommitAdded    any       any        any                 -         no         no more by other
//   EndRound       one       any        any                 -         no         by other [3]
//   NextRound      one       no         at once, by other   one [4]   -          -
//   EndRun         any       no         at once, by other   -         -          at once
//   DropRun        any       any        any                 -         no         no more by other
//   ReattachAll    any       no         at once             none      -          -
//
//   [1] if it returns true
//   [2] with several threads, and unless few records were valid of late; then no other records, and stars are collected
//       only if this round was speculated on
//   [3] if any were collected, else at once
//   [4] none after the last batch
//
// Thread safety: thread-compatible.
// Invariants: (1) while IsRecording, other threads read the structure, and write nothing but the records of the next
//             round's batches.
template <typename Domain>
class Rounds {
 public:
  static constexpr int D = Domain::kDimension;

  // REQUIRES:   all of these outlive this.
  Rounds(QueryStructure<D>& structure, const Domain& domain, PendingVertices<D>& pending, StarWriter<D>& stars)
      : structure_(structure), domain_(domain), pending_(pending), stars_(stars) {}

  // Begins a run, which speculates with the threads of `team`. EndRun or DropRun has to be called before one of these
  // goes; DropRun may be called after EndRun, and does nothing then.
  void BeginRun(const StepRules<D>& rules, ThreadTeam& team, const RunContext& context);
  // Writes the stars that are left, and adds the cost of the queries of other threads to `counters`.
  void EndRun(QueryCounters& counters);
  // Ends a run in which an exception has been thrown.
  void DropRun();

  // Detaches the vertices of `bucket`, the lowest; false if there are too few, and they stay where they are.
  bool Begin(int bucket);
  // Has the detached vertices that have not been refined be pending in their bucket alone.
  void ReattachAll();
  // Whether no vertex is detached any more.
  bool AreDone() const { return batches_.empty(); }
  // The bucket of the detached vertices.
  int bucket() const { return bucket_; }

  // Forgets the records of a run that has been stopped.
  void ForgetRecords();
  // Has other threads speculate on the batches of the next round, unless few records were valid of late. The batches of
  // this round have been speculated on by then.
  void BeginRound();
  // The next batch to be refined; null at the end of the round. Where other threads are at the last of the next round,
  // its first batches come, too.
  Batch<Domain>* NextBatch();
  // Ends the speculation, commits the added vertices, and has another thread write stars.
  void EndRound();
  // Goes on to the next round, with new batches in the place of those that have been refined.
  void NextRound();

  // Begins to refine `batch`.
  void BeginBatch(Batch<Domain>& batch);
  // Asks the memory for the data that refining the next vertices of `batch` reads.
  void Prefetch(const Batch<Domain>& batch) const;
  // Notes that a vertex has been added at `p`.
  void NoteInserted(const Point<D>& p) {
    if (notes_insertions_) {
      inserted_.push_back(p);
    }
  }
  // How many have been noted, and the places from one of them on.
  size_t inserted_count() const { return inserted_.size(); }
  std::span<const Point<D>> InsertedFrom(size_t i) const { return std::span(inserted_).subspan(i); }
  // Counts the record of a vertex of `batch` that is refined, for the decision whether to go on speculating.
  void CountRecord(const Batch<Domain>& batch, bool was_valid) {
    speculated_count_ += batch.records.is_speculated ? 1 : 0;
    valid_count_ += was_valid ? 1 : 0;
    counts_.speculated += batch.records.is_speculated ? 1 : 0;
    counts_.replayed += was_valid ? 1 : 0;
  }
  // The counts of all runs.
  const SpeculationCounts& counts() const { return counts_; }

  // Whether other threads may speculate.
  bool IsRecording() const { return is_recording_; }
  // Returns when other threads have ended the calls that were begun.
  void AwaitOthers();
  // Has queries find all vertices that have been added, once other threads have ended the calls that were begun.
  void CommitAdded();

  // The memory of a round; roughly. Unit: bytes.
  uint64_t MemoryBytes() const { return is_recording_ ? bytes_before_ : CountBytes(); }

 private:
  // The batches of the round, for 0, or of the next one.
  std::span<Batch<Domain>> HalfOf(size_t next) {
    return std::span(batches_).subspan((half_ ^ next) * batches_.size() / 2, batches_.size() / 2);
  }
  void TakeNext(Batch<Domain>& batch);
  void Speculate();
  void Prepare(std::span<Batch<Domain>> batches);
  void RecordPart(Batch<Domain>& batch, size_t part, size_t parts, StepWorkspace<D>& workspace) const;
  void Record(Batch<Domain>& batch, size_t at, StepWorkspace<D>& workspace) const;
  uint64_t CountBytes() const;

  QueryStructure<D>& structure_;
  const Domain& domain_;
  PendingVertices<D>& pending_;
  StarWriter<D>& stars_;

  // State of the detached vertices.
  int bucket_ = -1;
  HugeVector<VertexId> detached_;        // the last of each strip is the next
  std::vector<Batch<Domain>> batches_;   // by strip, the next of each; none if no vertex is detached
  std::vector<Batch<Domain>> finished_;  // of the bucket before, whose stars may still be written
  size_t half_ = 0;                      // whether this round is of the first half of the strips, or of the second
  size_t next_batch_ = 0;                // in this round and the next
  std::vector<Point<D>> inserted_;       // in these rounds, where they are speculated, from inserted_before_ on
  size_t inserted_before_ = 0;
  size_t speculated_count_ = 0;  // of the vertices of the bucket that have been refined, how many had been recorded
  size_t valid_count_ = 0;       // and how many of these records were still valid
  size_t distrusted_size_ = 0;   // of the last bucket where too few were; 0 if none
  SpeculationCounts counts_;

  // State of the run.
  const StepRules<D>* rules_ = nullptr;
  ThreadTeam* team_ = nullptr;  // null between runs
  const RunContext* context_ = nullptr;
  std::vector<StepWorkspace<D>> workspaces_;  // by thread
  bool is_recording_ = false;
  bool notes_insertions_ = false;  // this round has been speculated on, so that insertions may conflict
  uint64_t bytes_before_ = 0;      // of the arrays that other threads write, before they began
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_REFINE_SPECULATION_ROUNDS_H_
