// The integer grid under the 2^D-tree, and the Morton (Z) order on it.
#ifndef WELLSPACE_CORE_TREE_MORTON_H_
#define WELLSPACE_CORE_TREE_MORTON_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace wellspace::core {

template <int D>
using GridPoint = std::array<uint64_t, D>;

// A grid of cubes of side `quantum` over a box: so fine that it tells apart all points that the mesher serves. It is so
// coarse that corners of its cubes, and of nodes of a tree over them, are doubles where they are in the box. Hence
// comparing a coordinate with a side of a node is exact.
//
// Invariants: (1) the root cube [root_low, root_low + root_side]^D contains the box and root_side = quantum * 2^levels;
// (2) quantum is 4 to 7 times a quarter of `step`, a power of two; (3) corners in the box are exact doubles, since they
// are multiples of step / 4 and at most 2^53 times that.
template <int D>
class MortonGrid {
 public:
  // The grid under a tree over `count` points. In 3-D the root is up to twice as large as the box asks for. So a cube
  // on some level of the tree has about kEvenly of them if they are spread evenly: under the smallest root, leaves
  // would hold up to 8 times fewer vertices for one number of points than for another, and queries would look into more
  // leaves, or at more vertices.
  explicit MortonGrid(const Box<D>& box, size_t count = 0) : box_(box) {
    double magnitude = 0;
    for (int i = 0; i < D; ++i) {
      magnitude = std::max({magnitude, std::abs(box.low[i]), std::abs(box.high[i])});
    }
    const int exponent = std::ilogb(magnitude) + 1 - kBits;  // magnitude / step < 2^kBits
    per_quarter_ = std::ldexp(1.0, 2 - exponent);
    std::array<int64_t, D> reach;  // of the box, in quarters of a step
    for (int i = 0; i < D; ++i) {
      const double first = std::floor(box.low[i] * per_quarter_);
      root_low_[i] = first / per_quarter_;
      first_[i] = static_cast<int64_t>(first);
      reach[i] = static_cast<int64_t>(std::ceil(box.high[i] * per_quarter_)) - first_[i];
    }
    ChooseRoot(*std::max_element(reach.begin(), reach.end()), D == 3 ? count : 0);
    per_side_ = ~uint64_t{0} / static_cast<uint64_t>(side_) + 1;
    for (int i = 0; i < D; ++i) {
      // The last cube that the box reaches into: a coordinate on the box's high face belongs to it.
      last_[i] = static_cast<uint64_t>((reach[i] - 1) / side_);
    }
  }

  const Box<D>& box() const { return box_; }
  double step() const { return 4 / per_quarter_; }
  double quantum() const { return static_cast<double>(side_) / per_quarter_; }
  int levels() const { return levels_; }
  const Point<D>& root_low() const { return root_low_; }
  double root_side() const { return std::ldexp(quantum(), levels_); }
  // The sides of the nodes of a tree, by level.
  std::vector<double> Sides() const {
    std::vector<double> sides;
    for (int level = 0; level <= levels_; ++level) {
      sides.push_back(std::ldexp(root_side(), -level));
    }
    return sides;
  }

  // The cube of the grid that holds `p`, a point of the box.
  GridPoint<D> CubeOf(const Point<D>& p) const {
    GridPoint<D> cube;
    for (int i = 0; i < D; ++i) {
      const double quarters = p[i] * per_quarter_;
      const auto whole = static_cast<int64_t>(quarters);  // towards zero
      const int64_t below = quarters < static_cast<double>(whole) ? 1 : 0;
      cube[i] = std::min(BySide(static_cast<uint64_t>(whole - below - first_[i])), last_[i]);
    }
    return cube;
  }

 private:
  static constexpr int kBits = 51;
  // With the Steiner points a leaf then has 12 to 30.
  static constexpr double kEvenly = 8;

  // Sets side_ and levels_ so that the root is at least `extent` quarters of a step long, and less than twice that.
  void ChooseRoot(int64_t extent, size_t count) {
    side_ = 4;
    levels_ = 0;
    while (side_ << levels_ < extent) {
      ++levels_;
    }
    if (count == 0) {
      return;
    }
    // How far a root is from kEvenly points to a cube of some level, as a logarithm.
    const auto distance = [&](int64_t side, int levels) {
      double even = std::log2(static_cast<double>(count) / kEvenly);
      for (int i = 0; i < D; ++i) {
        even += std::log2(std::ldexp(static_cast<double>(side), levels) / per_quarter_ / (box_.high[i] - box_.low[i]));
      }
      return std::abs(std::remainder(even, D));
    };
    const int most = levels_;
    double least = distance(side_, levels_);
    for (int levels = std::max(most - 1, 0); levels <= most; ++levels) {
      for (int64_t side = 4; side <= 7; ++side) {
        const int64_t root = side << levels;
        if (root >= extent && root < 2 * extent && distance(side, levels) < least) {
          least = distance(side, levels);
          side_ = side;
          levels_ = levels;
        }
      }
    }
  }

  // number / side_, for a number of up to 54 bits.
  uint64_t BySide(uint64_t number) const {
    __extension__ using Wide = unsigned __int128;
    return static_cast<uint64_t>(Wide{number} * per_side_ >> 64);
  }

  Box<D> box_;
  double per_quarter_ = 0;  // of a step: a power of two
  int64_t side_ = 4;        // of a cube, in quarters of a step
  uint64_t per_side_ = 0;   // 2^64 / side_, rounded up
  int levels_ = 0;
  Point<D> root_low_;
  std::array<int64_t, D> first_;  // root_low_ in quarters of a step
  std::array<uint64_t, D> last_;  // and the last cube of the box, from there
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

// Where `cube` of a grid of so many `levels` lies on the same curve: the first 64 / D levels, in one number. A cube
// with a smaller one comes before, one with the same before or after. Of a number only bits from `kFirst` on have to be
// right.
//
// Complexity: O(D).
// Source:     interleaved bits (Morton 1966), eight at a time.
template <int D, int kFirst = 0>
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
      if (bit * D + 8 * D > kFirst) {
        prefix |= kSpread[first >> bit & 0xff] << (bit * D + i);
      }
    }
  }
  return prefix;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_TREE_MORTON_H_
