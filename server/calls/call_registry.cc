#include "server/calls/call_registry.h"

#include <chrono>
#include <utility>
#include <vector>

namespace wellspace::server {

CallRegistry::Admission CallRegistry::Add(std::function<void()> abort) {
  std::lock_guard lock(mutex_);
  const uint64_t id = next_id_++;
  calls_.emplace(id, std::move(abort));
  return Admission{.id = id, .admitted = !closed_};
}

void CallRegistry::Remove(uint64_t id) {
  std::lock_guard lock(mutex_);
  calls_.erase(id);
  if (calls_.empty()) {
    empty_.notify_all();
  }
}

void CallRegistry::Close() {
  std::lock_guard lock(mutex_);
  closed_ = true;
}

void CallRegistry::AbortAll() {
  std::vector<std::function<void()>> aborts;
  {
    std::lock_guard lock(mutex_);
    for (const auto& [id, abort] : calls_) {
      aborts.push_back(abort);
    }
  }
  for (const std::function<void()>& abort : aborts) {
    abort();
  }
}

bool CallRegistry::WaitUntilEmpty(absl::Duration timeout) {
  const auto deadline = std::chrono::steady_clock::now() + absl::ToChronoNanoseconds(timeout);
  std::unique_lock lock(mutex_);
  return empty_.wait_until(lock, deadline, [this] { return calls_.empty(); });
}

}  // namespace wellspace::server
