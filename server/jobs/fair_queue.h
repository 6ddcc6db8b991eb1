// The order of the jobs that wait: tenants take turns.
#ifndef WELLSPACE_SERVER_JOBS_FAIR_QUEUE_H_
#define WELLSPACE_SERVER_JOBS_FAIR_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>

namespace wellspace::server {

// A job in the queue, as far as its place depends on it.
struct QueuedJob {
  uint64_t sequence = 0;  // jobs are numbered in the order of their submission
  std::string tenant{};
  bool is_small = false;
  bool waits_for_memory = false;  // it has begun, and goes on with its memory; others wait for a worker
};

// Jobs that wait for a worker or for memory. The queue knows neither workers nor memory: the caller says of a job
// whether it can start now.
//
// Tenants take turns: a tenant whose job has just been started comes after all others. The jobs of one tenant start in
// the order of their submission. A job that waits for memory keeps its place: jobs of its tenant stay behind it, and
// jobs of others may be started in its place. The job is then skipped, which may happen kMaxSkips times.
//
// Small jobs have an order of their own: among them tenants take the same turns, and jobs that are not small do not
// hold them up.
//
// Thread safety: thread-compatible.
// Invariants: no two jobs have the same sequence.
class FairQueue {
 public:
  static constexpr int kMaxSkips = 16;

  // Whether a job can start now. It may take the memory that the job needs, where that is free: the job then starts.
  using Admit = std::function<bool(const QueuedJob&)>;

  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }

  // Takes `job` to its place: behind the jobs of its tenant that were submitted before it.
  void Add(QueuedJob job);
  // Takes a job out that is not started now. The turns stay as they are.
  //
  // REQUIRES:   there is such a job.
  void Remove(const std::string& tenant, uint64_t sequence);
  // Takes a job out that is started: the next job of its tenant comes after those of others.
  //
  // REQUIRES:   there is such a job.
  void Start(const std::string& tenant, uint64_t sequence);

  // Of the first jobs of each tenant, the first in the order of turns that `admit` admits. It is asked in that order,
  // and no more once it was true.
  std::optional<uint64_t> FindFirst(const Admit& admit) const;
  // As above, of small jobs, whatever they are behind.
  std::optional<uint64_t> FindSmall(const Admit& admit) const;

  // A job was started: each tenant's first job, if it waits for memory, was skipped.
  void CountSkips();
  // The job that was skipped kMaxSkips times, the oldest of them; nothing if there is none. It is the first of its
  // tenant.
  const QueuedJob* FindStarved() const;
  // The job counts as never skipped.
  //
  // REQUIRES:   there is such a job.
  void ForgetSkips(const std::string& tenant, uint64_t sequence);

 private:
  struct Entry {
    QueuedJob job;
    int skips = 0;
  };
  using Jobs = std::map<uint64_t, Entry>;  // of one tenant, by sequence

  std::map<std::string, Jobs> tenants_;  // none is empty
  std::list<std::string> turns_;         // the names of tenants_; the next turn is the first one's
  size_t size_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_FAIR_QUEUE_H_
