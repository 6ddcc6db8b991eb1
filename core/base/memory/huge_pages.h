// Large arrays on large pages.
#ifndef WELLSPACE_CORE_BASE_MEMORY_HUGE_PAGES_H_
#define WELLSPACE_CORE_BASE_MEMORY_HUGE_PAGES_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include "core/base/memory/page_pool.h"

namespace wellspace::core {

// For arrays that are filled as they grow: arrays of at least one large page have a mapping of their own, smaller ones
// share large pages, and small ones lie on the heap.
template <typename T>
struct HugePageAllocator {
  using value_type = T;

  HugePageAllocator() = default;
  template <typename U>
  HugePageAllocator(const HugePageAllocator<U>& /*other*/) {}  // NOLINT(google-explicit-constructor): as allocators are

  T* allocate(size_t count) {
    if (count > kMost) {
      throw std::bad_array_new_length();
    }
    const size_t bytes = count * sizeof(T);
    if (bytes < kLeastShared) {
      return std::allocator<T>().allocate(count);
    }
    return static_cast<T*>(bytes < kHugePage ? PagePool::Shared().Take(bytes) : MapHugePages(bytes));
  }

  void deallocate(T* memory, size_t count) {
    const size_t bytes = count * sizeof(T);
    if (bytes < kLeastShared) {
      std::allocator<T>().deallocate(memory, count);
    } else if (bytes < kHugePage) {
      PagePool::Shared().GiveBack(memory, bytes);
    } else {
      UnmapHugePages(memory, bytes);
    }
  }

  template <typename U>
  bool operator==(const HugePageAllocator<U>& /*other*/) const {
    return true;
  }

 private:
  // Under AddressSanitizer none: between arrays of the heap it detects reads beyond their ends.
#ifdef __SANITIZE_ADDRESS__
  static constexpr size_t kLeastShared = kHugePage;
#else
  static constexpr size_t kLeastShared = size_t{1} << 16;
#endif
  static constexpr size_t kMost = std::numeric_limits<ptrdiff_t>::max() / sizeof(T);
};

template <typename T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

// Bytes that are not set, where HugePageAllocator puts them.
struct HugePageDeleter {
  size_t count;
  void operator()(std::byte* memory) const { HugePageAllocator<std::byte>().deallocate(memory, count); }
};
using HugePageBytes = std::unique_ptr<std::byte[], HugePageDeleter>;
inline HugePageBytes MakeHugePageBytes(size_t count) {
  return {HugePageAllocator<std::byte>().allocate(count), HugePageDeleter{count}};
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_MEMORY_HUGE_PAGES_H_
