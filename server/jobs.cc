#include "server/jobs.h"

#include <algorithm>

namespace wellspace::server {

JobPool::JobPool(int workers, int max_queued) : capacity_(static_cast<size_t>(workers) + max_queued) {
  workers_.reserve(workers);
  for (int i = 0; i < workers; ++i) {
    workers_.emplace_back([this] { RunWorker(); });
  }
}

JobPool::~JobPool() {
  std::deque<std::shared_ptr<Job>> dropped;
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
    dropped.swap(queue_);
    for (const std::shared_ptr<Job>& job : running_) {
      job->context_.Cancel();
    }
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) {
    worker.join();
  }
  for (const std::shared_ptr<Job>& job : dropped) {
    job->context_.Cancel();
    job->work_ = nullptr;
  }
}

std::shared_ptr<Job> JobPool::Submit(Job::Work work) {
  auto job = std::make_shared<Job>(std::move(work));
  {
    std::lock_guard lock(mutex_);
    if (stopping_ || queue_.size() + running_.size() >= capacity_) {
      return nullptr;
    }
    queue_.push_back(job);
  }
  wake_.notify_one();
  return job;
}

void JobPool::Cancel(const std::shared_ptr<Job>& job) {
  job->context_.Cancel();
  Job::Work dropped;  // freed without the lock: it may hold much
  std::lock_guard lock(mutex_);
  const auto waiting = std::find(queue_.begin(), queue_.end(), job);
  if (waiting != queue_.end()) {
    dropped = std::exchange(job->work_, nullptr);
    queue_.erase(waiting);
  }
}

JobPool::Load JobPool::GetLoad() const {
  std::lock_guard lock(mutex_);
  return Load{.running = static_cast<int>(running_.size()), .queued = static_cast<int>(queue_.size())};
}

void JobPool::RunWorker() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (stopping_) {
      return;
    }
    std::shared_ptr<Job> job = std::move(queue_.front());
    queue_.pop_front();
    running_.insert(job);
    Job::Work work = std::exchange(job->work_, nullptr);
    lock.unlock();
    work(job->context_);
    work = nullptr;
    lock.lock();
    running_.erase(job);
  }
}

}  // namespace wellspace::server
