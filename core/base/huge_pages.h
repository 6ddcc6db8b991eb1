// Large arrays on large pages.
#ifndef WELLSPACE_CORE_BASE_HUGE_PAGES_H_
#define WELLSPACE_CORE_BASE_HUGE_PAGES_H_

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace wellspace::core {

inline constexpr size_t kHugePage = size_t{1} << 21;

// Has the system bring what lies at [begin, begin + bytes) in on pages of 2 MiB, if it has any and nothing there has been written yet: one fault
// brings in such a page, where small ones take 512. What lies beside it on the same pages comes along.
inline void AdviseHugePages(const void* begin, size_t bytes) {
  const uintptr_t first = reinterpret_cast<uintptr_t>(begin) & ~(kHugePage - 1);
  const uintptr_t end = (reinterpret_cast<uintptr_t>(begin) + bytes + kHugePage - 1) & ~(kHugePage - 1);
  madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);  // advice: nothing is lost if it is not taken
}

constexpr size_t WholeHugePages(size_t bytes) { return (bytes + kHugePage - 1) & ~(kHugePage - 1); }

// Maps so many bytes, in WholeHugePages, to the beginning of a large page. What is given back then is the system's at once, where the heap would keep
// it: arrays that are moved as they grow leave more than they need behind.
inline void* MapHugePages(size_t bytes) {
  const size_t mapped = WholeHugePages(bytes) + kHugePage;
  void* const memory = mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    throw std::bad_alloc();
  }
  auto* const begin = static_cast<std::byte*>(memory);
  const size_t before = -reinterpret_cast<uintptr_t>(begin) & (kHugePage - 1);
  if (before != 0) {
    munmap(begin, before);
  }
  munmap(begin + before + WholeHugePages(bytes), kHugePage - before);
  AdviseHugePages(begin + before, bytes);
  return begin + before;
}

// For arrays that are filled as they grow: those of at least one large page lie on such pages.
template <typename T>
struct HugePageAllocator {
  using value_type = T;

  HugePageAllocator() = default;
  template <typename U>
  HugePageAllocator(const HugePageAllocator<U>& /*other*/) {}  // NOLINT(google-explicit-constructor): as allocators are

  T* allocate(size_t count) {
    if (count < kLeast) {
      return std::allocator<T>().allocate(count);
    }
    if (count > kMost) {
      throw std::bad_array_new_length();
    }
    return static_cast<T*>(MapHugePages(count * sizeof(T)));
  }

  void deallocate(T* memory, size_t count) {
    if (count < kLeast) {
      std::allocator<T>().deallocate(memory, count);
    } else {
      munmap(memory, WholeHugePages(count * sizeof(T)));
    }
  }

  template <typename U>
  bool operator==(const HugePageAllocator<U>& /*other*/) const {
    return true;
  }

 private:
  static constexpr size_t kLeast = (kHugePage + sizeof(T) - 1) / sizeof(T);
  static constexpr size_t kMost = std::numeric_limits<ptrdiff_t>::max() / sizeof(T);
};

template <typename T>
using HugeVector = std::vector<T, HugePageAllocator<T>>;

// Bytes that nothing has been written to yet; of at least one large page on such pages.
struct HugePageDeleter {
  size_t count;
  void operator()(std::byte* memory) const { HugePageAllocator<std::byte>().deallocate(memory, count); }
};
using HugePageBytes = std::unique_ptr<std::byte[], HugePageDeleter>;
inline HugePageBytes MakeHugePageBytes(size_t count) {
  return {HugePageAllocator<std::byte>().allocate(count), HugePageDeleter{count}};
}

// Makes room for `count` items of a vector of the usual kind, on large pages if it spans any. For what will be filled, and soon.
template <typename T>
void ReserveOnHugePages(std::vector<T>& items, size_t count) {
  if (count <= items.capacity()) {
    return;
  }
  std::vector<T> larger;
  larger.reserve(count);
  if (count * sizeof(T) >= kHugePage) {
    AdviseHugePages(larger.data(), count * sizeof(T));
  }
  larger.insert(larger.end(), std::make_move_iterator(items.begin()), std::make_move_iterator(items.end()));
  items = std::move(larger);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_HUGE_PAGES_H_
