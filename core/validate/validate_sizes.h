// The bounds on sizes that a simplex is held to, and whether it keeps them.
#ifndef WELLSPACE_CORE_VALIDATE_VALIDATE_SIZES_H_
#define WELLSPACE_CORE_VALIDATE_VALIDATE_SIZES_H_

#include <array>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "core/geometry/criterion.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// Bounds on circumradii.
struct SizeBounds {
  double max_circumradius = 0;           // 0: none
  std::span<const SizeBox> boxes{};      // empty: none
  const SizeSamples* samples = nullptr;  // null: none
  double gradation = 0;                  // from boxes and samples; 0: the default of each

  bool IsEmpty() const {
    return max_circumradius == 0 && boxes.empty() && (samples == nullptr || samples->sizes.empty());
  }
};

// Refuses bounds that are none.
//
// Complexity: O(boxes + samples).
// Errors:     INVALID_ARGUMENT, naming the box or the sample.
absl::Status CheckSizeBounds(const SizeBounds& bounds, int dimension);

// In which way the circumradius of a simplex is too large, by more than a part of 1e-9; empty if it is not.
//
// REQUIRES:   CheckSizeBounds(bounds, D).ok().
// Complexity: O(boxes + samples): each is looked at.
template <int D>
std::string SizeExcess(const std::array<Point<D>, D + 1>& corners, const SizeBounds& bounds);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_VALIDATE_VALIDATE_SIZES_H_
