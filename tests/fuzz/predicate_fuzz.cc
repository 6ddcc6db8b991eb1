// The laws of DecideCut between bisectors, and its agreement with InSphere, which shares no arithmetic with it.
//
// Input: a byte (bits 0 to 2: dimension; bit 3: coordinates of eight bytes, the bits of a double; else of one, a grid
// line and tiny steps; the others: a quarter of the exponent of the tiny step), then the coordinates of a site, D
// generators and u.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>
#include <vector>

#include "core/geometry/exact_measure.h"
#include "core/geometry/power_predicate.h"
#include "tests/fuzz/fuzz.h"

namespace wellspace::fuzz {
namespace {

using core::ExactDecision;
using core::Orientation;
using core::Point;
using core::Sign;
using core::Simplex;
using core::TieRule;

// A site, the generators of D bisectors, and u.
template <int D>
using Decided = std::array<Point<D>, D + 2>;

// The bits of a finite double; 0 for others.
double ReadBits(ByteReader& bytes) {
  double x = 0;
  const std::span<const uint8_t> taken = bytes.Take(sizeof(x));
  if (taken.size() == sizeof(x)) {
    std::memcpy(&x, taken.data(), sizeof(x));
  }
  return std::isfinite(x) ? x : 0;
}

// Of 16 grid lines and 16 numbers of steps.
double ReadNearGrid(ByteReader& bytes, double step) {
  const uint8_t byte = bytes.Next();
  return (byte & 15) + step * ((byte >> 4) - 8);
}

template <int D>
Simplex<D> SimplexOf(const Decided<D>& p) {
  Simplex<D> simplex;
  std::copy_n(p.begin(), D + 1, simplex.begin());
  return simplex;
}

template <int D>
ExactDecision Decide(const Decided<D>& p, TieRule rule) {
  std::array<core::PlaneSource<D>, D> planes;
  for (int j = 0; j < D; ++j) {
    planes[j].generator = p[j + 1];
  }
  return core::DecideCut<D>(p[0], planes, p[D + 1], rule);
}

template <int D>
bool IsDecidable(Decided<D> p) {
  const Sign orientation = Orientation<D>(SimplexOf<D>(p)).sign;
  std::sort(p.begin(), p.end());
  return orientation != Sign::kZero && std::adjacent_find(p.begin(), p.end()) == p.end();
}

// The node is the circumcentre of the site and the generators: u cuts it off where it is inside their sphere.
template <int D>
void RequireAgreementWithInSphere(const Decided<D>& p) {
  const Sign expected = core::InSphere<D>(SimplexOf<D>(p), p[D + 1]).sign * Orientation<D>(SimplexOf<D>(p)).sign;
  const ExactDecision kept = Decide<D>(p, TieRule::kKeep);
  Require(kept.sign == expected, "DecideCut agrees with InSphere");
  Require(!kept.perturbed, "a kept decision is not perturbed");
  const ExactDecision perturbed = Decide<D>(p, TieRule::kPerturb);
  Require(perturbed.sign != Sign::kZero, "law 3: the perturbation leaves no tie");
  Require(perturbed.perturbed == (kept.sign == Sign::kZero), "only ties are perturbed");
  Require(perturbed.perturbed || perturbed.sign == kept.sign, "both rules agree where there is no tie");
}

// Other orders of D + 1 corners: all of them, but from 5-D on, where they take a minute under the sanitizers, the
// exchanges of two.
template <int D>
std::vector<std::array<int, D + 1>> Orders() {
  std::vector<std::array<int, D + 1>> orders;
  std::array<int, D + 1> order;
  std::iota(order.begin(), order.end(), 0);
  if constexpr (D < 5) {
    while (std::next_permutation(order.begin(), order.end())) {
      orders.push_back(order);
    }
  } else {
    for (int i = 0; i <= D; ++i) {
      for (int k = 0; k < i; ++k) {
        orders.push_back(order);
        std::swap(orders.back()[i], orders.back()[k]);
      }
    }
  }
  return orders;
}

// Law 1, and that the corners of a simplex may exchange their roles: the site is one of them.
template <int D>
void RequireOneDecisionForAllRoles(const Decided<D>& p) {
  const Sign kept = Decide<D>(p, TieRule::kKeep).sign;
  const Sign perturbed = Decide<D>(p, TieRule::kPerturb).sign;
  for (const std::array<int, D + 1>& order : Orders<D>()) {
    Decided<D> reordered = p;
    for (int k = 0; k <= D; ++k) {
      reordered[k] = p[order[k]];
    }
    Require(Decide<D>(reordered, TieRule::kKeep).sign == kept, "law 1: the order does not matter");
    Require(Decide<D>(reordered, TieRule::kPerturb).sign == perturbed, "law 1: the order does not matter to ties");
  }
}

template <int D>
Decided<D> Scaled(Decided<D> p, double factor) {
  for (Point<D>& point : p) {
    for (double& x : point) {
      x *= factor;
    }
  }
  return p;
}

template <int D>
Decided<D> Translated(Decided<D> p, double by) {
  for (Point<D>& point : p) {
    for (double& x : point) {
      x += by;
    }
  }
  return p;
}

// Law 2. A number that goes there and back unchanged was scaled exactly.
template <int D>
void RequireInvariance(const Decided<D>& p) {
  for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
    const Sign expected = Decide<D>(p, rule).sign;
    for (const int exponent : {-200, -3, 500}) {
      const Decided<D> scaled = Scaled<D>(p, std::ldexp(1.0, exponent));
      if (Scaled<D>(scaled, std::ldexp(1.0, -exponent)) == p) {
        Require(Decide<D>(scaled, rule).sign == expected, "law 2: scaling does not matter");
      }
    }
  }
}

// Translations by small integers are exact on the plain grid.
template <int D>
void RequireInvarianceOfGrid(const Decided<D>& p) {
  for (const TieRule rule : {TieRule::kKeep, TieRule::kPerturb}) {
    Require(Decide<D>(Translated<D>(p, 0x1p30), rule).sign == Decide<D>(p, rule).sign,
            "law 2: translation does not matter");
  }
}

template <int D>
void RequireLaws(ByteReader& bytes, bool any_bits, double step) {
  Decided<D> p;
  bool is_grid = true;
  for (Point<D>& point : p) {
    for (double& x : point) {
      x = any_bits ? ReadBits(bytes) : ReadNearGrid(bytes, step);
      is_grid = is_grid && std::abs(x) <= 32 && x == std::nearbyint(x);
    }
  }
  if (!IsDecidable<D>(p)) {
    return;
  }
  RequireAgreementWithInSphere<D>(p);
  RequireOneDecisionForAllRoles<D>(p);
  RequireInvariance<D>(p);
  if (is_grid) {
    RequireInvarianceOfGrid<D>(p);
  }
}

}  // namespace
}  // namespace wellspace::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  wellspace::fuzz::ByteReader bytes(data, size);
  const uint8_t shape = bytes.Next();
  const bool any_bits = (shape & 8) != 0;
  const double step = std::ldexp(1.0, -4 * (shape >> 4));
  switch (shape & 7) {
    case 0:
      wellspace::fuzz::RequireLaws<2>(bytes, any_bits, step);
      break;
    case 1:
      wellspace::fuzz::RequireLaws<3>(bytes, any_bits, step);
      break;
    case 2:
      wellspace::fuzz::RequireLaws<4>(bytes, any_bits, step);
      break;
    case 3:
      wellspace::fuzz::RequireLaws<5>(bytes, any_bits, step);
      break;
    default:
      wellspace::fuzz::RequireLaws<6>(bytes, any_bits, step);
      break;
  }
  return 0;
}
