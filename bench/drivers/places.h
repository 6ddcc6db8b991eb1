// Places of points in measured programs, and quantiles of what was measured.
#ifndef WELLSPACE_BENCH_DRIVERS_PLACES_H_
#define WELLSPACE_BENCH_DRIVERS_PLACES_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace wellspace::bench {

// Coordinates of points of the inner part of the unit box, the same on every machine.
class Places {
 public:
  explicit Places(uint64_t seed = 1) : state_(seed) {}

  double Next() {
    state_ = state_ * 6364136223846793005 + 1442695040888963407;
    return 0.1 + 0.8 * static_cast<double>(state_ >> 11) * 0x1p-53;
  }

 private:
  uint64_t state_;
};

// The value that the part `share` of `values`, not empty, is below.
inline double Quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<size_t>(share * static_cast<double>(values.size())))];
}

}  // namespace wellspace::bench

#endif  // WELLSPACE_BENCH_DRIVERS_PLACES_H_
