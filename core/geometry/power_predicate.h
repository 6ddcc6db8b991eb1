// The one decision that Voronoi cells rest on, taken exactly: does a bisector cut off a node?
#ifndef WELLSPACE_CORE_GEOMETRY_POWER_PREDICATE_H_
#define WELLSPACE_CORE_GEOMETRY_POWER_PREDICATE_H_

#include <array>
#include <cstdint>

#include "core/geometry/point.h"

namespace wellspace::core {

enum class Sign : int { kNegative = -1, kZero = 0, kPositive = 1 };

constexpr Sign operator-(Sign s) { return static_cast<Sign>(-static_cast<int>(s)); }
constexpr Sign operator*(Sign a, Sign b) { return static_cast<Sign>(static_cast<int>(a) * static_cast<int>(b)); }

// A plane that bounds the cell of a site: the bisector with another vertex, or a wall x[axis] = coordinate.
template <int D>
struct PlaneSource {
  Point<D> generator{};   // of a bisector
  double coordinate = 0;  // of a wall
  int axis = -1;          // of a wall; -1 for a bisector

  bool IsWall() const { return axis >= 0; }
};

// The treatment of exact ties.
enum class TieRule {
  kKeep,     // a node on the bisector stays; for cells that stand alone
  kPerturb,  // decided by a symbolic perturbation of the vertices' weights, the same for every site; for stars that
             // must agree
};

// How a sign was found, for tests and statistics: the cheapest stage that serves.
enum class Stage : uint8_t {
  kFilter,   // in doubles, certain by a bound on the error
  kWord,     // in integers of one word: all differences of coordinates are multiples of one power of two, below 2^29,
             // 2^19, 2^13, 2^10, 2^8 times it in 2-D to 6-D; but for walls whose place does not matter
  kInteger,  // in integers of fixed width: all differences of coordinates are multiples of one power of two, below
             // 2^62 times it
  kWideInteger,  // the same, 2^126
  kBigInteger,   // in integers of any size
};

// Eight bytes, so that it is returned in a register.
struct ExactDecision {
  Sign sign = Sign::kZero;  // kPositive: cut off
  Stage stage = Stage::kInteger;
  bool perturbed = false;  // the exact value was zero, and TieRule::kPerturb decided
};

// On which side of the bisector of `site` and `u` lies the node where the D planes `planes` of the cell of `site` meet:
// kPositive on the side of `u`, kNegative on the side of `site`, kZero (only with TieRule::kKeep) on it.
//
// With n_j . x = c_j the planes relative to the site (bisector of w = p_j - site: n = w, c = |w|^2 / 2; wall: n =
// e_axis) and the node x = A^-1 c, the value is g = w_u . x - |w_u|^2 / 2 = - det [A c; w_u c_u] / det A, evaluated in
// integers: all differences are multiples of one power of two. Never kFilter: the caller has filtered already.
//
// The perturbation gives vertex k the weight W_k = eps^(rank), rank by coordinates, lexicographically greatest first,
// so that c_j becomes (|w_j|^2 + W_site - W_j) / 2. g is linear in the weights: with w_u = sum_j lambda_j n_j, 2 g
// gains W_u - sum_j lambda_j W_j + (sum_j lambda_j - 1) W_site over the bisectors j, and the first coefficient in the
// order of ranks that is not zero decides; that of W_u is 1, so one always does. Coordinates are not touched: coplanar
// points stay so.
//
// Laws:       (1) antisymmetric in orientation: the order of `planes` does not matter; (2) scaling by powers of two and
//             translations that are exact do not change the result; (3) with kPerturb the result is never kZero.
// REQUIRES:   finite coordinates; the planes meet in one point (det A != 0); u different from the site and all
//             generators.
// Complexity: O(D 2^D) products; with kWord, of two words (3-D: 0.06 us); with kInteger, of one word by at most D of
//             them (3-D: 0.16 us, 6-D: 2.7 us).
// Errors:     none.
// Source:     ours; the determinant is that of the power test of regular triangulations. docs/design/geometry.md has
//             the bounds and the measurements.
template <int D>
ExactDecision DecideCut(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                        TieRule rule);

// The weights of a decision's vertices.
template <int D>
struct DecisionWeights {
  double site = 0;
  std::array<double, D> generators{};  // by plane; those of walls do not matter
  double u = 0;
};

// The same for weighted vertices: distances are powers |x p|^2 - W_p, so |w|^2 + W_site - W_p takes the place of |w|^2
// everywhere, and the perturbation is added to the weights.
//
// REQUIRES:   as DecideCut; weights finite, not negative, and none larger than the squared distance between its vertex
//             and the site.
// Complexity: as DecideCut.
// Errors:     none.
template <int D>
ExactDecision DecidePowerCut(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes, const Point<D>& u,
                             const DecisionWeights<D>& weights, TieRule rule);

// The point where D planes meet, relative to `site`, for planes so nearly dependent that doubles cannot tell where.
//
// REQUIRES:   as DecideCut.
// Guarantees: (1) each coordinate is within a relative error of 2^-50 of the exact one.
// Complexity: D determinants of integers of (D + 1) times the bits that the coordinates span.
// Errors:     none.
template <int D>
Point<D> ExactMeetingPoint(const Point<D>& site, const std::array<PlaneSource<D>, D>& planes);

}  // namespace wellspace::core

#endif  // WELLSPACE_CORE_GEOMETRY_POWER_PREDICATE_H_
