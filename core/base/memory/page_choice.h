// The choice of large or small pages for memory.
#ifndef WELLSPACE_CORE_BASE_MEMORY_PAGE_CHOICE_H_
#define WELLSPACE_CORE_BASE_MEMORY_PAGE_CHOICE_H_

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace wellspace::core {

inline constexpr size_t kHugePage = size_t{1} << 21;
inline constexpr size_t kSmallPage = size_t{1} << 12;

// Large pages are better to work on, and mostly come sooner. But the host of a virtual machine may take free memory
// back: whole large pages, and each is found anew in milliseconds, while the system keeps small ones at hand.
// There small ones are taken, and after a while a large one is tried again.
//
// Thread safety: thread-safe.
class PageChoice {
 public:
  // Bytes that are mapped between two tries where large pages are dear.
  static constexpr int64_t kBetweenTries = 64 * int64_t{kHugePage};

  // Whether `bytes` that are about to be mapped are to lie on large pages. If so, IsDear is to be told the time that
  // the first of them took.
  bool TakesLarge(size_t bytes) {
    return until_try_.load(std::memory_order_relaxed) <= 0 ||
           until_try_.fetch_sub(static_cast<int64_t>(bytes), std::memory_order_relaxed) <= 0;
  }

  // Whether a large page that took this many nanoseconds was dear, where as much memory on small ones takes small_ns();
  // then small ones are taken from now on.
  template <typename SmallNs>
  bool IsDear(double large_ns, SmallNs small_ns) {
    if (large_ns <= kWorth || large_ns <= kWorth + small_ns()) {
      return false;
    }
    until_try_.store(kBetweenTries, std::memory_order_relaxed);
    return true;
  }

 private:
  // The worth of a large page while it is worked on, in nanoseconds: where either is at hand, a mesh is made 1.07
  // times as fast on large pages as on small ones.
  static constexpr double kWorth = 1e6;

  std::atomic<int64_t> until_try_{0};  // bytes that are yet to be mapped before the next
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_MEMORY_PAGE_CHOICE_H_
