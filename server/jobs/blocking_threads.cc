#include "server/jobs/blocking_threads.h"

#include <utility>

namespace wellspace::server {

BlockingThreads::~BlockingThreads() {
  while (most_threads_ == 0 && RunNext()) {
  }
  std::vector<std::thread> threads;
  {
    std::unique_lock lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
    wake_.wait(lock, [this] { return ready_.empty() && idle_ == threads_.size(); });
    threads.swap(threads_);
    wake_.notify_all();
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
}

void BlockingThreads::Run(const std::string& key, std::function<void()> task) {
  std::lock_guard lock(mutex_);
  if (!key.empty()) {
    const auto [at, is_first] = waiting_.try_emplace(key);
    if (!is_first) {
      at->second.push_back(std::move(task));
      return;
    }
  }
  MakeReady({.key = key, .task = std::move(task)});
}

void BlockingThreads::MakeReady(Ready ready) {
  ready_.push_back(std::move(ready));
  if (idle_ >= ready_.size()) {
    wake_.notify_one();
  } else if (threads_.size() < most_threads_) {
    threads_.emplace_back([this] { RunThread(); });
  }
}

void BlockingThreads::GoOn(const std::string& key) {
  const auto at = waiting_.find(key);
  if (at == waiting_.end()) {
    return;
  }
  if (at->second.empty()) {
    waiting_.erase(at);
    return;
  }
  std::function<void()> next = std::move(at->second.front());
  at->second.pop_front();
  MakeReady({.key = key, .task = std::move(next)});
}

void BlockingThreads::RunThread() {
  std::unique_lock lock(mutex_);
  while (true) {
    if (ready_.empty()) {
      ++idle_;
      if (stopping_) {
        wake_.notify_all();
      }
      wake_.wait(lock, [this] { return !ready_.empty() || (stopping_ && threads_.empty()); });
      --idle_;
      if (ready_.empty()) {
        return;
      }
    }
    RunFirst(lock);
  }
}

void BlockingThreads::RunFirst(std::unique_lock<std::mutex>& lock) {
  Ready ready = std::move(ready_.front());
  ready_.pop_front();
  lock.unlock();
  ready.task();
  ready.task = nullptr;  // its captures are freed without the lock
  lock.lock();
  if (!ready.key.empty()) {
    GoOn(ready.key);
  }
}

bool BlockingThreads::RunNext() {
  std::unique_lock lock(mutex_);
  if (ready_.empty()) {
    return false;
  }
  RunFirst(lock);
  return true;
}

}  // namespace wellspace::server
