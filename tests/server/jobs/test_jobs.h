// Jobs that work as a test wants.
#ifndef WELLSPACE_TESTS_SERVER_JOBS_TEST_JOBS_H_
#define WELLSPACE_TESTS_SERVER_JOBS_TEST_JOBS_H_

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "gtest/gtest.h"
#include "server/base/options.h"
#include "server/jobs/job_pool.h"
#include "server/jobs/memory_budget.h"
#include "tests/server/service_harness.h"

namespace wellspace::server {

inline void WorkUntilCancelled(Job& job) {
  while (!job.context().IsCancelled()) {
    std::this_thread::yield();
  }
}

// A pool, and submitting without ceremony: null when refused.
class Pool {
 public:
  Pool(int workers, int max_queued, int max_per_tenant = 1000, uint64_t max_memory_bytes = 0)
      : memory(max_memory_bytes),
        pool({.workers = workers, .max_queued = max_queued, .max_per_tenant = max_per_tenant}, memory) {}

  std::shared_ptr<Job> Submit(Job::Work work, const std::string& tenant = "default") {
    return pool.Submit({.tenant = tenant, .work = std::move(work)}).value_or(nullptr);
  }
  void Cancel(const std::shared_ptr<Job>& job) { pool.Cancel(job); }
  JobPool::Load GetLoad() const { return pool.GetLoad(); }

  MemoryBudget memory;
  JobPool pool;
};

inline constexpr uint64_t kMegabyte = uint64_t{1} << 20;
// A budget of 100 MB.
inline constexpr uint64_t kMaxMemory = kProcessMemoryBytes + 100 * kMegabyte;

// Waits until so many jobs are in the queue.
inline void WaitForQueued(const Pool& pool, int count) {
  while (pool.GetLoad().queued != count) {
    std::this_thread::yield();
  }
}

// A job that, once the test lets it, reserves memory and keeps it until the test lets it end.
struct Needy {
  explicit Needy(uint64_t wanted) : bytes(wanted) {}

  Job::Work Work() {
    return [this](Job& job) {
      began.Set();
      status = job.context().ReserveMemory(bytes);
      reserved.Set();
      if (status.ok()) {
        EXPECT_TRUE(may_end.Wait());
      }
      ended.Set();
    };
  }

  const uint64_t bytes;
  absl::Status status;
  Event began;
  Event reserved;
  Event may_end;
  Event ended;
};

// A job with a tree, which then, once the test lets it, wants memory for its mesh, and ends.
struct WithTree {
  WithTree(uint64_t tree, uint64_t mesh) : tree_bytes(tree), mesh_bytes(mesh) {}

  Job::Work Work() {
    return [this](Job& job) {
      tree_status = job.context().ReserveMemory(tree_bytes);
      has_tree.Set();
      EXPECT_TRUE(may_go_on.Wait());
      mesh_status = job.context().ReserveMemory(mesh_bytes);
      ended.Set();
    };
  }

  const uint64_t tree_bytes;
  const uint64_t mesh_bytes;
  absl::Status tree_status;
  absl::Status mesh_status;
  Event has_tree;
  Event may_go_on;
  Event ended;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_JOBS_TEST_JOBS_H_
