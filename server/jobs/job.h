// A piece of work, the context by which it is watched and cancelled, and its memory.
#ifndef WELLSPACE_SERVER_JOBS_JOB_H_
#define WELLSPACE_SERVER_JOBS_JOB_H_

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "core/base/run_context.h"
#include "server/base/clock.h"
#include "server/jobs/memory_admission.h"
#include "server/jobs/memory_budget.h"

namespace wellspace::server {

class Job;
class JobPool;

// The work of a job, and its tenant.
struct JobRequest {
  std::string tenant{};
  // Is expected to end within about a second (server/jobs/job_size.h): it need not wait for jobs that are not small.
  bool is_small = false;
  // No other job runs beside it, and none begins before it: should it end the process, it is to take no other with it.
  bool is_alone = false;
  // The memory of data that the work brings along, such as its points; released with the work.
  MemoryReservation held{};
  // The bytes that the call which waits for the job has reserved, for longer than the work.
  uint64_t of_call = 0;
  // Has to return soon after the context of its job is cancelled, and must not throw.
  std::function<void(Job&)> work{};
};

// A piece of work for a JobPool, and the context by which it is watched and cancelled. The context's memory is lent by
// the job: a run that reserves memory which is not there gives its worker to another job, and waits in the queue.
//
// Thread safety: thread-safe.
class Job final : private core::MemoryLender, public std::enable_shared_from_this<Job> {
 public:
  using Work = std::function<void(Job&)>;

  core::RunContext& context() { return context_; }
  const core::RunContext& context() const { return context_; }
  const std::string& tenant() const { return tenant_; }

  // Cancels the context, and what runs apart from it. For a job in the queue, JobPool::Cancel does more.
  void Cancel();

  // The following are for the work alone.

  // Runs `run` with a context of its own, which is cancelled with the job's and has the same lender. For what the work
  // needs first: its progress is not the job's.
  absl::Status RunApart(const std::function<absl::Status(core::RunContext&)>& run);

  // The processor time of the work, on all its threads, since it began or was last asked. What is asked for here is not
  // told to the pool's OnTime.
  absl::Duration TakeProcessorTime();

  // Hands in the memory of objects that the run goes on with, such as its mesher: it counts as reserved by the run.
  //
  // REQUIRES:   the run has reserved nothing yet.
  void GiveMemory(MemoryReservation memory);

  // Hands over `bytes`, or all, of the memory of the run: for objects that outlive the job.
  MemoryReservation TakeMemory(uint64_t bytes);

 private:
  friend class JobPool;

  enum class State { kQueued, kRunning, kWaiting, kDone };

  Job(JobPool& pool, JobRequest request);

  // As MemoryLender has them. Errors: CANCELLED; those of MemoryBudget::Reserve, when the bytes are more than all of
  // the budget, more than sessions leave of it, or, for Allow, more than can be had now; and when all jobs wait for
  // memory that others of them have.
  absl::Status Reserve(uint64_t bytes) override;
  absl::Status Allow(uint64_t bytes) override;

  // Whether it has got the memory that the job waits for: if it is free, and, for a tree, at most `room_for_tree`.
  // Wants the pool's mutex to be held.
  bool TakeWanted(uint64_t room_for_tree);
  // The figures of its memory. Wants the pool's mutex to be held.
  JobMemory GetMemory() const;
  // The bytes of the run's memory that a session keeps, whatever others want.
  uint64_t KeptBytes() const;
  // Has the run have `bytes`, if there is room. Else false, and `*missing` is how many there are none of.
  bool TryToAllow(uint64_t bytes, uint64_t* missing);
  // Gives back the run's memory above `bytes`; false, and nothing is changed, if it has less.
  bool ShrinkTo(uint64_t bytes);
  void ReleaseAll();

  JobPool& pool_;
  const std::string tenant_;
  const bool is_small_;
  const bool is_alone_;
  const uint64_t of_call_;
  const absl::Duration submitted_ = SinceBoot();
  absl::Duration time_taken_until_ = absl::ZeroDuration();  // of the thread of the work
  core::RunContext context_;

  std::mutex apart_mutex_;             // after the pool's
  core::RunContext* apart_ = nullptr;  // guarded by apart_mutex_; of RunApart, while it runs

  mutable std::mutex memory_mutex_;  // after the pool's
  MemoryReservation held_;           // guarded by memory_mutex_
  MemoryReservation memory_;         // guarded by memory_mutex_

  // Guarded by the pool's mutex.
  State state_ = State::kQueued;
  bool has_small_worker_ = false;  // while kRunning
  uint64_t sequence_ = 0;
  Work work_;                     // empty once taken by a worker or cancelled
  uint64_t wanted_bytes_ = 0;     // while kWaiting
  bool has_all_ = false;          // its run was given more than its tree: it is expected to end with that
  bool is_refused_ = false;       // its next Reserve fails
  bool is_to_make_room_ = false;  // while kWaiting: its thread has idle sessions give up memory
  std::condition_variable wake_;  // of the thread that waits
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_JOB_H_
