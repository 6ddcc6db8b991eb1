// Memory on large pages: mappings of whole ones, and smaller arrays side by side on them.
#ifndef WELLSPACE_CORE_BASE_MEMORY_PAGE_POOL_H_
#define WELLSPACE_CORE_BASE_MEMORY_PAGE_POOL_H_

#include <bitset>
#include <cstddef>
#include <map>
#include <mutex>

#include "core/base/memory/page_choice.h"

namespace wellspace::core {

// Maps this number of bytes, rounded up to whole pages of 2 MiB, to the beginning of one, and, unless they are dear
// (PageChoice), asks for such pages: one fault brings one in, where small ones take 512. Memory given back is the
// system's at once, where the heap would keep it: arrays that are moved as they grow leave more than they need behind.
// Throws std::bad_alloc if the system has none.
void* MapHugePages(size_t bytes);

// Unmaps the memory that MapHugePages(bytes) returned.
void UnmapHugePages(void* memory, size_t bytes);

// Arrays smaller than a large page, in runs of small ones: the first by address that is free. Large pages are mapped as
// they are needed. One on which nothing is left is kept for the next array: the system would clear it anew, which takes
// as long as a mesh of ten points. A second one is the system's at once.
//
// Thread safety: thread-safe.
class PagePool {
 public:
  // The pool that all share; it is never destroyed.
  static PagePool& Shared();

  PagePool() = default;
  // REQUIRES:   all that was taken is given back.
  ~PagePool();
  PagePool(const PagePool&) = delete;
  PagePool& operator=(const PagePool&) = delete;

  // Memory that begins at a page. Its contents are not known. Throws std::bad_alloc if the system has none.
  //
  // REQUIRES:   0 < bytes <= kHugePage.
  // Complexity: O(large pages mapped).
  void* Take(size_t bytes);

  // Takes back the memory that Take(bytes) returned.
  void GiveBack(void* memory, size_t bytes);

 private:
  // The map of the small pages of a large one that are taken.
  class Pages {
   public:
    bool HasFree(size_t count) const { return longest_free_ >= count; }
    bool AllFree() const { return taken_.none(); }
    // Takes the first `count` free ones side by side and returns the number of the first of them.
    //
    // REQUIRES:   HasFree(count).
    size_t Take(size_t count);
    void GiveBack(size_t first, size_t count) { Mark(first, count, false); }

   private:
    static constexpr size_t kCount = kHugePage / kSmallPage;

    void Mark(size_t first, size_t count, bool taken);

    std::bitset<kCount> taken_;
    size_t longest_free_ = kCount;  // side by side
  };

  std::mutex mutex_;
  // Guarded by mutex_.
  std::map<std::byte*, Pages> large_pages_;
  std::byte* spare_ = nullptr;  // that of these on which nothing is
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_MEMORY_PAGE_POOL_H_
