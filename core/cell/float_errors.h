// The errors of a cell that is computed in floats, in the plane and in space: the bound on each error, and its
// derivation. u = 2^-24 is the unit of rounding of floats; x are nodes, w a vector to a vertex, R bounds the distance
// of all nodes; lengths are in the units of the nodes (float_cell.h). A bound per node would cost a column; one for all
// is looser, and nodes that it leaves in doubt go to NodeDoubtSq, and then to DecideCut.
//
//   error of                       bound            2-D     3-D     times     used by
//   a node                         kNodeError       1.5 u   16 u    |x|       all below
//   an excess x . w - |w|^2 / 2    kExcessError     16 u    32 u    R |w|     FloatBisector: which nodes are cut off
//   the same of one node           NodeDoubtSq      1.5 u   16 u    |x| |w|   DecideDoubtful, before DecideCut
//   a distance                     kDistanceError   8 u     32 u    |x|       SetReach, OffsetBound, KeepRoughPosition
//   a power p . (p - 2 x)          kPowerError      64 u    128 u   R^2       AreReached
//   a ratio, now and once placed   kRatioMargin     128 u   128 u   ratio     KeepsRatio
#ifndef WELLSPACE_CORE_CELL_FLOAT_ERRORS_H_
#define WELLSPACE_CORE_CELL_FLOAT_ERRORS_H_

#include "core/base/simd/lanes.h"
#include "core/geometry/point.h"

namespace wellspace::core {

// In units of u: a node x is wrong by at most kNodeError |x|. In the plane that is its rounding, and half of it
// from where it was computed in doubles; in space it may lie at the end of an edge as short.
template <int D>
inline constexpr float kNodeError = D == 2 ? 1.5f : 16;
// With R at least the distance of the nodes, an excess x . w - |w|^2 / 2 is wrong by at most u ((kNodeError + D + 2) R
// |w| + (2 D + 2) |w|^2 / 2): w is by u |w|; the products by u |x| |w| together, the D sums by D u (|x| |w| + |w|^2 /
// 2), and |w|^2 / 2 by (D + 2) u of itself. A vertex that may cut has
// |w| <= 2 R, so that all is less than 12 u R |w| in 2-D, 29 u R |w| in 3-D; one u more for the part taken off |w|^2 /
// 2.
template <int D>
inline constexpr float kExcessError = D == 2 ? 0x1p-20f : 0x1p-19f;
// The loss of squares of distances below the least float, and more: nothing that a cell is made of is as small.
inline constexpr float kUnderflow = 0x1p-80f;
// A distance differs by less than this share of itself from that of the exact node, a square by less than twice as
// much.
template <int D>
inline constexpr float kDistanceError = D == 2 ? 0x1p-21f : 0x1p-19f;
// By how much, in shares of |x|^2, the power p . (p - 2 x) of a point p within 2 |x| may be wrong: (44 + 4 kNodeError)
// u. Farther out it is positive.
template <int D>
inline constexpr float kPowerError = D == 2 ? 0x1p-18f : 0x1p-17f;
// A ratio is surely kept, whatever the rounding and whatever that of placed nodes (kPlacedError), if it is by this
// share.
inline constexpr double kRatioMargin = 0x1p-17;
inline float SurelyKeptRatioSq(double ratio) {
  const double surely = ratio * (1 - kRatioMargin);
  return static_cast<float>(surely * surely);
}

// The squared bound on the error of the excess of the node x, in doubles, over the bisector to a vertex at that squared
// distance: the error of the node itself times |w|, and a hundredth more for the rounding of doubles.
template <int D>
double NodeDoubtSq(const Point<D>& x, double length_sq) {
  constexpr double kShare = 1.01 * 0x1p-24 * kNodeError<D>;
  return kShare * kShare * NormSq<D>(x) * length_sq + double{kUnderflow} * kUnderflow;
}

// Half the square of the distance from its site within which a vertex may cut a cell of that radius, in floats: 2 R^2,
// since it is within 2 R. To compare with FloatBisector::offset.
template <int D>
WELLSPACE_INLINE float OffsetBound(float radius_bound) {
  return 2 * (1 + 8 * kDistanceError<D>)*radius_bound * radius_bound;
}

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_CELL_FLOAT_ERRORS_H_
