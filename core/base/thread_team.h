// Loops that several threads share, by oneTBB.
#ifndef WELLSPACE_CORE_BASE_THREAD_TEAM_H_
#define WELLSPACE_CORE_BASE_THREAD_TEAM_H_

#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstddef>

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace wellspace::core {

// Thread safety: thread-compatible; loops of different teams may run at once.
class ThreadTeam {
 public:
  // `threads`, but at most as many as the machine has cores; the calling thread is one of them.
  explicit ThreadTeam(int threads) : threads_(std::min(threads, tbb::info::default_concurrency())), arena_(threads_) {}

  int threads() const { return threads_; }

  // In a loop, which of its threads this is, from 0 to threads() - 1.
  static int CurrentThread() { return tbb::this_task_arena::current_thread_index(); }

  // Calls f(i) for each i below `count`, in any order, and returns when all calls have. What was written before is seen
  // in them, and what they write after.
  template <typename F>
  void ForEach(size_t count, const F& f) {
    Release(&begun_);
    arena_.execute([&] {
      tbb::parallel_for(size_t{0}, count, [&](size_t i) {
        Acquire(&begun_);
        f(i);
        Release(&ended_);
      });
    });
    Acquire(&ended_);
  }

 private:
  // oneTBB is not compiled for ThreadSanitizer, which has to be told of the order that it keeps.
#ifdef __SANITIZE_THREAD__
  static void Acquire(char* mark) { __tsan_acquire(mark); }
  static void Release(char* mark) { __tsan_release(mark); }
#else
  static void Acquire(char* /*mark*/) {}
  static void Release(char* /*mark*/) {}
#endif

  const int threads_;
  tbb::task_arena arena_;
  char begun_ = 0;
  char ended_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_THREAD_TEAM_H_
