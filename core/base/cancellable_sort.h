// Sorting that a run can be cancelled in.
#ifndef WELLSPACE_CORE_BASE_CANCELLABLE_SORT_H_
#define WELLSPACE_CORE_BASE_CANCELLABLE_SORT_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"

namespace wellspace::core {

// Sorts `items` by the strict order `less`: sorted runs are merged pair by pair, with a look at `context` every few
// thousand items.
//
// Complexity: O(n log n), with space for a second copy of the items.
// Errors:     CANCELLED, DEADLINE_EXCEEDED; the items are then in any order, some of them twice.
// Source:     bottom-up merge sort.
template <typename T, typename Less>
absl::Status CancellableSort(std::vector<T>& items, Less less, const RunContext& context) {
  constexpr size_t kRun = size_t{1} << 13;
  const size_t count = items.size();
  for (size_t begin = 0; begin < count; begin += kRun) {
    WELLSPACE_RETURN_IF_ERROR(context.Check());
    std::sort(items.begin() + begin, items.begin() + std::min(count, begin + kRun), less);
  }
  std::vector<T> merged(count > kRun ? count : 0);
  for (size_t width = kRun; width < count; width *= 2) {
    for (size_t begin = 0; begin < count; begin += 2 * width) {
      size_t left = begin;
      size_t right = std::min(count, begin + width);
      const size_t left_end = right;
      const size_t right_end = std::min(count, begin + 2 * width);
      for (size_t to = begin; to < right_end; ++to) {
        if (to % kRun == 0) {
          WELLSPACE_RETURN_IF_ERROR(context.Check());
        }
        const bool from_right = left == left_end || (right < right_end && less(items[right], items[left]));
        merged[to] = from_right ? items[right++] : items[left++];
      }
    }
    std::swap(items, merged);
  }
  return absl::OkStatus();
}

// Sorts `items` by key(item), a uint32_t; items with equal keys stay in order. `scratch` is as long.
//
// Complexity: O(n).
// Errors:     as CancellableSort.
// Source:     radix sort from the lowest byte up, bytes that all keys share are passed over; a few items by insertion.
template <typename T, typename Key>
absl::Status CancellableRadixSort(std::span<T> items, std::span<T> scratch, Key key, const RunContext& context) {
  constexpr int kBytes = sizeof(uint32_t);
  constexpr size_t kFew = 32;
  const size_t count = items.size();
  if (count <= kFew) {
    for (size_t i = 1; i < count; ++i) {
      for (size_t j = i; j > 0 && key(items[j]) < key(items[j - 1]); --j) {
        std::swap(items[j], items[j - 1]);
      }
    }
    return absl::OkStatus();
  }
  const auto byte_of = [&](const T& item, int byte) { return static_cast<uint8_t>(key(item) >> (8 * byte)); };
  std::array<std::array<size_t, 256>, kBytes> places{};  // at first the number of items with the byte
  for (size_t i = 0; i < count; ++i) {
    if (i % kStepsBetweenChecks == 0) {
      WELLSPACE_RETURN_IF_ERROR(context.Check());
    }
    for (int byte = 0; byte < kBytes; ++byte) {
      ++places[byte][byte_of(items[i], byte)];
    }
  }
  bool is_in_scratch = false;
  for (int byte = 0; byte < kBytes; ++byte) {
    if (places[byte][byte_of(items[0], byte)] == count) {
      continue;
    }
    size_t before = 0;
    for (size_t& place : places[byte]) {
      before += std::exchange(place, before);
    }
    for (size_t i = 0; i < count; ++i) {
      if (i % kStepsBetweenChecks == 0) {
        WELLSPACE_RETURN_IF_ERROR(context.Check());
      }
      scratch[places[byte][byte_of(items[i], byte)]++] = items[i];
    }
    std::swap(items, scratch);
    is_in_scratch = !is_in_scratch;
  }
  if (is_in_scratch) {
    std::copy(items.begin(), items.end(), scratch.begin());
  }
  return absl::OkStatus();
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_CANCELLABLE_SORT_H_
