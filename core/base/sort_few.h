// A sort of few items without branches, since none could be foretold.
#ifndef WELLSPACE_CORE_BASE_SORT_FEW_H_
#define WELLSPACE_CORE_BASE_SORT_FEW_H_

#include <algorithm>
#include <array>
#include <cstddef>

namespace wellspace::core {

// Sorts `items`, the least first, and returns whether that takes an odd number of exchanges.
//
// Complexity: O(N^2).
template <typename T, size_t N>
bool SortFew(std::array<T, N>& items) {
  bool is_odd = false;
  for (size_t last = N - 1; last > 0; --last) {
    for (size_t i = 0; i < last; ++i) {
      const T low = std::min(items[i], items[i + 1]);
      const T high = std::max(items[i], items[i + 1]);
      is_odd ^= low != items[i];
      items[i] = low;
      items[i + 1] = high;
    }
  }
  return is_odd;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SORT_FEW_H_
