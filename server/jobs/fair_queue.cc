#include "server/jobs/fair_queue.h"

#include <utility>

namespace wellspace::server {

void FairQueue::Add(QueuedJob job) {
  Jobs& jobs = tenants_[job.tenant];
  if (jobs.empty()) {
    turns_.push_back(job.tenant);
  }
  const uint64_t sequence = job.sequence;
  jobs.emplace(sequence, Entry{.job = std::move(job)});
  ++size_;
}

void FairQueue::Remove(const std::string& tenant, uint64_t sequence) {
  const auto jobs = tenants_.find(tenant);
  size_ -= jobs->second.erase(sequence);
  if (jobs->second.empty()) {
    turns_.remove(tenant);
    tenants_.erase(jobs);
  }
}

void FairQueue::Start(const std::string& tenant, uint64_t sequence) {
  Remove(tenant, sequence);
  if (tenants_.contains(tenant)) {
    turns_.remove(tenant);
    turns_.push_back(tenant);
  }
}

std::optional<uint64_t> FairQueue::FindFirst(const Admit& admit) const {
  for (const std::string& tenant : turns_) {
    const QueuedJob& first = tenants_.at(tenant).begin()->second.job;
    if (admit(first)) {
      return first.sequence;
    }
  }
  return std::nullopt;
}

std::optional<uint64_t> FairQueue::FindSmall(const Admit& admit) const {
  for (const std::string& tenant : turns_) {
    for (const auto& [sequence, entry] : tenants_.at(tenant)) {
      if (entry.job.is_small && admit(entry.job)) {
        return sequence;
      }
    }
  }
  return std::nullopt;
}

void FairQueue::CountSkips() {
  for (auto& [tenant, jobs] : tenants_) {
    Entry& first = jobs.begin()->second;
    first.skips += first.job.waits_for_memory ? 1 : 0;
  }
}

const QueuedJob* FairQueue::FindStarved() const {
  const QueuedJob* starved = nullptr;
  for (const auto& [tenant, jobs] : tenants_) {
    const Entry& first = jobs.begin()->second;
    if (first.skips >= kMaxSkips && (starved == nullptr || first.job.sequence < starved->sequence)) {
      starved = &first.job;
    }
  }
  return starved;
}

void FairQueue::ForgetSkips(const std::string& tenant, uint64_t sequence) {
  tenants_.at(tenant).at(sequence).skips = 0;
}

}  // namespace wellspace::server
