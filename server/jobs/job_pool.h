// The workers that run jobs, and the queue before them.
#ifndef WELLSPACE_SERVER_JOBS_JOB_POOL_H_
#define WELLSPACE_SERVER_JOBS_JOB_POOL_H_

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/jobs/fair_queue.h"
#include "server/jobs/job.h"
#include "server/jobs/memory_budget.h"
#include "server/jobs/run_by.h"

namespace wellspace::server {

// A fixed number of jobs that run at once, and a bounded queue of others that wait for it.
//
// The queue is a FairQueue: tenants take turns. A job that waits for memory is skipped FairQueue::kMaxSkips times; then
// it is starved, and none but small jobs are started before it.
//
// Small jobs wait for no large ones: where all workers are taken, `small_workers` more run them alone. A small job has
// a place of its own in the queue, whatever else is in it, and asks for memory without waiting for a starved job.
//
// A run reserves its tree first. The bytes that it asks for then are expected to be all that it needs. Memory that jobs
// need which wait with their trees is given to no other tree (RoomForTree in server/jobs/memory_admission.h). A job
// that has its tree goes on as soon as the rest fits, first of its tenant or not. If all jobs wait for the trees of
// one another all the same, one is refused (VictimOfDeadlock).
//
// Where idle sessions can give up memory (MemoryBudget::MakeRoom), the thread of a job that waits has them do so.
//
// A job that is to run alone (JobRequest::is_alone) waits for the end of all jobs that have begun, and all others for
// its own.
//
// Thread safety: thread-safe. Work runs without any lock of the pool held.
// Invariants: (1) at most `workers` jobs run, and `max_queued` more are in the queue; with small workers as many run
//             besides, and as many small jobs are taken; of either kind `max_per_tenant` of one tenant; (2) the work of
//             a job runs at most once, and never after Cancel found it in the queue; (3) the work and all that it holds
//             is freed when it returns or is cancelled, not when its Job is; (4) there are at most as many threads as
//             workers of both kinds, and one for each job that waits for memory, at most `workers` of a tenant.
class JobPool {
 public:
  struct Limits {
    int workers = 1;                    // at least 1
    int max_queued = 0;                 // at least 0
    int max_per_tenant = 1;             // at least 1
    int small_workers = 0;              // at least 0; 0: small jobs are as others
    RunBy run_by = RunBy::kOwnThreads;  // kCaller: where memory is not limited
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

  // Told how much processor time a job of `tenant` has taken; by its thread, without a lock.
  using OnTime = std::function<void(const std::string& tenant, absl::Duration time)>;

  // REQUIRES:   `memory` outlives this.
  JobPool(const Limits& limits, MemoryBudget& memory, OnTime on_time = nullptr);
  // Cancels all jobs and waits for the running ones.
  ~JobPool();
  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // Takes a job into the queue. Its work may begin, and end, before this returns.
  //
  // Errors:     QUEUE_FULL; QUOTA_EXCEEDED when the tenant has as many jobs as it may have.
  absl::StatusOr<std::shared_ptr<Job>> Submit(JobRequest request);

  // Cancels the context of `job`; one in the queue that has not begun leaves it at once. Does not wait for one that
  // runs.
  void Cancel(const std::shared_ptr<Job>& job);

  // With RunBy::kCaller: runs the job that a worker would run now. False: there is none. A job may call it, and runs
  // beside the other then.
  bool RunNext();

  // Jobs that would begin at once.
  struct Room {
    int jobs = 0;
    std::vector<std::string> full_tenants;  // that have as many jobs of a kind as they may have
  };
  Room GetRoom() const;

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

  // The implementation of Job::Reserve.
  absl::Status Reserve(Job& job, uint64_t bytes);
  absl::Status MemoryRefusal(uint64_t bytes) const;
  // Lets the thread of `job`, which cannot have its memory now, wait in the queue for it.
  absl::Status WaitInQueue(Job& job, std::unique_lock<std::mutex>& lock);
  // Waits until `job` goes on, and makes room where it is asked to.
  void WaitFor(Job& job, std::unique_lock<std::mutex>& lock);

  // The following want mutex_ to be held.

  // Why `job` cannot be taken; OK if it can.
  absl::Status CheckPlaceFor(const Job& job) const;
  // Starts jobs as long as there are workers for them. To be called when anything has changed.
  void Dispatch();
  // Starts the job whose turn it is, or refuses one where nothing else helps. False when all have to wait.
  bool StartNext();
  // The effect of a starved job, if there is one, on the others: none may start before it, or they go on.
  enum class Starved { kNone, kStarted, kHoldsUp };
  // Starts it, if its memory is there.
  Starved StartStarved(uint64_t room_for_tree);
  // Gives a small worker to the small job whose turn it is, if the memory of one is there.
  bool StartSmall();
  // Resumes the oldest job that waits with its tree and whose memory is there, first of its tenant or not.
  bool StartOneWithATree();
  // Refuses the victim of a deadlock, if there is one.
  bool RefuseVictim();
  // Asks the thread of a job that waits to make room: the starved one, or the oldest. Not while another does, and only
  // where idle sessions may have memory. Says whether one does now.
  bool AskForRoom();
  // The bytes that have to become free for `job` to have those that it waits for; 0: it waits for no memory.
  uint64_t RoomFor(const Job& job) const;
  // Whether `queued` needs nothing but a worker; where it waits for memory that is there, it has it then.
  bool Admit(const QueuedJob& queued, uint64_t room_for_tree);
  // Takes `job` out of the queue and gives it a worker, a small one or another.
  void Start(Job& job, bool small_worker = false);
  // How many run on workers of the kind that `job` has.
  int& RunningLike(const Job& job) { return job.has_small_worker_ ? running_small_ : running_; }
  // Gives its worker back to a job that waited.
  void Resume(Job& job);
  // See memory_admission.h.
  uint64_t GetRoomForTree() const;
  void AddToQueue(const std::shared_ptr<Job>& job);
  // Takes a job out of the queue that is not started.
  void RemoveFromQueue(const Job& job);
  void EndOf(Job& job);
  size_t Workers() const { return static_cast<size_t>(limits_.workers) + limits_.small_workers; }
  bool HasSurplusThread() const { return threads_.size() - blocked_ > Workers(); }
  void StartThread();

  void RunWorker(std::list<std::thread>::iterator self);
  // Runs the first job of started_, with mutex_ held but for its work.
  void RunFirst(std::unique_lock<std::mutex>& lock);

  const Limits limits_;
  MemoryBudget& memory_;
  const OnTime on_time_;  // may be null
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_. Jobs are by their sequence. Where a job is, and what counts it, by its state:
  //
  //   state                     in                 counted in
  //   kQueued                   queue_, queued_
  //   kRunning, no thread yet   started_           running_ or running_small_, by has_small_worker_
  //   kRunning                  begun_             the same
  //   kWaiting (for memory)     queue_, queued_,   blocked_
  //                             and begun_
  //   kDone                     none
  //
  // jobs_of_ and small_jobs_ count it from Submit to kDone.
  uint64_t next_sequence_ = 0;
  FairQueue queue_;
  std::map<uint64_t, std::shared_ptr<Job>> queued_;  // those in queue_
  std::map<std::string, Share> jobs_of_;             // by tenant, in the queue or running; none is empty
  std::deque<std::shared_ptr<Job>> started_;         // wait for their thread to wake
  std::map<uint64_t, std::shared_ptr<Job>> begun_;   // have a thread: they run, or wait for memory
  std::set<uint64_t> alone_;                         // the jobs that run alone, from Submit to kDone
  int running_ = 0;                                  // have a worker: started_, and begun_ that do not wait
  int running_small_ = 0;                            // have a small worker
  int small_jobs_ = 0;                               // in the queue or running
  Counters counters_;
  std::condition_variable idle_;
  bool stopping_ = false;
  std::list<std::thread> threads_;
  std::list<std::thread> ended_threads_;  // to be joined
  size_t blocked_ = 0;                    // threads whose job waits for memory
  bool is_making_room_ = false;           // one of these, now
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_JOB_POOL_H_
