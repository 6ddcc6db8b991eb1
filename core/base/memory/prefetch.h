// Prefetching: asking the memory for data that will soon be read.
#ifndef WELLSPACE_CORE_BASE_MEMORY_PREFETCH_H_
#define WELLSPACE_CORE_BASE_MEMORY_PREFETCH_H_

#include <array>
#include <cstddef>
#include <span>

namespace wellspace::core {

// Asks for the line of the cache that `address` is in, which need not be mapped.
inline void PrefetchLine(const void* address) {
  __builtin_prefetch(address);
  asm volatile("");  // a function that did nothing else would have no effect for g++, which drops calls of such
}

// For items that are worked on one after the other, and whose data are found in several steps: calls
// prefetch(item, step) for items that come some places after the one in place `at`, the first step the farthest ahead.
template <typename T, typename Prefetch>
void PrefetchAhead(std::span<T> items, size_t at, Prefetch prefetch) {
  constexpr std::array<size_t, 3> kAhead = {8, 4, 2};
  for (int step = 0; step < static_cast<int>(kAhead.size()); ++step) {
    if (at + kAhead[step] < items.size()) {
      prefetch(items[at + kAhead[step]], step);
    }
  }
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_MEMORY_PREFETCH_H_
