// Large arrays on large pages.
#ifndef WELLSPACE_CORE_BASE_HUGE_PAGES_H_
#define WELLSPACE_CORE_BASE_HUGE_PAGES_H_

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wellspace::core {

// Makes room for `count` items, on pages of 2 MiB as far as it spans whole ones and the system has any: one fault brings such a page in,
// where small ones take 512. For what will be filled, and soon.
template <typename T>
void ReserveOnHugePages(std::vector<T>& items, size_t count) {
  constexpr uintptr_t kPage = uintptr_t{1} << 21;
  items.reserve(count);
  const uintptr_t begin = (reinterpret_cast<uintptr_t>(items.data()) + kPage - 1) & ~(kPage - 1);
  const uintptr_t end = reinterpret_cast<uintptr_t>(items.data() + items.capacity()) & ~(kPage - 1);
  if (begin < end) {
    madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // advice: nothing is lost if it is not taken
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_HUGE_PAGES_H_
