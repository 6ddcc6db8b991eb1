#include "core/features/solids.h"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "core/base/cancellable_sort.h"
#include "core/base/check_at.h"
#include "core/base/status_macros.h"
#include "core/features/angle_order.h"
#include "core/features/triangle_crossing.h"
#include "core/features/union_find.h"
#include "core/geometry/box_tree.h"
#include "core/geometry/exact_measure.h"
#include "core/geometry/vector_product.h"

namespace wellspace::core {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
constexpr double kSixth = 1.0 / 6;

// Neumaier's compensated sum: rounding errors are summed apart, and added at the end.
class Sum {
 public:
  void Add(double term) {
    const double sum = sum_ + term;
    rest_ += std::abs(sum_) >= std::abs(term) ? (sum_ - sum) + term : (term - sum) + sum_;
    sum_ = sum;
  }
  double value() const { return sum_ + rest_; }

 private:
  double sum_ = 0;
  double rest_ = 0;
};

// A ray along an axis towards lower coordinates, from a point that is moved off its place by nothing to speak of:
// towards another point; less than that down the ray; still less upwards on the second axis, and least on the third. So
// it meets no edge, and no plane along it, and triangles that end in the place are met as they are a little beside it.
struct Ray {
  Point<3> from;
  Point<3> towards;
  size_t axis = 1;

  size_t second() const { return (axis + 1) % 3; }
  size_t third() const { return (axis + 2) % 3; }
};

class SolidFinder {
 public:
  SolidFinder(const SurfaceComplex& complex, const RunContext& context)
      : complex_(complex), context_(context), joined_(2 * complex.triangles.size() + 1) {}

  absl::StatusOr<Solids> Find() {
    WELLSPACE_RETURN_IF_ERROR(JoinAroundEdges());
    WELLSPACE_RETURN_IF_ERROR(JoinShells());
    WELLSPACE_RETURN_IF_ERROR(NumberSolids());
    WELLSPACE_RETURN_IF_ERROR(Measure());
    WELLSPACE_RETURN_IF_ERROR(CountCrossings());
    return std::move(out_);
  }

 private:
  uint32_t triangle_count() const { return static_cast<uint32_t>(complex_.triangles.size()); }

  // In joined_ 0 stands for the unbounded solid.
  static uint32_t NodeOf(HalfFacet half) { return half + 1; }

  // The half-facet that looks along growing angles around the edge, from its lower point to the higher one.
  HalfFacet Ahead(TriangleSide side) const { return HalfFacetOf(TriangleOf(side), !complex_.RunsUp(side)); }
  HalfFacet Behind(TriangleSide side) const { return Ahead(side) ^ 1; }

  // The sides at an edge by their angles around it.
  absl::Status SortAround(uint32_t edge, std::vector<TriangleSide>& sides) const {
    const std::span<const TriangleSide> given = complex_.SidesAt(edge);
    sides.assign(given.begin(), given.end());
    if (sides.size() < 3) {
      return absl::OkStatus();
    }
    const auto [a, b] = complex_.edges[edge];
    const auto apex = [this](TriangleSide side) -> const Point<3>& { return complex_.points[complex_.ApexOf(side)]; };
    const AngleOrder order(complex_.points[a], complex_.points[b], apex(sides[0]));
    return CancellableSort(
        sides, [&](TriangleSide s, TriangleSide t) { return order(apex(s), apex(t)); }, context_);
  }

  absl::Status JoinAroundEdges() {
    std::vector<TriangleSide> sides;
    for (uint32_t e = 0; e < complex_.edges.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * size_t{e}, context_));
      WELLSPACE_RETURN_IF_ERROR(SortAround(e, sides));
      for (size_t i = 0; i < sides.size(); ++i) {
        joined_.Join(NodeOf(Ahead(sides[i])), NodeOf(Behind(sides[(i + 1) % sides.size()])));
      }
    }
    return absl::OkStatus();
  }

  // Finds the shells, the parts that hang together by edges, and joins the outside of each to the solid around it.
  absl::Status JoinShells() {
    UnionFind shells(triangle_count());
    for (uint32_t e = 0; e < complex_.edges.size(); ++e) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * size_t{e}, context_));
      const std::span<const TriangleSide> sides = complex_.SidesAt(e);
      for (size_t i = 1; i < sides.size(); ++i) {
        shells.Join(TriangleOf(sides[0]), TriangleOf(sides[i]));
      }
    }
    // Triangles ascend by their least corners: the first of a shell has its lowest vertex.
    for (uint32_t t = 0; t < triangle_count(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      if (shells.Find(t) == t) {
        ++out_.shells;
      }
    }
    std::vector<Box<3>> boxes;
    BoxTree<3> tree;
    if (out_.shells > 1) {
      boxes.reserve(triangle_count());
      for (uint32_t t = 0; t < triangle_count(); ++t) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
        Box<3> box{complex_.Corner(t, 0), complex_.Corner(t, 0)};
        box.Include({complex_.Corner(t, 1), complex_.Corner(t, 1)});
        box.Include({complex_.Corner(t, 2), complex_.Corner(t, 2)});
        boxes.push_back(box);
      }
      WELLSPACE_RETURN_IF_ERROR(tree.Build(std::move(boxes), context_));
    }
    for (uint32_t t = 0; t < triangle_count(); ++t) {
      if (shells.Find(t) == t) {
        WELLSPACE_RETURN_IF_ERROR(context_.Check());
        WELLSPACE_RETURN_IF_ERROR(JoinShell(t, shells, tree));
      }
    }
    return absl::OkStatus();
  }

  // Joins the outside of the shell that begins with `first` with the solid in which that lies.
  absl::Status JoinShell(uint32_t first, UnionFind& shells, const BoxTree<3>& tree) {
    const uint32_t lowest = complex_.triangles[first][0];
    const Point<3>& v = complex_.points[lowest];
    // The edge from it that is the last clockwise in the projection along the third axis: beyond it is nothing of the
    // shell.
    const auto flat = [&](uint32_t point) { return Point<2>{complex_.points[point][0], complex_.points[point][1]}; };
    uint32_t last = kNone;
    const std::array<uint32_t, 2> low_end = {lowest, 0};
    for (auto at = std::lower_bound(complex_.edges.begin(), complex_.edges.end(), low_end);
         at != complex_.edges.end() && (*at)[0] == lowest; ++at) {
      const auto e = static_cast<uint32_t>(at - complex_.edges.begin());
      if (shells.Find(TriangleOf(complex_.SidesAt(e)[0])) != first || flat((*at)[1]) == flat(lowest)) {
        continue;
      }
      if (last == kNone ||
          Orientation<2>({flat(lowest), flat(complex_.edges[last][1]), flat((*at)[1])}).sign == Sign::kNegative) {
        last = e;
      }
    }
    // A ray from there that leaves the shell at once, and does not come back: no point of it is as low.
    // Other shells may touch this one in that vertex, so it begins a little along the edge.
    const Point<3>& end = complex_.points[complex_.edges[last][1]];
    const Ray ray{.from = v, .towards = end, .axis = end[0] > v[0] ? size_t{1} : size_t{0}};
    Point<3> beyond = v;
    beyond[ray.axis] -= std::max(1.0, std::abs(v[ray.axis]));
    // Between which triangles of the edge it leaves.
    std::vector<TriangleSide> sides;
    WELLSPACE_RETURN_IF_ERROR(SortAround(last, sides));
    const auto apex = [this](TriangleSide side) -> const Point<3>& { return complex_.points[complex_.ApexOf(side)]; };
    const AngleOrder order(v, end, apex(sides[0]));
    size_t before = 0;
    while (before + 1 < sides.size() && order(apex(sides[before + 1]), beyond)) {
      ++before;
    }
    const std::optional<HalfFacet> seen = out_.shells > 1 ? FirstSeen(ray, tree) : std::nullopt;
    joined_.Join(NodeOf(Ahead(sides[before])), seen.has_value() ? NodeOf(*seen) : 0);
    return absl::OkStatus();
  }

  // The first half-facet that a ray meets.
  std::optional<HalfFacet> FirstSeen(const Ray& ray, const BoxTree<3>& tree) const {
    const size_t u = ray.second();
    const size_t w = ray.third();
    std::optional<uint32_t> first;
    tree.ForEach(
        [&](const Box<3>& box) {
          return box.low[u] <= ray.from[u] && ray.from[u] <= box.high[u] && box.low[w] <= ray.from[w] &&
                 ray.from[w] <= box.high[w] && box.low[ray.axis] <= ray.from[ray.axis];
        },
        [&](uint32_t t) {
          if (Meets(ray, t) && (!first.has_value() || IsAbove(t, *first, ray))) {
            first = t;
          }
        });
    if (!first.has_value()) {
      return std::nullopt;
    }
    // From above, where its corners are counterclockwise if they are in the projection.
    return HalfFacetOf(*first, TurnOf(*first, ray) == Sign::kNegative);
  }

  Point<2> Flat(const Ray& ray, const Point<3>& p) const { return {p[ray.second()], p[ray.third()]}; }
  Sign TurnOf(uint32_t t, const Ray& ray) const {
    return Orientation<2>(
               {Flat(ray, complex_.Corner(t, 0)), Flat(ray, complex_.Corner(t, 1)), Flat(ray, complex_.Corner(t, 2))})
        .sign;
  }

  // On which side of the line from a to b the ray is; never zero unless a and b are one in the projection.
  Sign SideOfLine(const Ray& ray, const Point<3>& a, const Point<3>& b) const {
    const Point<2> from = Flat(ray, a);
    const Point<2> to = Flat(ray, b);
    const Point<2> at = Flat(ray, ray.from);
    const Sign sign = Orientation<2>({from, to, at}).sign;
    if (sign != Sign::kZero || from == to) {
      return sign;
    }
    // The place is on the line: on which side is where it is moved to? Seen from there an end of the line that is
    // elsewhere lies along it, or against it.
    const Point<2>& other = to != at ? to : from;
    const Sign moved = Orientation<2>({at, other, Flat(ray, ray.towards)}).sign;
    if (moved != Sign::kZero) {
      return (from < to) == (at < other) ? moved : -moved;
    }
    // The determinant grows by (from - to)[1] with the first coordinate of the place, and by (to - from)[0] with the
    // second one.
    const auto sign_of = [](double x, double y) {
      return x < y ? Sign::kNegative : x > y ? Sign::kPositive : Sign::kZero;
    };
    const Sign by_first = sign_of(from[1], to[1]);
    return by_first != Sign::kZero ? by_first : sign_of(to[0], from[0]);
  }

  bool Meets(const Ray& ray, uint32_t t) const {
    const Sign turn = TurnOf(t, ray);
    if (turn == Sign::kZero) {
      return false;
    }
    for (uint32_t k = 0; k < 3; ++k) {
      if (SideOfLine(ray, complex_.Corner(t, k), complex_.Corner(t, (k + 1) % 3)) != turn) {
        return false;
      }
    }
    // Whether the ray begins above: on the side to which the normal points if the corners are counterclockwise from
    // there. On the plane the point that it is moved towards decides, and if that is on it, too, the ray begins below.
    const auto side = [&](const Point<3>& p) {
      return Orientation<3>({complex_.Corner(t, 0), complex_.Corner(t, 1), complex_.Corner(t, 2), p}).sign;
    };
    const Sign of_place = side(ray.from);
    return (of_place != Sign::kZero ? of_place : side(ray.towards)) == turn;
  }

  // Whether the ray, which meets both, meets `t` before `u`.
  bool IsAbove(uint32_t t, uint32_t u, const Ray& ray) const {
    // Where the corners of one are all above the plane of the other, or below it, no division is needed.
    const Sign by_plane = SideOfTriangle(u, t, ray);
    if (by_plane != Sign::kZero) {
      return by_plane == Sign::kPositive;
    }
    const Sign by_other = SideOfTriangle(t, u, ray);
    return by_other != Sign::kZero ? by_other == Sign::kNegative : HeightsOf(t, ray) > HeightsOf(u, ray);
  }

  // kPositive if no corner of `t` is below the plane of `u`, kNegative if none is above, kZero otherwise.
  Sign SideOfTriangle(uint32_t u, uint32_t t, const Ray& ray) const {
    return SideOfCorners(complex_.TriangleAt(u), complex_.TriangleAt(t)) * TurnOf(u, ray);
  }

  // Where the plane of a triangle is met, and how it rises from there towards where the place is moved, along the
  // second axis and along the third; exact.
  using Rational = boost::multiprecision::cpp_rational;
  std::tuple<Rational, Rational, Rational, Rational> HeightsOf(uint32_t t, const Ray& ray) const {
    const auto difference = [&](const Point<3>& p, const Point<3>& q) {
      return std::array<Rational, 3>{Rational(p[ray.axis]) - Rational(q[ray.axis]),
                                     Rational(p[ray.second()]) - Rational(q[ray.second()]),
                                     Rational(p[ray.third()]) - Rational(q[ray.third()])};
    };
    const Point<3>& a = complex_.Corner(t, 0);
    const auto e = difference(complex_.Corner(t, 1), a);
    const auto f = difference(complex_.Corner(t, 2), a);
    const Rational determinant = e[1] * f[2] - e[2] * f[1];
    const Rational second = (e[0] * f[2] - e[2] * f[0]) / determinant;
    const Rational third = (e[1] * f[0] - e[0] * f[1]) / determinant;
    const auto from = difference(ray.from, a);
    const auto moved = difference(ray.towards, ray.from);
    return {Rational(a[ray.axis]) + second * from[1] + third * from[2], second * moved[1] + third * moved[2], second,
            third};
  }

  absl::Status NumberSolids() {
    std::vector<uint32_t> number(2 * size_t{triangle_count()} + 1, kNone);
    number[joined_.Find(0)] = 0;
    out_.solid_of.resize(2 * size_t{triangle_count()});
    for (HalfFacet half = 0; half < out_.solid_of.size(); ++half) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(half, context_));
      uint32_t& own = number[joined_.Find(NodeOf(half))];
      own = own == kNone ? out_.count++ : own;
      out_.solid_of[half] = own;
    }
    return absl::OkStatus();
  }

  // Adds up the cones from a point in the middle over all facets of each solid.
  absl::Status Measure() {
    std::vector<Sum> sums(out_.count);
    Box<3> box{complex_.points.empty() ? Point<3>{} : complex_.points[0], {}};
    box.high = box.low;
    for (const Point<3>& p : complex_.points) {
      box.Include({p, p});
    }
    Point<3> middle;
    for (int axis = 0; axis < 3; ++axis) {
      middle[axis] = 0.5 * (box.low[axis] + box.high[axis]);
    }
    for (uint32_t t = 0; t < triangle_count(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(4 * size_t{t}, context_));
      const Point<3> a = Difference<3>(complex_.Corner(t, 0), middle);
      const Point<3> b = Difference<3>(complex_.Corner(t, 1), middle);
      const Point<3> c = Difference<3>(complex_.Corner(t, 2), middle);
      const double cone = kSixth * Dot<3>(a, Cross(b, c));
      sums[out_.solid_of[HalfFacetOf(t, false)]].Add(-cone);
      sums[out_.solid_of[HalfFacetOf(t, true)]].Add(cone);
    }
    for (const Sum& sum : sums) {
      out_.volumes.push_back(sum.value());
    }
    out_.volumes[0] = std::numeric_limits<double>::infinity();
    return absl::OkStatus();
  }

  // Walks from the unbounded solid across triangles.
  absl::Status CountCrossings() {
    std::vector<uint32_t> first(size_t{out_.count} + 1);
    for (const uint32_t solid : out_.solid_of) {
      ++first[solid + 1];
    }
    for (uint32_t solid = 0; solid < out_.count; ++solid) {
      first[solid + 1] += first[solid];
    }
    std::vector<HalfFacet> around(out_.solid_of.size());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (HalfFacet half = 0; half < out_.solid_of.size(); ++half) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(half, context_));
      around[next[out_.solid_of[half]]++] = half;
    }
    out_.is_odd.resize(out_.count);
    std::vector<bool> is_known(out_.count);
    std::vector<uint32_t> pending = {0};
    is_known[0] = true;
    size_t steps = 0;
    for (size_t i = 0; i < pending.size(); ++i) {
      const uint32_t solid = pending[i];
      for (uint32_t k = first[solid]; k < first[solid + 1]; ++k) {
        WELLSPACE_RETURN_IF_ERROR(CheckAt(steps++, context_));
        const uint32_t beyond = out_.solid_of[around[k] ^ 1];
        if (!is_known[beyond]) {
          is_known[beyond] = true;
          out_.is_odd[beyond] = !out_.is_odd[solid];
          pending.push_back(beyond);
        }
      }
    }
    for (uint32_t t = 0; t < triangle_count(); ++t) {
      WELLSPACE_RETURN_IF_ERROR(CheckAt(t, context_));
      const uint32_t one = out_.solid_of[HalfFacetOf(t, false)];
      const uint32_t other = out_.solid_of[HalfFacetOf(t, true)];
      out_.membranes += one == other ? 1 : 0;
      out_.contradictory += one != other && out_.is_odd[one] == out_.is_odd[other] ? 1 : 0;
    }
    return absl::OkStatus();
  }

  const SurfaceComplex& complex_;
  const RunContext& context_;
  UnionFind joined_;  // half-facets
  Solids out_;
};

}  // namespace

absl::StatusOr<Solids> FindSolids(const SurfaceComplex& complex, const RunContext& context) {
  return SolidFinder(complex, context).Find();
}

uint64_t SolidsBytes(uint64_t triangles) {
  // Sets of half-facets, their numbers and solids; sets of triangles; boxes and a tree over them.
  return triangles * (2 * 4 * sizeof(uint32_t) + sizeof(uint32_t)) + BoxTree<3>::Bytes(triangles);
}

}  // namespace wellspace::core
