// The workers that mesh, and the line before them.
#ifndef WELLSPACE_SERVER_JOBS_JOBS_H_
#define WELLSPACE_SERVER_JOBS_JOBS_H_

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include "core/base/run_context.h"
#include "grpcpp/support/status.h"
#include "server/base/clock.h"
#include "server/jobs/memory_budget.h"

namespace wellspace::server {

class Job;
class JobPool;

// What is to be done, and for whom.
struct JobRequest {
  std::string tenant{};
  // Is expected to end within about a second (server/jobs/job_size.h): need not wait for those that are not.
  bool is_small = false;
  // Of what the work brings along, such as its points; released with the work, at the latest.
  MemoryReservation held{};
  // Has to return soon after the context of its job is cancelled, and must not throw.
  std::function<void(Job&)> work{};
};

// A piece of work for a JobPool, and the context by which it is watched and cancelled. The context's memory is lent by
// the job: a run that reserves memory which is not there gives its worker to another job and waits in line for it.
//
// Thread safety: thread-safe.
class Job final : private core::MemoryLender, public std::enable_shared_from_this<Job> {
 public:
  using Work = std::function<void(Job&)>;

  core::RunContext& context() { return context_; }
  const core::RunContext& context() const { return context_; }
  const std::string& tenant() const { return tenant_; }

  // Cancels the context, and what runs apart from it. For one in line, JobPool::Cancel does more.
  void Cancel();

  // The following are for the work alone.

  // Runs `run` with a context of its own, which is cancelled with that of the job and has the same lender: what the
  // work needs first, and whose progress is not the job's.
  absl::Status RunApart(const std::function<absl::Status(core::RunContext&)>& run);

  // Releases what the request brought along, once the work has let go of it.
  void ReleaseHeld();

  // Hands in what is reserved for what the run goes on with, such as its mesher: it counts as reserved by the run.
  //
  // REQUIRES:   the run has reserved nothing yet.
  void GiveMemory(MemoryReservation memory);

  // Hands over `bytes`, or all, of what the run has reserved: for what outlives the job.
  MemoryReservation TakeMemory(uint64_t bytes);

 private:
  friend class JobPool;

  Job(JobPool& pool, JobRequest request);

  // As MemoryLender has them. Errors: CANCELLED; those of MemoryBudget::Reserve, when the bytes are more than all of
  // the budget, more than sessions leave of it, or, for Allow, more than can be had now; and when all jobs wait for
  // what others of them have.
  absl::Status Reserve(uint64_t bytes) override;
  absl::Status Allow(uint64_t bytes) override;

  // What would be freed if it ended.
  uint64_t PassingBytes() const;
  // What its run has reserved.
  uint64_t RunBytes() const;
  void ReleaseAll();

  JobPool& pool_;
  const std::string tenant_;
  const bool is_small_;
  const absl::Duration submitted_ = SinceBoot();
  core::RunContext context_;

  std::mutex apart_mutex_;             // after the pool's
  core::RunContext* apart_ = nullptr;  // guarded by apart_mutex_; of RunApart, while it runs

  mutable std::mutex memory_mutex_;  // after the pool's
  MemoryReservation held_;           // guarded by memory_mutex_
  MemoryReservation memory_;         // guarded by memory_mutex_

  enum class State { kQueued, kRunning, kWaiting, kDone };

  // Guarded by the pool's mutex.
  State state_ = State::kQueued;
  bool has_small_worker_ = false;  // while kRunning
  uint64_t sequence_ = 0;
  Work work_;                     // empty once taken by a worker or cancelled
  uint64_t wanted_bytes_ = 0;     // while kWaiting
  bool has_all_ = false;          // its run was given more than its tree: it is expected to end with that
  int passed_over_ = 0;           // jobs that were started while this one, first of its tenant, waited for memory
  bool is_refused_ = false;       // its next Reserve fails
  std::condition_variable wake_;  // of the thread that waits
};

// A fixed number of jobs that run at once, and a bounded line of others that wait for it.
//
// Small jobs wait for no large ones: where all workers are taken, `small_workers` more run them alone. Among small jobs
// tenants take turns, and within a tenant who came first is first; those that are not small are passed. A small job has
// a place of its own in the line, whatever else is in it, and asks for memory without waiting for those that were
// passed.
//
// The line is fair: tenants take turns, and within a tenant who came first is first. A job that waits for memory keeps
// its place; those of its tenant stay behind it, those of others may pass, but only kMostPassing times.
//
// What a run reserves first is its tree, what it then asks for is expected to be all that it needs. No tree is begun
// with what those that wait with theirs need; and one whose rest fits goes on, first of its tenant or not. When all
// wait for the trees of one another all the same, the youngest is refused.
//
// Thread safety: thread-safe. Work runs without any lock of the pool held.
// Invariants: (1) at most `workers` jobs run and at most `max_queued` more are in line; with small workers as many run
// besides, and as many small jobs are taken besides; of either kind `max_per_tenant` of one tenant; (2) the work of a
// job runs at most once, and never after Cancel found it in line; (3) the work and all that it holds is freed when it
// returns or is cancelled, not when its Job is; (4) there are at most as many threads as workers of both kinds and one
// for each job that waits for memory, which are at most `workers` of a tenant.
class JobPool {
 public:
  static constexpr int kMostPassing = 16;

  struct Limits {
    int workers = 1;         // at least 1
    int max_queued = 0;      // at least 0
    int max_per_tenant = 1;  // at least 1
    int small_workers = 0;   // at least 0; 0: small jobs are as others
  };

  struct Load {
    int running = 0;
    int queued = 0;  // for a worker or for memory
  };

  // Of all jobs of a kind that were begun.
  struct Begun {
    uint64_t jobs = 0;
    absl::Duration waited = absl::ZeroDuration();  // all together, from Submit on
    absl::Duration longest = absl::ZeroDuration();
  };
  struct Counters {
    Begun small;
    Begun others;
  };

  struct Submission {
    std::shared_ptr<Job> job;  // null if refused
    grpc::Status refusal;      // QUEUE_FULL, or QUOTA_EXCEEDED when the tenant has as many jobs as it may have
  };

  // REQUIRES:   `memory` outlives this.
  JobPool(const Limits& limits, MemoryBudget& memory);
  // Cancels all jobs and waits for those that run.
  ~JobPool();
  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // Takes a job into the line.
  Submission Submit(JobRequest request);

  // Cancels the context of `job`; one in line that has not begun leaves it at once. Does not wait for one that runs.
  void Cancel(const std::shared_ptr<Job>& job);

  Load GetLoad() const;
  Counters GetCounters() const;

  // Waits until no job runs or waits, but not longer than `timeout`; says whether none does.
  bool WaitUntilIdle(absl::Duration timeout);

 private:
  friend class Job;

  // How many jobs a tenant has.
  struct Share {
    int small = 0;
    int others = 0;
  };
  static int& PartOf(Share& share, const Job& job) { return job.is_small_ ? share.small : share.others; }

  // One tenant's jobs in line, in the order of their sequence.
  using Line = std::deque<std::shared_ptr<Job>>;

  // What Job::Reserve does.
  absl::Status Reserve(Job& job, uint64_t bytes);
  // Lets the thread of `job`, which cannot have its memory now, wait in line for it.
  absl::Status WaitInLine(Job& job, std::unique_lock<std::mutex>& lock);

  // The following want mutex_ to be held.

  // Starts jobs as long as there are workers for them. To be called when anything has changed.
  void Dispatch();
  // Starts the job whose turn it is, or refuses one where nothing else helps. False when all have to wait.
  bool StartNext();
  // Gives a small worker to the small job whose turn it is, if there is one whose memory is there.
  bool StartSmall();
  // Starts or resumes the first job of `tenant`, unless it waits for memory that is not there.
  bool StartFirstOf(const std::string& tenant, uint64_t room_for_tree);
  // Resumes the oldest that waits with its tree and whose memory is there, first of its tenant or not.
  bool StartOneWithATree();
  // Takes `job` out of the line and gives it a worker, a small one or another.
  void Start(const std::shared_ptr<Job>& job, bool small_worker = false);
  // How many run on workers of the kind that `job` has.
  int& RunningLike(const Job& job) { return job.has_small_worker_ ? running_small_ : running_; }
  // Whether there is a place in the line.
  bool HasPlaceFor(const Job& job) const;
  // Gives its worker back to a job that waited.
  void Resume(Job& job);
  // Sets aside what `job` wants; says whether there was room.
  bool TakeWanted(Job& job, uint64_t room_for_tree);
  // Most that a tree may take, for good, so that those that wait with theirs can go on one after the other. No bound if
  // they could not even when all that run had ended. O(b log b) for b jobs that have begun.
  uint64_t RoomForTree() const;
  // A job was given a worker: those that wait for memory have been passed.
  void CountPassing();
  // The job that has been passed often enough, the oldest of them; null for none.
  std::shared_ptr<Job> Claimant() const;
  // If all memory that work could free is that of jobs in line, the youngest of them that waits with memory, or the
  // youngest if none does; null otherwise.
  std::shared_ptr<Job> VictimOfDeadlock() const;
  void Enter(const std::shared_ptr<Job>& job);
  void Leave(const Job& job);
  void EndOf(Job& job);
  size_t InLine() const;
  size_t Workers() const { return static_cast<size_t>(limits_.workers) + limits_.small_workers; }
  bool HasSurplusThread() const { return threads_.size() - blocked_ > Workers(); }
  void StartThread();

  void RunWorker(std::list<std::thread>::iterator self);

  const Limits limits_;
  MemoryBudget& memory_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  uint64_t next_sequence_ = 0;
  std::map<std::string, Line> lines_;               // none is empty
  std::list<std::string> turns_;                    // of lines_, who is next first
  std::map<std::string, Share> jobs_of_;            // by tenant, in line or running; none is empty
  std::deque<std::shared_ptr<Job>> started_;        // wait for their thread to wake
  std::map<uint64_t, std::shared_ptr<Job>> begun_;  // by sequence_; have a thread: they run, or wait for memory
  int running_ = 0;                                 // have a worker: started_, and begun_ that do not wait
  int running_small_ = 0;                           // the same on small workers
  int small_jobs_ = 0;                              // in line or running
  Counters counters_;
  std::condition_variable idle_;
  bool stopping_ = false;
  std::list<std::thread> threads_;
  std::list<std::thread> ended_threads_;  // to be joined
  size_t blocked_ = 0;                    // threads whose job waits for memory
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_JOBS_H_
