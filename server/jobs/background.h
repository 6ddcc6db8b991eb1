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
#include "server/jobs/run_by.h"

namespace wellspace::server {

// Runs tasks one after the other, in the order in which they are due, those due at once in the order of Post.
//
// Thread safety: thread-safe. Tasks run without any lock held and may post.
class Background {
 public:
  explicit Background(RunBy run_by = RunBy::kOwnThreads);
  ~Background() { Stop(); }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  // Runs `task` as soon as its turn has come, or not before `delay` has passed. Tasks must not throw.
  void Post(std::function<void()> task) { PostAfter(absl::ZeroDuration(), std::move(task)); }
  void PostAfter(absl::Duration delay, std::function<void()> task);

  // With RunBy::kCaller, where no time passes but in Pass: runs the first task that is due. False: there is none.
  bool RunDue();
  // As if `time` passed: tasks that are due within it run.
  void Pass(absl::Duration time);

  // Waits for the task that runs. The others, and those that are posted from now on, do not run any more.
  void Stop();

 private:
  using Clock = std::chrono::steady_clock;

  void Run();
  Clock::time_point Now() const { return run_by_ == RunBy::kCaller ? passed_ : Clock::now(); }
  // Runs the first task, with mutex_ held but for the task.
  void RunFirst(std::unique_lock<std::mutex>& lock);

  const RunBy run_by_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::multimap<Clock::time_point, std::function<void()>> tasks_;
  bool stopping_ = false;
  Clock::time_point passed_;  // with RunBy::kCaller: its time

  std::thread thread_;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_BACKGROUND_H_
