#include "server/jobs/background.h"

namespace wellspace::server {

Background::Background() : thread_([this] { Run(); }) {}

void Background::Stop() {
  {
    std::lock_guard lock(mutex_);
    if (std::exchange(stopping_, true)) {
      return;
    }
  }
  wake_.notify_one();
  thread_.join();
}

void Background::PostAfter(absl::Duration delay, std::function<void()> task) {
  {
    std::lock_guard lock(mutex_);
    tasks_.emplace(Clock::now() + absl::ToChronoNanoseconds(delay), std::move(task));
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
      std::function<void()> task = std::move(tasks_.begin()->second);
      tasks_.erase(tasks_.begin());
      lock.unlock();
      task();
      task = nullptr;  // what it holds is freed without the lock
      lock.lock();
    }
  }
}

}  // namespace wellspace::server
