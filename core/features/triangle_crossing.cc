#include "core/features/triangle_crossing.h"

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstddef>

#include "core/geometry/exact_measure.h"

namespace wellspace::core {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using RationalPoint = std::array<Rational, 3>;

// The sign of coordinate `axis` of the vector product (b - a) x (d - c).
Sign ProductSign(const Point<3>& a, const Point<3>& b, const Point<3>& c, const Point<3>& d, size_t axis) {
  const size_t i = (axis + 1) % 3;
  const size_t j = (axis + 2) % 3;
  // In doubles where that is certain: of each product two differences and itself are rounded.
  const double left = (b[i] - a[i]) * (d[j] - c[j]);
  const double right = (b[j] - a[j]) * (d[i] - c[i]);
  if (std::abs(left - right) > 0x1p-50 * (std::abs(left) + std::abs(right)) + 0x1p-960) {
    return left > right ? Sign::kPositive : Sign::kNegative;
  }
  if ((b[i] == a[i] || d[j] == c[j]) && (b[j] == a[j] || d[i] == c[i])) {
    return Sign::kZero;  // as of lines along axes, which are common
  }
  const auto difference = [](double x, double y) -> Rational { return Rational(x) - Rational(y); };
  const Rational exact =
      difference(b[i], a[i]) * difference(d[j], c[j]) - difference(b[j], a[j]) * difference(d[i], c[i]);
  return exact < 0 ? Sign::kNegative : exact > 0 ? Sign::kPositive : Sign::kZero;
}

// On which side of the segment from `p` to `q`, looking along it, the line from `a` to `b` passes.
//
// The determinant (q - p, a - p, b - p) loses the scalar product of (b - a) x (q - p) with the shift of both ends.
Sign SideOfLine(const Point<3>& p, const Point<3>& q, const Point<3>& a, const Point<3>& b) {
  Sign sign = Orientation<3>({p, q, a, b}).sign;
  for (size_t axis = 0; sign == Sign::kZero && axis < 3; ++axis) {
    sign = -ProductSign(a, b, p, q, axis);
  }
  return sign;
}

// The place along the segment from `p` to `q` where it meets the plane of a triangle, in its lengths; and the growth of
// that with each coordinate of the shift of both ends.
std::array<Rational, 4> MeetingOf(const Triangle& triangle, const Point<3>& p, const Point<3>& q) {
  const auto difference = [](const Point<3>& x, const Point<3>& y) {
    return RationalPoint{Rational(x[0]) - Rational(y[0]), Rational(x[1]) - Rational(y[1]),
                         Rational(x[2]) - Rational(y[2])};
  };
  const auto dot = [](const RationalPoint& x, const RationalPoint& y) -> Rational {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const RationalPoint u = difference(triangle[1], triangle[0]);
  const RationalPoint v = difference(triangle[2], triangle[0]);
  const RationalPoint normal = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const Rational along = dot(normal, difference(p, q));  // not zero: the ends are on different sides
  return {dot(normal, difference(p, triangle[0])) / along, normal[0] / along, normal[1] / along, normal[2] / along};
}

}  // namespace

Sign SideOfCorners(const Triangle& triangle, const Triangle& other) {
  Sign found = Sign::kZero;
  for (const Point<3>& corner : other) {
    const Sign side = Orientation<3>({triangle[0], triangle[1], triangle[2], corner}).sign;
    if (side != Sign::kZero && found != Sign::kZero && side != found) {
      return Sign::kZero;
    }
    found = side != Sign::kZero ? side : found;
  }
  return found;
}

Sign MovedSide(const Triangle& triangle, const Point<3>& p) {
  // Across an axis planes are common, and so are points on them up to rounding.
  for (size_t axis = 0; axis < 3; ++axis) {
    if (triangle[0][axis] == triangle[1][axis] && triangle[0][axis] == triangle[2][axis]) {
      const Sign turn = ProductSign(triangle[0], triangle[1], triangle[0], triangle[2], axis);
      return p[axis] < triangle[0][axis] ? -turn : turn;
    }
  }
  Sign sign = Orientation<3>({triangle[0], triangle[1], triangle[2], p}).sign;
  // The determinant grows by the coordinates of the normal, which tell how the triangle turns, seen along an axis.
  for (size_t axis = 0; sign == Sign::kZero && axis < 3; ++axis) {
    const auto seen = [axis](const Point<3>& q) { return Point<2>{q[(axis + 1) % 3], q[(axis + 2) % 3]}; };
    sign = Orientation<2>({seen(triangle[0]), seen(triangle[1]), seen(triangle[2])}).sign;
  }
  return sign;
}

bool Crosses(const Triangle& triangle, const Point<3>& p, Sign side_of_p, const Point<3>& q, Sign side_of_q) {
  if (side_of_p == side_of_q) {
    return false;
  }
  // The segment crosses the plane, so it is parallel to no side.
  const auto side = [&](size_t k) {
    // The same sides of an edge whichever triangle asks, since exchanging its ends negates an exact sign.
    return SideOfLine(p, q, triangle[k], triangle[(k + 1) % 3]);
  };
  const Sign first = side(0);
  return side(1) == first && side(2) == first;
}

bool IsCrossedBefore(const Triangle& one, const Triangle& other, const Point<3>& p, const Point<3>& q) {
  // Where all of one triangle is on one side of the plane of the other, no division is needed: the plane of the one
  // that comes first parts the other from p.
  if (const Sign side = SideOfCorners(one, other); side != Sign::kZero) {
    return side != MovedSide(one, p);
  }
  if (const Sign side = SideOfCorners(other, one); side != Sign::kZero) {
    return side == MovedSide(other, p);
  }
  return MeetingOf(one, p, q) < MeetingOf(other, p, q);
}

}  // namespace wellspace::core
