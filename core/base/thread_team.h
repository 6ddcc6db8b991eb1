// Loops that several threads share, by oneTBB.
#ifndef WELLSPACE_CORE_BASE_THREAD_TEAM_H_
#define WELLSPACE_CORE_BASE_THREAD_TEAM_H_

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "core/base/processor_time.h"

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace wellspace::core {

// The time that other threads work in its loops counts as that of the thread which makes and destroys it
// (processor_time.h).
//
// Thread safety: thread-compatible; loops of different teams may run at once, but only one of a team.
class ThreadTeam {
 public:
  // `threads`, but at most as many as the machine has cores; the calling thread is one of them.
  explicit ThreadTeam(int threads) : threads_(std::min(threads, tbb::info::default_concurrency())), arena_(threads_) {}
  ~ThreadTeam() { HelpersNanoseconds() += helpers_nanoseconds_; }

  int threads() const { return threads_; }

  // In a loop, which of its threads this is, from 0 to threads() - 1.
  static int CurrentThread() { return tbb::this_task_arena::current_thread_index(); }

  // Calls f(i) for each i below `count`, in any order, and returns when all calls have. All that was written before is
  // seen in them, and all that they write after.
  template <typename F>
  void ForEach(size_t count, const F& f) {
    Release(&begun_);
    const absl::Cleanup acquire = [this] { Acquire(&ended_); };  // be it that a call throws
    arena_.execute([&] {
      tbb::parallel_for(tbb::blocked_range<size_t>(0, count), [&](const tbb::blocked_range<size_t>& range) {
        Acquire(&begun_);
        const absl::Cleanup release = [this] { Release(&ended_); };
        const Helper helper(*this);
        for (size_t i = range.begin(); i != range.end(); ++i) {
          f(i);
        }
      });
    });
  }

  // As ForEach, for calls that return an absl::Status: of the errors that of the lowest i is returned. A
  // single call is made by the caller.
  template <typename F>
  absl::Status TryForEach(size_t count, const F& f) {
    if (count == 1) {
      return f(size_t{0});
    }
    std::vector<absl::Status> statuses(count);
    ForEach(count, [&](size_t i) { statuses[i] = f(i); });
    const auto failed =
        std::find_if(statuses.begin(), statuses.end(), [](const absl::Status& status) { return !status.ok(); });
    return failed == statuses.end() ? absl::OkStatus() : *failed;
  }

  // Has the other threads begin such a loop, while the caller goes on. Nothing that f reads may be written until End or
  // Drop, which has to be called before the next loop.
  void Begin(size_t count, std::function<void(size_t)> f) {
    f_ = std::move(f);
    count_ = count;
    next_ = 0;
    ended_calls_ = 0;
    has_begun_ = true;
    Release(&begun_);
    arena_.execute([&] {
      for (int thread = 1; thread < threads_; ++thread) {
        group_.run([this] { Work(); });
      }
    });
  }

  // Has another thread call f() once, while the caller goes on, be it with a loop. Nothing that f reads may be written
  // until End or Drop, which wait for it, too, and have to be called before the next such call.
  void BeginCall(std::function<void()> f) {
    call_ = std::move(f);
    has_begun_ = true;
    Release(&begun_);
    arena_.execute([&] {
      group_.run([this] {
        Acquire(&begun_);
        const absl::Cleanup release = [this] { Release(&ended_); };
        const Helper helper(*this);
        call_();
      });
    });
  }

  // Makes one of the calls that have been begun, if one is left.
  bool Help() {
    bool has_helped = false;
    arena_.execute([&] { has_helped = WorkOnce(); });
    return has_helped;
  }

  // Whether all calls that have been begun have been made.
  bool HasEnded() const { return ended_calls_ == count_; }

  // Joins in the calls that have been begun, if any, and returns when all have been made. If one throws, so does this,
  // and some are not made.
  void End() {
    if (!std::exchange(has_begun_, false)) {
      return;  // the arena may not even be there
    }
    const absl::Cleanup acquire = [this] { Acquire(&ended_); };
    arena_.execute([&] { group_.run_and_wait([this] { Work(); }); });
  }

  // Makes no more of the calls, and returns when those that are made have. Their exceptions are lost.
  void Drop() noexcept {
    next_ = count_;
    try {
      End();
    } catch (...) {
    }
  }

 private:
  // Counts the time of another thread than the team's own, as long as this lives.
  class Helper {
   public:
    explicit Helper(ThreadTeam& team)
        : team_(team),
          is_other_(std::this_thread::get_id() != team.owner_),
          begin_(is_other_ ? ThreadNanoseconds() : 0) {}
    ~Helper() {
      if (is_other_) {
        team_.helpers_nanoseconds_ += ThreadNanoseconds() - begin_;
      }
    }
    Helper(const Helper&) = delete;
    Helper& operator=(const Helper&) = delete;

   private:
    ThreadTeam& team_;
    const bool is_other_;
    const int64_t begin_;
  };

  // Takes calls of the loop that has been begun until all are taken.
  void Work() {
    Acquire(&begun_);
    const absl::Cleanup release = [this] { Release(&ended_); };
    const Helper helper(*this);
    while (WorkOnce()) {
    }
  }

  bool WorkOnce() {
    const size_t i = next_++;
    if (i >= count_) {
      return false;
    }
    f_(i);
    ++ended_calls_;
    return true;
  }

  // oneTBB is not compiled for ThreadSanitizer, which has to be told of the order that it keeps.
#ifdef __SANITIZE_THREAD__
  static void Acquire(char* mark) { __tsan_acquire(mark); }
  static void Release(char* mark) { __tsan_release(mark); }
#else
  static void Acquire(char* /*mark*/) {}
  static void Release(char* /*mark*/) {}
#endif

  const int threads_;
  const std::thread::id owner_ = std::this_thread::get_id();
  std::atomic<int64_t> helpers_nanoseconds_ = 0;
  tbb::task_arena arena_;
  std::function<void()> call_;
  std::function<void(size_t)> f_;
  size_t count_ = 0;
  bool has_begun_ = false;
  std::atomic<size_t> next_ = 0;
  std::atomic<size_t> ended_calls_ = 0;
  tbb::task_group group_;
  char begun_ = 0;
  char ended_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_THREAD_TEAM_H_
