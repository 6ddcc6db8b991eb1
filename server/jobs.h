// The workers that mesh, and the queue before them.
#ifndef WELLSPACE_SERVER_JOBS_H_
#define WELLSPACE_SERVER_JOBS_H_

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/base/run_context.h"

namespace wellspace::server {

// A piece of work for a JobPool, and the context by which it is watched and cancelled.
class Job {
 public:
  using Work = std::function<void(core::RunContext&)>;

  explicit Job(Work work) : work_(std::move(work)) {}

  const core::RunContext& context() const { return context_; }

 private:
  friend class JobPool;

  core::RunContext context_;
  Work work_;  // empty once taken by a worker or cancelled
};

// A fixed number of worker threads and a bounded first-in first-out queue.
//
// Thread safety: thread-safe. Work runs without any lock of the pool held.
// Invariants: (1) at most `workers` jobs run and at most `max_queued` more wait; (2) the work of a job runs at most once, and never
// after Cancel found it waiting; (3) the work and all that it holds is freed when it returns or is cancelled, not when its Job is.
class JobPool {
 public:
  struct Load {
    int running = 0;
    int queued = 0;
  };

  // REQUIRES:   workers >= 1 && max_queued >= 0.
  JobPool(int workers, int max_queued);
  // Cancels all jobs and waits for those that run.
  ~JobPool();
  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // Queues `work`, which must return soon after its context is cancelled and must not throw. Null when the queue is full.
  std::shared_ptr<Job> Submit(Job::Work work);

  // Cancels the context of `job`; one that waits leaves the queue at once. Does not wait for one that runs.
  void Cancel(const std::shared_ptr<Job>& job);

  Load GetLoad() const;

 private:
  void RunWorker();

  const size_t capacity_;  // jobs that run or wait
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::deque<std::shared_ptr<Job>> queue_;
  std::unordered_set<std::shared_ptr<Job>> running_;
  bool stopping_ = false;

  std::vector<std::thread> workers_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_H_
