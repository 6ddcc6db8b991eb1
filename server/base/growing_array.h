// An array that grows at its end.
#ifndef WELLSPACE_SERVER_BASE_GROWING_ARRAY_H_
#define WELLSPACE_SERVER_BASE_GROWING_ARRAY_H_

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <type_traits>

namespace wellspace::server {

// Where std::vector copies all it has when it grows, and holds it twice meanwhile, this asks for the memory to be
// grown: of a block from M_MMAP_THRESHOLD on (main.cc) the system moves the pages. Unused pages take no memory.
//
// Thread safety: thread-compatible.
template <typename T>
class GrowingArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T* begin() const { return items_.get(); }
  const T* end() const { return items_.get() + size_; }
  const T& operator[](size_t i) const { return items_[i]; }

  // Makes room for `count` in all, so that no Append copies much on average.
  //
  // Errors:     std::bad_alloc, which changes nothing.
  void MakeRoom(size_t count) {
    if (count <= capacity_) {
      return;
    }
    const size_t capacity = std::max(count, 2 * capacity_);
    void* const grown = std::realloc(items_.get(), capacity * sizeof(T));
    if (grown == nullptr) {
      throw std::bad_alloc();
    }
    (void)items_.release();
    items_.reset(static_cast<T*>(grown));
    capacity_ = capacity;
  }

  // Appends the items of a range.
  template <typename Iterator>
  void Append(Iterator first, Iterator last) {
    MakeRoom(size_ + static_cast<size_t>(last - first));
    size_ = static_cast<size_t>(std::uninitialized_copy(first, last, items_.get() + size_) - items_.get());
  }
  void Append(const T& item) { Append(&item, &item + 1); }

  // Makes it `count` long; new items are `item`.
  void Resize(size_t count, const T& item = T()) {
    MakeRoom(count);
    if (count > size_) {
      std::uninitialized_fill(items_.get() + size_, items_.get() + count, item);
    }
    size_ = count;
  }

 private:
  struct Free {
    void operator()(T* items) const { std::free(items); }
  };

  std::unique_ptr<T[], Free> items_;
  size_t size_ = 0;
  size_t capacity_ = 0;
};

}  // namespace wellspace::server

#endif  // WELLSPACE_SERVER_BASE_GROWING_ARRAY_H_
