#include "server/jobs/background.h"

#include <algorithm>

namespace wellspace::server {

Background::Background(RunBy run_by) : run_by_(run_by) {
  if (run_by == RunBy::kOwnThreads) {
    thread_ = std::thread([this] { Run(); });
  }
}

void Background::Stop() {
  {
    std::lock_guard lock(mutex_);
    if (std::exchange(stopping_, true)) {
      return;
    }
  }
  wake_.notify_one();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Background::PostAfter(absl::Duration delay, std::function<void()> task) {
  {
    std::lock_guard lock(mutex_);
    tasks_.emplace(Now() + absl::ToChronoNanoseconds(delay), std::move(task));
  }
  wake_.notify_one();
}

void Background::Run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (tasks_.empty()) {
      wake_.wait(lock);
    } else if (const Clock::time_point due = tasks_.begin()->first; Clock::now() < due) {
      wake_.wait_until(lock, due);
    } else {
      RunFirst(lock);
    }
  }
}

void Background::RunFirst(std::unique_lock<std::mutex>& lock) {
  std::function<void()> task = std::move(tasks_.begin()->second);
  tasks_.erase(tasks_.begin());
  lock.unlock();
  task();
  task = nullptr;  // its captures are freed without the lock
  lock.lock();
}

bool Background::RunDue() {
  std::unique_lock lock(mutex_);
  if (tasks_.empty() || tasks_.begin()->first > Now()) {
    return false;
  }
  RunFirst(lock);
  return true;
}

void Background::Pass(absl::Duration time) {
  std::unique_lock lock(mutex_);
  const Clock::time_point end = passed_ + absl::ToChronoNanoseconds(time);
  while (!tasks_.empty() && tasks_.begin()->first <= end) {
    passed_ = std::max(passed_, tasks_.begin()->first);
    RunFirst(lock);
  }
  passed_ = end;
}

}  // namespace wellspace::server
