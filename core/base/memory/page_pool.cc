#include "core/base/memory/page_pool.h"

#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iterator>
#include <new>

namespace wellspace::core {

namespace {

constexpr size_t WholeHugePages(size_t bytes) { return (bytes + kHugePage - 1) & ~(kHugePage - 1); }

// Nanoseconds that writing a byte every `step` takes.
double TimeToWrite(std::byte* memory, size_t bytes, size_t step) {
  const auto begin = std::chrono::steady_clock::now();
  for (size_t at = 0; at < bytes; at += step) {
    *static_cast<volatile std::byte*>(memory + at) = std::byte{0};
  }
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
}

// Nanoseconds that it takes to bring in a large page's memory by small ones, by some of them.
double TimeOfSmallPages() {
  constexpr size_t kMeasured = 16 * kSmallPage;
  void* const memory = mmap(nullptr, kMeasured, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    return 0;
  }
  const double time = TimeToWrite(static_cast<std::byte*>(memory), kMeasured, kSmallPage);
  munmap(memory, kMeasured);
  return time * (kHugePage / kMeasured);
}

// Asks for the pages that memory which has just been mapped is to be brought in by. Advice: nothing is lost if it is
// not taken.
void ChoosePages(std::byte* memory, size_t bytes) {
  static PageChoice choice;
  if (!choice.TakesLarge(bytes)) {
    madvise(memory, bytes, MADV_NOHUGEPAGE);
    return;
  }
  madvise(memory, bytes, MADV_HUGEPAGE);
  if (choice.IsDear(TimeToWrite(memory, kHugePage, kHugePage), TimeOfSmallPages) && bytes > kHugePage) {
    madvise(memory + kHugePage, bytes - kHugePage, MADV_NOHUGEPAGE);
  }
}

}  // namespace

void* MapHugePages(size_t bytes) {
  const size_t whole = WholeHugePages(bytes);
  void* const memory = mmap(nullptr, whole + kHugePage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    throw std::bad_alloc();
  }
  auto* const begin = static_cast<std::byte*>(memory);
  const size_t before = -reinterpret_cast<uintptr_t>(begin) & (kHugePage - 1);
  if (before != 0) {
    munmap(begin, before);
  }
  munmap(begin + before + whole, kHugePage - before);
  ChoosePages(begin + before, whole);
  return begin + before;
}

void UnmapHugePages(void* memory, size_t bytes) { munmap(memory, WholeHugePages(bytes)); }

PagePool& PagePool::Shared() {
  static auto* const pool = new PagePool;
  return *pool;
}

PagePool::~PagePool() {
  if (spare_ != nullptr) {
    UnmapHugePages(spare_, kHugePage);
  }
}

void* PagePool::Take(size_t bytes) {
  const size_t count = (bytes + kSmallPage - 1) / kSmallPage;
  const std::lock_guard lock(mutex_);
  auto at = std::find_if(large_pages_.begin(), large_pages_.end(),
                         [&](const auto& entry) { return entry.second.HasFree(count); });
  if (at == large_pages_.end()) {
    at = large_pages_.try_emplace(static_cast<std::byte*>(MapHugePages(kHugePage))).first;
  }
  spare_ = spare_ == at->first ? nullptr : spare_;
  return at->first + at->second.Take(count) * kSmallPage;
}

void PagePool::GiveBack(void* memory, size_t bytes) {
  auto* const begin = static_cast<std::byte*>(memory);
  const std::lock_guard lock(mutex_);
  const auto at = std::prev(large_pages_.upper_bound(begin));
  at->second.GiveBack((begin - at->first) / kSmallPage, (bytes + kSmallPage - 1) / kSmallPage);
  if (!at->second.AllFree()) {
    return;
  }
  if (spare_ == nullptr) {
    spare_ = at->first;
    return;
  }
  UnmapHugePages(at->first, kHugePage);
  large_pages_.erase(at);
}

size_t PagePool::Pages::Take(size_t count) {
  size_t first = 0;
  size_t free = 0;
  for (size_t page = 0; free < count; ++page) {
    free = taken_[page] ? 0 : free + 1;
    first = page + 1 - free;
  }
  Mark(first, count, true);
  return first;
}

void PagePool::Pages::Mark(size_t first, size_t count, bool taken) {
  for (size_t page = first; page < first + count; ++page) {
    taken_[page] = taken;
  }
  longest_free_ = 0;
  size_t free = 0;
  for (size_t page = 0; page < kCount; ++page) {
    free = taken_[page] ? 0 : free + 1;
    longest_free_ = std::max(longest_free_, free);
  }
}

}  // namespace wellspace::core
