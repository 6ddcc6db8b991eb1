// A sort of few items without branches, since they could not be predicted.
#ifndef WELLSPACE_CORE_BASE_SORT_FEW_H_
#define WELLSPACE_CORE_BASE_SORT_FEW_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace wellspace::core {

// Sorts `items`, numbers or identifiers of at most 64 bits, the least first, and returns whether that takes an odd
// number of exchanges.
//
// Complexity: O(N^2).
template <typename T, size_t N>
bool SortFew(std::array<T, N>& items) {
  using Number = std::conditional_t<sizeof(T) <= sizeof(uint32_t), uint32_t, uint64_t>;
  uint32_t is_odd = 0;
  for (size_t last = N - 1; last > 0; --last) {
    for (size_t i = 0; i < last; ++i) {
      // Compilers make jumps of std::min and std::max here.
      const auto a = static_cast<Number>(items[i]);
      const auto b = static_cast<Number>(items[i + 1]);
      const Number is_exchanged = b < a ? 1 : 0;
      const Number difference = (a ^ b) & -is_exchanged;
      items[i] = static_cast<T>(a ^ difference);
      items[i + 1] = static_cast<T>(b ^ difference);
      is_odd ^= static_cast<uint32_t>(is_exchanged);
    }
  }
  return is_odd != 0;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SORT_FEW_H_
