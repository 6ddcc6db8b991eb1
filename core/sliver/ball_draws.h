// Points of the unit ball in a fixed sequence, so that random trials are the same on every machine.
#ifndef WELLSPACE_CORE_SLIVER_BALL_DRAWS_H_
#define WELLSPACE_CORE_SLIVER_BALL_DRAWS_H_

#include <cstdint>

#include "core/geometry/point.h"

namespace wellspace::core {

// Thread safety: thread-compatible.
// Source:        SplitMix64: Steele, Lea and Flood 2014.
class BallDraws {
 public:
  // The next point; all of the closed unit ball are equally likely.
  Point<3> Next() {
    Point<3> p;
    do {
      for (double& x : p) {
        state_ += 0x9e3779b97f4a7c15;
        uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
        z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
        x = static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-52 - 1;
      }
    } while (NormSq<3>(p) > 1);
    return p;
  }

 private:
  uint64_t state_ = 0;
};

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_SLIVER_BALL_DRAWS_H_
