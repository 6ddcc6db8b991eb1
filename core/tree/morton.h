// The integer grid under the 2^D-tree, and the Morton (Z) order on it.
#ifndef WELLSPACE_CORE_TREE_MORTON_H_
#define WELLSPACE_CORE_TREE_MORTON_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

template <int D>
using GridPoint = std::array<uint64_t, D>;

// A grid of cubes of side `quantum`, a power of two, over a box: so fine that it tells apart all points that the mesher
// serves, so coarse that every corner of every cube is a double. Hence comparing a coordinate with a side of a tree
// node is exact.
//
// Invariants: (1) the root cube [root_low, root_low + root_side]^D contains the box and root_side = quantum * 2^levels;
// (2) all corners of cubes are exact doubles, since their multiples of quantum stay below 2^53.
template <int D>
class MortonGrid {
 public:
  explicit MortonGrid(const Box<D>& box) {
    double magnitude = 0;
    for (int i = 0; i < D; ++i) {
      magnitude = std::max({magnitude, std::abs(box.low[i]), std::abs(box.high[i])});
    }
    const int exponent = std::ilogb(magnitude) + 1 - kBits;  // magnitude / quantum < 2^kBits
    quantum_ = std::ldexp(1.0, exponent);
    per_quantum_ = std::ldexp(1.0, -exponent);
    uint64_t extent = 1;
    for (int i = 0; i < D; ++i) {
      const double first = std::floor(box.low[i] / quantum_);
      root_low_[i] = first * quantum_;
      first_[i] = static_cast<int64_t>(first);
      // The last cube that the box reaches into: a coordinate on the box's high face belongs to it.
      last_[i] = static_cast<int64_t>(std::ceil(box.high[i] / quantum_)) - first_[i] - 1;
      extent = std::max(extent, static_cast<uint64_t>(last_[i] + 1));
    }
    while ((uint64_t{1} << levels_) < extent) {
      ++levels_;
    }
  }

  double quantum() const { return quantum_; }
  int levels() const { return levels_; }
  const Point<D>& root_low() const { return root_low_; }
  double root_side() const { return std::ldexp(quantum_, levels_); }

  // The cube of the grid that holds `p`, a point of the box.
  GridPoint<D> CubeOf(const Point<D>& p) const {
    GridPoint<D> cube;
    for (int i = 0; i < D; ++i) {
      const double steps = p[i] * per_quantum_;
      const auto whole = static_cast<int64_t>(steps);  // towards zero
      const int64_t below = steps < static_cast<double>(whole) ? 1 : 0;
      cube[i] = static_cast<uint64_t>(std::min(whole - below - first_[i], last_[i]));
    }
    return cube;
  }

 private:
  static constexpr int kBits = 51;

  double quantum_ = 0;
  double per_quantum_ = 0;  // 1 / quantum_, a power of two too
  int levels_ = 0;
  Point<D> root_low_;
  std::array<int64_t, D> first_;  // root_low_ in steps of quantum_
  std::array<int64_t, D> last_;   // and the last cube of the box, from there
};

// Whether `a` comes before `b` on the Z curve on which axis D - 1 is the most significant of a level.
//
// Complexity: O(D).
// Source:     T. Chan 2002: the axis with the highest differing bit decides.
template <int D>
inline bool MortonLess(const GridPoint<D>& a, const GridPoint<D>& b) {
  int axis = D - 1;
  uint64_t highest = a[axis] ^ b[axis];
  for (int i = D - 2; i >= 0; --i) {
    const uint64_t difference = a[i] ^ b[i];
    if (highest < difference && highest < (highest ^ difference)) {
      axis = i;
      highest = difference;
    }
  }
  return a[axis] < b[axis];
}

// Where `cube` of a grid of so many `levels` lies on the same curve: the first 64 / D levels, in one number. A cube with a
// smaller one comes before, one with the same before or after.
//
// Complexity: O(D).
// Source:     interleaved bits (Morton 1966), eight at a time.
template <int D>
inline uint64_t MortonPrefix(const GridPoint<D>& cube, int levels) {
  static constexpr std::array<uint64_t, 256> kSpread = [] {
    std::array<uint64_t, 256> spread{};
    for (uint64_t byte = 0; byte < 256; ++byte) {
      for (int bit = 0; bit < 8; ++bit) {
        spread[byte] |= (byte >> bit & 1) << (bit * D);
      }
    }
    return spread;
  }();
  constexpr int kLevels = 64 / D;
  uint64_t prefix = 0;
  for (int i = 0; i < D; ++i) {
    const uint64_t first = levels >= kLevels ? cube[i] >> (levels - kLevels) : cube[i] << (kLevels - levels);
    for (int bit = 0; bit < kLevels; bit += 8) {
      prefix |= kSpread[first >> bit & 0xff] << (bit * D + i);
    }
  }
  return prefix;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_MORTON_H_
