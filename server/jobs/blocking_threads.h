// Threads for work that waits for the disk: gRPC's threads and the workers have other things to do.
#ifndef WELLSPACE_SERVER_JOBS_BLOCKING_THREADS_H_
#define WELLSPACE_SERVER_JOBS_BLOCKING_THREADS_H_

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace wellspace::server {

// Runs tasks on as many threads as are needed, up to a limit; tasks with the same key one after the other. So a session
// with many changes in line holds one thread, and the others stay for other sessions.
//
// Thread safety: thread-safe. Tasks run without any lock held, may give others, and must not throw.
class BlockingThreads {
 public:
  // `most_threads` 0: tasks run in RunNext alone, and in the destructor. For tests.
  explicit BlockingThreads(size_t most_threads) : most_threads_(most_threads) {}
  // Runs all tasks to their end.
  ~BlockingThreads();
  BlockingThreads(const BlockingThreads&) = delete;
  BlockingThreads& operator=(const BlockingThreads&) = delete;

  // Tasks of one `key` run in the order of these calls; the empty key is none.
  void Run(const std::string& key, std::function<void()> task);

  // Without threads: runs the task whose turn it is. False: there is none.
  bool RunNext();

 private:
  struct Ready {
    std::string key;
    std::function<void()> task;
  };

  void RunThread();
  // Runs the first task that is ready, with mutex_ held but for the task.
  void RunFirst(std::unique_lock<std::mutex>& lock);
  // Wants mutex_ to be held.
  void MakeReady(Ready ready);
  // Starts the task that follows one of `key`. Wants mutex_ to be held.
  void GoOn(const std::string& key);

  const size_t most_threads_;
  std::mutex mutex_;
  std::condition_variable wake_;
  // Guarded by mutex_.
  std::deque<Ready> ready_;
  std::map<std::string, std::deque<std::function<void()>>> waiting_;  // of keys with a task that is ready or runs
  std::vector<std::thread> threads_;
  size_t idle_ = 0;
  bool stopping_ = false;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_JOBS_BLOCKING_THREADS_H_
