// One thread for small work that is due now or soon and has no place in a reaction of gRPC.
#ifndef WELLSPACE_SERVER_JOBS_BACKGROUND_H_
#define WELLSPACE_SERVER_JOBS_BACKGROUND_H_

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/time/time.h"

namespace wellspace::server {

// Runs tasks one after the other, in the order in which they are due, those due at once in the order of Post.
//
// Thread safety: thread-safe. Tasks run without any lock held and may post.
class Background {
 public:
  Background();
  ~Background() { Stop(); }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  // Runs `task` as soon as its turn has come, or not before `delay` has passed. Tasks must not throw.
  void Post(std::function<void()> task) { PostAfter(absl::ZeroDuration(), std::move(task)); }
  void PostAfter(absl::Duration delay, std::function<void()> task);

  // Waits for the task that runs. The others, and those that are posted from now on, do not run any more.
  void Stop();

 private:
  using Clock = std::chrono::steady_clock;

  void Run();

  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::multimap<Clock::time_point, std::function<void()>> tasks_;
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_BACKGROUND_H_
