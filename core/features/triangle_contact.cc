#include "core/features/triangle_contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "core/geometry/exact_measure.h"
#include "core/geometry/segment.h"
#include "core/geometry/triangle.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

using Triangle = std::array<Point<3>, 3>;

constexpr double kThird = 1.0 / 3;

Sign SideOfPlane(const Triangle& t, const Point<3>& p) { return Orientation<3>({t[0], t[1], t[2], p}).sign; }

// Whether all of `one` lie on one side of a plane through `origin`, and all of `other` on the other side, each farther
// from it than `least`. `normal` is that of the plane, any vector.
//
// Every product of a difference with a component passes through two roundings, and through two of the sum: the error
// is less than 2^-50 of the sum of their absolute values.
bool AreApart(const Point<3>& normal, const Point<3>& origin, std::span<const Point<3>> one,
              std::span<const Point<3>> other, double least) {
  double size = 0;
  for (const double x : normal) {
    size = std::max(size, std::abs(x));
  }
  if (!(size > 0x1p-300 && size < 0x1p300)) {
    return false;
  }
  const double reach = 2 * least * size;  // more than least times the length of the normal
  const auto is_beyond = [&](const Point<3>& p, double sign) {
    double sum = 0;
    double magnitude = 0;
    for (int i = 0; i < 3; ++i) {
      const double term = normal[i] * (p[i] - origin[i]);
      sum += term;
      magnitude += std::abs(term);
    }
    return sign * sum > reach + 0x1p-50 * magnitude + 0x1p-900;
  };
  return std::all_of(one.begin(), one.end(), [&](const Point<3>& p) { return is_beyond(p, 1); }) &&
         std::all_of(other.begin(), other.end(), [&](const Point<3>& p) { return is_beyond(p, -1); });
}

Point<3> Unit(const Point<3>& v) {
  const double length = std::sqrt(NormSq<3>(v));
  return length > 0 ? Point<3>{v[0] / length, v[1] / length, v[2] / length} : v;
}

Point<3> Centre(const Triangle& t) {
  Point<3> centre;
  for (int i = 0; i < 3; ++i) {
    centre[i] = kThird * t[0][i] + kThird * t[1][i] + kThird * t[2][i];
  }
  return centre;
}

// The axes of a projection in which a triangle has an area.
std::pair<size_t, size_t> AxesOf(const Triangle& t) {
  const Point<3> normal = NormalOf(t);
  size_t along = 0;
  for (size_t axis = 1; axis < 3; ++axis) {
    along = std::abs(normal[axis]) > std::abs(normal[along]) ? axis : along;
  }
  for (size_t turn = 0; turn < 3; ++turn, along = (along + 1) % 3) {
    const size_t u = (along + 1) % 3;
    const size_t v = (along + 2) % 3;
    if (Orientation<2>({{{t[0][u], t[0][v]}, {t[1][u], t[1][v]}, {t[2][u], t[2][v]}}}).sign != Sign::kZero) {
      return {u, v};
    }
  }
  return {0, 1};
}

// A projection onto two axes, which is one to one on the plane of a triangle.
class Projection {
 public:
  explicit Projection(const Triangle& t) : axes_(AxesOf(t)) {}

  Point<2> Of(const Point<3>& p) const { return {p[axes_.first], p[axes_.second]}; }
  Sign Turn(const Point<3>& a, const Point<3>& b, const Point<3>& c) const {
    return Orientation<2>({Of(a), Of(b), Of(c)}).sign;
  }
  // Whether a point of the plane is in the triangle, or on its border.
  bool Holds(const Triangle& t, const Point<3>& p) const {
    const Sign turn = Turn(t[0], t[1], t[2]);
    for (size_t k = 0; k < 3; ++k) {
      if (Turn(t[k], t[(k + 1) % 3], p) * turn == Sign::kNegative) {
        return false;
      }
    }
    return true;
  }
  // Where two segments of the plane have a point in common, if they do; exact but for the place.
  std::optional<Point<3>> Meet(const Point<3>& a, const Point<3>& b, const Point<3>& c, const Point<3>& d) const {
    const Sign c_side = Turn(a, b, c);
    const Sign d_side = Turn(a, b, d);
    if (c_side == Sign::kZero && d_side == Sign::kZero) {
      // On one line: ends are ordered along it, and the higher one of the two lower ends has to be below the others.
      const auto is_below = [this](const Point<3>& p, const Point<3>& q) { return Of(p) < Of(q); };
      const Point<3>& low = std::max(std::min(a, b, is_below), std::min(c, d, is_below), is_below);
      const Point<3>& high = std::min(std::max(a, b, is_below), std::max(c, d, is_below), is_below);
      return is_below(high, low) ? std::nullopt : std::optional(low);
    }
    if (c_side * d_side == Sign::kPositive || Turn(c, d, a) * Turn(c, d, b) == Sign::kPositive) {
      return std::nullopt;
    }
    const auto area = [this](const Point<3>& p, const Point<3>& q, const Point<3>& r) {
      return core::Cross(Difference<2>(Of(q), Of(p)), Difference<2>(Of(r), Of(p)));
    };
    const double from = area(c, d, a);
    const double to = area(c, d, b);
    return Between(a, b, from == to ? 0.5 : std::clamp(from / (from - to), 0.0, 1.0));
  }

 private:
  std::pair<size_t, size_t> axes_;
};

// The volume of a tetrahedron over a triangle, correctly rounded.
double VolumeOver(const Triangle& t, const Point<3>& p) {
  ExactVolumeSum<3> volume;
  volume.Add({t[0], t[1], t[2], p});
  return volume.value();
}

// Where the segment from `a` to `b` meets a triangle, if it does; exact but for the place.
std::optional<Point<3>> SegmentMeets(const Point<3>& a, const Point<3>& b, const Triangle& t) {
  const Sign a_side = SideOfPlane(t, a);
  const Sign b_side = SideOfPlane(t, b);
  if (a_side == b_side && a_side != Sign::kZero) {
    return std::nullopt;
  }
  if (a_side == Sign::kZero || b_side == Sign::kZero) {
    const Projection flat(t);
    if (a_side == Sign::kZero && flat.Holds(t, a)) {
      return a;
    }
    if (b_side == Sign::kZero && flat.Holds(t, b)) {
      return b;
    }
    if (a_side != b_side) {
      return std::nullopt;
    }
    for (size_t k = 0; k < 3; ++k) {
      if (const auto place = flat.Meet(a, b, t[k], t[(k + 1) % 3])) {
        return place;
      }
    }
    return std::nullopt;
  }
  Sign around = Sign::kZero;
  for (size_t k = 0; k < 3; ++k) {
    const Sign sign = Orientation<3>({a, b, t[k], t[(k + 1) % 3]}).sign;
    if (sign != Sign::kZero && around != Sign::kZero && sign != around) {
      return std::nullopt;
    }
    around = sign != Sign::kZero ? sign : around;
  }
  // In doubles these volumes might be nothing but rounding.
  const double from = std::abs(VolumeOver(t, a));
  const double to = std::abs(VolumeOver(t, b));
  return Between(a, b, from / (from + to));
}

// The least of the given distances that is too small, as a contact.
class NearCorner {
 public:
  explicit NearCorner(double least) : least_(least) {}

  void Look(const Point<3>& corner, const Triangle& t) {
    const double distance = DistanceToTriangle(corner, t);
    if (distance < least_ && (found_.kind == TriangleContact::Kind::kNone || distance < found_.distance)) {
      found_ = {TriangleContact::Kind::kNear, corner, distance};
    }
  }
  const TriangleContact& found() const { return found_; }

 private:
  const double least_;
  TriangleContact found_;
};

TriangleContact MeetAt(const Point<3>& place) { return {TriangleContact::Kind::kMeet, place, 0}; }

// Whether `u` lies beyond a plane that is parallel to `t`, or that is across it and parallel to a side of it; false
// where that is not clear.
bool IsBeyondAPlaneOf(const Triangle& t, const Triangle& u, double least) {
  const auto is_beyond = [&](const Point<3>& out, const Point<3>& from) {
    double nearest = 0;
    size_t at = 0;
    for (size_t i = 0; i < 3; ++i) {
      const double away = Dot<3>(out, Difference<3>(u[i], from));
      at = i == 0 || away < nearest ? i : at;
      nearest = i == 0 ? away : std::min(nearest, away);
    }
    if (!(nearest > 0)) {
      return false;
    }
    // Halfway to the nearest corner.
    const double share = 0.5 * nearest / NormSq<3>(out);
    const Point<3> middle = {from[0] + share * out[0], from[1] + share * out[1], from[2] + share * out[2]};
    return AreApart(out, middle, u, t, least);
  };
  const Point<3> normal = NormalOf(t);
  if (is_beyond(normal, t[0]) || is_beyond({-normal[0], -normal[1], -normal[2]}, t[0])) {
    return true;
  }
  for (size_t k = 0; k < 3; ++k) {
    if (is_beyond(Cross(Difference<3>(t[(k + 1) % 3], t[k]), normal), t[k])) {
      return true;
    }
  }
  return false;
}

// The contact of triangles without a common corner.
TriangleContact ContactOfStrangers(const Triangle& t, const Triangle& u, double least) {
  const Point<3> middle = Between(Centre(t), Centre(u), 0.5);
  const Point<3> apart = Difference<3>(Centre(t), Centre(u));
  if (AreApart(apart, middle, t, u, least)) {
    return {};
  }
  if (IsBeyondAPlaneOf(t, u, least) || IsBeyondAPlaneOf(u, t, least)) {
    return {};
  }
  for (size_t k = 0; k < 3; ++k) {
    if (const auto place = SegmentMeets(t[k], t[(k + 1) % 3], u)) {
      return MeetAt(*place);
    }
  }
  for (size_t k = 0; k < 3; ++k) {
    if (const auto place = SegmentMeets(u[k], u[(k + 1) % 3], t)) {
      return MeetAt(*place);
    }
  }
  NearCorner near(least);
  for (size_t k = 0; k < 3; ++k) {
    near.Look(t[k], u);
    near.Look(u[k], t);
  }
  return near.found();
}

// The contact of triangles with the first corner in common, and no other.
TriangleContact ContactAtCorner(const Triangle& t, const Triangle& u, double least) {
  const Point<3>& v = t[0];
  const std::array<Point<3>, 2> t_ways = {Unit(Difference<3>(t[1], v)), Unit(Difference<3>(t[2], v))};
  const std::array<Point<3>, 2> u_ways = {Unit(Difference<3>(u[1], v)), Unit(Difference<3>(u[2], v))};
  const std::span<const Point<3>> t_rest(t.data() + 1, 2);
  const std::span<const Point<3>> u_rest(u.data() + 1, 2);
  // Planes through v: across the way between their middles, and halfway between the two sides that are nearest.
  Point<3> middles;
  for (int i = 0; i < 3; ++i) {
    middles[i] = t_ways[0][i] + t_ways[1][i] - u_ways[0][i] - u_ways[1][i];
  }
  if (AreApart(middles, v, t_rest, u_rest, least)) {
    return {};
  }
  double nearest = -std::numeric_limits<double>::infinity();
  Point<3> between{};
  for (const Point<3>& own : t_ways) {
    for (const Point<3>& other : u_ways) {
      if (Dot<3>(own, other) > nearest) {
        nearest = Dot<3>(own, other);
        between = Difference<3>(own, other);
      }
    }
  }
  if (AreApart(between, v, t_rest, u_rest, least)) {
    return {};
  }
  // If they have a point in common beside v, then one where the side across from v of one of them ends it.
  if (const auto place = SegmentMeets(t[1], t[2], u)) {
    return MeetAt(*place);
  }
  if (const auto place = SegmentMeets(u[1], u[2], t)) {
    return MeetAt(*place);
  }
  NearCorner near(least);
  for (const size_t k : {size_t{1}, size_t{2}}) {
    near.Look(t[k], u);
    near.Look(u[k], t);
  }
  return near.found();
}

// The contact of triangles with the first two corners in common.
TriangleContact ContactAtSide(const Triangle& t, const Triangle& u, double least) {
  const Point<3> along = Difference<3>(t[1], t[0]);
  const Point<3> t_across = Cross(along, Difference<3>(t[2], t[0]));
  const Point<3> u_across = Cross(along, Difference<3>(u[2], t[0]));
  // Far from lying on each other, where their directions differ by much more than their rounding errors.
  const double length = std::sqrt(NormSq<3>(along));
  const double t_length = std::sqrt(NormSq<3>(t_across));
  const double u_length = std::sqrt(NormSq<3>(u_across));
  const auto is_wide = [&](double across, const Point<3>& apex) {
    return across > std::max(2 * least, 0x1p-34 * std::sqrt(DistanceSq<3>(apex, t[0]))) * length;
  };
  if (is_wide(t_length, t[2]) && is_wide(u_length, u[2]) && t_length * u_length > 0x1p-300 &&
      Dot<3>(t_across, u_across) < -0x1p-10 * (t_length * u_length)) {
    return {};
  }
  if (SideOfPlane(t, u[2]) == Sign::kZero) {
    const Projection flat(t);
    if (flat.Turn(t[0], t[1], t[2]) == flat.Turn(t[0], t[1], u[2])) {
      return MeetAt(Between(t[0], t[1], 0.5));
    }
  }
  NearCorner near(least);
  near.Look(t[2], u);
  near.Look(u[2], t);
  return near.found();
}

TriangleContact OrderedContact(const TriangleCorners& one, const TriangleCorners& other, double least) {
  std::array<size_t, 3> of_one{};
  std::array<size_t, 3> of_other{};
  size_t shared = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      if (one.names[i] == other.names[k]) {
        of_one[shared] = i;
        of_other[shared++] = k;
      }
    }
  }
  if (shared == 0) {
    return ContactOfStrangers(one.places, other.places, least);
  }
  const auto rest = [&](std::array<size_t, 3>& order) {
    size_t next = shared;
    for (size_t i = 0; i < 3; ++i) {
      if (std::find(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(shared), i) ==
          order.begin() + static_cast<std::ptrdiff_t>(shared)) {
        order[next++] = i;
      }
    }
  };
  rest(of_one);
  rest(of_other);
  const auto ordered = [](const TriangleCorners& t, const std::array<size_t, 3>& order) {
    return Triangle{t.places[order[0]], t.places[order[1]], t.places[order[2]]};
  };
  return shared == 1 ? ContactAtCorner(ordered(one, of_one), ordered(other, of_other), least)
                     : ContactAtSide(ordered(one, of_one), ordered(other, of_other), least);
}

}  // namespace

TriangleContact FindContact(const TriangleCorners& one, const TriangleCorners& other, double least) {
  return one.names < other.names ? OrderedContact(one, other, least) : OrderedContact(other, one, least);
}

// The place on the triangle is found by the regions of its corners, its sides and its inside.
double DistanceToTriangle(const Point<3>& p, const std::array<Point<3>, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const Point<3> normal = Cross(Difference<3>(b, a), Difference<3>(c, a));
  const double norm_sq = NormSq<3>(normal);
  bool is_over = norm_sq > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < 3; ++k) {
    const Point<3>& from = triangle[k];
    const Point<3> side = Difference<3>(triangle[(k + 1) % 3], from);
    const Point<3> to = Difference<3>(p, from);
    is_over = is_over && Dot<3>(Cross(normal, side), to) >= 0;
    const double length_sq = NormSq<3>(side);
    const double share = length_sq > 0 ? std::clamp(Dot<3>(to, side) / length_sq, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, Distance<3>(p, Between(from, triangle[(k + 1) % 3], share)));
  }
  return is_over ? std::min(nearest, std::abs(Dot<3>(normal, Difference<3>(p, a))) / std::sqrt(norm_sq)) : nearest;
}

}  // namespace wellspace::core
