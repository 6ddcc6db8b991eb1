// A client that asks a server all the time, while others misbehave.
#ifndef WELLSPACE_TESTS_SERVER_OBSERVER_H_
#define WELLSPACE_TESTS_SERVER_OBSERVER_H_

#include <algorithm>
#include <atomic>
#include <thread>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/client.h"

namespace wellspace::server {

// Thread safety: thread-compatible.
class Observer {
 public:
  explicit Observer(client::Client client) : thread_([this, client]() mutable { Run(client); }) {}
  ~Observer() { Stop(); }

  // The longest time that an answer took, or none at all.
  absl::Duration Stop() {
    stop_ = true;
    if (thread_.joinable()) {
      thread_.join();
    }
    return longest_;
  }

 private:
  void Run(client::Client& client) {
    while (!stop_) {
      const absl::Time begin = absl::Now();
      const bool is_served = client.GetServerInfo().ok();
      longest_ = std::max(longest_, is_served ? absl::Now() - begin : absl::InfiniteDuration());
    }
  }

  std::atomic<bool> stop_ = false;
  absl::Duration longest_;
  std::thread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_TESTS_SERVER_OBSERVER_H_
