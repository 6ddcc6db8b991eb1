#include "core/simplex/overlap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/simplex/determinant.h"

namespace wellspace::core {
namespace {

// Corners of a simplex by their heights above the facets of the other one, each facet in a unit of its own. Heights are
// linear along edges, so nothing else is needed to cut it.
template <int D>
using Heights = std::array<std::array<double, D + 1>, D + 1>;

// Heights of the corners of `simplex` above the facets of `other`.
template <int D>
Heights<D> HeightsAbove(const Simplex<D>& simplex, const Simplex<D>& other) {
  Heights<D> heights;
  std::array<Simplex<D>, D + 1> differences;
  // Halves: a difference may be beyond the range of doubles.
  double size = 0;
  for (int i = 0; i <= D; ++i) {
    size = std::max(size, Differences<D>(other, simplex[i], 0.5, &differences[i]));
  }
  const int exponent = size > 0 ? std::ilogb(size) : 0;
  const bool is_extreme = std::abs(exponent) > 100;  // products would be beyond it, too
  for (int i = 0; i <= D; ++i) {
    if (is_extreme) {
      for (Point<D>& p : differences[i]) {
        for (double& x : p) {
          x = std::ldexp(x, -exponent);
        }
      }
    }
    for (int k = 0; k <= D; ++k) {
      heights[i][k] = CornerVolume<D>(differences[i], k);
    }
  }
  return heights;
}

// The part of the simplex of these corners that is above the facets from `facet` on. It is cut along an edge that
// crosses the facet, into two, as often as there is one.
template <int D>
double PartAbove(const Heights<D>& corners, int facet) {
  for (; facet <= D; ++facet) {
    int high = -1;
    int low = -1;
    for (int i = 0; i <= D; ++i) {
      high = corners[i][facet] > 0 ? i : high;
      low = corners[i][facet] < 0 ? i : low;
    }
    if (high < 0) {
      return 0;
    }
    if (low < 0) {
      continue;
    }
    // The point of the facet on the edge.
    const double above = corners[high][facet];
    const double below = -corners[low][facet];
    const double part_of_high = below / (above + below);
    const double part_of_low = above / (above + below);
    std::array<double, D + 1> crossing;
    for (int k = 0; k <= D; ++k) {
      crossing[k] = part_of_high * corners[high][k] + part_of_low * corners[low][k];
    }
    crossing[facet] = 0;
    Heights<D> with_high = corners;
    with_high[low] = crossing;
    Heights<D> with_low = corners;
    with_low[high] = crossing;
    return part_of_low * PartAbove<D>(with_high, facet) + part_of_high * PartAbove<D>(with_low, facet);
  }
  return 1;
}

}  // namespace

template <int D>
double PartInside(const Simplex<D>& simplex, const Simplex<D>& other) {
  const Heights<D> heights = HeightsAbove<D>(simplex, other);
  for (int k = 0; k <= D; ++k) {
    double highest = -std::numeric_limits<double>::infinity();
    for (int i = 0; i <= D; ++i) {
      highest = std::max(highest, heights[i][k]);
    }
    if (!(highest > 0)) {
      return 0;
    }
  }
  return std::min(1.0, PartAbove<D>(heights, 0));
}

template double PartInside<2>(const Simplex<2>&, const Simplex<2>&);
template double PartInside<3>(const Simplex<3>&, const Simplex<3>&);

}  // namespace wellspace::core
