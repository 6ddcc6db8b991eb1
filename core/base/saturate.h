// Counts that were computed as doubles.
#ifndef WELLSPACE_CORE_BASE_SATURATE_H_
#define WELLSPACE_CORE_BASE_SATURATE_H_

#include <cstdint>

namespace wellspace::core {

// Stands for larger counts, too, which are no figures that something could be done with. Up to here a double, and so
// JSON, has every whole number.
inline constexpr double kMostCounted = 0x1p53;

// `count` without its fraction: 0 below 0 and for NaN, kMostCounted above that.
//
// A plain cast of a number that does not fit is undefined behaviour.
constexpr uint64_t SaturatedCount(double count) {
  if (!(count > 0)) {
    return 0;
  }
  return static_cast<uint64_t>(count < kMostCounted ? count : kMostCounted);
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_BASE_SATURATE_H_
